//! Where code for a set of instructions is entered: the traversal as a whole, and the leaves apart from it, whose registers they would take.
//!
//! Each entry is a method of the token that proves that the processor has the instructions. It calls a function that is compiled for them, into which
//! everything else is inlined.
#![expect(unsafe_code, reason = "calls of functions that are compiled for instructions whose token the caller has")]

use super::leaf::{blocks, rows, spheres, triangles};
use super::packet::{self, PacketResult, PacketState, PacketVisitor};
use super::projected_ray::{ProjectedRay, Unsure};
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::traverse::{HitVisitor, traverse, traverse_instance};
use super::triangle8::Triangle8;
use super::{Bvh8, Child};
use crate::aabb::BoundingSphere;
use crate::instance::RoughInverse;
use crate::math::simd::Portable;
#[cfg(target_arch = "x86_64")]
use crate::math::simd::{Avx2, Avx512};
use crate::shapes::{PreparedRay, TriangleHit};

/// Entries of a set of instructions: methods of its token, each of which calls a function that an attribute has compiled for them.
macro_rules! entries {
    ($token:ident, $compiled:meta: $(
        $(#[doc = $about:literal])*
        $visibility:vis fn $name:ident<$G:ident: $Bound:ident>($s:ident $(, $argument:ident: $kind:ty)*) { $body:expr } -> $out:ty;
    )*) => { $(
        $(#[doc = $about])*
        #[inline(always)]
        #[allow(clippy::too_many_arguments, reason = "in registers")]
        $visibility fn $name<$G: $Bound>(self $(, $argument: $kind)*) -> $out {
            #[inline(never)]
            #[$compiled]
            #[allow(clippy::too_many_arguments, reason = "in registers")]
            fn enter<$G: $Bound>($s: $token $(, $argument: $kind)*) -> $out {
                $body
            }
            #[allow(unused_unsafe, reason = "what every processor has is safe to call")]
            // SAFETY: `self` exists, so the processor has what the function needs.
            unsafe { enter(self $(, $argument)*) }
        }
    )* };
}

/// What a query asks of the whole tree.
macro_rules! traversals {
    ($token:ident, $compiled:meta) => {
        entries! { $token, $compiled:
            /// The walk with these instructions.
            pub(super) fn walk<A: HitVisitor>(
                s, bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, near: f32, answer: &mut A
            ) { traverse(s, bvh, &TraversalRay::new([ox, oy, oz], [dx, dy, dz], near), answer) } -> bool;
            /// The same for a ray in the space of an instance.
            pub(super) fn walk_mapped<A: HitVisitor>(s, bvh: &Bvh8, setup: &TraversalRay, answer: &mut A) {
                traverse(s, bvh, setup, answer)
            } -> bool;
            /// The same for a ray of the world, by the map of an instance. None where f32 can't tell it well enough.
            pub(super) fn walk_instance<A: HitVisitor>(
                s, bvh: &Bvh8, inverse: &RoughInverse, bounds: &BoundingSphere, ray: &PreparedRay, answer: &mut A
            ) { traverse_instance(s, bvh, inverse, bounds, ray, answer) } -> Option<bool>;
            /// The rows that every query tests.
            pub(super) fn rows<A: HitVisitor>(
                s, bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, answer: &mut A
            ) { rows(s, bvh, &PreparedRay::in_world([ox, oy, oz], [dx, dy, dz]), answer) } -> bool;
            /// The same for a ray in the space of an instance.
            pub(super) fn rows_mapped<A: HitVisitor>(s, bvh: &Bvh8, line: &PreparedRay, answer: &mut A) { rows(s, bvh, line, answer) } -> bool;
            /// Blocks and the rest where there are no nodes.
            pub(super) fn blocks<A: HitVisitor>(s, bvh: &Bvh8, aim: &LeafRay, answer: &mut A) { blocks(s, bvh, aim, answer) } -> bool;
            /// Rays from one point.
            pub(super) fn pencil<M: PacketVisitor>(s, bvh: &Bvh8, pencil: &mut PacketState, meets: &mut M) {
                packet::walk(s, bvh, pencil, meets)
            } -> PacketResult;
        }
    };
}

/// What a traversal asks of a leaf, apart from it, whose registers that would take, with the exact test of a lane.
macro_rules! leaves {
    ($token:ident, $compiled:meta, $crossing:expr) => {
        #[inline(always)]
        fn crossing(self, block: &Triangle8, lane: usize, sight: &ProjectedRay) -> Result<Option<TriangleHit>, Unsure> {
            #[allow(unused_unsafe, reason = "what every processor has is safe to call")]
            // SAFETY: `self` exists, so the processor has what the function needs.
            unsafe {
                $crossing(block, lane, sight)
            }
        }
        entries! { $token, $compiled:
            fn settle<A: HitVisitor>(s, bvh: &Bvh8, number: usize, lanes: u32, aim: &LeafRay, answer: &mut A) {
                triangles(s, bvh, number, lanes, aim, answer)
            } -> bool;
            fn spheres<A: HitVisitor>(s, bvh: &Bvh8, leaf: Child, aim: &LeafRay, line: &mut Option<PreparedRay>, answer: &mut A) {
                spheres(s, bvh, leaf, aim, line, answer)
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
    leaves!(Portable, cfg(all()), |_, _, _| Err(Unsure));
}

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    traversals!(Avx2, target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt"));
}

#[cfg(target_arch = "x86_64")]
impl Avx512 {
    traversals!(Avx512, target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"));
}
