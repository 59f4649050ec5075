//! Progress display of a long computation: a bar on a terminal, occasional lines elsewhere, always
//! on standard error.

use std::io::{self, IsTerminal};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle as Template};
use raywright_core::Observer;
use raywright_io::report::format_whole_seconds;

use crate::args::ProgressStyle;
use crate::console::{self, Verbosity};

/// Time before the first plain line of a progress display.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
/// Longest pause between plain lines. Each pause is twice as long as the pause before, so that a
/// render of an hour does not fill a log.
const LONGEST_PAUSE: Duration = Duration::from_secs(32);

/// Progress display of a load, a render or a denoising. Any thread may report progress.
#[derive(Debug)]
pub struct Progress {
    label: &'static str,
    start: Instant,
    display: ProgressDisplay,
    /// Number of reports so far.
    reports: AtomicU64,
    /// Number of finished pieces of the work, such as pictures of a run.
    finished_pieces: AtomicU64,
    /// Number of all pieces of the work.
    piece_count: u64,
    /// Largest share of the work reported so far, in units of 2⁻³².
    share: AtomicU64,
}

/// Number of units of `Progress::share` in the whole work, 2³².
const SHARE_UNITS: f64 = (1_u64 << 32) as f64;

#[derive(Debug)]
enum ProgressDisplay {
    Nothing,
    Bar(ProgressBar),
    Lines(Mutex<LineSchedule>),
}

impl Progress {
    /// Starts a display of the work named `label`, by default as a bar on a terminal and as lines
    /// elsewhere.
    pub fn start(label: &'static str, style: ProgressStyle, verbosity: Verbosity) -> Self {
        let display = ProgressDisplay::new(label, style, verbosity, io::stderr().is_terminal());
        Self {
            label,
            start: Instant::now(),
            display,
            reports: AtomicU64::new(0),
            finished_pieces: AtomicU64::new(0),
            piece_count: 1,
            share: AtomicU64::new(0),
        }
    }

    /// Creates a display that shows nothing.
    pub fn hidden() -> Self {
        Self::start("", ProgressStyle::None, Verbosity::Quiet)
    }

    /// Divides the work into `total` pieces, such as pictures of a run; [`Progress::report`] then
    /// counts the steps of the current piece.
    pub fn with_work_pieces(self, total: usize) -> Self {
        Self {
            piece_count: total as u64,
            ..self
        }
    }

    /// Restarts the clock of the display, at the begin of the first render.
    pub fn restart_clock(&mut self) {
        self.start = Instant::now();
    }

    /// Counts the current piece of the work, such as a picture of a run, as finished.
    pub fn finish_work_piece(&self) {
        self.finished_pieces.fetch_add(1, Ordering::Relaxed);
    }

    /// Reports that `done` of `total` steps of the current piece of work, such as the tiles of a
    /// picture, are finished.
    pub fn report(&self, done: u64, total: u64) {
        let (done, total) = (
            done + self.finished_pieces.load(Ordering::Relaxed) * total,
            total * self.piece_count,
        );
        // With a target error `total` grows during the render; the displayed share never falls.
        let share = (done as f64 / total.max(1) as f64 * SHARE_UNITS) as u64;
        let share = self.share.fetch_max(share, Ordering::Relaxed).max(share);
        let reports = 1 + self.reports.fetch_add(1, Ordering::Relaxed);
        let work = WorkProgress {
            elapsed: self.start.elapsed(),
            reports,
            done: share,
            total: SHARE_UNITS as u64,
        };
        if let Some(line) = self.display.report(self.label, work) {
            console::print_message(line);
        }
    }

    /// Returns the number of finished pieces of the work and the number of all pieces.
    pub fn work_piece_counts(&self) -> [u64; 2] {
        [
            self.finished_pieces.load(Ordering::Relaxed),
            self.piece_count,
        ]
    }

    /// Returns the seconds since the start, and the estimated seconds until the end at the same
    /// speed; the estimate is `None` in the first moments of the work.
    pub fn elapsed_and_left(&self) -> (f64, Option<f64>) {
        let share = self.share.load(Ordering::Relaxed) as f64 / SHARE_UNITS;
        let elapsed = self.start.elapsed().as_secs_f64();
        (
            elapsed,
            (share > 0.0).then(|| elapsed * (1.0 - share).max(0.0) / share),
        )
    }

