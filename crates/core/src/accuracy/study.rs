//! A measurement: its table of trials, and the renders that fill it.

use core::time::Duration;
use std::time::Instant;

use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::effects::{EffectBench, EffectCosts};
use super::outputs::{OutputFormatReport, measure_output_formats};
use super::renderer::{
    FilmRequest, REPLICATES, Reference, SettingRenderer, TimedFilm, UnfinishedRender,
};
use super::space::{FEWEST_TILES, SettingSpace};
use super::tiles::{crop_picture, tile_count, tile_crop};
use super::trial::{
    DenoisedTrial, Job, Region, Replicates, TileSums, Trial, mean_of_replicates, replicates_of,
};
use super::{AccuracyEffort, ProgressListener};
use crate::denoise;
use crate::display::Display;
use crate::ladder::Ladder;
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Shares of the budget: the ends of the trials and of the costs of effects.
pub(super) const TRIALS_END: f64 = 0.88;
const EFFECTS_END: f64 = 0.97;
/// Time limit of a trial in expected times. In Whitted ray tracing rays split at glass and mirrors,
/// so that their number doubles with each segment of the path.
const PATIENCE: f64 = 20.0;
/// Least time limit of a trial.
const LEAST_PATIENCE: Duration = Duration::from_secs(1);

/// A measurement in progress.
pub(super) struct Study<'a> {
    pub renderer: &'a SettingRenderer<'a>,
    pub space: SettingSpace<'a>,
    pub display: Display,
    pub effort: AccuracyEffort,
    start: Instant,
    /// The finished trials, in order.
    pub table: Vec<Trial>,
    pub reference: Option<Reference>,
    /// Tiles on which rungs are tried, in ascending order.
    pub tiles: Vec<u32>,
    /// The shown part of the picture.
    pub shown: Crop,
    pub reference_replicates: Replicates,
    /// Mean of the replicates of the reference, for each tile.
    pub truth: Vec<Vec<[f32; 3]>>,
    /// Round and replicates of the exact setting's latest trial.
    pub exact_replicates: Option<(u64, Replicates)>,
    baseline_replicates: Replicates,
}

impl<'a> Study<'a> {
    /// Creates a measurement whose time starts at `start`.
    pub fn new(
        renderer: &'a SettingRenderer<'a>,
        display: Display,
        effort: AccuracyEffort,
        start: Instant,
    ) -> Self {
        Self {
            renderer,
            space: SettingSpace::new(renderer),
            display,
            effort,
            start,
            table: Vec::new(),
            reference: None,
            tiles: Vec::new(),
            shown: tile_crop(renderer.settings.size, 0),
            reference_replicates: Vec::new(),
            truth: Vec::new(),
            exact_replicates: None,
            baseline_replicates: Vec::new(),
        }
    }

    /// Renders the film of a trial, and returns the replicates of the tiles, of a whole picture none.
    /// Under a fixed pattern of samples, pictures with other random numbers are the replicates.
    pub fn render(
        &self,
        job: &Job,
        end: Instant,
    ) -> Result<(TimedFilm, Replicates), UnfinishedRender> {
        let is_whole = job.region == Region::Whole;
        let samples = self.space.sample_count(&job.setting);
        let is_fixed = self.space.is_fixed(&job.setting);
        let can_denoise = self.space.ladders.contains(&Ladder::Reconstruction);
        let film = |round: u64| {
            self.renderer.render_film(&FilmRequest {
                setting: &job.setting,
                round,
                tiles: (!is_whole).then_some(&self.tiles[..]),
                denoises: is_whole
                    && can_denoise
                    && !is_fixed
                    && samples >= denoise::FEWEST_SAMPLES,
                prepares: job.prepares,
                end,
            })
        };
        let first = film(job.round)?;
        if is_whole {
            return Ok((first, Vec::new()));
        }
        let rounds = u64::from(if is_fixed && first.is_random {
            REPLICATES
        } else {
            1
        });
        let mut replicates = replicates_of(&first.film, &self.tiles).unwrap_or_default();
        for k in 1..rounds {
            let other = film(job.round + k * u64::from(self.effort.rounds))?;
            let other = replicates_of(&other.film, &self.tiles).unwrap_or_default();
            replicates
                .iter_mut()
                .zip(other)
                .for_each(|(all, other)| all.extend(other));
        }
        Ok((first, replicates))
    }

