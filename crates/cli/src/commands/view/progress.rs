//! Progressive render for the viewer: a coarse preview at once, finer previews, and the render in
//! slices of time, between which newer requests are served.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use raywright_core::film::{Film, Uncertainty};
use raywright_core::settings::Aov;
use raywright_core::{Observer, ReadyScene, RenderOutput, RenderStage};

use super::shared::SharedView;
use super::status::RenderProgress;
use crate::watch::{Deadlines, Watch};

/// Target time of the first preview in seconds, so that it appears within a tenth of a second.
const SKETCH: f64 = 0.03;
/// Assumed speed of previews, in pixels per second, before the first measurement.
const FIRST_GUESS: f64 = 300_000.0;
/// Largest edge of a preview's pixel, in pixels of the picture.
const LARGEST: u32 = 16;
/// Least and greatest duration of a slice of the render.
const PIECES: [Duration; 2] = [Duration::from_millis(120), Duration::from_millis(1500)];
/// The first stage of the render takes all samples divided by this number.
const FIRST_STAGE: u64 = 128;
/// Least intervals between error estimates, and between denoised pictures, as multiples of the
/// duration of the last estimate or denoising.
const ERROR_SHARE: u32 = 10;
const DENOISE_SHARE: u32 = 4;
/// Largest number of error estimates in the history.
const MOST_HISTORY: usize = 300;

/// Observer of a render that stops for Ctrl-C, at deadlines, and for a newer request or a job of
/// the page.
pub struct RequestWatch<'a> {
    pub watch: Watch<'a>,
    shared: &'a SharedView,
    /// Number of the current request; `None`: neither newer requests nor jobs stop the work.
    wish: Option<u64>,
    /// Sample count of the finished render, summed over all pixels.
    total: AtomicU64,
    has_paused: AtomicBool,
}

impl<'a> RequestWatch<'a> {
    /// Creates an observer that stops when `stop` is set, and for a job or a request newer than
    /// `wish`.
    pub fn new(shared: &'a SharedView, stop: &'a AtomicBool, wish: Option<u64>) -> Self {
        Self {
            watch: Watch::until(stop),
            shared,
            wish,
            total: AtomicU64::new(0),
            has_paused: AtomicBool::new(false),
        }
    }

    /// Returns the number of finished samples, summed over all pixels.
    fn done(&self) -> u64 {
        self.watch.done.load(Ordering::Relaxed)
    }
}

impl Observer for RequestWatch<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.watch.progress(done, total);
        self.total.store(total, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.watch.is_cancelled()
            || self
                .wish
                .is_some_and(|wish| self.shared.is_interrupted(wish))
    }

    fn has_enough(&self, everywhere: bool) -> bool {
        let has_enough = self.watch.has_enough(everywhere);
        self.has_paused.fetch_or(has_enough, Ordering::Relaxed);
        has_enough
    }
}

/// Running mean of the speed of previews, in pixels per second.
pub struct Speed(f64);

impl Default for Speed {
    fn default() -> Self {
        Self(FIRST_GUESS)
    }
}

impl Speed {
    /// Returns the edge of the first preview's pixels, in pixels of the picture, with which the
    /// preview takes its target time.
    pub fn edge(&self, [width, height]: [u32; 2]) -> u32 {
        let pixels = f64::from(width) * f64::from(height);
        ((pixels / (self.0 * SKETCH)).sqrt().ceil() as u32).clamp(1, LARGEST)
    }

    fn measure(&mut self, pixels: usize, time: Duration) {
        // The mean dampens the effect of a preview that a slow tile or another program delayed.
        self.0 = 0.5 * self.0 + 0.5 * (pixels as f64 / time.as_secs_f64().max(1e-4)).min(1e8);
    }
}

/// The viewer's current render, with its film and its statistics.
pub struct LiveRender {
    pub film: Film,
    /// Pixel edge of the next preview, in pixels of the picture; `None`: no further preview.
    next_edge: Option<u32>,
    spent: Duration,
    piece: Duration,
    /// Sample count, summed over all pixels, at which the next stage ends. A stage about doubles
    /// the samples, unless the time of a slice ends it first.
    next_stage: u64,
    estimated: Option<(Duration, Duration)>,
    denoised: Option<(Duration, Duration)>,
    pub progress: RenderProgress,
    /// The displayed picture after the previews.
    pub rendered: Option<RenderOutput>,
    pub is_done: bool,
}

impl LiveRender {
    /// Creates a render without samples.
    pub fn new(ready: &ReadyScene) -> Self {
        let film = ready.film("");
        let progress = RenderProgress {
            of: film.requested_samples(),
            max_error: ready.settings().max_error,
            exact: !ready.is_by_chance() || ready.settings().sampling.is_fixed(),
            ..RenderProgress::default()
        };
        let pixels = film.size().into_iter().map(u64::from).product::<u64>();
        Self {
            // With a target error the final number of samples is unknown, so that time alone
            // divides the render.
            next_stage: film.requested_samples().map_or(u64::MAX, |samples| {
                (pixels * u64::from(samples)).div_ceil(FIRST_STAGE)
            }),
            film,
            next_edge: None,
            spent: Duration::ZERO,
            piece: PIECES[0],
            estimated: None,
            denoised: None,
            progress,
            rendered: None,
            is_done: false,
        }
    }