    /// Removes the bar from the terminal, so that messages can follow.
    pub fn finish(&self) {
        if let ProgressDisplay::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

impl ProgressDisplay {
    fn new(label: &str, style: ProgressStyle, verbosity: Verbosity, is_terminal: bool) -> Self {
        match style {
            _ if verbosity == Verbosity::Quiet => Self::Nothing,
            // The `render` command prints JSON progress itself, because it knows samples and
            // errors.
            ProgressStyle::None | ProgressStyle::Json => Self::Nothing,
            ProgressStyle::Auto if is_terminal => Self::Bar(create_bar(label)),
            ProgressStyle::Auto | ProgressStyle::Plain => {
                Self::Lines(Mutex::new(LineSchedule::new()))
            }
        }
    }

    /// Updates the bar. Returns the line to print, if lines are shown and the next is due.
    fn report(&self, label: &str, work: WorkProgress) -> Option<String> {
        let is_shown = self.show(work, || work.format_time_left());
        (is_shown && work.done < work.total).then(|| work.format_line(label))
    }

    /// Moves the bar, with a message beside it. Returns whether a line is due in place of a bar.
    fn show(&self, work: WorkProgress, message: impl FnOnce() -> String) -> bool {
        match self {
            Self::Nothing => false,
            Self::Bar(bar) => {
                bar.set_length(work.total);
                bar.set_position(work.done);
                bar.set_message(message());
                false
            }
            // If another thread holds the lock, that thread reports, and this report is skipped.
            Self::Lines(pace) => pace
                .try_lock()
                .is_ok_and(|mut pace| pace.is_due(work.elapsed)),
        }
    }
}

/// Progress of a measurement whose steps have names.
#[derive(Debug)]
pub struct StepProgress(Progress);

impl StepProgress {
    /// Starts the display; quiet runs have none.
    pub fn start(verbosity: Verbosity) -> Self {
        Self(Progress::start("measuring", ProgressStyle::Auto, verbosity))
    }

    /// Shows the name of a step, and the finished share of all steps from 0 to 1.
    pub fn show_step(&mut self, label: &str, share: f64) {
        let work = WorkProgress {
            elapsed: self.0.start.elapsed(),
            reports: 0,
            done: (share * SHARE_UNITS) as u64,
            total: SHARE_UNITS as u64,
        };
        let label = console::mask_to_one_line(label);
        if self.0.display.show(work, || label.clone()) {
            console::print_message(format_args!("measuring: {:.0} %, {label}", 100.0 * share));
        }
    }
}

impl Drop for StepProgress {
    fn drop(&mut self) {
        self.0.finish();
    }
}

fn create_bar(label: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    let template = format!("{label} {{wide_bar}} {{percent:>3}} %  {{msg:12}}");
    if let Ok(template) = Template::with_template(&template) {
        bar.set_style(template);
    }
    bar
}

/// Least number of reports before the time left is estimated. The first tiles of a picture may be
/// its slowest, so that a single report allows no estimate.
const ENOUGH_REPORTS: u64 = 16;
/// Least finished share of the work before the time left is estimated.
const ENOUGH_SHARE: f64 = 0.05;

/// Progress of the work at a report, from which the display is formatted.
#[derive(Clone, Copy, Debug)]
struct WorkProgress {
    /// Time since the start of the work.
    elapsed: Duration,
    /// Number of reports so far; each is the end of a tile.
    reports: u64,
    /// Number of finished steps of the work.
    done: u64,
    /// Number of all steps of the work.
    total: u64,
}

impl WorkProgress {
    /// Formats a plain line: label, percentage and time left.
    fn format_line(self, label: &str) -> String {
        let percent = 100 * self.done / self.total.max(1);
        let left = self.format_time_left();
        if left.is_empty() {
            format!("{label}: {percent} %")
        } else {
            format!("{label}: {percent} %, {left}")
        }
    }

    /// Formats the estimated time left at the same speed; empty before an estimate is possible.
    fn format_time_left(self) -> String {
        let Self {
            elapsed,
            reports,
            done,
            total,
        } = self;
        if done == 0 || reports < ENOUGH_REPORTS && (done as f64) < ENOUGH_SHARE * total as f64 {
            return String::new();
        }
        let seconds = elapsed.as_secs_f64() * total.saturating_sub(done) as f64 / done as f64;
        format!("{} left", format_whole_seconds(seconds.ceil() as u64))
    }
}

/// Schedule of the plain lines of a progress display.
#[derive(Debug)]
struct LineSchedule {
    /// Time of the next line, since the start of the work.
    next: Duration,
    /// Pause before the next line.
    pause: Duration,
}

impl LineSchedule {
    fn new() -> Self {
        Self {
            next: FIRST_PAUSE,
            pause: FIRST_PAUSE,
        }
    }

    fn is_due(&mut self, elapsed: Duration) -> bool {
        let due = elapsed >= self.next;
        if due {
            self.pause = (2 * self.pause).min(LONGEST_PAUSE);
            self.next = elapsed + self.pause;
        }
        due
    }
}

// Observer of loading, preparation and render, for progress, Ctrl-C, and time limits.

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
mod tests;

#[cfg(test)]
mod observer_tests {
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
