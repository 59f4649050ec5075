//! How far a long import has come, for whoever looks on.

use std::sync::atomic::{AtomicU64, Ordering};

use raywright_core::Observer;

/// Work that is planned and done, in vertices and indices of meshes. Any thread may report.
pub(crate) struct Work<'a> {
    observer: &'a dyn Observer,
    total: u64,
    done: AtomicU64,
}

impl<'a> Work<'a> {
    /// What an image counts for: about as many vertices take as long.
    pub const IMAGE: u64 = 1 << 20;

    /// Nothing is planned yet.
    pub fn new(observer: &'a dyn Observer) -> Self {
        Self {
            observer,
            total: 0,
            done: AtomicU64::new(0),
        }
    }

    /// So much is to be done.
    pub fn plan(&mut self, total: u64) {
        self.total = total;
    }

    /// So much more is done.
    pub fn done(&self, amount: u64) {
        let before = self.done.fetch_add(amount, Ordering::Relaxed);
        // What is made in several poses was planned once.
        self.observer
            .progress(before.saturating_add(amount).min(self.total), self.total);
    }
}
