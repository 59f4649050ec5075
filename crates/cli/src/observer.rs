//! Observer of loading, preparation and render, for progress, Ctrl-C, and time limits.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use raywright_core::Observer;

use crate::progress::Progress;

/// Observer that forwards progress to the display, and stops the work for Ctrl-C or at its limits.
pub struct RunObserver<'a> {
    /// Progress display of the work; `None`: no display.
    pub progress: Option<&'a Progress>,
    /// Limits at which the render pauses or ends.
    pub deadlines: Deadlines,
    /// Start of the run. If there is a deadline, the displayed progress is the elapsed share of the
    /// time between this start and the deadline.
    pub start: Instant,
    /// Flag that Ctrl-C sets.
    pub stop: &'a AtomicBool,
    /// Number of finished samples, summed over all pixels.
    pub finished_samples: AtomicU64,
}

/// Limits at which a render pauses or ends.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deadlines {
    /// Time at which the render ends, if every pixel has a sample by then.
    pub deadline: Option<Instant>,
    /// Time at which the render pauses, for a checkpoint or a report.
    pub pause_at: Option<Instant>,
    /// Sample count, summed over all pixels, at which the render pauses, for a preview.
    pub pause_at_samples: Option<u64>,
}

impl<'a> RunObserver<'a> {
    /// Creates an observer that stops the work when `stop` is set, without display and limits.
    pub fn with_stop_flag(stop: &'a AtomicBool) -> Self {
        Self {
            progress: None,
            deadlines: Deadlines::default(),
            start: Instant::now(),
            stop,
            finished_samples: AtomicU64::new(0),
        }
    }

    /// Whether Ctrl-C has set the flag.
    pub fn was_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Whether the deadline has passed.
    pub fn is_past_deadline(&self) -> bool {
        has_passed(self.deadlines.deadline)
    }
}

fn has_passed(time: Option<Instant>) -> bool {
    time.is_some_and(|time| Instant::now() >= time)
}

impl Observer for RunObserver<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.finished_samples.store(done, Ordering::Relaxed);
        let Some(progress) = self.progress else {
            return;
        };
        match self.deadlines.deadline {
            // With a deadline, progress is the elapsed share of the time, because the number of
            // samples is unknown.
            Some(deadline) => {
                let all = deadline.saturating_duration_since(self.start).as_millis() as u64;
                progress.report((self.start.elapsed().as_millis() as u64).min(all), all);
            }
            None => progress.report(done, total),
        }
    }

    fn is_cancelled(&self) -> bool {
        self.was_stopped()
    }

    fn has_enough_samples(&self, everywhere: bool) -> bool {
        let has_most = self
            .deadlines
            .pause_at_samples
            .is_some_and(|maximum| self.finished_samples.load(Ordering::Relaxed) >= maximum);
        everywhere && self.is_past_deadline() || has_most || has_passed(self.deadlines.pause_at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a budget ends a render only once every pixel has samples; a pause for a checkpoint
    /// has no such condition.
    #[test]
    fn time_ends_what_is_somewhere_everywhere() {
        let stop = AtomicBool::new(false);
        let watch = |deadline, pause_at| RunObserver {
            deadlines: Deadlines {
                deadline,
                pause_at,
                pause_at_samples: None,
            },
            ..RunObserver::with_stop_flag(&stop)
        };
        let now = Some(Instant::now());
        let later = now.map(|now| now + std::time::Duration::from_secs(3600));
        let enough = |watch: RunObserver| {
            [
                watch.has_enough_samples(false),
                watch.has_enough_samples(true),
            ]
        };
        assert_eq!(enough(watch(None, None)), [false, false]);
        assert_eq!(enough(watch(later, later)), [false, false]);
        assert_eq!(enough(watch(now, None)), [false, true]);
        assert_eq!(enough(watch(None, now)), [true, true]);
        let counted = RunObserver {
            deadlines: Deadlines {
                pause_at_samples: Some(10),
                ..Deadlines::default()
            },
            ..RunObserver::with_stop_flag(&stop)
        };
        let with = |done| {
            counted.progress(done, 20);
            counted.has_enough_samples(false)
        };
        assert_eq!([9, 10, 11].map(with), [false, true, true]);
        assert!(watch(now, None).is_past_deadline() && !watch(later, now).is_past_deadline());
    }
}
