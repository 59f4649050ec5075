//! What the program looks at while a picture is made: progress to show, and Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};

use raywright_core::Observer;

use crate::progress::Progress;

/// Passes progress on, and stops the render when asked to.
pub struct Watch<'a> {
    /// Where progress is shown.
    pub progress: &'a Progress,
    /// Set by Ctrl-C.
    pub stop: &'a AtomicBool,
}

impl Observer for Watch<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.progress.report(done, total);
    }
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