    /// Adds the trial of a whole picture to the table, with its claim and its denoised picture.
    pub fn record_whole(&mut self, job: &Job, timed: TimedFilm, wall: f64, end: Instant) {
        let before = (self.renderer.now)();
        let film = &timed.film;
        let denoised = film
            .is_to_be_denoised()
            .then(|| self.renderer.denoise_film(film, end))
            .flatten();
        let claim = match &denoised {
            Some((output, _)) => output.noisy_error,
            None => film.estimate_uncertainty(),
        };
        let denoised = denoised.map(|(output, seconds)| DenoisedTrial {
            claim: output.error,
            light_change: output.light_change,
            seconds,
            picture: Some(crop_picture(&output.picture, self.shown)),
        });
        let picture = crop_picture(&film.picture(), self.shown);
        let wall = wall + ((self.renderer.now)() - before).as_secs_f64();
        self.table.push(Trial {
            claim,
            denoised,
            picture: Some(picture),
            ..Trial::of_film(&job.setting, Region::Whole, job.round, &timed, wall)
        });
    }

    /// Adds a trial on tiles to the table, with its sums of errors.
    pub fn record_tiles(
        &mut self,
        job: &Job,
        timed: &TimedFilm,
        replicates: Replicates,
        wall: f64,
    ) {
        let is_fixed = self.space.is_fixed(&job.setting);
        let is_exact = job.setting == self.space.exact_baseline();
        if is_exact && !is_fixed {
            self.exact_replicates = Some((job.round, replicates.clone()));
        }
        // The random numbers of the exact setting are those of the same round.
        let exact = match &self.exact_replicates {
            Some((round, exact)) if *round == job.round && !is_fixed => exact,
            _ => &self.reference_replicates,
        };
        let sums = replicates.par_iter().zip(exact).zip(&self.truth);
        let sums = sums
            .map(|((own, exact), truth)| TileSums::new(own, exact, truth, !is_fixed))
            .collect();
        let is_own = job.setting == self.space.baseline && job.round == 0;
        if is_own && self.baseline_replicates.is_empty() {
            self.baseline_replicates.clone_from(&replicates);
        }
        let picture = self.shown_picture(&replicates, is_fixed);
        self.table.push(Trial {
            sums,
            has_same_bits: replicates == self.baseline_replicates,
            picture: Some(picture),
            is_prepared_anew: job.prepares,
            ..Trial::of_film(&job.setting, Region::Tiles, job.round, timed, wall)
        });
    }

    /// Returns the sums of the reference's own noise over each tile.
    pub fn reference_noise(&self) -> Vec<TileSums> {
        let tiles = self.reference_replicates.iter().zip(&self.truth);
        tiles
            .map(|(of, truth)| TileSums::new(of, of, truth, true))
            .collect()
    }

    /// Returns the shown part of the reference.
    pub fn reference_picture(&self) -> Picture {
        self.shown_picture(&self.reference_replicates, false)
    }

    /// Returns the shown part of a picture from the replicates of the tiles: their mean, or the
    /// first.
    fn shown_picture(&self, replicates: &Replicates, is_first: bool) -> Picture {
        let (shown, size) = (self.shown, self.renderer.settings.size);
        let mut picture = Picture::new(shown.width, shown.height);
        for (&tile, replicates) in self.tiles.iter().zip(replicates) {
            let crop = tile_crop(size, tile);
            let count = if is_first { 1 } else { replicates.len() };
            let means = mean_of_replicates(&replicates[..count]);
            for (at, colour) in means.into_iter().enumerate() {
                let (x, y) = (
                    crop.x + at as u32 % crop.width,
                    crop.y + at as u32 / crop.width,
                );
                let [column, row] = [x.wrapping_sub(shown.x), y.wrapping_sub(shown.y)];
                if column < shown.width && row < shown.height {
                    picture.rgb[(row * shown.width + column) as usize] = colour;
                }
            }
        }
        picture
    }

