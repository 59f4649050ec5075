//! What is tested without nodes: rows that every query meets, and all there is where that is so little that nodes would cost more than
//! they spare.

use core::ops::Range;

use super::row::RayF64;
use super::traversal_ray::LeafRay;
use super::traversal_simd::{TraversalSimd, asked};
use super::traverse::HitVisitor;
use super::{Bvh8, WIDTH};
use crate::math::simd::Simd;

/// What a scan may take before a tree takes over, and what it takes for a row and for a block: a row as it was measured, a block so that there are
/// two at most. Rays that miss a small mesh miss all of its blocks, and without nodes each is asked: instances of 60 triangles took 1.38 times
/// the instructions (`../../../../benches/runs/2026-11-25-what-stays.md`). What comes in neither is asked one by one: two of those are slower
/// than their boxes.
const LIMIT: u64 = 100;
const ROW: u64 = 5;
const BLOCK: u64 = 50;

impl Bvh8 {
    /// The places of all there is, where that is nothing but primitives that are tested one by one.
    pub fn places_alone(&self) -> Option<Range<usize>> {
        (self.nodes.is_empty() && self.blocks.is_empty() && self.always == 0).then(|| self.others.clone())
    }

    /// Whether so many primitives of any kinds may be.
    pub fn may_be_flat(primitives: usize) -> bool {
        primitives as u64 <= LIMIT / ROW * WIDTH as u64 + 1
    }

    /// Whether so many spheres, triangles and other primitives are tested one after the other as fast as by way of nodes.
    pub fn is_flat(spheres: u64, triangles: u64, others: u64) -> bool {
        let eights = |count: u64, each: u64| count.div_ceil(WIDTH as u64).saturating_mul(each);
        others <= 1 && eights(spheres, ROW).saturating_add(eights(triangles, BLOCK)) <= LIMIT
    }
}

/// Asks about the rows that every query meets. Whether some answer ended it.
#[inline(always)]
pub(super) fn rows<S: Simd, A: HitVisitor>(s: S, bvh: &Bvh8, line: &RayF64, answer: &mut A) -> bool {
    for row in &bvh.rows[..bvh.always] {
        answer.several(u64::from(row.facts.count));
        let found = row.hits(s, line, answer.range(), answer.culls());
        if found.hits == 0 {
            continue;
        }
        if answer.row(&row.facts, &found.roots(s)) {
            return true;
        }
    }
    false
}

/// Asks about each block, and then about what comes in no block. Whether some answer ended it.
#[inline(always)]
pub(super) fn blocks<S: TraversalSimd, A: HitVisitor>(s: S, bvh: &Bvh8, aim: &LeafRay, answer: &mut A) -> bool {
    for (number, block) in bvh.blocks.iter().enumerate() {
        answer.block(number);
        if asked(s, block, number, aim, answer) {
            return true;
        }
    }
    bvh.others.clone().any(|place| answer.other(place))
}
