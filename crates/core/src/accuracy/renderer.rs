//! Rendering and timing of settings: preparation is not timed, the observer may stop, and renders
//! end when time is out.

use std::cell::RefCell;
use std::time::Instant;

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::estimate::relative_variance;
use super::setting::{Setting, reference};
use super::tiles::{PilotPass, TileGrid};
use super::{MeasureError, MeasurementStart};
use crate::bench::clock::Stopwatch;
use crate::denoise::DenoiseError;
use crate::dispatch::{ReadyScene, prepare};
use crate::film::{Film, FilmPart};
use crate::ladder::Ladder;
use crate::observer::Observer;
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::render::RenderOutput;
use crate::scene::Scene;
use crate::settings::{Crop, Sampling, Settings};

/// Replicates of the reference, from which its standard error is estimated.
const REPLICATES: u32 = 4;

/// Margin in pixels around a denoised tile. The filter combines pixels within this distance; only
/// their weights depend on a few pixels farther out.
pub(super) const MARGIN: u32 = 20;

/// Bytes of prepared scenes that are kept.
const KEPT_BYTES: u64 = 1 << 30;

/// Most samples of the first look.
const LOOK_SAMPLES: u32 = 4;

/// Edge in pixels of the threads' work items within a tile, where pictures do not depend on it.
const UNIT: u32 = 16;

/// Round of the first pilot: random numbers that no setting uses.
const PILOT_ROUND: u64 = 1000;

/// Clock. Tests replace it by one that advances with each call.
pub(super) type ClockFunction<'a> = &'a (dyn Fn() -> Instant + Sync);

/// Reason for a missing render.
#[derive(Debug)]
pub(super) enum UnfinishedRender {
    /// Time is out, or the user stopped the render.
    Late,
    /// The scene cannot be prepared.
    Failed(PrepareError),
}

impl UnfinishedRender {
    /// Converts to the error of a measurement that cannot continue without the render.
    pub fn into_error(self) -> PrepareError {
        match self {
            Self::Late => PrepareError::Cancelled,
            Self::Failed(error) => error,
        }
    }

    /// Returns `None` where time is out, and keeps other errors.
    pub fn allow<T>(result: Result<T, Self>) -> Result<Option<T>, PrepareError> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(Self::Late) => Ok(None),
            Err(Self::Failed(error)) => Err(error),
        }
    }
}

/// A scene prepared for a setting; valid for all settings that differ only in ladders without
/// preparation.
struct PreparedSetting {
    setting: Setting,
    is_fixed: bool,
    ready: ReadyScene,
}

/// Scene, settings and clock.
pub(super) struct Renderer<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub observer: &'a dyn Observer,
    /// Stopwatch in seconds of all threads.
    pub stopwatch: Stopwatch,
    pub now: ClockFunction<'a>,
    /// Last prepared scenes, so that a scene is not prepared again for each tile.
    prepared: RefCell<Vec<PreparedSetting>>,
}

/// A finished render with its times.
pub(super) struct TimedRender {
    pub picture: Picture,
    /// Ratio of the denoised picture's light to the noisy one's; one without denoising.
    pub brightened: f64,
    /// Seconds of all threads: rendering with denoising, denoising alone, and preparation.
    pub seconds: f64,
    pub denoising: f64,
    pub preparing: f64,
    pub rays: u64,
    /// Whether other random numbers would change the picture.
    pub by_chance: bool,
    /// Bytes of geometry and accelerator.
    pub geometry: u64,
}

/// The caller's observer with a deadline.
struct DeadlineObserver<'a> {
    observer: &'a dyn Observer,
    now: ClockFunction<'a>,
    end: Instant,
}

impl Observer for DeadlineObserver<'_> {
    fn is_cancelled(&self) -> bool {
        self.observer.is_cancelled() || (self.now)() >= self.end
    }
}