    /// Renders the first preview and measures its speed. Returns the preview and the edge of its
    /// pixels. Only the end of the program interrupts this preview.
    pub fn first_sketch(
        &mut self,
        ready: &ReadyScene,
        layers: &[Aov],
        speed: &mut Speed,
        watch: &RequestWatch<'_>,
    ) -> (RenderOutput, u32) {
        let edge = speed.edge(ready.settings().size);
        let began = Instant::now();
        let sketch = ready.sketch(edge, 1, layers, watch);
        speed.measure(sketch.picture.pixels(), began.elapsed());
        self.next_edge = (edge > 1).then_some(edge / 2);
        (sketch, edge)
    }

    /// Renders the next finer preview. Returns the preview and the edge of its pixels; `None` if no
    /// finer preview follows, or if a newer request or a job interrupted it.
    pub fn next_sketch(
        &mut self,
        ready: &ReadyScene,
        layers: &[Aov],
        watch: &RequestWatch<'_>,
    ) -> Option<(RenderOutput, u32)> {
        let edge = self.next_edge.take()?;
        let sketch = ready.sketch(edge, 1, layers, watch);
        self.next_edge = (edge > 1).then_some(edge / 2);
        sketch.finished.then_some((sketch, edge))
    }

    /// Whether the render is unfinished.
    pub fn has_more(&self) -> bool {
        !self.is_done
    }

    /// Renders the picture for the time of a slice. Returns whether a new picture is ready to show.
    pub fn step(&mut self, ready: &ReadyScene, mut watch: RequestWatch<'_>) -> bool {
        let began = Instant::now();
        watch.watch.deadlines = Deadlines {
            pause_at: Some(began + self.piece),
            pause_with: Some(self.next_stage),
            ..Deadlines::default()
        };
        let whole = self.film.whole_part();
        // The call cannot fail, because the film was created for this scene.
        let _ = ready.render_part(&mut self.film, &whole, &watch);
        self.spent += began.elapsed();
        let was_paused = watch.has_paused.load(Ordering::Relaxed);
        let lacks = self.film.lacking(&whole) > 0;
        let is_cancelled = watch.is_cancelled();
        // In adaptive sampling, the samples of a round decide whether another round follows.
        let continues = was_paused && ready.settings().max_error.is_some();
        self.is_done = !(lacks || is_cancelled || continues);
        self.next_stage = self.next_stage.max(watch.done()).saturating_mul(2);
        self.account(&watch);
        if is_cancelled || self.progress.samples[0] == 0 {
            return false;
        }
        let shown = Instant::now();
        let is_new = self.develop(&watch);
        self.piece = (4 * shown.elapsed())
            .max(self.piece * 3 / 2)
            .clamp(PIECES[0], PIECES[1]);
        is_new
    }

    /// Updates samples, times and speed in the statistics of the render.
    fn account(&mut self, watch: &RequestWatch<'_>) {
        let samples = self.film.samples(&self.film.whole_part());
        let [done, total] =
            [watch.done(), watch.total.load(Ordering::Relaxed)].map(|count| count as f64);
        let seconds = self.spent.as_secs_f64();
        let progress = &mut self.progress;
        progress.samples = [*samples.start(), *samples.end()];
        progress.seconds = seconds;
        progress.rays_per_second = self.film.counters().rays() as f64 / seconds.max(1e-6);
        progress.seconds_left = match self.is_done {
            true => Some(0.0),
            false => (done > 0.0 && progress.max_error.is_none())
                .then(|| seconds * (total - done).max(0.0) / done),
        };
    }

    /// Updates the displayed picture and its error from the samples so far, unless that would take
    /// too large a share of the time. Returns whether the picture is new.
    fn develop(&mut self, watch: &RequestWatch<'_>) -> bool {
        let is_due = |last: Option<(Duration, Duration)>, share: u32, spent: Duration| {
            last.is_none_or(|(at, took)| spent.saturating_sub(at) >= took * share)
        };
        let stage = RenderStage::of(&self.film);
        if self.is_done || is_due(self.estimated, ERROR_SHARE, self.spent) {
            let began = Instant::now();
            self.progress.error = stage.error();
            self.estimated = Some((self.spent, began.elapsed()));
            self.progress
                .error
                .iter()
                .for_each(|error| remember(&mut self.progress.history, self.spent, &stage, error));
        }
        if !self.film.is_to_be_denoised() {
            self.rendered = Some(stage.rendered(watch));
            return true;
        }
        if !self.is_done && !is_due(self.denoised, DENOISE_SHARE, self.spent) {
            return false;
        }
        let began = Instant::now();
        let rendered = stage.rendered(watch);
        // An interrupted denoising is discarded, and repeated in the next slice.
        if watch.is_cancelled() {
            self.is_done = false;
            return false;
        }
        self.denoised = Some((self.spent, began.elapsed()));
        self.rendered = Some(rendered);
        true
    }
}

/// Adds an error estimate to the history. A full history drops every second entry.
fn remember(
    history: &mut Vec<[f64; 5]>,
    spent: Duration,
    stage: &RenderStage<'_>,
    error: &Uncertainty,
) {
    let estimate = error.root_relmse;
    let samples = f64::from(*stage.samples().start());
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

    /// Protects: the pixels of the first preview are large enough for its target time, at any size
    /// and speed.
    #[test]
    fn sketches_take_their_time() {
        assert_eq!(Speed(1e9).edge([640, 360]), 1);
        assert_eq!(Speed(1.0).edge([640, 360]), LARGEST);
        let mut speed = Speed::default();
        let before = speed.edge([1280, 720]);
        (0..8).for_each(|_| speed.measure(1000, Duration::from_millis(20)));
        let edge = speed.edge([1280, 720]);
        assert!(edge > before, "{edge} {before}");
    }
}
