//! Stages of a measurement in their order: pilot pass over the tiles, choice of the reference's
//! quality levels (rungs), plan, reference, every rung, combinations of rungs, more tiles for
//! promising settings, costs of effects. Each stage has its share of the time budget.

mod cost_measurements;
mod feasible;
mod frontier_walks;
mod plan;
mod report_rows;
mod turn_timing;

use std::time::Instant;
use std::vec;

use super::estimate::ReferenceTile;
use super::measurements::Measurements;
use super::outputs::measure_output_formats;
use super::renderer::{ClockFunction, IncrementalReference, SettingRenderer};
use super::report::{AccuracyReport, LadderReport, ReferenceReport, TileReport};
use super::setting::RungSetting;
use super::tiles::TileSample;
use super::{AccuracyEffort, MeasureError, MeasurementStart, ProgressListener, ReusableReference};
use crate::bench::clock::Stopwatch;
use crate::denoise;
use crate::dispatch::find_collapsed_objects;
use crate::display::Display;
use crate::effects::{EffectSet, detect};
use crate::ladder::{Ladder, RungChoice, RungValue, applicable_ladders, needed_effects};
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

/// Share of the time budget, 0 to 1, that is spent at the end of each stage.
const PILOT_PASS_END: f64 = 0.06;
const FEASIBLE_RUNGS_END: f64 = 0.12;
const PILOTS_END: f64 = 0.27;
const REFERENCE_END: f64 = 0.45;
const RUNGS_END: f64 = 0.74;
const WALKS_END: f64 = 0.8;
const REFINEMENT_END: f64 = 0.87;
const TURNS_END: f64 = 0.92;
const PRICES_END: f64 = 0.94;
const COSTS_END: f64 = 0.96;

/// Number of samples per pixel with which quality levels other than sample counts are measured, if
/// the scene has more samples. A change is as visible with few samples, and more tiles can be
/// measured.
const BASE_SAMPLES: u32 = 16;
/// Assumed render time of a reference sample divided by that of a sample of the scene's own
/// setting, until the ratio is measured.
const ASSUMED_REFERENCE_RATIO: f64 = 1.8;
/// Factor on the scene's sample count that halves its error. Sample counts up to this factor are
/// measured first.
const HALVING_SAMPLES: u32 = 4;

/// Measurement in progress: scene, clock, time budget, and results of the first stages.
pub(super) struct MeasurementSession<'a> {
    scene: &'a Scene,
    settings: Settings,
    display: Display,
    effort: AccuracyEffort,
    observer: &'a dyn Observer,
    stopwatch: Stopwatch,
    now: ClockFunction<'a>,
    start: Instant,
    /// Setting to which every changed rung except a sample count is applied: the scene's own
    /// setting, or the scene with fewer samples.
    baseline: RungSetting,
    /// Effects that the scene needs.
    effects: EffectSet,
    picture_ladders: Vec<Ladder>,
    cost_ladders: Vec<Ladder>,
    /// Rungs (quality levels) that took too long on a trial tile.
    infeasible_rungs: Vec<RungChoice>,
    /// Rungs whose number format cannot represent the scene. They have no picture.
    unstorable_rungs: Vec<RungChoice>,
    cut_short: bool,
    /// Wall-clock seconds per sample of one pixel.
    seconds_per_sample: f64,
    /// Render time of a reference sample divided by that of a sample of the scene's own setting.
    reference_time_ratio: f64,
}

