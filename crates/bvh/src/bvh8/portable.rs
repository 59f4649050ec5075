//! The kernel of every processor: exact tests one by one.

use super::gathered::gathered;
use super::row::RayF64;
use super::traversal_ray::LeafRay;
use super::traversal_simd::{TraversalSimd, settled};
use super::traverse::HitVisitor;
use super::triangle8::Triangle8;
use super::{Bvh8, Child};
use crate::math::simd::Portable;
use crate::shapes::PreparedRay;

impl TraversalSimd for Portable {
    #[inline(never)]
    fn settle<A: HitVisitor>(
        self,
        block: &Triangle8,
        at: [usize; 2],
        aim: &LeafRay,
        probe: Option<&PreparedRay>,
        answer: &mut A,
    ) -> bool {
        settled(self, block, at, aim, probe, answer)
    }
    #[inline(never)]
    fn gathered<A: HitVisitor>(
        self,
        bvh: &Bvh8,
        leaf: Child,
        aim: &LeafRay,
        probe: Option<&PreparedRay>,
        line: &mut Option<RayF64>,
        answer: &mut A,
    ) -> bool {
        gathered(self, bvh, leaf, aim, probe, line, answer)
    }
}
