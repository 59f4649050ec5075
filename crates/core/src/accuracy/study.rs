//! A measurement: its table of trials, and the renders that fill it.

use core::time::Duration;
use std::time::Instant;

use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::AccuracyEffort;
use super::renderer::{FilmRequest, SettingRenderer, TimedFilm, none_if_cancelled};
use super::setting::RungSetting;
use super::space::SettingSpace;
use super::tiles::{crop_picture, tile_count, tile_crop, tiles_of_crop};
use super::trial::{
    DenoisedTrial, Job, Region, Replicates, TileSums, Trial, mean_of_replicates, replicates_of,
};
use crate::film::{ErrorEstimate, Film, Uncertainty};
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Share of the budget at which the trials end. What is left is for the magnified pictures, and for
/// what a render does after its last ray. In runs of 1 to 180 s the budget was kept to 1.02
/// (`benches/runs/2026-11-27-advice.md`).
pub(super) const TRIALS_END: f64 = 0.92;
/// Time limit of a trial in expected times, besides the time of the first picture. In Whitted ray
/// tracing rays split at glass and mirrors, so that their number doubles with each segment of the
/// path.
const PATIENCE: f64 = 20.0;
/// Share of the budget that any trial may take: a busy machine pauses a short trial for longer than
/// the trial lasts.
const LEAST_PATIENCE: f64 = 0.005;

/// A measurement in progress.
pub(super) struct Study<'a> {
    pub renderer: &'a SettingRenderer<'a>,
    pub space: SettingSpace<'a>,
    pub effort: AccuracyEffort,
    start: Instant,
    /// The finished trials, in order.
    pub table: Vec<Trial>,
    pub reference: Option<TimedFilm>,
    /// Tiles on which rungs are tried, in ascending order.
    pub tiles: Vec<u32>,
    /// The tile with the most light, which is always tried. It stands for itself alone.
    pub brightest: u32,
    /// Seconds of what a render does before its first sample, summed over all threads.
    pub first_look: f64,
    /// The magnified part of the picture.
    pub detail: Crop,
    /// The whole picture of the most samples, but at most those in use, with their number.
    pub overview: (u32, Picture),
    pub reference_replicates: Replicates,
    /// Mean of the replicates of the reference, for each tile.
    pub truth: Vec<Vec<[f32; 3]>>,
    /// Round and replicates of the exact setting's latest trial.
    pub exact_replicates: Option<(u64, Replicates)>,
}

impl<'a> Study<'a> {
    /// Creates a measurement whose time starts at `start`.
    pub fn new(renderer: &'a SettingRenderer<'a>, effort: AccuracyEffort, start: Instant) -> Self {
        Self {
            renderer,
            space: SettingSpace::new(renderer),
            effort,
            start,
            table: Vec::new(),
            reference: None,
            tiles: Vec::new(),
            brightest: 0,
            first_look: 0.0,
            detail: tile_crop(renderer.settings.size, 0),
            overview: (0, Picture::default()),
            reference_replicates: Vec::new(),
            truth: Vec::new(),
            exact_replicates: None,
        }
    }

    /// Renders the film of a job, and returns the replicates of the tiles, of a whole picture none.
    /// Under a fixed pattern of samples the picture is the only one: its noise is part of its error.
    pub fn render(&self, job: &Job, end: Instant) -> Result<(TimedFilm, Replicates), PrepareError> {
        let is_whole = job.region == Region::Whole;
        let timed = self.renderer.render_film(&FilmRequest {
            setting: &job.setting,
            round: job.round,
            tiles: (!is_whole).then_some(&self.tiles[..]),
            denoises: self.space.has_layers(job),
            end,
        })?;
        let replicates = match is_whole {
            true => None,
            false => replicates_of(&timed.film, &self.tiles),
        };
        Ok((timed, replicates.unwrap_or_default()))
    }