impl<'a> Renderer<'a> {
    pub fn new(
        scene: &'a Scene,
        settings: &'a Settings,
        observer: &'a dyn Observer,
        (stopwatch, now): (Stopwatch, ClockFunction<'a>),
    ) -> Self {
        Self {
            scene,
            settings,
            observer,
            stopwatch,
            now,
            prepared: RefCell::default(),
        }
    }

    /// Renders parts of a setting side by side, with the random numbers of a round; without parts,
    /// the whole picture. The time of all parts together is divided among them by their rays,
    /// because a clock of the whole process cannot separate them.
    pub fn render_setting(
        &self,
        setting: &Setting,
        parts: &[Crop],
        round: u64,
        end: Instant,
    ) -> Result<Vec<TimedRender>, UnfinishedRender> {
        let (scene, settings) = setting.applied(self.scene, self.settings);
        let settings = Settings {
            seed: settings.seed.wrapping_add(round),
            ..settings
        };
        self.with_prepared(setting, (&scene, &settings), end, |ready| {
            self.timed(ready, (&settings, parts), 0.0, end)
        })?
    }

    /// Returns the number of samples of the first look.
    pub fn look_samples(&self) -> u32 {
        let samples = self.settings.sampling.count();
        if self.settings.sampling.is_fixed() {
            samples
        } else {
            samples.clamp(2, LOOK_SAMPLES)
        }
    }

    /// Looks at tiles: the time of each, and the noise of a few samples.
    pub fn look(
        &self,
        grid: TileGrid,
        tiles: &[u32],
        end: Instant,
    ) -> Result<Vec<PilotPass>, UnfinishedRender> {
        let sampling = self.settings.sampling;
        let sampling = if sampling.is_fixed() {
            sampling
        } else {
            Sampling::General(self.look_samples())
        };
        let settings = Settings {
            sampling,
            replicates: Some(2),
            denoise: false,
            ..self.settings.clone()
        };
        let (until, parts) = (
            self.until(end),
            tiles
                .iter()
                .map(|&tile| grid.tile(tile))
                .collect::<Vec<_>>(),
        );
        self.with_prepared(&Setting::default(), (self.scene, &settings), end, |ready| {
            let render = |settings: &Settings| ready.expose_as(settings, &until);
            let films = self.side_by_side(&parts, &settings, render, |film| film.counters().rays());
            if films.iter().any(|(film, _)| film.unfinished() > 0) {
                return Err(UnfinishedRender::Late);
            }
            let noise = |film: &Film| {
                let pixels = film
                    .whole_part()
                    .tiles
                    .filter_map(|part| film.means_of(part))
                    .flatten();
                pixels.map(|pixel| relative_variance(&pixel)).sum()
            };
            Ok(tiles
                .iter()
                .zip(&films)
                .map(|(&tile, (film, seconds))| PilotPass {
                    tile,
                    seconds: *seconds,
                    noise: noise(film),
                })
                .collect())
        })?
    }

    /// Renders a noisy picture of the whole, with the scene's settings except for the number of
    /// samples, and its own random numbers.
    pub fn pilot(
        &self,
        samples: u32,
        round: u64,
        end: Instant,
    ) -> Result<Picture, UnfinishedRender> {
        let seed = self.settings.seed.wrapping_add(PILOT_ROUND + round);
        let settings = Settings {
            sampling: Sampling::General(samples),
            denoise: false,
            seed,
            ..self.settings.clone()
        };
        let render = |ready: &ReadyScene| self.timed(ready, (&settings, &[]), 0.0, end);
        let mut renders =
            self.with_prepared(&Setting::default(), (self.scene, &settings), end, render)??;
        renders
            .pop()
            .map(|render| render.picture)
            .ok_or(UnfinishedRender::Late)
    }

    /// Renders parts side by side and returns the seconds of each: the total time, divided by rays.
    fn side_by_side<T: Send>(
        &self,
        parts: &[Crop],
        settings: &Settings,
        render: impl Fn(&Settings) -> T + Sync,
        rays: impl Fn(&T) -> u64,
    ) -> Vec<(T, f64)> {
        let mut done = Vec::new();
        let tile_size = if settings.sampling.is_fixed() {
            settings.tile_size
        } else {
            UNIT
        };
        let part = |&part: &Crop| {
            render(&Settings {
                crop: Some(part),
                tile_size,
                ..settings.clone()
            })
        };
        let seconds = (self.stopwatch)(&mut || {
            done = match parts {
                [] => vec![render(&Settings {
                    crop: None,
                    ..settings.clone()
                })],
                parts => parts.par_iter().map(part).collect(),
            };
            done.iter().map(&rays).sum()
        });
        let (sum, count) = (
            done.iter().map(&rays).sum::<u64>() as f64,
            done.len() as f64,
        );
        let share = |of: &T| {
            if sum > 0.0 {
                rays(of) as f64 / sum
            } else {
                1.0 / count
            }
        };
        done.into_iter()
            .map(|of| (share(&of), of))
            .map(|(share, of)| (of, seconds * share))
            .collect()
    }

    /// Runs work on a scene prepared for these settings, or for others that need the same
    /// preparation.
    fn with_prepared<T>(
        &self,
        setting: &Setting,
        (scene, settings): (&Scene, &Settings),
        end: Instant,
        work: impl FnOnce(&ReadyScene) -> T,
    ) -> Result<T, UnfinishedRender> {
        let is_fixed = settings.sampling.is_fixed();
        let free = [Ladder::Samples, Ladder::Sampler, Ladder::Reconstruction];
        let setting = free
            .into_iter()
            .fold(setting.clone(), |setting, ladder| setting.without(ladder));
        let mut prepared = self.prepared.borrow_mut();
        let place = prepared
            .iter()
            .position(|of| of.setting == setting && of.is_fixed == is_fixed);
        let latest = match place {
            Some(index) => prepared.remove(index),
            None => PreparedSetting {
                setting,
                is_fixed,
                ready: self.prepare(scene, settings, end)?.0,
            },
        };
        let done = work(&latest.ready);
        prepared.push(latest);
        let bytes = |of: &PreparedSetting| of.ready.memory().total() - of.ready.memory().film;
        while prepared.len() > 1 && prepared.iter().map(bytes).sum::<u64>() > KEPT_BYTES {
            prepared.remove(0);
        }
        Ok(done)
    }

    /// Prepares a setting anew and renders parts of it.
    pub fn render_parts(
        &self,
        setting: &Setting,
        parts: &[Crop],
        round: u64,
        end: Instant,
    ) -> Result<Vec<TimedRender>, UnfinishedRender> {
        let (scene, settings) = setting.applied(self.scene, self.settings);
        let settings = Settings {
            seed: settings.seed.wrapping_add(round),
            ..settings
        };
        let (ready, preparing) = self.prepare(&scene, &settings, end)?;
        self.timed(&ready, (&settings, parts), preparing, end)
    }

    /// Prepares and renders any scene.
    pub fn render(
        &self,
        scene: &Scene,
        settings: &Settings,
        end: Instant,
    ) -> Result<TimedRender, UnfinishedRender> {
        let (ready, preparing) = self.prepare(scene, settings, end)?;
        self.timed(&ready, (settings, &[]), preparing, end)?
            .pop()
            .ok_or(UnfinishedRender::Late)
    }

    fn prepare(
        &self,
        scene: &Scene,
        settings: &Settings,
        end: Instant,
    ) -> Result<(ReadyScene, f64), UnfinishedRender> {
        let mut ready = Err(PrepareError::Cancelled);
        let preparing = (self.stopwatch)(&mut || {
            ready = prepare(scene, settings, &self.until(end));
            0
        });
        match ready {
            Ok(ready) => Ok((ready, preparing)),
            Err(PrepareError::Cancelled) => Err(UnfinishedRender::Late),
            Err(error) => Err(UnfinishedRender::Failed(error)),
        }
    }

    /// Renders parts of a prepared scene; without parts, the whole picture.
    fn timed(
        &self,
        ready: &ReadyScene,
        (settings, parts): (&Settings, &[Crop]),
        preparing: f64,
        end: Instant,
    ) -> Result<Vec<TimedRender>, UnfinishedRender> {
        let until = self.until(end);
        let films = self.side_by_side(
            parts,
            settings,
            |settings| ready.expose_as(settings, &until),
            |film| film.counters().rays(),
        );
        let mut renders = Vec::new();
        let denoising = (self.stopwatch)(&mut || {
            renders = films
                .par_iter()
                .map(|(film, _)| RenderOutput::from_film(film, &until))
                .collect();
            0
        });
        let is_stopped = |rendered: &RenderOutput| {
            matches!(rendered.denoised, Some(Err(DenoiseError::Cancelled)))
        };
        if renders
            .iter()
            .any(|rendered| !rendered.finished || is_stopped(rendered))
        {
            return Err(UnfinishedRender::Late);
        }
        // The denoising time is the same for each pixel.
        let pixels: usize = renders
            .iter()
            .map(|rendered| rendered.picture.pixels())
            .sum();
        let timed = |(rendered, (_, tracing)): (RenderOutput, (Film, f64))| {
            let denoising = denoising * rendered.picture.pixels() as f64 / pixels as f64;
            TimedRender {
                rays: rendered.counters.rays(),
                brightened: rendered
                    .denoised()
                    .map_or(1.0, |denoised| 1.0 + denoised.brightened),
                picture: rendered.shown_picture().clone(),
                seconds: tracing + denoising,
                denoising,
                preparing,
                by_chance: ready.is_by_chance(),
                geometry: ready.memory().geometry,
            }
        };
        Ok(renders.into_iter().zip(films).map(timed).collect())
    }

    fn until(&self, end: Instant) -> DeadlineObserver<'_> {
        DeadlineObserver {
            observer: self.observer,
            now: self.now,
            end,
        }
    }

