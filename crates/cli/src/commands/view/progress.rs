//! Progressive render for the viewer: a coarse preview at once, finer previews, and the render in
//! slices of time, between which newer requests are served.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use raywright_core::film::{Film, Uncertainty};
use raywright_core::settings::Aov;
use raywright_core::{Observer, ReadyScene, RenderOutput, RenderStage};

use super::shared::SharedView;
use super::status::RenderProgress;
use crate::progress::{Deadlines, RunObserver};

/// Target time of the first preview in seconds, so that it appears within a tenth of a second.
const PREVIEW_SECONDS: f64 = 0.03;
/// Assumed speed of previews, in pixels per second, before the first measurement.
const FIRST_SPEED_GUESS: f64 = 300_000.0;
/// Largest edge of a preview's pixel, in pixels of the picture.
const LARGEST_EDGE: u32 = 16;
/// Shortest and longest duration of a slice, the part of a render between two looks for new
/// requests.
const PIECE_DURATIONS: [Duration; 2] = [Duration::from_millis(120), Duration::from_millis(1500)];
/// Number of samples of the whole render, divided by the number of samples of its first stage.
const FIRST_STAGE: u64 = 128;
/// Shortest interval between error estimates, as a multiple of the duration of the last estimate.
const ERROR_SHARE: u32 = 10;
/// Shortest interval between denoised pictures, as a multiple of the duration of the last
/// denoising.
const DENOISE_SHARE: u32 = 4;
/// Largest number of error estimates in the history.
const MOST_HISTORY: usize = 300;

/// Observer of a render that stops for Ctrl-C, at deadlines, and for a newer request or a job of
/// the page.
pub struct RequestObserver<'a> {
    /// Observer for Ctrl-C and deadlines.
    pub watch: RunObserver<'a>,
    shared: &'a SharedView,
    /// Number of the current request; `None`: neither newer requests nor jobs stop the work.
    request: Option<u64>,
    /// Sample count of the finished render, summed over all pixels.
    total: AtomicU64,
    /// Whether the render has paused at its limit of time or samples.
    has_paused: AtomicBool,
}

impl<'a> RequestObserver<'a> {
    /// Creates an observer that stops the work in three cases: `watch` does, a job of the page
    /// waits, or a request of the page has a number above `wish`.
    pub fn new(shared: &'a SharedView, watch: RunObserver<'a>, wish: Option<u64>) -> Self {
        Self {
            watch,
            shared,
            request: wish,
            total: AtomicU64::new(0),
            has_paused: AtomicBool::new(false),
        }
    }

    /// Returns the number of finished samples, summed over all pixels.
    fn finished_samples(&self) -> u64 {
        self.watch.finished_samples.load(Ordering::Relaxed)
    }
}

impl Observer for RequestObserver<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.watch.progress(done, total);
        self.total.store(total, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.watch.is_cancelled()
            || self
                .request
                .is_some_and(|wish| self.shared.has_newer_work(wish))
    }

    fn has_enough_samples(&self, everywhere: bool) -> bool {
        let has_enough = self.watch.has_enough_samples(everywhere);
        self.has_paused.fetch_or(has_enough, Ordering::Relaxed);
        has_enough
    }
}

/// Observer of loading and preparation, which reports their stages to the page.
pub struct LoadObserver<'a> {
    watch: RunObserver<'static>,
    shared: &'a SharedView,
    /// Number of the request for which the scene is loaded.
    request: u64,
    /// Current stage, and the time of its last report.
    stage: Mutex<(&'static str, Instant)>,
}

impl<'a> LoadObserver<'a> {
    pub fn new(shared: &'a SharedView, watch: RunObserver<'static>, request: u64) -> Self {
        Self {
            watch,
            shared,
            request,
            stage: Mutex::new(("", Instant::now())),
        }
    }

