//! Selection of the traversal code by the processor's instructions, once for all rays, and the
//! entry points of that code. An entry point runs the whole traversal, or the test of a leaf. Leaf
//! tests are separate functions, which take no registers of the traversal.
//!
//! Each entry point is a method of a token that proves that the processor has the instructions. It
//! calls a function compiled for these instructions, into which all other code is inlined.
#![expect(
    unsafe_code,
    reason = "calls of functions that are compiled for instructions whose token the caller has"
)]

use super::Bvh8;
use super::ChildRef;
use super::leaf::{blocks, rows, spheres, triangles};
use super::packet::{self, PacketResult, PacketState, PacketVisitor};
use super::projected_ray::{ProjectedRay, UncertainSign};
use super::query::{HitVisitor, Mode, TraversalMode, TraversalQuery};
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::traverse::{traverse, traverse_instance};
use super::triangle8::Triangle8;
use crate::aabb::BoundingSphere;
use crate::instance::RoughInverse;
use crate::math::simd::{Avx2, Avx512, Portable};
use crate::shapes::{PreparedRay, TriangleHit};

/// Instruction set of the traversal code. Hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kernel {
    /// Baseline instructions of the target.
    Portable,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 with 256-bit vectors.
    Avx512,
}

impl Kernel {
    /// Returns the kernels that this processor can run, slowest first.
    pub fn available() -> Vec<Self> {
        let all = [Self::Portable, Self::Avx2, Self::Avx512];
        all.into_iter()
            .filter(|&kernel| ChosenKernel::new(kernel).is_some())
            .collect()
    }
}

/// A kernel that this processor can run, with its token.
#[derive(Clone, Copy, Debug)]
pub(super) enum ChosenKernel {
    Portable(Portable),
    Avx2(Avx2),
    Avx512(Avx512),
}

impl ChosenKernel {
    pub fn new(kernel: Kernel) -> Option<Self> {
        match kernel {
            Kernel::Portable => Some(Self::Portable(Portable)),
            Kernel::Avx2 => Avx2::detect().map(Self::Avx2),
            Kernel::Avx512 => Avx512::detect().map(Self::Avx512),
        }
    }
}

/// Selects the fastest kernel that this processor can run.
impl Default for ChosenKernel {
    fn default() -> Self {
        [Kernel::Avx512, Kernel::Avx2]
            .into_iter()
            .find_map(Self::new)
            .unwrap_or(Self::Portable(Portable))
    }
}

/// Evaluates an expression with the query's mode as a type. `$mapped` and `$counts` are literals,
/// and `any` is read from the query.
macro_rules! by_mode {
    ($query:expr, $mapped:literal, $counts:literal, $mode:ident => $call:expr) => {
        if $query.any {
            type $mode = Mode<true, $mapped, $counts>;
            $call
        } else {
            type $mode = Mode<false, $mapped, $counts>;
            $call
        }
    };
}

/// Calls an entry point with the token of a kernel and with the query's mode as a type. Counting
/// queries always use the portable code: they are not timed, so they need no copy per instruction
/// set.
macro_rules! with {
    ($kernel:expr, $query:expr, $mapped:literal, $token:ident, $mode:ident => $call:expr) => {
        match $kernel {
            _ if $query.counts => {
                let $token = Portable;
                by_mode!($query, $mapped, true, $mode => $call)
            }
            ChosenKernel::Portable($token) => by_mode!($query, $mapped, false, $mode => $call),
            ChosenKernel::Avx2($token) => by_mode!($query, $mapped, false, $mode => $call),
            ChosenKernel::Avx512($token) => by_mode!($query, $mapped, false, $mode => $call),
        }
    };
}

