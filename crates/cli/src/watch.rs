//! What the program looks at while a picture is prepared and made: progress to show, and Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};

use raywright_core::Observer;

use crate::progress::Progress;

/// Passes progress on, and stops the work when asked to.
pub struct Watch<'a> {
    /// Where a render's progress is shown; none while there is no render.
    pub progress: Option<&'a Progress>,
    /// Set by Ctrl-C.
    pub stop: &'a AtomicBool,
}

impl Observer for Watch<'_> {
    fn progress(&self, done: u64, total: u64) {
        if let Some(progress) = self.progress {
            progress.report(done, total);
        }
    }
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