    /// Measures every output format on tiles of the baseline's picture.
    pub fn measure_outputs(&self) -> Vec<OutputFormatReport> {
        let (size, is_fixed) = (
            self.renderer.settings.size,
            self.space.is_fixed(&self.space.baseline),
        );
        let tiles = self
            .tiles
            .iter()
            .zip(&self.baseline_replicates)
            .take(FEWEST_TILES);
        let picture = |(&tile, replicates): (&u32, &Vec<Vec<[f32; 3]>>)| {
            let count = if is_fixed { 1 } else { replicates.len() };
            let crop = tile_crop(size, tile);
            Picture {
                rgb: mean_of_replicates(&replicates[..count]),
                ..Picture::new(crop.width, crop.height)
            }
        };
        let pictures: Vec<Picture> = tiles.map(picture).collect();
        let share = pictures.len() as f64 / tile_count(self.renderer.settings.size) as f64;
        let [width, height] = size.map(f64::from);
        measure_output_formats(
            &pictures
                .iter()
                .map(|picture| (share, picture))
                .collect::<Vec<_>>(),
            width * height,
            self.display,
            self.renderer.settings.output,
            self.renderer.stopwatch,
        )
    }

    /// Measures the cost of each effect of the scene with the baseline, in the rest of the budget;
    /// `None` if the time does not suffice for one effect.
    ///
    /// # Errors
    /// A render that cannot be prepared.
    pub fn measure_effect_costs(
        &self,
        listener: &mut dyn ProgressListener,
    ) -> Result<Option<EffectCosts>, PrepareError> {
        let renderer = self.renderer;
        let (scene, settings) = self.space.baseline.apply(renderer.scene, renderer.settings);
        let start = (renderer.now)();
        let bench = EffectBench {
            scene: &scene,
            observer: renderer.observer,
            stopwatch: renderer.stopwatch,
            now: renderer.now,
            start,
            budget: self
                .instant_of(EFFECTS_END)
                .saturating_duration_since(start),
        };
        let from = self.spent_share();
        let mut later = |label: &str, share: f64| {
            listener.report_step(label, from + share * (1.0 - from));
        };
        match bench.measure_costs(&settings, &mut later) {
            Ok(costs) => Ok(Some(costs)),
            Err(PrepareError::Cancelled) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Returns the share of the picture's tiles, 0 to 1, on which rungs are tried.
    pub fn tile_share(&self) -> f64 {
        self.tiles.len() as f64 / tile_count(self.renderer.settings.size) as f64
    }

    /// Returns the instant at which a trial of these expected seconds counts as too long.
    pub fn time_limit(&self, expected: f64) -> Instant {
        let patience = Duration::from_secs_f64(PATIENCE * expected).max(LEAST_PATIENCE);
        ((self.renderer.now)() + patience).min(self.instant_of(TRIALS_END))
    }

    /// Returns the instant at which this share of the budget, 0 to 1, is spent.
    pub fn instant_of(&self, share: f64) -> Instant {
        self.start + self.effort.budget.mul_f64(share)
    }

    /// Returns the wall-clock seconds until this share of the budget is spent; zero afterwards.
    pub fn seconds_until(&self, share: f64) -> f64 {
        let left = self
            .instant_of(share)
            .saturating_duration_since((self.renderer.now)());
        left.as_secs_f64()
    }

    /// Returns the wall-clock seconds since the start of the measurement.
    pub fn elapsed(&self) -> f64 {
        ((self.renderer.now)() - self.start).as_secs_f64()
    }

    /// Returns the spent share of the budget, 0 to 1.
    pub fn spent_share(&self) -> f64 {
        (self.elapsed() / self.effort.budget.as_secs_f64().max(1e-9)).min(1.0)
    }
}

#[cfg(test)]
mod tests;
