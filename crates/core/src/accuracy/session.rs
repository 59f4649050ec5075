//! Stages of a measurement, each with its share of the time budget. The pilot pass over the tiles
//! comes first, then the choice of the reference's quality levels (rungs) and the plan. The
//! reference, every rung, combinations of rungs and costs of effects follow.

mod cost_measurements;
mod expected_cost;
mod feasible_rungs;
mod frontier_walks;
mod measurement_plan;
mod pareto_front;
mod planned_settings;
mod promising_settings;
mod recommended_timing;
mod reference_tiles;
mod report_rows;
mod rung_measurements;
mod rung_settings;
mod stage_results;
mod time_budget;

use std::time::Instant;

use super::measurements::Measurements;
use super::outputs::{OutputFormatReport, measure_output_formats};
use super::renderer::{ClockFunction, SettingRenderer};
use super::report::AccuracyReport;
use super::setting::RungSetting;
use super::tiles::TileSample;
use super::{AccuracyEffort, MeasureError, MeasurementStart, ProgressListener, ReusableReference};
use crate::bench::clock::Stopwatch;
use crate::dispatch::find_collapsed_objects;
use crate::display::Display;
use crate::effects::{EffectSet, assess_effects};
use crate::ladder::{Ladder, RungChoice, applicable_ladders, needed_effects};
use crate::observer::Observer;
use crate::prepare::PrepareError;
use crate::scene::Scene;
use crate::settings::Settings;

use rung_settings::rung_sample_count;
use stage_results::StageResults;
use time_budget::RUNGS_END;

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
    /// Creates a measurement whose time starts now.
    pub fn new(
        scene: &'a Scene,
        settings: &Settings,
        display: Display,
        effort: AccuracyEffort,
        observer: &'a dyn Observer,
        (stopwatch, now): (Stopwatch, ClockFunction<'a>),
    ) -> Self {
        let effects = assess_effects(scene, settings);
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

    /// Runs all stages of the measurement. Returns the report, and the reference for reuse.
    ///
    /// # Errors
    /// See [`MeasureError`].
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
        let (sample, reference_rungs) = self
            .choose_tiles_and_reference(&renderer, start.reference.as_ref(), listener)
            .map_err(|error| renderer.to_measure_error(error))?;
        let mut plan = self.make_plan(&sample);
        if let Some(kept_reference) = &start.reference {
            plan.reference_samples = plan
                .reference_samples
                .max(kept_reference.film.requested_samples().unwrap_or(0));
        }
        let mut reference = renderer.prepare_reference(
            &reference_rungs,
            plan.reference_samples,
            sample.grid,
            start,
            self.instant_of_budget_share(RUNGS_END),
        )?;
        let mut measurements = Measurements::new(&renderer, &sample, self.display);
        listener.report_step(&plan.description(&sample), self.spent_budget_share());
        self.render_pilots(&plan, &mut measurements)?;
        if !self.render_reference(&plan, &mut reference, &mut measurements) {
            return Err(renderer.to_measure_error(PrepareError::Cancelled));
        }
        let paired_settings = self.measure_rungs(&plan, &mut measurements, listener)?;
        let known_settings = self.measure_combinations(&plan, &mut measurements, listener)?;
        self.measure_promising_on_more_tiles(
            &known_settings,
            &mut measurements,
            &mut reference,
            listener,
        )?;
        // Output formats are measured before the stages that end by the clock, because their
        // duration follows from the number of pixels.
        let outputs = self.measure_outputs(&measurements);
        self.time_recommended_alternately(&known_settings, &mut measurements, listener)?;
        let results = StageResults {
            plan,
            reference_rungs,
            known_settings,
            paired_settings,
            outputs,
            prices: self.measure_rung_costs(&measurements, listener)?,
            costs: self.measure_effect_costs(listener)?,
        };
        let rungs = results.reference_rungs.choices().to_vec();
        let report = self
            .assemble_report(results, &measurements, &reference)
            .ok_or_else(|| renderer.to_measure_error(PrepareError::Cancelled))?;
        Ok((
            report,
            ReusableReference {
                rungs,
                film: reference.film,
            },
        ))
    }

    /// Measures every output format on the kept pictures of the scene's own setting.
    fn measure_outputs(&self, measurements: &Measurements<'_>) -> Vec<OutputFormatReport> {
        let [width, height] = self.settings.size.map(f64::from);
        measure_output_formats(
            &measurements.kept_pictures(&RungSetting::default()),
            width * height,
            self.display,
            self.settings.output,
            self.stopwatch,
        )
    }

    /// Runs the first stages, which time the tiles of the picture. Returns the drawn tiles, and the
    /// rungs (quality levels) of the reference. A kept reference decides the tiles' size and the
    /// rungs.
    fn choose_tiles_and_reference(
        &mut self,
        renderer: &SettingRenderer<'_>,
        kept_reference: Option<&ReusableReference>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(TileSample, RungSetting), PrepareError> {
        listener.report_step("timing the tiles of the picture", 0.0);
        let kept_edge = kept_reference.map(|reference| reference.film.tile_size());
        let grid = self.choose_tile_grid(renderer, kept_edge)?;
        let pilot_passes = self.run_pilot_passes(renderer, grid)?;
        listener.report_step(
            "choosing the quality levels of the reference",
            self.spent_budget_share(),
        );
        let feasible = self.find_feasible_rungs(renderer, grid, &pilot_passes)?;
        let rungs = kept_reference.map_or(feasible, |reference| {
            RungSetting::from_rungs(&reference.rungs)
        });
        Ok((TileSample::new(grid, &pilot_passes), rungs))
    }
}

#[cfg(test)]
mod tests;