    /// Begins a stage, and reports it.
    pub fn start_stage(&self, name: &'static str) {
        if let Ok(mut stage) = self.stage.lock() {
            *stage = (name, Instant::now());
            self.shared.publish_stage(self.request, name);
        }
    }
}

impl Observer for LoadObserver<'_> {
    fn progress(&self, done: u64, total: u64) {
        // Another thread that holds the lock reports its progress at this moment.
        let Ok(mut stage) = self.stage.try_lock() else {
            return;
        };
        if total > 0 && stage.1.elapsed() >= STAGE_INTERVAL {
            stage.1 = Instant::now();
            let percent = 100.0 * done as f64 / total as f64;
            let report = format!("{}, {percent:.0} %", stage.0);
            self.shared.publish_stage(self.request, &report);
        }
    }

    fn is_cancelled(&self) -> bool {
        self.watch.is_cancelled()
    }
}

/// Shortest interval between reports of the progress of a stage.
const STAGE_INTERVAL: Duration = Duration::from_millis(200);

/// Running mean of the speed of previews, in pixels per second.
pub struct PreviewSpeed(f64);

impl Default for PreviewSpeed {
    fn default() -> Self {
        Self(FIRST_SPEED_GUESS)
    }
}

impl PreviewSpeed {
    /// Returns the pixel size of the first preview, in pixels of the picture. With this size, the
    /// preview is expected to take its target time.
    pub fn choose_preview_pixel_edge(&self, [width, height]: [u32; 2]) -> u32 {
        let pixels = f64::from(width) * f64::from(height);
        ((pixels / (self.0 * PREVIEW_SECONDS)).sqrt().ceil() as u32).clamp(1, LARGEST_EDGE)
    }

    fn record_preview(&mut self, pixels: usize, time: Duration) {
        // The mean dampens the effect of a preview that a slow tile or another program delayed.
        self.0 = 0.5 * self.0 + 0.5 * (pixels as f64 / time.as_secs_f64().max(1e-4)).min(1e8);
    }
}

/// The viewer's current render, with its film and its statistics.
pub struct LiveRender {
    /// Film with the samples so far.
    pub film: Film,
    /// Pixel edge of the next preview, in pixels of the picture; `None`: no further preview.
    next_edge: Option<u32>,
    /// Total time of all slices so far.
    render_time: Duration,
    /// Duration of the next slice of the render.
    piece_duration: Duration,
    /// Sample count, summed over all pixels, at which the next stage ends. A stage about doubles
    /// the samples, unless the time of a slice ends it first.
    next_stage: u64,
    /// Render time at the latest error estimate, and duration of that estimate.
    last_estimate: Option<(Duration, Duration)>,
    /// Render time at the latest denoising, and duration of that denoising.
    last_denoising: Option<(Duration, Duration)>,
    pub progress: RenderProgress,
    /// The displayed picture after the previews.
    pub rendered: Option<RenderOutput>,
    /// Whether the render is finished.
    pub is_done: bool,
}

impl LiveRender {
    /// Creates a render without samples.
    pub fn new(ready: &ReadyScene) -> Self {
        let film = ready.new_film("");
        let progress = RenderProgress {
            of: film.requested_samples(),
            max_error: ready.settings().max_error,
            exact: !ready.depends_on_seed() || ready.settings().sampling.is_fixed(),
            ..RenderProgress::default()
        };
        let pixels = film.size().into_iter().map(u64::from).product::<u64>();
        Self {
            // With a target error the final number of samples is unknown; only the time of a slice
            // then ends it.
            next_stage: film.requested_samples().map_or(u64::MAX, |samples| {
                (pixels * u64::from(samples)).div_ceil(FIRST_STAGE)
            }),
            film,
            next_edge: None,
            render_time: Duration::ZERO,
            piece_duration: PIECE_DURATIONS[0],
            last_estimate: None,
            last_denoising: None,
            progress,
            rendered: None,
            is_done: false,
        }
    }

