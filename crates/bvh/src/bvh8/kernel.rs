//! Selection of the traversal code by the processor's instructions, once for all rays, and the
//! entry points of that code. An entry point runs the whole traversal, or the tests of one leaf.
//! Leaf tests are separate functions, so that they occupy no registers of the traversal.
//!
//! Each entry point is a method of a token. A token's existence proves that the processor has the
//! instructions. The method calls a function that is compiled for these instructions, and into
//! which all other code is inlined.
#![expect(
    unsafe_code,
    reason = "calls of functions that are compiled for instructions which the token proves to exist"
)]

use super::Bvh8;
use super::ChildRef;
use super::leaf::{
    intersect_all_triangle_blocks, intersect_rows_outside_tree, intersect_sphere_leaf,
    intersect_triangles,
};
use super::packet::{PacketResult, PacketState, PacketVisitor, traverse_packet};
use super::projected_ray::{ProjectedRay, UncertainSign};
use super::query::{HitVisitor, StaticTraversalMode, TraversalMode, TraversalQuery};
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::traverse::{traverse, traverse_instance};
use super::triangle8::Triangle8;
use crate::aabb::BoundingSphere;
use crate::math::simd::{Avx2, Avx512, Portable};
use crate::shapes::{PreparedRay, Transform, TriangleHit};

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
    /// Returns the kernels that this processor can run, the fastest last.
    pub fn available() -> Vec<Self> {
        let all = [Self::Portable, Self::Avx2, Self::Avx512];
        all.into_iter()
            .filter(|&kernel| AvailableKernel::new(kernel).is_some())
            .collect()
    }
}

/// A kernel that this processor can run, with the token that proves this.
#[derive(Clone, Copy, Debug)]
pub(super) enum AvailableKernel {
    Portable(Portable),
    Avx2(Avx2),
    Avx512(Avx512),
}

impl AvailableKernel {
    pub fn new(kernel: Kernel) -> Option<Self> {
        match kernel {
            Kernel::Portable => Some(Self::Portable(Portable)),
            Kernel::Avx2 => Avx2::detect().map(Self::Avx2),
            Kernel::Avx512 => Avx512::detect().map(Self::Avx512),
        }
    }
}

/// Selects the fastest kernel that this processor can run.
impl Default for AvailableKernel {
    fn default() -> Self {
        [Kernel::Avx512, Kernel::Avx2]
            .into_iter()
            .find_map(Self::new)
            .unwrap_or(Self::Portable(Portable))
    }
}

/// Evaluates an expression in which the name `$mode` is a [`TraversalMode`] with the properties of
/// `$query`. `$mapped` and `$counts` are literals. Whether any hit ends the query is a property of
/// `$query`.
macro_rules! dispatch_mode {
    ($query:expr, $mapped:literal, $counts:literal, $mode:ident => $call:expr) => {
        if $query.ends_at_any_hit {
            type $mode = StaticTraversalMode<true, $mapped, $counts>;
            $call
        } else {
            type $mode = StaticTraversalMode<false, $mapped, $counts>;
            $call
        }
    };
}

/// Calls an entry point as a method of the kernel's token, with the query's [`TraversalMode`] as a
/// type. Queries that count their work always use the portable code. Their speed does not matter,
/// so one copy of the code suffices.
macro_rules! dispatch_kernel {
    ($kernel:expr, $query:expr, $mapped:literal, $token:ident, $mode:ident => $call:expr) => {
        match $kernel {
            _ if $query.counts_work => {
                let $token = Portable;
                dispatch_mode!($query, $mapped, true, $mode => $call)
            }
            AvailableKernel::Portable($token) => dispatch_mode!($query, $mapped, false, $mode => $call),
            AvailableKernel::Avx2($token) => dispatch_mode!($query, $mapped, false, $mode => $call),
            AvailableKernel::Avx512($token) => dispatch_mode!($query, $mapped, false, $mode => $call),
        }
    };
}