    /// Prepares a reference on these rungs, with this number of samples. It is empty, or holds the
    /// film of an earlier reference.
    pub fn reference(
        &self,
        exact: &Setting,
        samples: u32,
        grid: TileGrid,
        start: MeasurementStart<'_>,
        end: Instant,
    ) -> Result<GrowingReference<'_>, MeasureError> {
        let (scene, settings) = reference(exact, self.scene, self.settings, samples);
        let settings = Settings {
            replicates: Some(REPLICATES),
            tile_size: grid.edge,
            ..settings
        };
        let (ready, _) = self
            .prepare(&scene, &settings, end)
            .map_err(|error| self.explained(error.into_error()))?;
        let mut film = ready.film(start.scene);
        if let Some(earlier) = start.reference {
            film.adopt(earlier.film).map_err(MeasureError::Reference)?;
        }
        let kept = film.counters().rays();
        Ok(GrowingReference {
            renderer: self,
            ready,
            film,
            kept,
            seconds: 0.0,
        })
    }

    /// Converts the reason of a missing measurement: stopped by the user, or too little time.
    pub fn explained(&self, error: PrepareError) -> MeasureError {
        match error {
            PrepareError::Cancelled if !self.observer.is_cancelled() => MeasureError::NoTime,
            error => error.into(),
        }
    }
}