/// Traversals, compiled once for both scalars of the caller.
impl Bvh8 {
    /// Passes the hits of a ray, exact in f32, to `visitor`. Returns whether a hit ended the
    /// traversal. The numbers of the ray are separate arguments, in registers. In memory, a load of
    /// two numbers would wait for both stores of a caller that just wrote the ray.
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "in registers")]
    pub(crate) fn visit(
        &self,
        ox: f32,
        oy: f32,
        oz: f32,
        dx: f32,
        dy: f32,
        dz: f32,
        near: f32,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        // The rare case is a separate function, so that this function only forwards its registers.
        if self.always > 0 || self.nodes.is_empty() {
            return self.visit_flat(ox, oy, oz, dx, dy, dz, near, query, visitor);
        }
        with!(self.kernel, query, false, s, M => s.walk::<M>(self, ox, oy, oz, dx, dy, dz, near, query, visitor))
    }

    /// Passes hits as [`Self::visit`], in a structure with primitives outside nodes: rows first,
    /// then the tree or, if it has no nodes, blocks and other primitives.
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "in registers")]
    fn visit_flat(
        &self,
        ox: f32,
        oy: f32,
        oz: f32,
        dx: f32,
        dy: f32,
        dz: f32,
        near: f32,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        if self.always > 0
            && with!(self.kernel, query, false, s, M => s.rows::<M>(self, ox, oy, oz, dx, dy, dz, query, visitor))
        {
            return true;
        }
        if !self.nodes.is_empty() {
            return with!(self.kernel, query, false, s, M => s.walk::<M>(self, ox, oy, oz, dx, dy, dz, near, query, visitor));
        }
        if self.blocks.is_empty() && self.others.is_empty() {
            return false;
        }
        let leaf_ray = TraversalRay::new([ox, oy, oz], [dx, dy, dz], near).leaf_ray;
        with!(self.kernel, query, false, s, M => s.blocks::<M>(self, &leaf_ray, query, visitor))
    }

    /// Passes hits as [`Self::visit`], for a ray in an instance's space, which f32 does not
    /// represent exactly. `traversal_ray` is the result of [`TraversalRay::mapped`].
    #[inline(never)]
    pub(crate) fn visit_mapped(
        &self,
        traversal_ray: &TraversalRay,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        if self.always > 0 || self.nodes.is_empty() {
            return self.visit_flat_mapped(traversal_ray, query, visitor);
        }
        with!(self.kernel, query, true, s, M => s.walk_mapped::<M>(self, traversal_ray, query, visitor))
    }

    /// Passes hits as [`Self::visit_mapped`], in a structure with primitives outside nodes.
    #[inline(never)]
    fn visit_flat_mapped(
        &self,
        traversal_ray: &TraversalRay,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        if self.always > 0 {
            let prepared_ray = *query.prepared();
            if with!(self.kernel, query, true, s, M => s.rows_mapped::<M>(self, &prepared_ray, query, visitor))
            {
                return true;
            }
        }
        if !self.nodes.is_empty() {
            return with!(self.kernel, query, true, s, M => s.walk_mapped::<M>(self, traversal_ray, query, visitor));
        }
        with!(self.kernel, query, true, s, M => s.blocks::<M>(self, &traversal_ray.leaf_ray, query, visitor))
    }

    /// Passes hits as [`Self::visit`], for a world-space ray that reaches an instance of this tree;
    /// `None` if the ray must be mapped in f64.
    #[inline(never)]
    pub(crate) fn visit_instance(
        &self,
        inverse: &RoughInverse,
        bounds: &BoundingSphere,
        ray: &PreparedRay,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> Option<bool> {
        if self.always > 0 || self.nodes.is_empty() {
            return None;
        }
        with!(self.kernel, query, true, s, M => s.walk_instance::<M>(self, inverse, bounds, ray, query, visitor))
    }

    /// Traverses the tree with a packet. Primitives without a packet test are passed to `meets`.
    #[inline(never)]
    pub(crate) fn visit_packet(
        &self,
        packet_state: &mut PacketState,
        meets: &mut dyn PacketVisitor,
    ) -> PacketResult {
        match self.kernel {
            ChosenKernel::Portable(s) => s.traverse_packet(self, packet_state, meets),
            ChosenKernel::Avx2(s) => s.traverse_packet(self, packet_state, meets),
            ChosenKernel::Avx512(s) => s.traverse_packet(self, packet_state, meets),
        }
    }
}

