//! Progress of a long import, for an observer.

use std::sync::atomic::{AtomicU64, Ordering};

use raywright_core::Observer;

/// Planned and finished work, in vertices and indices of meshes. Any thread may report.
pub(crate) struct ImportProgress<'a> {
    observer: &'a dyn Observer,
    total: u64,
    done: AtomicU64,
}

impl<'a> ImportProgress<'a> {
    /// Work of an image, as the number of vertices that take about the same time.
    pub const IMAGE_COST: u64 = 1 << 20;

    /// Creates a progress report without planned work.
    pub fn new(observer: &'a dyn Observer) -> Self {
        Self {
            observer,
            total: 0,
            done: AtomicU64::new(0),
        }
    }

    /// Sets the planned work.
    pub fn set_total(&mut self, total: u64) {
        self.total = total;
    }

    /// Adds finished work.
    pub fn report_done(&self, amount: u64) {
        let before = self.done.fetch_add(amount, Ordering::Relaxed);
        // The finished work may exceed the planned work, which counts a mesh with several
        // deformations once.
        self.observer
            .progress(before.saturating_add(amount).min(self.total), self.total);
    }
}