/// A reference that is rendered tile by tile.
pub(super) struct GrowingReference<'a> {
    renderer: &'a Renderer<'a>,
    ready: ReadyScene,
    pub film: Film,
    /// Rays of the earlier reference.
    kept: u64,
    /// Seconds of all threads so far.
    pub seconds: f64,
}

impl GrowingReference<'_> {
    /// Renders all samples of these tiles. Returns false where time is out.
    pub fn expose(&mut self, tiles: &[u32], end: Instant) -> bool {
        let Self {
            renderer,
            ready,
            film,
            ..
        } = self;
        let until = renderer.until(end);
        let whole_part = film.whole_part();
        let mut tiles = tiles.to_vec();
        tiles.sort_unstable();
        let part = FilmPart {
            among: Some(tiles),
            ..whole_part
        };
        if film.lacking(&part) == 0 {
            return true;
        }
        let before = film.counters().rays();
        self.seconds += (renderer.stopwatch)(&mut || {
            // The film belongs to this scene, so no part is refused.
            let _ = ready.render_part(film, &part, &until);
            film.counters().rays() - before
        });
        film.lacking(&part) == 0
    }

    /// Whether all of the film comes from an earlier measurement.
    pub fn is_kept(&self) -> bool {
        self.kept > 0 && self.kept == self.film.counters().rays()
    }
}
