//! Plan of a measurement, made once from the speed of the pilot pass. It contains the number of
//! samples of the reference, and the number of tiles on which each setting is measured at first.
//!
//! Every plan has the same settings in the same order. It reserves twice their expected time, so
//! that no setting is dropped when the machine becomes slower. The remaining time goes to more
//! tiles for promising settings.

use super::MeasurementSession;
use super::expected_cost::{FEWEST, FILTER, MOST_REFERENCE};
use super::time_budget::REFERENCE_END;
use crate::accuracy::measurements::Measurements;
use crate::accuracy::pilot::PilotPicturePair;
use crate::accuracy::renderer::UnfinishedRender;
use crate::accuracy::tiles::TileSample;
use crate::prepare::PrepareError;

/// Largest share of the time budget that samples of the reference beyond the necessary number may
/// take.
const SPARE: f64 = 0.1;
/// Share of the tiles on which settings of less important ladders are measured if the time is
/// short.
const REST: f64 = 1.0 / 3.0;
/// Largest share of the time budget for the two pilots, noisy whole pictures.
const BOTH_PILOTS: f64 = 0.16;

/// Plan of a measurement: samples of the reference, and numbers of tiles and settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasurementPlan {
    /// Samples per pixel of the reference.
    pub reference_samples: u32,
    /// Number of tiles of the most important settings; slow settings get fewer.
    pub tiles: usize,
    /// Number of tiles of all other settings.
    pub secondary_tiles: usize,
    /// Number of planned settings.
    settings: usize,
}

impl MeasurementPlan {
    /// Returns the description of the plan that the progress listener shows.
    pub(super) fn description(&self, sample: &TileSample) -> String {
        let Self {
            reference_samples,
            tiles,
            settings,
            secondary_tiles: rest,
            ..
        } = self;
        let rest = if rest < tiles {
            format!("{rest} or ")
        } else {
            String::new()
        };
        format!(
            "plan: {settings} settings on {rest}{tiles} of {} tiles, reference of {reference_samples} samples",
            sample.grid.tile_count()
        )
    }
}

impl MeasurementSession<'_> {
    /// Returns the plan for the tiles of this sample.
    pub(super) fn make_plan(&self, sample: &TileSample) -> MeasurementPlan {
        let grid = &sample.grid;
        let (tile_sample, budget) = (
            self.tile_sample_seconds(grid),
            self.effort.budget.as_secs_f64(),
        );
        let mut reference_samples = self.minimum_reference_samples();
        let fitting = self.affordable_tile_count(grid, 1.0);
        // If nearly all tiles fit, all are measured.
        let is_all = fitting + fitting / 4 >= sample.drawable_tile_count();
        let enough = |tiles: usize| tiles.max(FEWEST).min(sample.drawable_tile_count());
        let tiles = if is_all {
            sample.drawable_tile_count()
        } else {
            enough(self.affordable_tile_count(grid, REST))
        };
        let rest = if is_all {
            tiles
        } else {
            enough((tiles as f64 * REST) as usize)
        };
        if sample.covers_picture(tiles) {
            let whole = tile_sample * self.reference_time_ratio * tiles as f64;
            while reference_samples < MOST_REFERENCE
                && 4.0 * f64::from(reference_samples) * whole < SPARE * budget
            {
                reference_samples *= 4;
            }
        }
        MeasurementPlan {
            reference_samples,
            tiles,
            secondary_tiles: rest,
            settings: self.planned_settings().len(),
        }
    }

    /// Renders the pilots, two noisy whole pictures, with as many samples as their share of the
    /// time allows. No pilots are needed if all tiles are measured, or no setting is denoised.
    pub(super) fn render_pilots(
        &self,
        plan: &MeasurementPlan,
        measurements: &mut Measurements<'_>,
    ) -> Result<(), PrepareError> {
        let is_needed = self
            .planned_settings()
            .iter()
            .any(|item| measurements.is_denoised(&item.setting));
        if !is_needed || measurements.sample.covers_picture(plan.tiles) {
            return Ok(());
        }
        measurements.whole_samples = self.whole_picture_samples();
        let own = self.settings.sampling.samples_per_pixel();
        let cost = 2.0 * self.whole_picture_seconds(1) / FILTER;
        let maximum =
            ((BOTH_PILOTS * self.effort.budget.as_secs_f64() / cost.max(1e-12)) as u32).min(own);
        if maximum < 2 {
            return Ok(());
        }
        // Low-discrepancy sequences are most uniform at powers of two.
        let samples = 1 << maximum.ilog2();
        let render = |round| {
            UnfinishedRender::none_if_interrupted(measurements.renderer.render_pilot(
                samples,
                round,
                self.instant_of_budget_share(REFERENCE_END),
            ))
        };
        if let (Some(one), Some(other)) = (render(0)?, render(1)?) {
            measurements.pilots = Some(PilotPicturePair([one, other]));
        }
        Ok(())
    }
}
