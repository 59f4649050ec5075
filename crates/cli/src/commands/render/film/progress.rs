//! Lines of `--progress json` during a render, with estimates of the picture's error.

use std::time::{Duration, Instant};

use raywright_core::film::{Film, Uncertainty};
use serde::Serialize;

use super::FilmRender;
use crate::progress::Progress;

/// Shortest interval between error estimates, as a multiple of the duration of the last estimate.
/// It keeps estimates of large pictures from taking a large part of the render time.
const ESTIMATE_INTERVAL_FACTOR: u32 = 50;

/// Latest estimate of a picture's error during its render, for progress lines.
#[derive(Default)]
pub struct ErrorTracker {
    /// The latest estimate; `None` before the first.
    error: Option<Uncertainty>,
    /// Time and duration of the latest estimate; `None` before the first.
    last_estimate: Option<(Instant, Duration)>,
}

impl ErrorTracker {
    /// Makes a new error estimate if an estimate is due or `is_last`, and returns the latest
    /// estimate.
    pub fn update_estimate(&mut self, film: &Film, is_last: bool) -> Option<Uncertainty> {
        if is_last
            || self
                .last_estimate
                .is_none_or(|(at, took)| is_estimate_due(at.elapsed(), took))
        {
            let began = Instant::now();
            self.error = film.estimate_uncertainty();
            self.last_estimate = Some((Instant::now(), began.elapsed()));
        }
        self.error
    }
}

/// Whether a new error estimate is due: `passed` is the time since the last estimate, `took` is the
/// duration of the last estimate.
fn is_estimate_due(passed: Duration, took: Duration) -> bool {
    passed >= took * ESTIMATE_INTERVAL_FACTOR
}

/// Version of the layout of [`ProgressLine`].
const PROGRESS_FORMAT: u32 = 1;

/// A line of `--progress json`.
#[derive(Serialize)]
struct ProgressLine {
    format: u32,
    /// Number of the picture in the run, counted from one.
    picture: u64,
    /// Number of pictures in the run.
    pictures: u64,
    /// Least and greatest number of samples of a pixel so far.
    samples: [u32; 2],
    /// Requested number of samples per pixel; null with a time budget or a target error.
    of: Option<u32>,
    /// Latest error estimate, in the form of `--stats`; null without an estimate.
    error: Option<Uncertainty>,
    /// Seconds since the start of the first picture.
    seconds: f64,
    /// Estimated seconds until the last picture is finished; null where unknown.
    seconds_left: Option<f64>,
}

impl FilmRender<'_> {
    /// Formats the progress as a line of JSON for `--progress json`.
    pub(super) fn format_progress_line(
        &self,
        progress: &Progress,
        error: Option<Uncertainty>,
    ) -> String {
        let ([picture, pictures], (seconds, left)) =
            (progress.work_piece_counts(), progress.elapsed_and_left());
        let samples = self.kept_film.film.sample_range(&self.part);
        let pass = ProgressLine {
            format: PROGRESS_FORMAT,
            picture: picture + 1,
            pictures,
            samples: [*samples.start(), *samples.end()],
            of: self.kept_film.film.requested_samples(),
            error,
            seconds,
            seconds_left: if self.is_done && picture + 1 == pictures {
                Some(0.0)
            } else {
                left
            },
        };
        serde_json::to_string(&pass).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: error estimates for progress lines take at most a fiftieth of the render time.
    #[test]
    fn estimates_have_a_bounded_share() {
        let [millisecond, second] = [Duration::from_millis(1), Duration::from_secs(1)];
        assert!(
            is_estimate_due(second, millisecond)
                && is_estimate_due(second, second / 50)
                && is_estimate_due(Duration::ZERO, Duration::ZERO)
        );
        assert!(!is_estimate_due(second, second / 49) && !is_estimate_due(40 * second, second));
    }
}
