//! When to omit nodes: sets so small that testing every primitive costs less.

use core::ops::Range;

use super::{Bvh8, WIDTH};

/// Greatest cost of a scan before a tree takes over, and the costs of a row and of a block in the
/// same unit. The cost of a row was measured; that of a block admits at most two. A ray that misses
/// a small mesh misses all of its blocks, and without nodes it tests each: instances of 60
/// triangles took 1.38 times the instructions
/// (`../../../../benches/runs/2026-11-25-what-stays.md`). At most one primitive may be outside rows
/// and blocks: testing two is slower than testing their boxes.
const LIMIT: u64 = 100;
const ROW: u64 = 5;
const BLOCK: u64 = 50;

impl Bvh8 {
    /// Positions of all primitives, if every primitive is tested alone.
    #[inline(always)]
    pub fn places_alone(&self) -> Option<Range<usize>> {
        (self.nodes.is_empty() && self.blocks.is_empty() && self.always == 0)
            .then(|| self.others.clone())
    }

    /// Upper bound of primitives of any kind.
    pub const MOST_FLAT: usize = LIMIT as usize / ROW as usize * WIDTH + 1;

    /// Whether testing these primitives in sequence is as fast as through nodes.
    pub fn is_flat(spheres: u64, triangles: u64, others: u64) -> bool {
        let eights = |count: u64, each: u64| count.div_ceil(WIDTH as u64).saturating_mul(each);
        others <= 1 && eights(spheres, ROW).saturating_add(eights(triangles, BLOCK)) <= LIMIT
    }
}
