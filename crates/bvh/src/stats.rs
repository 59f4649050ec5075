//! Statistics of traversals: the numbers of nodes, leaves and primitives that queries test.

/// Receiver of work counts: the numbers of nodes, leaves and primitives that queries test. The
/// receiver `()` discards the counts, at no cost.
pub trait TraversalCounter {
    /// Whether the counter keeps any counts. Queries that count run on [`crate::Kernel::Portable`],
    /// so that the counts do not depend on the processor.
    const COUNTS: bool;
    /// Adds the counts of one query, or of one step of a query.
    fn count(&mut self, work: TraversalStats);
}

impl TraversalCounter for () {
    const COUNTS: bool = false;
    #[inline(always)]
    fn count(&mut self, _: TraversalStats) {}
}

/// Numbers of nodes, leaves and primitives that queries tested, summed over any number of queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalStats {
    /// Number of visited nodes. A visit tests the boxes of up to eight children.
    pub nodes: u64,
    /// Number of tested leaves: blocks of triangles, rows of spheres or planes, and primitives that
    /// are tested alone.
    pub leaves: u64,
    /// Number of primitives in the tested leaves.
    pub primitives: u64,
}

impl TraversalStats {
    /// Counts of a single primitive that is tested alone.
    pub(crate) const ONE: Self = Self {
        nodes: 0,
        leaves: 1,
        primitives: 1,
    };
}

impl TraversalCounter for TraversalStats {
    const COUNTS: bool = true;
    #[inline(always)]
    fn count(&mut self, work: Self) {
        self.nodes += work.nodes;
        self.leaves += work.leaves;
        self.primitives += work.primitives;
    }
}
