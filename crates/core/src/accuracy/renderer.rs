//! Rendering and timing of settings. A render ends without a result when the observer stops it or
//! its time runs out; its error is then [`PrepareError::Cancelled`].

use std::cell::RefCell;
use std::time::Instant;

use super::setting::RungSetting;
use super::tiles::tile_edge;
use crate::bench::clock::Stopwatch;
use crate::denoise::{DenoiseOutput, denoise};
use crate::dispatch::{ReadyScene, prepare};
use crate::film::{Film, FilmPart};
use crate::ladder::Ladder;
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::{Aov, Settings};

/// Number of replicates (independent parts of a pixel's samples) of every film: the fewest of which
/// each pair of differences is independent of another pair.
pub(crate) const REPLICATES: u32 = 4;

/// Function that returns the current instant. Tests use a clock that advances with each call.
pub(crate) type ClockFunction<'a> = &'a (dyn Fn() -> Instant + Sync);

/// Converts a render that was stopped, or whose time ran out, to `None`; other errors stay.
pub(crate) fn none_if_cancelled<T>(
    result: Result<T, PrepareError>,
) -> Result<Option<T>, PrepareError> {
    match result {
        Err(PrepareError::Cancelled) => Ok(None),
        other => other.map(Some),
    }
}

/// Observer that stops a render at a deadline, or when the caller's observer stops it.
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

/// Scene prepared for a setting. It is reused by all settings that differ only in samples, sampler
/// or denoising.
struct PreparedSetting {
    setting: RungSetting,
    has_fixed_pattern: bool,
    ready: ReadyScene,
}

/// Renders settings of a scene and measures their times.
pub(crate) struct SettingRenderer<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub observer: &'a dyn Observer,
    /// Stopwatch of the CPU time of all threads, in seconds.
    pub stopwatch: Stopwatch,
    pub now: ClockFunction<'a>,
    /// Most recently prepared scenes, so that a scene is not prepared again for each render.
    prepared: RefCell<Vec<PreparedSetting>>,
}

/// Finished film with its times.
pub(crate) struct TimedFilm {
    pub film: Film,
    /// Render time in seconds, summed over all threads.
    pub seconds: f64,
    /// Whether other random numbers would change the picture.
    pub is_random: bool,
}

/// Request of a film.
pub(crate) struct FilmRequest<'r> {
    pub setting: &'r RungSetting,
    /// Number that is added to the seed.
    pub round: u64,
    /// Tiles to render, in ascending order; `None` for the whole picture.
    pub tiles: Option<&'r [u32]>,
    pub denoises: bool,
    /// Instant at which an unfinished render is dropped.
    pub end: Instant,
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

    /// Renders a film of four replicates, or of one under a fixed pattern of samples.
    pub fn render_film(&self, request: &FilmRequest<'_>) -> Result<TimedFilm, PrepareError> {
        let (scene, settings) = request.setting.apply(self.scene, self.settings);
        let settings = Settings {
            seed: settings.seed.wrapping_add(request.round),
            replicates: Some(REPLICATES),
            tile_size: tile_edge(settings.size),
            denoise: request.denoises,
            ..settings
        };
        let end = request.end;
        self.run_on_prepared_scene(request.setting, (&scene, &settings), end, |ready| {
            let until = self.deadline_observer(end);
            let mut film = None;
            let seconds = (self.stopwatch)(&mut || {
                let done = ready.render_with_settings(&settings, request.tiles, &until);
                film.insert(done).counters().ray_count()
            });
            let part = |film: &Film| FilmPart {
                selected_tiles: request.tiles.map(<[u32]>::to_vec),
                ..film.full_part()
            };
            let film = film
                .filter(|film| film.unfinished_tiles(&part(film)) == 0)
                .ok_or(PrepareError::Cancelled)?;
            Ok(TimedFilm {
                film,
                seconds,
                is_random: ready.depends_on_seed(),
            })
        })?
    }

    /// Returns which object each tile shows in its middle, or −1 for the sky.
    pub fn find_objects(&self, end: Instant) -> Result<Vec<f32>, PrepareError> {
        let (setting, edge) = (RungSetting::default(), tile_edge(self.settings.size));
        let until = self.deadline_observer(end);
        let look = |ready: &ReadyScene| ready.render_preview(edge, 1, &[Aov::Object], &until);
        let place = (self.scene, self.settings);
        let picture = self
            .run_on_prepared_scene(&setting, place, end, look)?
            .picture;
        let objects = picture
            .layer("object.id")
            .map(|layer| layer.samples.clone());
        Ok(objects.unwrap_or_default())
    }

    /// Returns the seconds of what a render does before its first sample: a search for objects in view.
    pub fn time_first_look(&self, end: Instant) -> Result<f64, PrepareError> {
        let setting = RungSetting::default();
        let until = self.deadline_observer(end);
        self.run_on_prepared_scene(&setting, (self.scene, self.settings), end, |ready| {
            (self.stopwatch)(&mut || ready.look_for_objects(&until).0.counters.ray_count())
        })
    }

    /// Denoises a film. Returns the result with its seconds, summed over all threads; `None` if the
    /// film cannot be denoised, or the time runs out.
    pub fn denoise_film(&self, film: &Film, end: Instant) -> Option<(DenoiseOutput, f64)> {
        let mut output = None;
        let seconds = (self.stopwatch)(&mut || {
            output = denoise(film, &self.deadline_observer(end)).ok();
            0
        });
        output.map(|output| (output, seconds))
    }

    /// Runs `work` on a scene prepared for the setting. A kept scene is reused if it was prepared
    /// in the same way.
    fn run_on_prepared_scene<T>(
        &self,
        setting: &RungSetting,
        (scene, settings): (&Scene, &Settings),
        end: Instant,
        work: impl FnOnce(&ReadyScene) -> T,
    ) -> Result<T, PrepareError> {
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
                ready: prepare(scene, settings, &self.deadline_observer(end))?,
            },
        };
        let done = work(&latest.ready);
        prepared.push(latest);
        let bytes = |of: &PreparedSetting| of.ready.memory().total() - of.ready.memory().film;
        // Kept scenes take a quarter of a render's memory.
        let most = self.settings.max_memory.unwrap_or(u64::MAX) / 4;
        while prepared.len() > 1 && prepared.iter().map(bytes).sum::<u64>() > most {
            prepared.remove(0);
        }
        Ok(done)
    }

    /// Returns an observer that stops a render at `end`, or when the caller's observer stops it.
    fn deadline_observer(&self, end: Instant) -> DeadlineObserver<'_> {
        DeadlineObserver {
            observer: self.observer,
            now: self.now,
            end,
        }
    }
}
