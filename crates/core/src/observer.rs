//! Interface for observing and cancelling preparation and rendering.

/// Observer of preparation and rendering, which may stop both. The rendering threads call its
/// methods a few hundred times per picture. Preparation calls them between its stages, and
/// occasionally within long stages.
#[doc(alias("ProgressReporter", "CancellationToken"))]
pub trait Observer: Sync {
    /// Reports progress: `done` of `total` samples, summed over all pixels.
    fn progress(&self, done: u64, total: u64) {
        let _ = (done, total);
    }
    /// Returns true to cancel. A render then stops at the next tile and keeps its finished samples.
    /// Preparation returns [`PrepareError::Cancelled`](crate::prepare::PrepareError::Cancelled) at
    /// its next check. It finishes a BVH that is being built first.
    fn is_cancelled(&self) -> bool {
        false
    }
    /// Returns true if the picture has enough samples, so that the render ends at the next tile.
    /// Called before each tile. `everywhere` is whether every rendered pixel has samples.
    fn has_enough_samples(&self, everywhere: bool) -> bool {
        let _ = everywhere;
        false
    }
}

/// Ignores progress and never stops.
impl Observer for () {}
