//! Choice of the settings that are timed by rendering them alternately: the recommended settings
//! and their closest competitors.

use std::time::{Duration, Instant};

use super::super::ProgressListener;
use super::super::measurements::Measurements;
use super::super::setting::RungSetting;
use super::MeasurementSession;
use super::time_budget::TURNS_END;
use crate::prepare::PrepareError;

/// Largest number of settings that are timed alternately besides the recommended ones. An earlier
/// time may be too short only because the machine was fast at that moment.
const MOST: usize = 6;
/// Number of turns (one render of each setting) for which time is reserved.
const PLANNED: f64 = 4.0;

/// Progress of the stage at which each of its three passes ends, as a fraction of the stage's time.
/// If a pass changes the recommended setting, the next pass times the new one.
const PASSES: [f64; 3] = [0.5, 0.7, 1.0];

impl MeasurementSession<'_> {
    /// Times the scene's own setting, the recommended settings and their closest competitors by
    /// rendering them alternately. If the recommendation changes, the newly recommended settings
    /// are timed too.
    pub(super) fn time_recommended_alternately(
        &self,
        settings: &[RungSetting],
        measurements: &mut Measurements<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<(), PrepareError> {
        let (begun, all) = ((self.now)(), self.seconds_until_budget_share(TURNS_END));
        for (pass, share) in PASSES.into_iter().enumerate() {
            let mut contestants = self.recommended_and_pareto_settings(
                settings,
                measurements,
                if pass == 0 { MOST } else { 0 },
            );
            contestants.retain(|setting| !measurements.was_timed_alternately(setting));
            if contestants.is_empty() {
                break;
            }
            listener.report_step(
                &format!("timing {} settings alternately", contestants.len()),
                self.spent_budget_share(),
            );
            let end = begun + Duration::from_secs_f64(share * all);
            self.time_affordable_alternately(end, contestants, measurements)?;
        }
        Ok(())
    }

    /// Times the first settings of the list by rendering them alternately. Their number and the
    /// number of tiles are as large as the time until `end` permits.
    fn time_affordable_alternately(
        &self,
        end: Instant,
        settings: Vec<RungSetting>,
        measurements: &mut Measurements<'_>,
    ) -> Result<(), PrepareError> {
        let (grid, left) = (
            measurements.sample.grid,
            end.saturating_duration_since((self.now)()).as_secs_f64(),
        );
        let planned = |setting: &RungSetting, tiles: usize| {
            let tiles = if measurements.is_rendered_as_whole_picture(setting) {
                measurements.measured_tile_count(setting)
            } else {
                tiles
            };
            PLANNED * self.expected_seconds(setting, tiles, &grid)
                / self.round_count(setting) as f64
        };
        let mut chosen_settings = vec![RungSetting::default()];
        let own = planned(
            &chosen_settings[0],
            measurements.measured_tile_count(&chosen_settings[0]),
        ) / PLANNED;
        let mut spent = own + planned(&chosen_settings[0], 1);
        for setting in settings {
            let cost = planned(&setting, 1);
            if spent + cost < left && !chosen_settings.contains(&setting) {
                spent += cost;
                chosen_settings.push(setting);
            }
        }
        let value_of = |tiles: usize| {
            own + chosen_settings
                .iter()
                .map(|setting| planned(setting, tiles))
                .sum::<f64>()
        };
        let tiles = (1..=measurements.reference_tile_count())
            .rev()
            .find(|&tiles| value_of(tiles) < left)
            .unwrap_or(1);
        measurements.time_settings_alternately(&chosen_settings, tiles, end)
    }

    /// Returns the recommended settings and the first `maximum` settings of the Pareto front.
    fn recommended_and_pareto_settings(
        &self,
        settings: &[RungSetting],
        measurements: &Measurements<'_>,
        maximum: usize,
    ) -> Vec<RungSetting> {
        let recommendations = self.recommend_settings(settings, measurements);
        let is_named = |setting: &&RungSetting| recommendations.contains(setting);
        let mut chosen_settings: Vec<RungSetting> =
            settings.iter().filter(is_named).cloned().collect();
        chosen_settings.extend(
            self.pareto_settings(settings, measurements)
                .into_iter()
                .take(maximum),
        );
        chosen_settings
    }
}
