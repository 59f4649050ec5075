//! Measurement of every planned setting, in the order of the plan.

use super::MeasurementSession;
use super::measurement_plan::MeasurementPlan;
use super::planned_settings::PlannedSetting;
use super::time_budget::RUNGS_END;
use crate::accuracy::ProgressListener;
use crate::accuracy::measurements::Measurements;
use crate::accuracy::renderer::UnfinishedRender;
use crate::accuracy::setting::RungSetting;
use crate::ladder::Ladder;
use crate::prepare::PrepareError;

/// Largest share of the remaining time that a single setting may take.
const MOST_OF_REST: f64 = 0.35;

impl MeasurementSession<'_> {
    /// Measures every setting of the plan. Returns the settings that were compared with another
    /// setting under the same random numbers, each with its ladder.
    pub(super) fn measure_rungs(
        &mut self,
        plan: &MeasurementPlan,
        measurements: &mut Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<Vec<(RungSetting, Ladder)>, PrepareError> {
        let mut pairs = Vec::new();
        if measurements.sample.covers_picture(plan.tiles) {
            // The first picture of a size also includes the time of memory allocation, so it is not
            // measured.
            let first = measurements.renderer.render_setting(
                &RungSetting::default(),
                &[],
                0,
                self.instant_of_budget_share(RUNGS_END),
            );
            UnfinishedRender::none_if_interrupted(first)?;
        }
        for (i, item) in self.planned_settings().into_iter().enumerate() {
            let (
                is_telling,
                PlannedSetting {
                    setting,
                    ladder,
                    compared_setting: beside,
                    keeps_pictures: is_kept,
                },
            ) = (item.has_important_ladder(), item);
            listener.report_step(&setting.to_string(), self.spent_budget_share());
            let tiles = if is_telling {
                plan.tiles
            } else {
                plan.secondary_tiles
            };
            let tiles = self.setting_tile_count(&setting, tiles, measurements.sample);
            let left = self.seconds_until_budget_share(RUNGS_END);
            let expected = self.expected_seconds(&setting, tiles, &measurements.sample.grid);
            if i > 0 && expected > MOST_OF_REST * left {
                // This setting would take the time of many others, and perhaps not finish.
                self.cut_short = true;
                continue;
            }
            // Without the scene's own picture the report is empty, so this picture may take all
            // remaining time.
            let end = self.instant_of_budget_share(if i == 0 { 1.0 } else { RUNGS_END });
            let rounds = self.round_count(&setting);
            self.cut_short |= !measurements.measure_setting(
                &setting,
                (tiles, rounds),
                beside.as_ref(),
                is_kept,
                end,
            )?;
            if beside.is_some() {
                pairs.push((setting, ladder));
            }
        }
        Ok(pairs)
    }
}
