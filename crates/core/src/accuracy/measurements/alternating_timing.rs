//! Timing of settings by rendering them alternately, several times. The speed of a machine changes
//! within a minute. So a ratio of two times is reliable only if both were measured shortly after
//! one another.

use std::time::Instant;

use super::super::estimate::ConfidenceInterval;
use super::super::renderer::{TimedRender, UnfinishedRender};
use super::super::setting::RungSetting;
use super::{Measurements, SettingMeasurements};
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Largest number of turns, followed by the least number that gives an estimate. In a turn, each
/// setting is rendered once.
const MOST_TURNS: usize = 5;
const FEWEST_TURNS: usize = 3;
/// Half width of the 95 % interval of a mean, divided by half the range of its samples. The three
/// values hold for three, four and five samples. They are Student's factor, with the standard
/// deviation estimated from the range.
const WIDENING: [f64; 3] = [2.9, 1.54, 1.07];
/// Factor by which the ratio of two settings' times may be wrong if they could not be rendered
/// alternately.
const UNSURE: f64 = 1.5;

impl Measurements<'_> {
    /// Times settings by rendering them alternately, with the random numbers of their first render.
    ///
    /// - A setting is rendered on its first tiles, or as a whole picture if it was measured so.
    /// - Times are relative to the first setting of the list. If this setting has such times from
    ///   an earlier call, the new times are scaled to them.
    /// - Without time for three turns (renders of all settings), no time is stored, and the
    ///   settings count as uncertain.
    pub fn time_settings_alternately(
        &mut self,
        settings: &[RungSetting],
        tiles: usize,
        end: Instant,
    ) -> Result<(), PrepareError> {
        self.has_timed_in_turns = true;
        let mut turns: Vec<Vec<f64>> = Vec::new();
        while turns.len() < MOST_TURNS {
            let turn = settings
                .iter()
                .map(|setting| self.repeat_render_time_ratio(setting, tiles, end));
            let Some(turn) = turn.collect::<Result<Option<Vec<f64>>, PrepareError>>()? else {
                break;
            };
            turns.push(turn);
        }
        if turns.len() < FEWEST_TURNS {
            return Ok(());
        }
        let Some(first) = settings
            .first()
            .and_then(|first| self.find_setting_measurements(first))
        else {
            return Ok(());
        };
        let (earlier, has_more) = (
            first.turn_ratios.clone(),
            first.whole_seconds.is_none() && first.tiles.len() > tiles,
        );
        let mut scale = 1.0;
        if has_more && earlier.is_empty() {
            // The times of single tiles were derived from their numbers of rays. Only the time of
            // all tiles together was measured.
            let all = self
                .repeat_render_time_ratio(&settings[0], first.tiles.len(), end)?
                .unwrap_or(1.0);
            scale = all / median_with_interval(turns.iter().map(|turn| turn[0]).collect()).value;
        }
        for (i, setting) in settings.iter().enumerate() {
            let Some(figures) = self
                .setting_measurements
                .iter_mut()
                .find(|figures| figures.setting == *setting)
            else {
                continue;
            };
            figures.turn_ratios = match &earlier[..] {
                [] => turns.iter().map(|turn| scale * turn[i]).collect(),
                earlier => turns
                    .iter()
                    .zip(earlier)
                    .map(|(turn, first)| first * turn[i] / turn[0])
                    .collect(),
            };
        }
        Ok(())
    }

    /// Whether the times of a setting were measured by rendering it alternately with other
    /// settings.
    pub fn was_timed_alternately(&self, setting: &RungSetting) -> bool {
        self.find_setting_measurements(setting)
            .is_some_and(|figures| !figures.turn_ratios.is_empty())
    }

    /// Whether a setting was rendered as a whole picture, not in tiles.
    pub fn is_rendered_as_whole_picture(&self, setting: &RungSetting) -> bool {
        self.find_setting_measurements(setting)
            .is_some_and(|figures| figures.whole_seconds.is_some())
    }

    /// Renders a setting again on its first tiles. Returns the new time divided by the time of the
    /// setting's first render. `None` if the time limit `end` is reached.
    fn repeat_render_time_ratio(
        &self,
        setting: &RungSetting,
        tiles: usize,
        end: Instant,
    ) -> Result<Option<f64>, PrepareError> {
        let Some(figures) = self.find_setting_measurements(setting) else {
            return Ok(None);
        };
        let (parts, before) = match figures.whole_seconds {
            Some(seconds) => (Vec::new(), seconds),
            None => {
                let tiles = tiles.min(figures.tiles.len());
                let parts: Vec<Crop> = (0..tiles)
                    .map(|position| self.crop_for_tile(setting, position))
                    .collect();
                (
                    parts,
                    figures.tiles[..tiles]
                        .iter()
                        .map(|tile| tile.first_seconds)
                        .sum(),
                )
            }
        };
        let Some(renders) = UnfinishedRender::none_if_interrupted(
            self.renderer.render_setting(setting, &parts, 0, end),
        )?
        else {
            return Ok(None);
        };
        let share = |position: usize| match parts.get(position) {
            Some(part) => self.tile_area_share(position, *part),
            None => 1.0,
        };
        let seconds = |(position, render): (usize, &TimedRender)| share(position) * render.seconds;
        let after: f64 = renders.iter().enumerate().map(seconds).sum();
        // A clock may be too coarse for a tiny picture.
        Ok((before > 0.0 && after > 0.0).then(|| after / before))
    }

    /// Returns a factor for the ratio of two settings' times, with its interval. The factor
    /// corrects the ratio for changes of the machine's speed between the two measurements.
    pub(super) fn speed_correction_of_time_ratio(
        &self,
        figures: &SettingMeasurements,
        other: &SettingMeasurements,
    ) -> ConfidenceInterval {
        match (&figures.turn_ratios[..], &other.turn_ratios[..]) {
            ([], []) if self.has_timed_in_turns => ConfidenceInterval {
                value: 1.0,
                low: 1.0 / UNSURE,
                high: UNSURE,
            },
            ([], []) => ConfidenceInterval::from_exact(1.0),
            ([], turns) => interval_from_one_to_median_ratio(turns.iter().map(|drift| 1.0 / drift)),
            (turns, []) => interval_from_one_to_median_ratio(turns.iter().copied()),
            (turns, others) => median_with_interval(
                turns
                    .iter()
                    .zip(others)
                    .map(|(of, other)| of / other)
                    .collect(),
            ),
        }
    }

    /// Returns a factor that corrects a setting's time for changes of the machine's speed. A
    /// setting that was not rendered alternately with others has the factor of the scene's own
    /// setting.
    pub(super) fn speed_correction_of_time(
        &self,
        figures: &SettingMeasurements,
    ) -> ConfidenceInterval {
        if !figures.turn_ratios.is_empty() {
            return median_with_interval(figures.turn_ratios.clone());
        }
        let own = self
            .find_setting_measurements(&RungSetting::default())
            .map_or(&[][..], |own_figures| &own_figures.turn_ratios[..]);
        if own.is_empty() {
            return ConfidenceInterval::from_exact(1.0);
        }
        let drift = interval_from_one_to_median_ratio(own.iter().copied());
        ConfidenceInterval {
            value: if drift.low < 1.0 {
                drift.low
            } else {
                drift.high
            },
            ..drift
        }
    }
}