    /// Renders the first preview and measures its speed. Returns the preview and the edge of its
    /// pixels. Only the end of the program interrupts this preview.
    pub fn render_first_preview(
        &mut self,
        ready: &ReadyScene,
        layers: &[Aov],
        speed: &mut PreviewSpeed,
        watch: &RequestObserver<'_>,
    ) -> (RenderOutput, u32) {
        let edge = speed.choose_preview_pixel_edge(ready.settings().size);
        let began = Instant::now();
        let sketch = ready.render_preview(edge, 1, layers, watch);
        speed.record_preview(sketch.picture.pixel_count(), began.elapsed());
        self.next_edge = (edge > 1).then_some(edge / 2);
        (sketch, edge)
    }

    /// Renders the next finer preview. Returns the preview and the edge of its pixels; `None` if no
    /// finer preview follows, or if a newer request or a job interrupted it.
    pub fn render_next_preview(
        &mut self,
        ready: &ReadyScene,
        layers: &[Aov],
        watch: &RequestObserver<'_>,
    ) -> Option<(RenderOutput, u32)> {
        let edge = self.next_edge.take()?;
        let sketch = ready.render_preview(edge, 1, layers, watch);
        self.next_edge = (edge > 1).then_some(edge / 2);
        sketch.finished.then_some((sketch, edge))
    }

    /// Whether the render is unfinished.
    pub fn is_unfinished(&self) -> bool {
        !self.is_done
    }

    /// Renders until the time of a slice is over or the samples of a stage are complete. Returns
    /// whether a new picture is ready to show.
    pub fn render_slice(&mut self, ready: &ReadyScene, mut watch: RequestObserver<'_>) -> bool {
        let began = Instant::now();
        watch.watch.deadlines = Deadlines {
            pause_at: Some(began + self.piece_duration),
            pause_at_samples: Some(self.next_stage),
            ..Deadlines::default()
        };
        let whole = self.film.full_part();
        // The call cannot fail, because the film was created for this scene.
        let _ = ready.render_part(&mut self.film, &whole, &watch);
        self.render_time += began.elapsed();
        let was_paused = watch.has_paused.load(Ordering::Relaxed);
        let lacks = self.film.unfinished_tiles(&whole) > 0;
        let is_cancelled = watch.is_cancelled();
        // With a target error, the errors of the samples so far decide whether more samples follow.
        let continues = was_paused && ready.settings().max_error.is_some();
        self.is_done = !(lacks || is_cancelled || continues);
        self.next_stage = self
            .next_stage
            .max(watch.finished_samples())
            .saturating_mul(2);
        self.update_statistics(&watch);
        if is_cancelled || self.progress.samples[0] == 0 {
            return false;
        }
        let shown = Instant::now();
        let is_new = self.update_picture(&watch);
        self.piece_duration = (4 * shown.elapsed())
            .max(self.piece_duration * 3 / 2)
            .clamp(PIECE_DURATIONS[0], PIECE_DURATIONS[1]);
        is_new
    }

    /// Updates the numbers of samples, the times and the speed in the progress of the render.
    fn update_statistics(&mut self, watch: &RequestObserver<'_>) {
        let samples = self.film.sample_range(&self.film.full_part());
        let [done, total] = [
            watch.finished_samples(),
            watch.total.load(Ordering::Relaxed),
        ]
        .map(|count| count as f64);
        let seconds = self.render_time.as_secs_f64();
        let progress = &mut self.progress;
        progress.samples = [*samples.start(), *samples.end()];
        progress.seconds = seconds;
        progress.rays_per_second = self.film.counters().ray_count() as f64 / seconds.max(1e-6);
        progress.seconds_left = match self.is_done {
            true => Some(0.0),
            false if progress.max_error.is_some() => None,
            false => estimate_seconds_left(seconds, [done, total]),
        };
    }

