//! What the program looks at while a picture is prepared and made: progress to show, Ctrl-C, and
//! how long it may take.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use raywright_core::Observer;

use crate::progress::Progress;

/// Passes progress on, and stops the work when asked to or when its time is over.
pub struct Watch<'a> {
    /// Where a render's progress is shown; none while there is no render.
    pub progress: Option<&'a Progress>,
    /// Until when it may go on.
    pub patience: Patience,
    /// When the run began that has so much time.
    pub began: Instant,
    /// Set by Ctrl-C.
    pub stop: &'a AtomicBool,
    /// Samples of all pixels that there are.
    pub done: AtomicU64,
}

/// Times at which a render pauses or ends.
#[derive(Clone, Copy, Debug, Default)]
pub struct Patience {
    /// When it ends, if every pixel has samples by then.
    pub deadline: Option<Instant>,
    /// When it pauses, to be kept in a file or told of.
    pub pause_at: Option<Instant>,
    /// Samples of all pixels at which it pauses, to be shown.
    pub pause_with: Option<u64>,
}

impl<'a> Watch<'a> {
    /// Looks at Ctrl-C alone.
    pub fn until(stop: &'a AtomicBool) -> Self {
        Self {
            progress: None,
            patience: Patience::default(),
            began: Instant::now(),
            stop,
            done: AtomicU64::new(0),
        }
    }

    /// Whether Ctrl-C came.
    pub fn was_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Whether its time is over.
    pub fn is_late(&self) -> bool {
        is_past(self.patience.deadline)
    }
}

fn is_past(time: Option<Instant>) -> bool {
    time.is_some_and(|time| Instant::now() >= time)
}

impl Observer for Watch<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.done.store(done, Ordering::Relaxed);
        let Some(progress) = self.progress else {
            return;
        };
        match self.patience.deadline {
            // What can be done is not known, but when it ends.
            Some(deadline) => {
                let all = deadline.saturating_duration_since(self.began).as_millis() as u64;
                progress.report((self.began.elapsed().as_millis() as u64).min(all), all);
            }
            None => progress.report(done, total),
        }
    }

    fn cancelled(&self) -> bool {
        self.was_stopped()
    }

    fn has_enough(&self, everywhere: bool) -> bool {
        let has_most = self
            .patience
            .pause_with
            .is_some_and(|most| self.done.load(Ordering::Relaxed) >= most);
        everywhere && self.is_late() || has_most || is_past(self.patience.pause_at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a budget ends a render once there is something everywhere and not before; a pause
    /// to keep it needs nothing.
    #[test]
    fn time_ends_what_is_somewhere_everywhere() {
        let stop = AtomicBool::new(false);
        let watch = |deadline, pause_at| Watch {
            patience: Patience {
                deadline,
                pause_at,
                pause_with: None,
            },
            ..Watch::until(&stop)
        };
        let now = Some(Instant::now());
        let later = now.map(|now| now + std::time::Duration::from_secs(3600));
        let enough = |watch: Watch| [watch.has_enough(false), watch.has_enough(true)];
        assert_eq!(enough(watch(None, None)), [false, false]);
        assert_eq!(enough(watch(later, later)), [false, false]);
        assert_eq!(enough(watch(now, None)), [false, true]);
        assert_eq!(enough(watch(None, now)), [true, true]);
        let counted = Watch {
            patience: Patience {
                pause_with: Some(10),
                ..Patience::default()
            },
            ..Watch::until(&stop)
        };
        let with = |done| {
            counted.progress(done, 20);
            counted.has_enough(false)
        };
        assert_eq!([9, 10, 11].map(with), [false, true, true]);
        assert!(watch(now, None).is_late() && !watch(later, now).is_late());
    }
}
