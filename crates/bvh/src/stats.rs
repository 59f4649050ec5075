//! Traversal statistics.

/// Counter of traversal work; `()` counts nothing and costs nothing.
pub trait TraversalCounter {
    /// Whether anything is counted. Counting queries use [`crate::Kernel::Portable`], so that
    /// counts do not depend on the processor.
    const COUNTS: bool;
    /// Adds the work of a query.
    fn count(&mut self, done: TraversalStats);
}

impl TraversalCounter for () {
    const COUNTS: bool = false;
    #[inline(always)]
    fn count(&mut self, _: TraversalStats) {}
}

/// Counts of one query or of many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalStats {
    /// Nodes whose boxes were tested.
    pub nodes: u64,
    /// Leaves tested: blocks of triangles, rows of spheres or planes, and single primitives.
    pub leaves: u64,
    /// Primitives tested.
    pub primitives: u64,
}

impl TraversalStats {
    /// One primitive tested alone.
    pub(crate) const ONE: Self = Self {
        nodes: 0,
        leaves: 1,
        primitives: 1,
    };
}

impl TraversalCounter for TraversalStats {
    const COUNTS: bool = true;
    #[inline(always)]
    fn count(&mut self, done: Self) {
        self.nodes += done.nodes;
        self.leaves += done.leaves;
        self.primitives += done.primitives;
    }
}
