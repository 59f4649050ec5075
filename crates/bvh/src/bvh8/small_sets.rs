//! The decision whether a set is so small that queries are faster without nodes. Every query then
//! tests every primitive.

use core::ops::Range;

use super::{Bvh8, WIDTH};

/// Greatest total cost of the rows and blocks in a structure without nodes, then the cost of a row
/// and the cost of a block, all in a common unit.
///
/// The cost of a row was measured. The cost of a block allows at most two blocks. In a tree a ray
/// that misses a small mesh tests none of its blocks, without nodes it tests all of them. Instances
/// of 60 triangles without nodes took 1.38 times the instructions
/// (`../../../../benches/runs/2026-11-25-what-stays.md`). At most one primitive may be outside rows
/// and blocks: testing two such primitives is slower than testing their boxes.
const LIMIT: u64 = 100;
const ROW: u64 = 5;
const BLOCK: u64 = 50;

impl Bvh8 {
    /// Returns the positions of all primitives if each of them is tested alone: the structure has
    /// no nodes, no blocks and no rows. Otherwise `None`.
    #[inline(always)]
    pub fn single_primitive_positions(&self) -> Option<Range<usize>> {
        (self.nodes.is_empty() && self.blocks.is_empty() && self.always_row_count == 0)
            .then(|| self.single_positions.clone())
    }

    /// Upper bound of the number of primitives in a structure without nodes.
    pub const MAX_WITHOUT_NODES: usize = LIMIT as usize / ROW as usize * WIDTH + 1;

    /// Whether a query is at least as fast without nodes as with a tree, for these numbers of
    /// spheres, triangles and other primitives.
    pub fn prefers_no_nodes(spheres: u64, triangles: u64, others: u64) -> bool {
        let eights = |count: u64, each: u64| count.div_ceil(WIDTH as u64).saturating_mul(each);
        others <= 1 && eights(spheres, ROW).saturating_add(eights(triangles, BLOCK)) <= LIMIT
    }
}
