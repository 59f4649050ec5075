//! Times of what the first sentence names, taken in turns.

use std::time::{Duration, Instant};

use super::super::Listener;
use super::super::measurements::Measurements;
use super::super::setting::Setting;
use super::{Session, TURNS};
use crate::prepare::PrepareError;

/// Settings beside those that are named which are timed in turns at most: the best of many is
/// partly the one that was timed at the best moment.
const MOST: usize = 6;
/// Turns that there is to be time for.
const PLANNED: f64 = 4.0;

/// The share of the time for all turns that each pass may take: what is named then may be another
/// one.
const PASSES: [f64; 3] = [0.5, 0.7, 1.0];

impl Session<'_> {
    /// Times the setting in use, what is named beside it, and what else comes near, in turns; and
    /// then what is named in their place.
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

    /// Times those of these settings in turns that there is time for, the first ones first, on as
    /// many tiles as fit.
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

    /// What is named beside the setting in use, and so many of those that none beats.
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