    /// Updates the displayed picture and its error from the samples so far. An error estimate or a
    /// denoising is skipped if it would take too large a share of the time. Returns whether the
    /// picture is new.
    fn update_picture(&mut self, watch: &RequestObserver<'_>) -> bool {
        let is_due = |last: Option<(Duration, Duration)>, share: u32, spent: Duration| {
            last.is_none_or(|(at, took)| spent.saturating_sub(at) >= took * share)
        };
        let stage = RenderStage::from_film(&self.film);
        if self.is_done || is_due(self.last_estimate, ERROR_SHARE, self.render_time) {
            let began = Instant::now();
            self.progress.error = stage.error();
            self.last_estimate = Some((self.render_time, began.elapsed()));
            self.progress.error.iter().for_each(|error| {
                record_error_estimate(&mut self.progress.history, self.render_time, &stage, error)
            });
        }
        if !self.film.is_to_be_denoised() {
            self.rendered = Some(stage.into_output(watch));
            return true;
        }
        if !self.is_done && !is_due(self.last_denoising, DENOISE_SHARE, self.render_time) {
            return false;
        }
        let began = Instant::now();
        let rendered = stage.into_output(watch);
        // An interrupted denoising is discarded, and repeated in the next slice.
        if watch.is_cancelled() {
            self.is_done = false;
            return false;
        }
        self.last_denoising = Some((self.render_time, began.elapsed()));
        self.rendered = Some(rendered);
        true
    }
}

/// Estimates the seconds until all samples are rendered, which take as long as the samples `done`
/// in `seconds`; `None` without a sample.
fn estimate_seconds_left(seconds: f64, [done, total]: [f64; 2]) -> Option<f64> {
    (done > 0.0).then(|| seconds * (total - done).max(0.0) / done)
}

/// Adds an error estimate to the history, or replaces the last entry if it has as many samples. A
/// full history drops every second entry.
fn record_error_estimate(
    history: &mut Vec<[f64; 5]>,
    spent: Duration,
    stage: &RenderStage<'_>,
    error: &Uncertainty,
) {
    let estimate = error.root_relmse;
    let samples = f64::from(*stage.sample_range().start());
    if history.last().is_some_and(|last| last[1] == samples) {
        history.pop();
    }
    history.push([
        spent.as_secs_f64(),
        samples,
        estimate.value,
        estimate.low,
        estimate.high,
    ]);
    if history.len() > MOST_HISTORY {
        let mut place = 0;
        history.retain(|_| {
            place += 1;
            place % 2 == 1
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the remaining time is in proportion to the remaining samples, and neither negative
    /// nor known before the first sample.
    #[test]
    fn time_left_is_in_proportion() {
        for (seconds, counts, left) in [
            (2.0, [100.0, 400.0], Some(6.0)),
            (3.0, [300.0, 400.0], Some(1.0)),
            (5.0, [1.0, 1e6 + 1.0], Some(5e6)),
            (2.0, [400.0, 400.0], Some(0.0)),
            (2.0, [500.0, 400.0], Some(0.0)),
            (0.0, [0.0, 400.0], None),
        ] {
            assert_eq!(estimate_seconds_left(seconds, counts), left, "{counts:?}");
        }
    }

    /// Protects: the pixels of the first preview are large enough for its target time, at any size
    /// and speed.
    #[test]
    fn sketches_take_their_time() {
        assert_eq!(PreviewSpeed(1e9).choose_preview_pixel_edge([640, 360]), 1);
        assert_eq!(
            PreviewSpeed(1.0).choose_preview_pixel_edge([640, 360]),
            LARGEST_EDGE
        );
        let mut speed = PreviewSpeed::default();
        let before = speed.choose_preview_pixel_edge([1280, 720]);
        (0..8).for_each(|_| speed.record_preview(1000, Duration::from_millis(20)));
        let edge = speed.choose_preview_pixel_edge([1280, 720]);
        assert!(edge > before, "{edge} {before}");
    }
}
