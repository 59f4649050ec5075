//! Assembly of the report from the results of all stages.

use super::MeasurementSession;
use super::measurement_plan::MeasurementPlan;
use crate::accuracy::EffectCosts;
use crate::accuracy::measurements::Measurements;
use crate::accuracy::outputs::OutputFormatReport;
use crate::accuracy::renderer::IncrementalReference;
use crate::accuracy::report::{AccuracyReport, LadderCostReport, ReferenceReport, TileReport};
use crate::accuracy::setting::RungSetting;
use crate::accuracy::tiles::TileSample;
use crate::ladder::Ladder;

/// Results of the stages, besides the measurements of settings.
pub(super) struct StageResults {
    pub plan: MeasurementPlan,
    /// Rungs (quality levels) of the reference.
    pub reference_rungs: RungSetting,
    /// All measured settings.
    pub known_settings: Vec<RungSetting>,
    /// Settings that were compared with another setting under the same random numbers, each with
    /// its ladder.
    pub paired_settings: Vec<(RungSetting, Ladder)>,
    pub outputs: Vec<OutputFormatReport>,
    /// Time and memory of rungs that do not change the picture.
    pub prices: Vec<LadderCostReport>,
    /// Costs of the scene's effects; `None` if the time did not suffice.
    pub costs: Option<EffectCosts>,
}

impl MeasurementSession<'_> {
    /// Returns the report of the whole measurement; `None` if the scene's own setting was not
    /// measured.
    pub(super) fn assemble_report(
        &self,
        results: StageResults,
        measurements: &Measurements<'_>,
        reference: &IncrementalReference<'_>,
    ) -> Option<AccuracyReport> {
        let own_setting = RungSetting::default();
        let own = measurements.summarise_setting(&own_setting, &own_setting)?;
        let (frontier, recommendations) =
            self.frontier_report(&results.known_settings, measurements);
        Some(AccuracyReport {
            size: self.settings.size,
            tiles: tile_report(measurements.sample, own.tiles),
            reference: ReferenceReport {
                samples: results.plan.reference_samples,
                rungs: results.reference_rungs.flags(),
                tiles: measurements.reference_tile_count(),
                standard_error: measurements.reference_standard_error(),
                seconds: reference.seconds,
                kept: reference.is_reused(),
            },
            recommendations,
            outputs: results.outputs,
            own,
            base: self.baseline_report(measurements),
            ladders: self
                .picture_ladders
                .iter()
                .map(|&ladder| self.ladder_report(ladder, measurements, &results.paired_settings))
                .collect(),
            combinations: self.combination_reports(&results.known_settings, measurements),
            prices: results.prices,
            not_called_for: self.unneeded_ladder_names(),
            costs: results.costs,
            frontier,
            pictures: self.report_pictures(measurements, &reference.film),
            seconds: self.elapsed(),
            cut_short: self.cut_short || self.observer.is_cancelled(),
        })
    }

    /// Returns the names of the ladders that the scene does not call for.
    fn unneeded_ladder_names(&self) -> Vec<&'static str> {
        Ladder::ALL
            .into_iter()
            .filter(|ladder| {
                !self.picture_ladders.contains(ladder)
                    && !self.cost_ladders.contains(ladder)
                    && *ladder != Ladder::Output
            })
            .map(Ladder::name)
            .collect()
    }
}

/// Returns the report on the tiles of a sample, of which the scene's own setting was measured on
/// the first `measured`.
fn tile_report(sample: &TileSample, measured: usize) -> TileReport {
    let first = sample.grid.tile_crop(sample.passes[0].tile);
    TileReport {
        edge: sample.grid.edge,
        measured,
        all: sample.grid.tile_count(),
        shown: [first.x, first.y],
    }
}