/// Traversals. No scalar type of the caller is a parameter, so they are compiled only once.
impl Bvh8 {
    /// Passes the hits of a ray, exact in f32, to `visitor`. Returns whether a hit ended the
    /// traversal.
    ///
    /// The six components of the ray are separate arguments, so that they are passed in registers.
    /// A caller that just wrote the ray to memory would make a load of two components wait for both
    /// stores.
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "in registers")]
    pub(crate) fn visit_hits(
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
        if self.always_row_count > 0 || self.nodes.is_empty() {
            return self.visit_rows_then_tree(ox, oy, oz, dx, dy, dz, near, query, visitor);
        }
        dispatch_kernel!(self.kernel, query, false, s, M => s.traverse::<M>(self, ox, oy, oz, dx, dy, dz, near, query, visitor))
    }

    /// Passes hits as [`Self::visit_hits`], in a structure with primitives outside nodes. Rows that
    /// every query tests come first. Then the tree is traversed or, if it has no nodes, all blocks
    /// and single primitives are tested.
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "in registers")]
    fn visit_rows_then_tree(
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
        if self.always_row_count > 0
            && dispatch_kernel!(self.kernel, query, false, s, M => s.intersect_rows_outside_tree::<M>(self, ox, oy, oz, dx, dy, dz, query, visitor))
        {
            return true;
        }
        if !self.nodes.is_empty() {
            return dispatch_kernel!(self.kernel, query, false, s, M => s.traverse::<M>(self, ox, oy, oz, dx, dy, dz, near, query, visitor));
        }
        if self.blocks.is_empty() && self.single_positions.is_empty() {
            return false;
        }
        let leaf_ray = TraversalRay::new([ox, oy, oz], [dx, dy, dz], near).leaf_ray;
        dispatch_kernel!(self.kernel, query, false, s, M => s.intersect_triangle_blocks::<M>(self, &leaf_ray, query, visitor))
    }

    /// Passes hits as [`Self::visit_hits`], for a ray in f64 that f32 does not represent exactly: a
    /// ray in an instance's space, or of a set stored in f64. `traversal_ray` is the result of
    /// [`TraversalRay::from_f64_ray`].
    #[inline(never)]
    pub(crate) fn visit_hits_of_rounded_ray(
        &self,
        traversal_ray: &TraversalRay,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        if self.always_row_count > 0 || self.nodes.is_empty() {
            return self.visit_all_by_rounded_ray(traversal_ray, query, visitor);
        }
        dispatch_kernel!(self.kernel, query, true, s, M => s.traverse_by_rounded_ray::<M>(self, traversal_ray, query, visitor))
    }

    /// Passes hits of a ray in f64 as [`Self::visit_hits_of_rounded_ray`], in a structure with
    /// primitives outside nodes. Their order is that of [`Self::visit_rows_then_tree`].
    #[inline(never)]
    fn visit_all_by_rounded_ray(
        &self,
        traversal_ray: &TraversalRay,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> bool {
        if self.always_row_count > 0 {
            let prepared_ray = *query.prepared_ray();
            if dispatch_kernel!(self.kernel, query, true, s, M => s.intersect_unculled_rows::<M>(self, &prepared_ray, query, visitor))
            {
                return true;
            }
        }
        if !self.nodes.is_empty() {
            return dispatch_kernel!(self.kernel, query, true, s, M => s.traverse_by_rounded_ray::<M>(self, traversal_ray, query, visitor));
        }
        dispatch_kernel!(self.kernel, query, true, s, M => s.intersect_triangle_blocks::<M>(self, &traversal_ray.leaf_ray, query, visitor))
    }

    /// Passes hits as [`Self::visit_hits`], for a world-space ray that reaches an instance of this
    /// tree. Returns `None`, without a traversal, if f32 is too imprecise to map the ray, or if the
    /// structure has primitives outside nodes.
    #[inline(never)]
    pub(crate) fn visit_instance(
        &self,
        transform: &Transform,
        bounds: &BoundingSphere,
        ray: &PreparedRay,
        query: &mut TraversalQuery<'_>,
        visitor: &mut dyn HitVisitor,
    ) -> Option<bool> {
        if self.always_row_count > 0 || self.nodes.is_empty() {
            return None;
        }
        dispatch_kernel!(self.kernel, query, true, s, M => s.traverse_instance::<M>(self, transform, bounds, ray, query, visitor))
    }

    /// Traverses the tree with a packet of rays. Primitives without a packet test are passed to
    /// `visitor`. Hits are stored in `packet_state`.
    #[inline(never)]
    pub(crate) fn visit_packet(
        &self,
        packet_state: &mut PacketState,
        visitor: &mut dyn PacketVisitor,
    ) -> PacketResult {
        match self.kernel {
            AvailableKernel::Portable(s) => s.traverse_packet(self, packet_state, visitor),
            AvailableKernel::Avx2(s) => s.traverse_packet(self, packet_state, visitor),
            AvailableKernel::Avx512(s) => s.traverse_packet(self, packet_state, visitor),
        }
    }
}

/// Defines entry points as methods of an instruction set's token. Each method calls an inner
/// function, whose attribute `$compiled` selects the instruction set.
macro_rules! define_entry_points {
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
            #[allow(unused_unsafe, reason = "the portable version needs no special instructions, so its call is safe")]
            // SAFETY: `self` exists, so the processor has what the function needs.
            unsafe { enter$(::<$G>)?(self $(, $argument)*) }
        }
    )* };
}