    /// Adds the trial of a whole picture to the table, with its claim and its denoised picture.
    pub fn record_whole(&mut self, job: &Job, timed: &TimedFilm, wall: f64, end: Instant) {
        let before = (self.renderer.now)();
        let film = &timed.film;
        let denoised = film
            .is_to_be_denoised()
            .then(|| self.renderer.denoise_film(film, end))
            .flatten();
        let claim = claim_of(film);
        let denoised = denoised.map(|(output, seconds)| DenoisedTrial {
            claim: output.error,
            light_change: output.light_change,
            seconds,
            detail: crop_picture(&output.picture, self.detail),
        });
        let picture = film.mean_colours();
        let detail = Some(crop_picture(&picture, self.detail));
        let samples = self.space.sample_count(&job.setting);
        let most = self.space.sample_count(&RungSetting::default());
        let is_better = (self.overview.0 + 1..=most).contains(&samples);
        if is_better || self.table.is_empty() {
            self.overview = (samples, picture);
        }
        let wall = wall + ((self.renderer.now)() - before).as_secs_f64();
        self.table.push(Trial {
            claim,
            denoised,
            detail,
            ..Trial::of_film(job, timed, wall)
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
        if job.setting == self.space.exact_baseline() && !is_fixed {
            self.exact_replicates = Some((job.round, replicates.clone()));
        }
        // The random numbers of the exact setting are those of the same round.
        let exact = match &self.exact_replicates {
            Some((round, exact)) if *round == job.round && !is_fixed => exact,
            _ => &self.reference_replicates,
        };
        let others = tile_count(self.renderer.settings.size) as f64 - 1.0;
        let share = others / (self.tiles.len() as f64 - 1.0).max(1.0);
        let weight = |&tile: &u32| if tile == self.brightest { 1.0 } else { share };
        let sums = replicates.par_iter().zip(exact).zip(&self.truth);
        let sums = sums
            .zip(&self.tiles)
            .map(|(((own, exact), truth), tile)| {
                TileSums::new(own, exact, truth).scale(weight(tile))
            })
            .collect();
        self.table.push(Trial {
            sums,
            ..Trial::of_film(job, timed, wall)
        });
    }

    /// Keeps the reference and its replicates of each tile.
    pub fn set_reference(&mut self, reference: TimedFilm, replicates: Replicates) {
        let means = replicates.iter().map(|of| mean_of_replicates(of));
        self.truth = means.collect();
        self.reference_replicates = replicates;
        self.reference = Some(reference);
    }

    /// Returns the sums of the reference's own noise over each tile.
    pub fn reference_noise(&self) -> Vec<TileSums> {
        let tiles = self.reference_replicates.iter().zip(&self.truth);
        tiles
            .map(|(of, truth)| TileSums::new(of, of, truth))
            .collect()
    }

    /// Renders the magnified part of the picture with a setting; `None` if the time runs out.
    ///
    /// # Errors
    /// A render that cannot be prepared.
    pub fn render_detail(
        &self,
        setting: &RungSetting,
        round: u64,
    ) -> Result<Option<Picture>, PrepareError> {
        let tiles = tiles_of_crop(self.renderer.settings.size, self.detail);
        let left = Duration::from_secs_f64(self.seconds_until(1.0) / 2.0);
        let timed = self.renderer.render_film(&FilmRequest {
            setting,
            round,
            tiles: Some(&tiles),
            denoises: false,
            end: (self.renderer.now)() + left,
        });
        let crop = |timed: TimedFilm| crop_picture(&timed.film.mean_colours(), self.detail);
        Ok(none_if_cancelled(timed)?.map(crop))
    }

    /// Returns the wall-clock seconds of a whole picture's sample per pixel.
    pub fn seconds_of_sample(&self) -> f64 {
        let whole = self.table.iter();
        let whole = whole.filter(|trial| trial.job.region == Region::Whole);
        let seconds = whole.map(|trial| (self.space.sample_count(&trial.job.setting), trial.wall));
        let largest = seconds.max_by_key(|(samples, _)| *samples);
        largest.map_or(0.0, |(samples, wall)| wall / f64::from(samples))
    }

    /// Returns the most exact setting, with as many samples as the magnified part can have in half of
    /// the time that is left; `None` if its noise would be more than half of that in use.
    pub fn setting_of_exact_detail(&self) -> Option<RungSetting> {
        let tiles = tiles_of_crop(self.renderer.settings.size, self.detail).len() as f64;
        let share = tiles / tile_count(self.renderer.settings.size) as f64;
        let sample = share * self.seconds_of_sample();
        let count = |setting: &RungSetting| f64::from(self.space.sample_count(setting));
        let left = self.seconds_until(1.0) / 2.0;
        let mut settings = self.space.sample_settings();
        settings.retain(|setting| sample * count(setting) < left);
        let is_random = self.table.first().is_some_and(|trial| trial.is_random);
        let least = if is_random {
            4.0 * count(&RungSetting::default())
        } else {
            0.0
        };
        let most = settings.pop().filter(|setting| count(setting) >= least)?;
        Some(most.with_rungs(self.space.exact.choices()))
    }

    /// Returns the share of the picture's tiles, 0 to 1, on which rungs are tried.
    pub fn tile_share(&self) -> f64 {
        self.tiles.len() as f64 / tile_count(self.renderer.settings.size) as f64
    }

    /// Returns the instant at which a trial of these expected seconds counts as too long.
    pub fn time_limit(&self, expected: f64) -> Instant {
        let first = self.table.first().map_or(0.0, |trial| trial.wall);
        let patience = Duration::from_secs_f64(PATIENCE * expected + first);
        let patience = patience.max(self.effort.budget.mul_f64(LEAST_PATIENCE));
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

/// Returns the claim of a whole picture, between two bounds where two replicates share a net. Its two
/// nets, by which `render` claims, are up to a tenth too low where few pixels carry the noise, and do
/// not tell small lamps from rare light. All four replicates, taken as independent, are up to a fifth
/// too high where nets are well spread (`benches/runs/2026-12-01-claims.md`).
fn claim_of(film: &Film) -> Option<Uncertainty> {
    let (nets, (all, _)) = (film.estimate_uncertainty()?, film.estimate_by_replicates()?);
    let between = |one: ErrorEstimate, other: ErrorEstimate| ErrorEstimate {
        value: (one.value * other.value).sqrt(),
        low: one.low.min(other.low),
        high: one.high.max(other.high),
        carriers: one.carriers.min(other.carriers),
    };
    Some(Uncertainty {
        rmse: between(nets.rmse, all.rmse),
        root_relmse: between(nets.root_relmse, all.root_relmse),
        replicates: nets.replicates,
        doubt: all.doubt,
    })
}

#[cfg(test)]
mod tests;
