//! Progress of a long import, reported to an observer.

use std::sync::atomic::{AtomicU64, Ordering};

use raywright_core::Observer;

/// Planned and finished work of an import. The unit is a vertex or an index of a mesh. Any thread
/// may report.
pub(crate) struct ImportProgress<'a> {
    observer: &'a dyn Observer,
    total: u64,
    done: AtomicU64,
}

impl<'a> ImportProgress<'a> {
    /// Work of decoding an image, as the number of vertices that take about the same time.
    pub const IMAGE_COST: u64 = 1 << 20;

    /// Creates a progress report, with a planned work of zero.
    pub fn new(observer: &'a dyn Observer) -> Self {
        Self {
            observer,
            total: 0,
            done: AtomicU64::new(0),
        }
    }

    /// Sets the planned work, in vertices and indices.
    pub fn set_total(&mut self, total: u64) {
        self.total = total;
    }

    /// Adds finished work, in vertices and indices, and reports the progress to the observer.
    pub fn report_done(&self, amount: u64) {
        let before = self.done.fetch_add(amount, Ordering::Relaxed);
        // The finished work may exceed the planned work, which counts a mesh with several
        // deformations once.
        self.observer
            .progress(before.saturating_add(amount).min(self.total), self.total);
    }
}
