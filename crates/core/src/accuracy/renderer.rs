//! Rendering and timing of settings. Preparation is timed separately. A render ends without a
//! result when the observer stops it or its time runs out.

mod deadline;
mod incremental_reference;
mod pilot_renders;

use std::cell::RefCell;
use std::time::Instant;

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::MeasureError;
use super::setting::RungSetting;
use crate::bench::clock::Stopwatch;
use crate::denoise::DenoiseError;
use crate::dispatch::{ReadyScene, prepare};
use crate::film::Film;
use crate::ladder::Ladder;
use crate::observer::Observer;
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::render::RenderOutput;
use crate::scene::Scene;
use crate::settings::{Crop, Settings};

use deadline::DeadlineObserver;
pub(super) use deadline::{ClockFunction, UnfinishedRender};
pub(super) use incremental_reference::IncrementalReference;

/// Margin in pixels around a denoised tile. The denoiser averages pixels within this distance. A
/// few pixels farther away affect only the weights of that average.
pub(super) const MARGIN: u32 = 20;

/// Largest memory, in bytes, of all prepared scenes that are kept for reuse.
const KEPT_BYTES: u64 = 1 << 30;

/// Edge in pixels of the square blocks into which threads divide a tile, if the picture does not
/// depend on this edge.
const UNIT: u32 = 16;

/// Scene prepared for a setting. It is reused by all settings that differ only in samples, sampler
/// or denoising.
struct PreparedSetting {
    setting: RungSetting,
    has_fixed_pattern: bool,
    ready: ReadyScene,
}

/// Renders settings of a scene and measures their times.
pub(super) struct SettingRenderer<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub observer: &'a dyn Observer,
    /// Stopwatch of the CPU time of all threads, in seconds.
    pub stopwatch: Stopwatch,
    pub now: ClockFunction<'a>,
    /// Most recently prepared scenes, so that a scene is not prepared again for each tile.
    prepared: RefCell<Vec<PreparedSetting>>,
}

/// Finished render with its times and its number of rays.
pub(super) struct TimedRender {
    pub picture: Picture,
    /// Ratio of the denoised picture's summed radiance to the noisy picture's; 1 without denoising.
    pub light_ratio: f64,
    /// Seconds of rendering and denoising together, summed over all threads.
    pub seconds: f64,
    /// Seconds of denoising alone, summed over all threads.
    pub denoising_seconds: f64,
    /// Seconds of preparation, summed over all threads.
    pub preparing_seconds: f64,
    pub rays: u64,
    /// Whether other random numbers would change the picture.
    pub is_random: bool,
    /// Memory of geometry and acceleration structure in bytes.
    pub geometry_bytes: u64,
}

impl<'a> SettingRenderer<'a> {
    /// Creates a renderer without prepared scenes.
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

    /// Renders crops by a setting, in parallel. `round` selects the random numbers. An empty list
    /// of crops stands for the whole picture. The CPU time of the process is divided among the
    /// crops in proportion to their numbers of rays.
    pub fn render_setting(
        &self,
        setting: &RungSetting,
        parts: &[Crop],
        round: u64,
        end: Instant,
    ) -> Result<Vec<TimedRender>, UnfinishedRender> {
        let (scene, settings) = setting.apply(self.scene, self.settings);
        let settings = Settings {
            seed: settings.seed.wrapping_add(round),
            ..settings
        };
        self.run_on_prepared_scene(setting, (&scene, &settings), end, |ready| {
            self.render_and_time(ready, (&settings, parts), 0.0, end)
        })?
    }