/// Returns the median of at least three time ratios, one per turn (a render of each setting). The
/// confidence interval follows from their range and number.
fn median_with_interval(mut turns: Vec<f64>) -> ConfidenceInterval {
    turns.sort_by(f64::total_cmp);
    let (middle, last) = (turns.len() / 2, turns.len() - 1);
    let value = if turns.len() % 2 == 1 {
        turns[middle]
    } else {
        0.5 * (turns[middle - 1] + turns[middle])
    };
    let widening = WIDENING[(turns.len() - FEWEST_TURNS).min(WIDENING.len() - 1)];
    let factor = libm::exp(0.5 * widening * libm::log(turns[last] / turns[0]));
    ConfidenceInterval {
        value,
        low: value / factor,
        high: value * factor,
    }
}

/// Returns a factor that corrects the ratio of two times if only one setting was rendered
/// alternately with others. The true factor lies between 1 and the median of `turns`, the time
/// ratios of that setting.
fn interval_from_one_to_median_ratio(turns: impl Iterator<Item = f64>) -> ConfidenceInterval {
    let drift = median_with_interval(turns.collect()).value;
    ConfidenceInterval {
        value: 1.0,
        low: drift.min(1.0),
        high: drift.max(1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: turns give their median with an interval that is wide for few turns. A setting
    /// that was not timed again may have drifted as far as another one.
    #[test]
    fn few_turns_say_little() {
        let three = median_with_interval(vec![1.2, 0.9, 1.0]);
        let five = median_with_interval(vec![1.2, 0.9, 1.0, 1.0, 1.1]);
        assert_eq!((three.value, five.value), (1.0, 1.0));
        assert!(
            three.low < 0.7 && three.high > 1.5 && five.low > 0.8 && five.high < 1.2,
            "{three:?} {five:?}"
        );
        assert_eq!(
            median_with_interval(vec![0.5; 4]),
            ConfidenceInterval::from_exact(0.5)
        );
        assert_eq!(
            interval_from_one_to_median_ratio([1.5, 1.25, 2.0].into_iter()),
            ConfidenceInterval {
                value: 1.0,
                low: 1.0,
                high: 1.5
            }
        );
        assert_eq!(
            interval_from_one_to_median_ratio([0.5; 3].into_iter()),
            ConfidenceInterval {
                value: 1.0,
                low: 0.5,
                high: 1.0
            }
        );
    }

    /// Protects: with times that are off by a tenth at random, the interval of turns contains the
    /// truth in at least nine of ten cases.
    #[test]
    fn intervals_of_turns_hold() {
        let uniform = |index: u64| (crate::hash::splitmix64(index) >> 11) as f64 / 2_f64.powi(53);
        for turns in 3..=5_u64 {
            let held = |case: &u64| {
                let time = |turn: u64| {
                    1.0 + 0.2
                        * (uniform(100 * case + 2 * turn) + uniform(100 * case + 2 * turn + 1)
                            - 1.0)
                };
                let interval = median_with_interval((0..turns).map(time).collect());
                interval.low <= 1.0 && 1.0 <= interval.high
            };
            let count = (0..1000).filter(held).count();
            assert!(
                (900..=995).contains(&count),
                "{count} of 1000 by {turns} turns"
            );
        }
    }
}
