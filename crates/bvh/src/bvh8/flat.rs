//! The decision whether a set is so small that a tree without nodes is faster: every query then
//! tests every primitive.

use core::ops::Range;

use super::{Bvh8, WIDTH};

/// Greatest cost of testing all primitives without nodes, and the costs of a row and of a block,
/// all in a common unit.
///
/// The cost of a row was measured. The cost of a block admits at most two blocks: a ray that misses
/// a small mesh misses all of its blocks, but without nodes it tests each of them. Instances of 60
/// triangles without nodes took 1.38 times the instructions
/// (`../../../../benches/runs/2026-11-25-what-stays.md`). At most one primitive may be outside rows
/// and blocks, since testing two is slower than testing their boxes.
const LIMIT: u64 = 100;
const ROW: u64 = 5;
const BLOCK: u64 = 50;

impl Bvh8 {
    /// Returns the positions of all primitives if the structure has neither nodes nor blocks nor
    /// rows, so that every primitive is tested alone.
    #[inline(always)]
    pub fn single_primitive_positions(&self) -> Option<Range<usize>> {
        (self.nodes.is_empty() && self.blocks.is_empty() && self.always_row_count == 0)
            .then(|| self.single_positions.clone())
    }

    /// Upper bound of the number of primitives in a structure without nodes.
    pub const MAX_WITHOUT_NODES: usize = LIMIT as usize / ROW as usize * WIDTH + 1;

    /// Whether testing all of these primitives without nodes is at least as fast as a tree.
    pub fn prefers_no_nodes(spheres: u64, triangles: u64, others: u64) -> bool {
        let eights = |count: u64, each: u64| count.div_ceil(WIDTH as u64).saturating_mul(each);
        others <= 1 && eights(spheres, ROW).saturating_add(eights(triangles, BLOCK)) <= LIMIT
    }
}
