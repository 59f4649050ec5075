//! Observation and cancellation of preparation and rendering, through a single interface.

/// Watches preparation and rendering, and may stop both. The working threads call it: a few hundred
/// times a picture, between the stages of preparation, and now and then within long stages.
#[doc(alias("ProgressReporter", "CancellationToken"))]
pub trait Observer: Sync {
    /// Reports progress: `done` of `total` samples of all pixels.
    fn progress(&self, done: u64, total: u64) {
        let _ = (done, total);
    }
    /// Returns true to cancel. A render stops at the next tile and keeps its finished samples.
    /// Preparation returns [`PrepareError::Cancelled`](crate::prepare::PrepareError::Cancelled) at
    /// its next check; a tree under construction is finished first.
    fn is_cancelled(&self) -> bool {
        false
    }
    /// Returns true to end a render at the next tile with its finished samples. Called before each
    /// tile; `everywhere` says whether every rendered pixel has samples already.
    fn has_enough(&self, everywhere: bool) -> bool {
        let _ = everywhere;
        false
    }
}

/// An observer that ignores progress and never stops.
impl Observer for () {}
