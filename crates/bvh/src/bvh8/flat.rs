//! When nodes would cost more than they spare: where there is so little that all of it is tested.

use core::ops::Range;

use super::{Bvh8, WIDTH};

/// What a scan may take before a tree takes over, and what it takes for a row and for a block: a
/// row as it was measured, a block so that there are two at most. Rays that miss a small mesh miss
/// all of its blocks, and without nodes each is asked: instances of 60 triangles took 1.38 times
/// the instructions (`../../../../benches/runs/2026-11-25-what-stays.md`). What comes in neither is
/// asked one by one: two of those are slower than their boxes.
const LIMIT: u64 = 100;
const ROW: u64 = 5;
const BLOCK: u64 = 50;

impl Bvh8 {
    /// The places of all there is, where that is nothing but primitives that are tested one by one.
    #[inline(always)]
    pub fn places_alone(&self) -> Option<Range<usize>> {
        (self.nodes.is_empty() && self.blocks.is_empty() && self.always == 0)
            .then(|| self.others.clone())
    }

    /// More primitives of whatever kinds are too many.
    pub const MOST_FLAT: usize = LIMIT as usize / ROW as usize * WIDTH + 1;

    /// Whether so many spheres, triangles and other primitives are tested one after the other as
    /// fast as by way of nodes.
    pub fn is_flat(spheres: u64, triangles: u64, others: u64) -> bool {
        let eights = |count: u64, each: u64| count.div_ceil(WIDTH as u64).saturating_mul(each);
        others <= 1 && eights(spheres, ROW).saturating_add(eights(triangles, BLOCK)) <= LIMIT
    }
}
