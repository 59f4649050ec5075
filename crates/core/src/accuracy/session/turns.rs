//! Times of the settings in the report's first sentences, measured in turns.

use std::time::{Duration, Instant};

use super::super::Listener;
use super::super::measurements::Measurements;
use super::super::setting::Setting;
use super::{Session, TURNS};
use crate::prepare::PrepareError;

/// Most settings timed in turns besides the named ones. The best of many settings is partly the one
/// timed at the best moment.
const MOST: usize = 6;
/// Turns for which time is planned.
const PLANNED: f64 = 4.0;

/// Shares of the time for turns at which each pass ends; a pass may change the named setting.
const PASSES: [f64; 3] = [0.5, 0.7, 1.0];

impl Session<'_> {
    /// Times the setting in use, the named settings and their closest competitors in turns; then
    /// the settings that are named instead.
    pub(super) fn turns(
        &self,
        known: &[Setting],
        measurements: &mut Measurements<'_>,
        listener: &mut dyn Listener,
    ) -> Result<(), PrepareError> {
        let (begun, all) = ((self.now)(), self.left(TURNS));
        for (pass, share) in PASSES.into_iter().enumerate() {
            let mut contestants =
                self.contestants(known, measurements, if pass == 0 { MOST } else { 0 });
            contestants.retain(|setting| !measurements.is_timed_in_turns(setting));
            if contestants.is_empty() {
                break;
            }
            listener.step(
                &format!("times of {} settings in turns", contestants.len()),
                self.spent(),
            );
            let end = begun + Duration::from_secs_f64(share * all);
            self.turns_until(end, contestants, measurements)?;
        }
        Ok(())
    }

    /// Times as many of these settings in turns as time allows, the first ones first, on as many
    /// tiles as fit.
    fn turns_until(
        &self,
        end: Instant,
        settings: Vec<Setting>,
        measurements: &mut Measurements<'_>,
    ) -> Result<(), PrepareError> {
        let (grid, left) = (
            measurements.sample.grid,
            end.saturating_duration_since((self.now)()).as_secs_f64(),
        );
        let planned = |setting: &Setting, tiles: usize| {
            let tiles = if measurements.is_rendered_whole(setting) {
                measurements.tiles(setting)
            } else {
                tiles
            };
            PLANNED * self.expected(setting, tiles, &grid) / self.rounds(setting) as f64
        };
        let mut chosen = vec![Setting::default()];
        let own = planned(&chosen[0], measurements.tiles(&chosen[0])) / PLANNED;
        let mut spent = own + planned(&chosen[0], 1);
        for setting in settings {
            let cost = planned(&setting, 1);
            if spent + cost < left && !chosen.contains(&setting) {
                spent += cost;
                chosen.push(setting);
            }
        }
        let of = |tiles: usize| {
            own + chosen
                .iter()
                .map(|setting| planned(setting, tiles))
                .sum::<f64>()
        };
        let tiles = (1..=measurements.known())
            .rev()
            .find(|&tiles| of(tiles) < left)
            .unwrap_or(1);
        measurements.time_in_turns(&chosen, tiles, end)
    }

    /// Returns the settings named beside the setting in use, and some of the Pareto front.
    fn contestants(
        &self,
        known: &[Setting],
        measurements: &Measurements<'_>,
        most: usize,
    ) -> Vec<Setting> {
        let answer = self.answer(known, measurements);
        let named = [&answer.half_the_error, &answer.same_error]
            .into_iter()
            .flatten()
            .map(|advice| advice.flags.clone());
        let named: Vec<Vec<String>> = named.collect();
        let is_named = |setting: &&Setting| named.contains(&setting.flags());
        let mut chosen: Vec<Setting> = known.iter().filter(is_named).cloned().collect();
        chosen.extend(self.unbeaten(known, measurements).into_iter().take(most));
        chosen
    }
}
