//! Counting what queries do.

/// Counts what a query does; `()` counts nothing and costs nothing.
pub trait TraversalCounter {
    /// A node's boxes were tested.
    fn node(&mut self);
    /// So many primitives were tested. The number is asked for only where it is counted.
    fn primitives(&mut self, count: impl FnOnce() -> u64);
}

impl TraversalCounter for () {
    fn node(&mut self) {}
    fn primitives(&mut self, _: impl FnOnce() -> u64) {}
}

/// Statistics of a query or of many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalStats {
    /// Nodes whose boxes were tested.
    pub nodes: u64,
    /// Primitives tested.
    pub primitives: u64,
}

impl TraversalCounter for TraversalStats {
    #[inline(always)]
    fn node(&mut self) {
        self.nodes += 1;
    }
    #[inline(always)]
    fn primitives(&mut self, count: impl FnOnce() -> u64) {
        self.primitives += count();
    }
}
