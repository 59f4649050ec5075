//! Measurement of promising settings on more tiles. More tiles reveal the settings that look good
//! only by chance.

use super::expected_cost::ROUNDS;
use super::time_budget::REFINEMENT_END;
use super::{HALVING_SAMPLES, MeasurementSession};
use crate::accuracy::ProgressListener;
use crate::accuracy::measurements::Measurements;
use crate::accuracy::renderer::IncrementalReference;
use crate::accuracy::setting::RungSetting;
use crate::prepare::PrepareError;

/// Factor by which the number of tiles grows per step, and with it the expected time.
const GROWTH: f64 = 1.3;
/// Largest number of promising settings that are measured on more tiles.
const MOST_AGAIN: usize = 6;

impl MeasurementSession<'_> {
    /// Measures promising settings on more tiles, in chunks of growing size, or with more renders
    /// per tile if all tiles were measured. More tiles reveal the settings that look good only by
    /// chance.
    pub(super) fn measure_promising_on_more_tiles(
        &mut self,
        settings: &[RungSetting],
        measurements: &mut Measurements<'_>,
        reference: &mut IncrementalReference<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(), PrepareError> {
        let own_setting = RungSetting::default();
        let chosen_settings = self.promising_settings(settings, measurements);
        let (sample, end) = (
            measurements.sample,
            self.instant_of_budget_share(REFINEMENT_END),
        );
        let mut tiles = measurements.reference_tile_count();
        if sample.covers_picture(tiles) {
            return self.measure_on_all_tiles(&chosen_settings, measurements, listener);
        }
        while tiles < sample.drawable_tile_count() {
            let next =
                ((tiles as f64 * GROWTH) as usize).clamp(tiles + 1, sample.drawable_tile_count());
            let before = (self.now)();
            listener.report_step(
                &format!(
                    "measuring promising settings, now on {next} of the picture's {} tiles",
                    sample.grid.tile_count()
                ),
                self.spent_budget_share(),
            );
            self.add_reference_tiles(reference, measurements, next, end);
            if measurements.reference_tile_count() < next {
                break;
            }
            for setting in &chosen_settings {
                let tiles = self.setting_tile_count(setting, next, sample);
                if !measurements.measure_setting(
                    setting,
                    (tiles, self.round_count(setting)),
                    None,
                    *setting == own_setting,
                    end,
                )? {
                    return Ok(());
                }
            }
            tiles = next;
            if sample.covers_picture(tiles) {
                return self.measure_on_all_tiles(&chosen_settings, measurements, listener);
            }
            // The time of the next chunk grows with its size.
            if (self.now)() + ((self.now)() - before).mul_f64(GROWTH) > end {
                break;
            }
        }
        Ok(())
    }

    /// Returns the settings to be measured on more tiles: the scene's own, common sample counts,
    /// the settings recommended so far, and further settings on the Pareto front.
    fn promising_settings(
        &self,
        settings: &[RungSetting],
        measurements: &Measurements<'_>,
    ) -> Vec<RungSetting> {
        let own_setting = RungSetting::default();
        let recommendations = self.recommend_settings(settings, measurements);
        let mut others = self.pareto_settings(settings, measurements);
        others.sort_by_key(|setting| !recommendations.contains(setting));
        let maximum = HALVING_SAMPLES.saturating_mul(self.settings.sampling.samples_per_pixel());
        others.retain(|setting| *setting != own_setting && self.sample_count(setting) <= maximum);
        others.truncate(MOST_AGAIN);
        let mut chosen_settings = vec![own_setting];
        for setting in self
            .common_sample_settings()
            .into_iter()
            .filter(|setting| settings.contains(setting))
            .chain(others)
        {
            if !chosen_settings.contains(&setting) {
                chosen_settings.push(setting);
            }
        }
        chosen_settings
    }

    /// Measures each setting on the tiles that it lacks, then with more renders per tile. Slow
    /// settings have fewer tiles than fast settings.
    fn measure_on_all_tiles(
        &self,
        settings: &[RungSetting],
        measurements: &mut Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(), PrepareError> {
        let (tiles, grid, end) = (
            measurements.reference_tile_count(),
            measurements.sample.grid,
            self.instant_of_budget_share(REFINEMENT_END),
        );
        for setting in settings {
            let lacking = tiles - measurements.measured_tile_count(setting).min(tiles);
            if lacking > 0
                && self.expected_seconds(setting, lacking, &grid)
                    < self.seconds_until_budget_share(REFINEMENT_END)
            {
                listener.report_step(
                    &format!("on more tiles: {setting}"),
                    self.spent_budget_share(),
                );
                measurements.measure_setting(
                    setting,
                    (tiles, self.round_count(setting)),
                    None,
                    false,
                    end,
                )?;
            }
        }
        let once = |setting: &RungSetting| {
            self.expected_seconds(setting, tiles, &grid) / self.round_count(setting) as f64
        };
        let once: f64 = settings.iter().map(once).sum();
        for rounds in (ROUNDS + 1..=u64::from(self.effort.rounds)).rev() {
            if once * (rounds as f64) < self.seconds_until_budget_share(REFINEMENT_END) {
                for setting in settings {
                    listener.report_step(
                        &format!("repeating the renders of {setting}"),
                        self.spent_budget_share(),
                    );
                    measurements.measure_setting(
                        setting,
                        (tiles, rounds),
                        None,
                        *setting == RungSetting::default(),
                        end,
                    )?;
                }
                break;
            }
        }
        Ok(())
    }
}
