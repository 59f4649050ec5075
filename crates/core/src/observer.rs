//! Whoever asked for a picture can look on, and stop the work: one interface for preparation and
//! rendering.

/// Watches preparation and rendering, and may stop both. Called from the threads that do the work,
/// wherever they are: a few hundred times a picture, and in preparation between its stages and now
/// and then within the long ones.
pub trait Observer: Sync {
    /// So much of a render is done: samples of all pixels.
    fn progress(&self, done: u64, total: u64) {
        let _ = (done, total);
    }
    /// True to stop: a render at the next tile, with what it has; preparation with
    /// [`PrepareError::Cancelled`](crate::prepare::PrepareError::Cancelled) where it next asks. A
    /// tree that is being built is finished first.
    fn cancelled(&self) -> bool {
        false
    }
    /// True to end a render at the next tile with what it has: asked before each tile, and told
    /// whether every pixel of what is rendered has samples by now.
    fn has_enough(&self, everywhere: bool) -> bool {
        let _ = everywhere;
        false
    }
}

/// Looks at nothing and stops nothing.
impl Observer for () {}