/// Defines entry points of an instruction set as methods of its token. Each method calls a function
/// with the attribute that compiles it for the instruction set.
macro_rules! entries {
    ($token:ident, $compiled:meta: $(
        $(#[doc = $about:literal])*
        $visibility:vis fn $name:ident$(<$G:ident: $Bound:ident>)?($s:ident $(, $argument:ident: $kind:ty)*) { $body:expr } -> $out:ty;
    )*) => { $(
        $(#[doc = $about])*
        #[inline(always)]
        #[allow(clippy::too_many_arguments, reason = "in registers")]
        $visibility fn $name$(<$G: $Bound>)?(self $(, $argument: $kind)*) -> $out {
            #[inline(never)]
            #[$compiled]
            #[allow(clippy::too_many_arguments, reason = "in registers")]
            fn enter$(<$G: $Bound>)?($s: $token $(, $argument: $kind)*) -> $out {
                $body
            }
            #[allow(unused_unsafe, reason = "what every processor has is safe to call")]
            // SAFETY: `self` exists, so the processor has what the function needs.
            unsafe { enter$(::<$G>)?(self $(, $argument)*) }
        }
    )* };
}

/// Defines the entry points for the whole tree.
macro_rules! traversals {
    ($token:ident, $compiled:meta) => {
        entries! { $token, $compiled:
            /// Traverses the tree by a world-space ray, exact in f32.
            pub(super) fn walk<M: TraversalMode>(
                s, bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, near: f32, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor
            ) { traverse::<_, M>(s, bvh, &TraversalRay::new([ox, oy, oz], [dx, dy, dz], near), query, visitor) } -> bool;
            /// Traverses the tree by a ray in an instance's space.
            pub(super) fn walk_mapped<M: TraversalMode>(s, bvh: &Bvh8, traversal_ray: &TraversalRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) {
                traverse::<_, M>(s, bvh, traversal_ray, query, visitor)
            } -> bool;
            /// Traverses the tree of an instance by a world-space ray; `None` if f32 is too
            /// imprecise to map the ray.
            pub(super) fn walk_instance<M: TraversalMode>(
                s, bvh: &Bvh8, inverse: &RoughInverse, bounds: &BoundingSphere, ray: &PreparedRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor
            ) { traverse_instance::<_, M>(s, bvh, inverse, bounds, ray, query, visitor) } -> Option<bool>;
            /// Intersects a world-space ray with the rows that every query tests.
            pub(super) fn rows<M: TraversalMode>(
                s, bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor
            ) { rows::<_, M>(s, bvh, &PreparedRay::in_world([ox, oy, oz], [dx, dy, dz]), query, visitor) } -> bool;
            /// Intersects a ray in an instance's space with the rows that every query tests.
            pub(super) fn rows_mapped<M: TraversalMode>(s, bvh: &Bvh8, prepared_ray: &PreparedRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) { rows::<_, M>(s, bvh, prepared_ray, query, visitor) } -> bool;
            /// Intersects a ray with all blocks and other primitives, for a structure without
            /// nodes.
            pub(super) fn blocks<M: TraversalMode>(s, bvh: &Bvh8, leaf_ray: &LeafRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) { blocks::<_, M>(s, bvh, leaf_ray, query, visitor) } -> bool;
            /// Traverses the tree with a packet of rays.
            pub(super) fn traverse_packet(s, bvh: &Bvh8, pencil: &mut PacketState, meets: &mut dyn PacketVisitor) {
                packet::walk(s, bvh, pencil, meets)
            } -> PacketResult;
        }
    };
}

/// Defines the entry points for leaf tests, and the exact test of a lane. The leaf tests are
/// separate functions, which take no registers of the traversal.
macro_rules! leaves {
    ($token:ident, $compiled:meta, $crossing:expr) => {
        #[inline(always)]
        fn crossing(self, block: &Triangle8, lane: usize, sight: &ProjectedRay) -> Result<Option<TriangleHit>, UncertainSign> {
            #[allow(unused_unsafe, reason = "what every processor has is safe to call")]
            // SAFETY: `self` exists, so the processor has what the function needs.
            unsafe {
                $crossing(block, lane, sight)
            }
        }
        entries! { $token, $compiled:
            fn settle<M: TraversalMode>(s, bvh: &Bvh8, number: usize, lanes: u32, leaf_ray: &LeafRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) {
                triangles::<_, M>(s, bvh, number, lanes, leaf_ray, query, visitor)
            } -> bool;
            fn spheres<M: TraversalMode>(s, bvh: &Bvh8, leaf: ChildRef, leaf_ray: &LeafRay, prepared_ray: &mut Option<PreparedRay>, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) {
                spheres::<_, M>(s, bvh, leaf, leaf_ray, prepared_ray, query, visitor)
            } -> bool;
        }
    };
}

#[cfg(target_arch = "x86_64")]
pub(super) use {entries, leaves};

impl Portable {
    traversals!(Portable, cfg(all()));
}

impl TraversalSimd for Portable {
    leaves!(Portable, cfg(all()), |_, _, _| Err(UncertainSign));
}

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    traversals!(
        Avx2,
        target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")
    );
}

#[cfg(target_arch = "x86_64")]
impl Avx512 {
    traversals!(
        Avx512,
        target_feature(
            enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
        )
    );
}