    /// Renders crops in parallel and returns each result with its seconds. The total CPU time is
    /// divided among the crops in proportion to their rays. An empty list of crops stands for the
    /// whole picture.
    fn render_crops_in_parallel<T: Send>(
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

    /// Runs `work` on a scene prepared for the setting. A kept scene is reused if it was prepared
    /// in the same way.
    fn run_on_prepared_scene<T>(
        &self,
        setting: &RungSetting,
        (scene, settings): (&Scene, &Settings),
        end: Instant,
        work: impl FnOnce(&ReadyScene) -> T,
    ) -> Result<T, UnfinishedRender> {
        let is_fixed = settings.sampling.is_fixed();
        let free = [Ladder::Samples, Ladder::Sampler, Ladder::Reconstruction];
        let setting = free.into_iter().fold(setting.clone(), |setting, ladder| {
            setting.without_ladder(ladder)
        });
        let mut prepared = self.prepared.borrow_mut();
        let place = prepared
            .iter()
            .position(|of| of.setting == setting && of.has_fixed_pattern == is_fixed);
        let latest = match place {
            Some(index) => prepared.remove(index),
            None => PreparedSetting {
                setting,
                has_fixed_pattern: is_fixed,
                ready: self.prepare_and_time(scene, settings, end)?.0,
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

    /// Prepares the scene again for a setting and renders crops of it, so that the preparation is
    /// timed too.
    pub fn prepare_and_render_crops(
        &self,
        setting: &RungSetting,
        parts: &[Crop],
        round: u64,
        end: Instant,
    ) -> Result<Vec<TimedRender>, UnfinishedRender> {
        let (scene, settings) = setting.apply(self.scene, self.settings);
        let settings = Settings {
            seed: settings.seed.wrapping_add(round),
            ..settings
        };
        let (ready, preparing) = self.prepare_and_time(&scene, &settings, end)?;
        self.render_and_time(&ready, (&settings, parts), preparing, end)
    }

    /// Prepares and renders the whole picture of any scene.
    pub fn prepare_and_render(
        &self,
        scene: &Scene,
        settings: &Settings,
        end: Instant,
    ) -> Result<TimedRender, UnfinishedRender> {
        let (ready, preparing) = self.prepare_and_time(scene, settings, end)?;
        self.render_and_time(&ready, (settings, &[]), preparing, end)?
            .pop()
            .ok_or(UnfinishedRender::Interrupted)
    }

    /// Prepares a scene and returns it with the seconds of preparation, summed over all threads.
    fn prepare_and_time(
        &self,
        scene: &Scene,
        settings: &Settings,
        end: Instant,
    ) -> Result<(ReadyScene, f64), UnfinishedRender> {
        let mut ready = Err(PrepareError::Cancelled);
        let preparing = (self.stopwatch)(&mut || {
            ready = prepare(scene, settings, &self.deadline_observer(end));
            0
        });
        match ready {
            Ok(ready) => Ok((ready, preparing)),
            Err(PrepareError::Cancelled) => Err(UnfinishedRender::Interrupted),
            Err(error) => Err(UnfinishedRender::Failed(error)),
        }
    }

    /// Renders and denoises crops of a prepared scene. An empty list of crops stands for the whole
    /// picture. `preparing` is the time of preparation in seconds, which is copied to every result.
    fn render_and_time(
        &self,
        ready: &ReadyScene,
        (settings, parts): (&Settings, &[Crop]),
        preparing: f64,
        end: Instant,
    ) -> Result<Vec<TimedRender>, UnfinishedRender> {
        let until = self.deadline_observer(end);
        let films = self.render_crops_in_parallel(
            parts,
            settings,
            |settings| ready.render_with_settings(settings, &until),
            |film| film.counters().ray_count(),
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
            return Err(UnfinishedRender::Interrupted);
        }
        // The denoising time is divided evenly among the pixels.
        let pixels: usize = renders
            .iter()
            .map(|rendered| rendered.picture.pixel_count())
            .sum();
        let timed = |(rendered, (_, tracing)): (RenderOutput, (Film, f64))| {
            let denoising = denoising * rendered.picture.pixel_count() as f64 / pixels as f64;
            TimedRender {
                rays: rendered.counters.ray_count(),
                light_ratio: rendered
                    .denoise_output()
                    .map_or(1.0, |denoised| 1.0 + denoised.light_change),
                picture: rendered.final_picture().clone(),
                seconds: tracing + denoising,
                denoising_seconds: denoising,
                preparing_seconds: preparing,
                is_random: ready.depends_on_seed(),
                geometry_bytes: ready.memory().geometry,
            }
        };
        Ok(renders.into_iter().zip(films).map(timed).collect())
    }

    /// Returns an observer that stops a render at `end`, or when the caller's observer stops it.
    fn deadline_observer(&self, end: Instant) -> DeadlineObserver<'_> {
        DeadlineObserver {
            observer: self.observer,
            now: self.now,
            end,
        }
    }

    /// Converts an error of preparation to an error of the measurement. A cancelled preparation
    /// counts as lack of time, unless the observer stopped it.
    pub fn to_measure_error(&self, error: PrepareError) -> MeasureError {
        match error {
            PrepareError::Cancelled if !self.observer.is_cancelled() => {
                MeasureError::InsufficientTime
            }
            error => error.into(),
        }
    }
}