impl<'a> MeasurementSession<'a> {
    pub fn new(
        scene: &'a Scene,
        settings: &Settings,
        display: Display,
        effort: AccuracyEffort,
        observer: &'a dyn Observer,
        (stopwatch, now): (Stopwatch, ClockFunction<'a>),
    ) -> Self {
        let effects = detect(scene, settings);
        let (mut pictured, priced): (Vec<Ladder>, Vec<Ladder>) =
            applicable_ladders(scene, settings, &effects)
                .filter(|&ladder| ladder != Ladder::Output)
                .partition(|ladder| ladder.changes_pictures());
        // Ladders by descending usual benefit.
        const FIRST: [Ladder; 7] = [
            Ladder::Samples,
            Ladder::Reconstruction,
            Ladder::Integrator,
            Ladder::LightSampling,
            Ladder::PathLength,
            Ladder::Roulette,
            Ladder::TextureFilter,
        ];
        pictured.sort_by_key(|ladder| {
            FIRST
                .iter()
                .position(|first| first == ladder)
                .unwrap_or(FIRST.len())
        });
        let lost = |&choice: &RungChoice| {
            let (scene, settings) = RungSetting::from_rung(choice).apply(scene, settings);
            !find_collapsed_objects(&scene, settings.precision).is_empty()
        };
        let unshown = Ladder::Precision.choices().filter(lost).collect();
        let has_more = pictured.contains(&Ladder::Samples)
            && settings.sampling.samples_per_pixel() > BASE_SAMPLES;
        let fewer = Ladder::Samples
            .choices()
            .find(|&choice| has_more && rung_sample_count(choice) == Some(BASE_SAMPLES));
        let base = fewer.map(RungSetting::from_rung).unwrap_or_default();
        let size = effort.size.unwrap_or(settings.size);
        let settings = Settings {
            size,
            crop: None,
            aovs: Vec::new(),
            max_error: None,
            ..settings.clone()
        };
        let start = now();
        Self {
            scene,
            settings,
            display,
            effort,
            observer,
            stopwatch,
            now,
            start,
            baseline: base,
            effects: needed_effects(&effects),
            picture_ladders: pictured,
            cost_ladders: priced,
            infeasible_rungs: Vec::new(),
            unstorable_rungs: unshown,
            cut_short: false,
            seconds_per_sample: 0.0,
            reference_time_ratio: ASSUMED_REFERENCE_RATIO,
        }
    }

    pub fn run_measurement(
        mut self,
        start: MeasurementStart<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(AccuracyReport, ReusableReference), MeasureError> {
        let settings = self.settings.clone();
        let renderer = SettingRenderer::new(
            self.scene,
            &settings,
            self.observer,
            (self.stopwatch, self.now),
        );
        let kept_reference = start.reference.as_ref();
        listener.report_step("timing the tiles of the picture", 0.0);
        let explained = |error| renderer.to_measure_error(error);
        let grid = self
            .choose_tile_grid(
                &renderer,
                kept_reference.map(|kept_reference| kept_reference.film.tile_size()),
            )
            .map_err(explained)?;
        let looks = self.run_pilot_passes(&renderer, grid).map_err(explained)?;
        listener.report_step(
            "choosing the quality levels of the reference",
            self.spent_budget_share(),
        );
        let reached = self
            .find_feasible_rungs(&renderer, grid, &looks)
            .map_err(explained)?;
        let exact = kept_reference.map_or(reached, |kept_reference| {
            RungSetting::from_rungs(&kept_reference.rungs)
        });
        let sample = TileSample::new(grid, &looks);
        let mut plan = self.make_plan(&sample);
        if let Some(kept_reference) = kept_reference {
            plan.reference_samples = plan
                .reference_samples
                .max(kept_reference.film.requested_samples().unwrap_or(0));
        }
        let mut exposure = renderer.prepare_reference(
            &exact,
            plan.reference_samples,
            grid,
            start,
            self.instant_of_budget_share(RUNGS_END),
        )?;
        let mut measurements = Measurements::new(&renderer, &sample, self.display);
        listener.report_step(&plan.description(&sample), self.spent_budget_share());
        self.render_pilots(&plan, &mut measurements)?;
        // An estimate needs at least two tiles.
        let minimum = 2.min(sample.drawable_tile_count());
        self.add_reference_tiles(
            &mut exposure,
            &mut measurements,
            minimum,
            self.instant_of_budget_share(REFINEMENT_END),
        );
        if measurements.reference_tile_count() < minimum {
            return Err(renderer.to_measure_error(PrepareError::Cancelled));
        }
        while measurements.reference_tile_count() < plan.tiles
            && (self.now)() < self.instant_of_budget_share(REFERENCE_END)
            && !self.observer.is_cancelled()
        {
            let next = plan.tiles.min(4 * measurements.reference_tile_count());
            self.add_reference_tiles(
                &mut exposure,
                &mut measurements,
                next,
                self.instant_of_budget_share(REFERENCE_END),
            );
        }
        let own_errors = self.measure_rungs(&plan, &mut measurements, listener)?;
        let known_settings = self.measure_combinations(&plan, &mut measurements, listener)?;
        self.measure_promising_on_more_tiles(
            &known_settings,
            &mut measurements,
            &mut exposure,
            listener,
        )?;
        let setting = RungSetting::default();
        let pixels = f64::from(settings.size[0]) * f64::from(settings.size[1]);
        // Output formats are measured before the stages that end by the clock, because their
        // duration follows from the number of pixels.
        let outputs = measure_output_formats(
            &measurements.kept_pictures(&setting),
            pixels,
            self.display,
            settings.output,
            self.stopwatch,
        );
        self.time_recommended_alternately(&known_settings, &mut measurements, listener)?;
        let prices = self.measure_rung_costs(&measurements, listener)?;
        let costs = self.measure_effect_costs(listener)?;
        let Some(own_measured) = measurements.summarise_setting(&setting, &setting) else {
            return Err(renderer.to_measure_error(PrepareError::Cancelled));
        };
        let reference = ReferenceReport {
            samples: plan.reference_samples,
            rungs: exact.flags(),
            tiles: measurements.reference_tile_count(),
            standard_error: measurements.reference_standard_error(),
            seconds: exposure.seconds,
            kept: exposure.is_reused(),
        };
        let (frontier, recommendations) = self.frontier_report(&known_settings, &measurements);
        let ladders: Vec<LadderReport> = self
            .picture_ladders
            .iter()
            .map(|&ladder| self.ladder_report(ladder, &measurements, &own_errors))
            .collect();
        let called_for: Vec<Ladder> = self
            .picture_ladders
            .iter()
            .chain(&self.cost_ladders)
            .chain(&[Ladder::Output])
            .copied()
            .collect();
        let report = AccuracyReport {
            size: settings.size,
            tiles: TileReport {
                edge: grid.edge,
                measured: own_measured.tiles,
                all: grid.tile_count(),
                shown: [
                    grid.tile_crop(sample.passes[0].tile).x,
                    grid.tile_crop(sample.passes[0].tile).y,
                ],
            },
            reference,
            recommendations,
            outputs,
            own: own_measured,
            base: self.baseline_report(&measurements),
            ladders,
            combinations: self.combination_reports(&known_settings, &measurements),
            prices,
            not_called_for: Ladder::ALL
                .into_iter()
                .filter(|l| !called_for.contains(l))
                .map(Ladder::name)
                .collect(),
            costs,
            frontier,
            pictures: self.report_pictures(&measurements, &exposure.film),
            seconds: self.elapsed(),
            cut_short: self.cut_short || self.observer.is_cancelled(),
        };
        Ok((
            report,
            ReusableReference {
                rungs: exact.choices().to_vec(),
                film: exposure.film,
            },
        ))
    }

    /// Renders the reference on the first `count` tiles of the drawing order and adds the new tiles
    /// to the measurements. Tiles that are unfinished at `end` are not added.
    fn add_reference_tiles(
        &mut self,
        exposure: &mut IncrementalReference<'_>,
        measurements: &mut Measurements<'_>,
        count: usize,
        end: Instant,
    ) {
        let (sample, from) = (measurements.sample, measurements.reference_tile_count());
        let new: Vec<u32> = sample.passes[from..count.max(from)]
            .iter()
            .map(|pilot_pass| pilot_pass.tile)
            .collect();
        self.cut_short |= !exposure.render_tiles(&new, end);
        let tile = |&tile: &u32| {
            let crop = sample.grid.tile_crop(tile);
            let is_done = exposure.film.unfinished_tiles(&crate::film::FilmPart {
                tiles: tile..tile + 1,
                ..exposure.film.full_part()
            }) == 0;
            let means = exposure
                .film
                .tile_means_and_variances(tile)
                .filter(|_| is_done)?;
            Some(ReferenceTile::new(
                [crop.width, crop.height],
                &means,
                self.display,
            ))
        };
        measurements.add_reference_tiles(new.iter().map_while(tile));
    }

    /// Returns the instant at which this share of the time budget, 0 to 1, is spent.
    fn instant_of_budget_share(&self, share: f64) -> Instant {
        self.start + self.effort.budget.mul_f64(share)
    }

    /// Returns the wall-clock seconds until this share of the time budget is spent; zero if it is
    /// spent already.
    fn seconds_until_budget_share(&self, share: f64) -> f64 {
        self.instant_of_budget_share(share)
            .saturating_duration_since((self.now)())
            .as_secs_f64()
    }

    /// Returns the wall-clock seconds since the start of the measurement.
    fn elapsed(&self) -> f64 {
        ((self.now)() - self.start).as_secs_f64()
    }

    /// Returns the spent share of the time budget, 0 to 1.
    fn spent_budget_share(&self) -> f64 {
        (self.elapsed() / self.effort.budget.as_secs_f64().max(1e-9)).min(1.0)
    }

    /// Returns the rungs (quality levels) of a ladder that change this scene's picture and whose
    /// number format can represent the scene.
    fn applicable_rungs(&self, ladder: Ladder) -> vec::IntoIter<RungChoice> {
        let choices = ladder.choices().filter(|choice| {
            choice.changes_picture(self.effects) && !self.unstorable_rungs.contains(choice)
        });
        choices.collect::<Vec<_>>().into_iter()
    }

    /// Whether a rung (quality level) is the one of the scene's own setting.
    fn is_in_use(&self, choice: RungChoice) -> bool {
        choice.rung()
            == choice
                .ladder()
                .current_rung_name(self.scene, &self.settings)
    }

    /// Returns the setting to which the rungs (quality levels) of a ladder are applied and
    /// compared: the scene's own setting for sample counts; for other ladders the baseline, the
    /// scene with fewer samples.
    fn baseline_for_ladder(&self, ladder: Ladder) -> RungSetting {
        if ladder == Ladder::Samples {
            RungSetting::default()
        } else {
            self.baseline.clone()
        }
    }

    /// Returns the setting by which a rung (quality level) is measured. For a rung that is in use,
    /// it is the unchanged baseline.
    fn setting_of_rung(&self, choice: RungChoice) -> RungSetting {
        let beside = self.baseline_for_ladder(choice.ladder());
        if self.is_in_use(choice) {
            beside
        } else {
            beside.with_rung(choice)
        }
    }

    /// Returns the baseline (the scene, possibly with fewer samples) on the ladder's most exact
    /// rung that does not take too long.
    fn most_exact_setting(&self, ladder: Ladder) -> RungSetting {
        let reached = |choice: &RungChoice| {
            choice.can_be_reference() && !self.infeasible_rungs.contains(choice)
        };
        let choice = self.applicable_rungs(ladder).rev().find(reached);
        choice.map_or_else(
            || self.baseline_for_ladder(ladder),
            |choice| self.setting_of_rung(choice),
        )
    }

    /// Returns the number of samples per pixel of a setting.
    fn sample_count(&self, setting: &RungSetting) -> u32 {
        setting
            .rung(Ladder::Samples)
            .and_then(rung_sample_count)
            .unwrap_or(self.settings.sampling.samples_per_pixel())
    }

    /// Whether a setting can be rendered. A denoised setting needs enough samples.
    fn is_valid_setting(&self, setting: &RungSetting) -> bool {
        let (_, settings) = setting.apply(self.scene, &self.settings);
        !settings.denoise || denoise::can_denoise(settings.sampling)
    }
}

/// Returns the number of samples per pixel that a rung (quality level) of the samples ladder sets,
/// or `None` for another ladder.
fn rung_sample_count(choice: RungChoice) -> Option<u32> {
    let RungValue::Samples(samples) = choice.value() else {
        return None;
    };
    Some(samples)
}

#[cfg(test)]
mod tests;
