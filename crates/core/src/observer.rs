//! Interface for observing and cancelling preparation and rendering.

/// Observer of preparation and rendering. It receives their progress and can stop them. Rendering
/// threads call its methods a few hundred times per picture. Preparation calls them between its
/// stages, and occasionally within long stages.
#[doc(alias("ProgressReporter", "CancellationToken"))]
pub trait Observer: Sync {
    /// Reports progress: `done` of `total` samples are finished, summed over all pixels.
    fn progress(&self, done: u64, total: u64) {
        let _ = (done, total);
    }
    /// Whether to cancel. A render then stops at the next tile and keeps its finished samples.
    /// Preparation returns [`PrepareError::Cancelled`](crate::prepare::PrepareError::Cancelled) at
    /// its next check. A BVH that is being built is finished first.
    fn is_cancelled(&self) -> bool {
        false
    }
    /// Whether the picture has enough samples. The render then ends at the next tile. This method
    /// is called before each tile. `everywhere` is whether every rendered pixel already has
    /// samples.
    fn has_enough_samples(&self, everywhere: bool) -> bool {
        let _ = everywhere;
        false
    }
}

/// Observer that ignores progress and never stops.
impl Observer for () {}
