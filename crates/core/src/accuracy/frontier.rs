//! Greedy search for combinations of rungs (quality levels) on the Pareto front of time and error.
//! A walk starts at a setting and changes one rung per step, towards less time or towards less
//! error. Each step is predicted from measurements in which a single rung was changed.

use std::collections::BTreeMap;

use super::setting::RungSetting;
use crate::ladder::{Ladder, RungChoice};

/// Time and error of a setting, the coordinates of the Pareto front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrontierPoint {
    /// Render time in seconds, above zero.
    pub time: f64,
    /// Relative mean squared error (`relmse` of the report), at least zero.
    pub error: f64,
}

/// Largest number of steps of a search towards less time, and of a search towards less error.
const LONGEST_WALK: usize = 12;
/// Least predicted relative gain, in time or in error, for which a step is taken.
const WORTH: f64 = 0.02;

/// Rungs (quality levels) of one ladder, with the time and error measured when only this ladder
/// changes.
#[derive(Clone, Debug)]
pub(super) struct LadderSteps {
    pub ladder: Ladder,
    /// Rungs (quality levels) from fast to exact, with time and error. `None` stands for the value
    /// in the scene, which need not be a rung.
    pub rungs: Vec<(Option<RungChoice>, FrontierPoint)>,
    /// Index in `rungs` of the rung (quality level) at which the search starts.
    pub start: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum WalkDirection {
    Faster,
    MoreExact,
}

/// Measurement of the settings that the greedy search visits. Tests replace it by a formula.
pub(super) trait SettingMeasurer {
    /// Whether a setting can be rendered.
    fn is_valid_setting(&self, setting: &RungSetting) -> bool;
    /// Returns the time and error of a setting, or `None` if the time has run out.
    fn measure_setting(&mut self, setting: &RungSetting) -> Option<FrontierPoint>;
    /// Whether `setting` may be recommended and is certainly better than `other`: faster or more
    /// exact, depending on the direction. The search continues only from a better setting.
    fn is_certain_improvement(
        &self,
        setting: &RungSetting,
        other: &RungSetting,
        direction: WalkDirection,
    ) -> bool;
}

/// Walks from a setting towards less time and towards less error. Returns all measured settings
/// with their time and error.
pub(super) fn walk_frontier(
    steps: &[LadderSteps],
    (start, point): (&RungSetting, FrontierPoint),
    surveyor: &mut dyn SettingMeasurer,
) -> Vec<(RungSetting, FrontierPoint)> {
    let mut found = Vec::new();
    for direction in [WalkDirection::Faster, WalkDirection::MoreExact] {
        let mut walk = FrontierWalk {
            steps,
            positions: steps.iter().map(|s| (s.ladder, s.start)).collect(),
            point,
            setting: start.clone(),
        };
        let mut rejected_steps: Vec<(Ladder, usize)> = Vec::new();
        for _ in 0..LONGEST_WALK {
            let Some((ladder, rung)) = walk.choose_step(direction, &rejected_steps) else {
                break;
            };
            let setting = walk.setting_with_rung_at(ladder, rung);
            if !surveyor.is_valid_setting(&setting) {
                rejected_steps.push((ladder, rung));
                continue;
            }
            let Some(point) = surveyor.measure_setting(&setting) else {
                return found;
            };
            found.push((setting.clone(), point));
            if surveyor.is_certain_improvement(&setting, &walk.setting, direction) {
                walk.positions.insert(ladder, rung);
                (walk.setting, walk.point) = (setting, point);
            } else {
                rejected_steps.push((ladder, rung));
            }
        }
    }
    found
}

/// State of the greedy search in one direction: current setting, its time and error, and the index
/// of the current rung (quality level) per ladder.
struct FrontierWalk<'a> {
    steps: &'a [LadderSteps],
    positions: BTreeMap<Ladder, usize>,
    setting: RungSetting,
    point: FrontierPoint,
}

impl FrontierWalk<'_> {
    /// Returns the current setting with one ladder changed to the rung (quality level) of this
    /// index.
    fn setting_with_rung_at(&self, ladder: Ladder, rung: usize) -> RungSetting {
        let choice = self
            .steps
            .iter()
            .find(|steps| steps.ladder == ladder)
            .and_then(|steps| steps.rungs[rung].0);
        choice.map_or_else(
            || self.setting.without_ladder(ladder),
            |choice| self.setting.with_rung(choice),
        )
    }

    /// Returns the next step of the search as a ladder and the index of its new rung (quality
    /// level). Of the neighbouring rungs of all ladders, it has the largest predicted ratio of gain
    /// to price, both as logarithms. Rungs in `rejected_steps` are skipped, because they were tried
    /// before.
    fn choose_step(
        &self,
        direction: WalkDirection,
        rejected_steps: &[(Ladder, usize)],
    ) -> Option<(Ladder, usize)> {
        let worth = |steps: &LadderSteps| {
            let position = *self.positions.get(&steps.ladder)?;
            let next = match direction {
                WalkDirection::Faster => position.checked_sub(1)?,
                WalkDirection::MoreExact => {
                    Some(position + 1).filter(|&next| next < steps.rungs.len())?
                }
            };
            let (from, to) = (steps.rungs[position].1, steps.rungs[next].1);
            let time = to.time / from.time;
            // Mean squared errors of independent causes add up.
            let error = (self.point.error + to.error - from.error).max(1e-3 * self.point.error)
                / self.point.error.max(1e-300);
            let (gain, price) = match direction {
                WalkDirection::Faster => (1.0 / time, error),
                WalkDirection::MoreExact => (1.0 / error, time),
            };
            let promising = gain > 1.0 + WORTH && !rejected_steps.contains(&(steps.ladder, next));
            promising.then(|| {
                (
                    libm::log(gain) / libm::log(price).max(1e-3),
                    steps.ladder,
                    next,
                )
            })
        };
        let best = self
            .steps
            .iter()
            .filter_map(worth)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, ladder, rung)| (ladder, rung))
    }
}

/// Largest relative difference of two times, and of two errors, that counts as equal. Clocks and
/// noise do not resolve smaller differences.
const SAME_TIME: f64 = 0.03;
const SAME_ERROR: f64 = 0.02;

/// Returns the indices of the points on the Pareto front, by ascending time. A point is left out if
/// another point is better in time or error and at least equal in the other coordinate. Of equal
/// points the first remains.
pub(super) fn pareto_front_indices(points: &[FrontierPoint]) -> Vec<usize> {
    let beaten = |i: usize| {
        let p = points[i];
        points.iter().enumerate().any(|(j, q)| {
            let at_most =
                q.time <= p.time * (1.0 + SAME_TIME) && q.error <= p.error * (1.0 + SAME_ERROR);
            let less =
                q.time < p.time * (1.0 - SAME_TIME) || q.error < p.error * (1.0 - SAME_ERROR);
            at_most && (less || j < i)
        })
    };
    let mut order: Vec<usize> = (0..points.len()).filter(|&i| !beaten(i)).collect();
    order.sort_by(|&a, &b| points[a].time.total_cmp(&points[b].time));
    order
}

#[cfg(test)]
mod tests;