/// Defines the entry points that traverse the whole tree.
macro_rules! define_traversals {
    ($token:ident, $compiled:meta) => {
        define_entry_points! { $token, $compiled:
            /// Traverses the tree by a world-space ray, exact in f32.
            pub(super) fn traverse<M: TraversalMode>(
                s, bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, near: f32, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor
            ) { traverse::<_, M>(s, bvh, &TraversalRay::new([ox, oy, oz], [dx, dy, dz], near), query, visitor) } -> bool;
            /// Traverses the tree by a ray in f64, as in an instance's space, rounded to f32.
            pub(super) fn traverse_by_rounded_ray<M: TraversalMode>(s, bvh: &Bvh8, traversal_ray: &TraversalRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) {
                traverse::<_, M>(s, bvh, traversal_ray, query, visitor)
            } -> bool;
            /// Traverses the tree of an instance by a world-space ray; `None` if f32 is too
            /// imprecise to map the ray.
            pub(super) fn traverse_instance<M: TraversalMode>(
                s, bvh: &Bvh8, transform: &Transform, bounds: &BoundingSphere, ray: &PreparedRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor
            ) { traverse_instance::<_, M>(s, bvh, transform, bounds, ray, query, visitor) } -> Option<bool>;
            /// Intersects a world-space ray with the rows that every query tests.
            pub(super) fn intersect_rows_outside_tree<M: TraversalMode>(
                s, bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor
            ) { intersect_rows_outside_tree::<_, M>(s, bvh, &PreparedRay::from_world_ray([ox, oy, oz], [dx, dy, dz]), query, visitor) } -> bool;
            /// Intersects a ray in f64, as in an instance's space, with the rows that every query
            /// tests.
            pub(super) fn intersect_unculled_rows<M: TraversalMode>(s, bvh: &Bvh8, prepared_ray: &PreparedRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) { intersect_rows_outside_tree::<_, M>(s, bvh, prepared_ray, query, visitor) } -> bool;
            /// Intersects a ray with all triangle blocks and then all single primitives of a
            /// structure without nodes.
            pub(super) fn intersect_triangle_blocks<M: TraversalMode>(s, bvh: &Bvh8, leaf_ray: &LeafRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) { intersect_all_triangle_blocks::<_, M>(s, bvh, leaf_ray, query, visitor) } -> bool;
            /// Traverses the tree with a packet of rays.
            pub(super) fn traverse_packet(s, bvh: &Bvh8, packet_state: &mut PacketState, visitor: &mut dyn PacketVisitor) {
                traverse_packet(s, bvh, packet_state, visitor)
            } -> PacketResult;
        }
    };
}

/// Defines the entry points of leaf tests, and the exact test of the triangle in one lane. Leaf
/// tests are separate functions, so that they occupy no registers of the traversal.
macro_rules! define_leaf_tests {
    ($token:ident, $compiled:meta, $intersect_lane:expr) => {
        #[inline(always)]
        fn intersect_triangle_in_lane(self, block: &Triangle8, lane: usize, projected_ray: &ProjectedRay) -> Result<Option<TriangleHit>, UncertainSign> {
            #[allow(unused_unsafe, reason = "the portable version needs no special instructions, so its call is safe")]
            // SAFETY: `self` exists, so the processor has what the function needs.
            unsafe {
                $intersect_lane(block, lane, projected_ray)
            }
        }
        define_entry_points! { $token, $compiled:
            fn intersect_triangles<M: TraversalMode>(s, bvh: &Bvh8, number: usize, lanes: u32, leaf_ray: &LeafRay, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) {
                intersect_triangles::<_, M>(s, bvh, number, lanes, leaf_ray, query, visitor)
            } -> bool;
            fn intersect_sphere_leaf<M: TraversalMode>(s, bvh: &Bvh8, leaf: ChildRef, leaf_ray: &LeafRay, prepared_ray: &mut Option<PreparedRay>, query: &mut TraversalQuery<'_>, visitor: &mut dyn HitVisitor) {
                intersect_sphere_leaf::<_, M>(s, bvh, leaf, leaf_ray, prepared_ray, query, visitor)
            } -> bool;
        }
    };
}

#[cfg(target_arch = "x86_64")]
pub(super) use {define_entry_points, define_leaf_tests};

impl Portable {
    define_traversals!(Portable, cfg(all()));
}

impl TraversalSimd for Portable {
    define_leaf_tests!(Portable, cfg(all()), |_, _, _| Err(UncertainSign));
}

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    define_traversals!(
        Avx2,
        target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")
    );
}

#[cfg(target_arch = "x86_64")]
impl Avx512 {
    define_traversals!(
        Avx512,
        target_feature(
            enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
        )
    );
}
