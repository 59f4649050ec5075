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
mod tests {
    use super::*;

    fn point(time: f64, error: f64) -> FrontierPoint {
        FrontierPoint { time, error }
    }

    /// Protects: exactly the points that no other beats in both time and error remain, in any
    /// order; of two equal points, one remains.
    #[test]
    fn only_the_unbeaten_stay() {
        let points = [
            point(4.0, 1.0),
            point(1.0, 9.0),
            point(2.0, 9.0),
            point(2.0, 4.0),
            point(3.0, 5.0),
            point(4.0, 1.0),
        ];
        assert_eq!(pareto_front_indices(&points), [1, 3, 0]);
        // Points that a clock cannot separate: the first remains, although it is a little slower.
        assert_eq!(
            pareto_front_indices(&[point(1.02, 1.0), point(1.0, 1.01), point(1.0, 0.9)]),
            [2]
        );
        assert_eq!(
            pareto_front_indices(&[point(1.02, 1.0), point(1.0, 1.01)]),
            [0]
        );
        assert_eq!(pareto_front_indices(&[]), [0_usize; 0]);
    }

    /// Samples with noise 1/n, and a ladder of light sampling: half the time costs an error of
    /// 10⁻⁹, twice the time saves 10⁻³.
    fn steps() -> Vec<LadderSteps> {
        let samples = Ladder::Samples.choices().map(|choice| {
            let n: f64 = choice.rung().parse().expect("a number");
            ((n != 16.0).then_some(choice), point(n, 1.0 / n + 0.001))
        });
        let ways = [
            point(8.0, 0.001 + 1e-9),
            point(16.0, 0.001),
            point(32.0, 0.0),
        ];
        let lights = Ladder::LightSampling
            .choices()
            .zip(ways)
            .map(|(choice, at)| ((at.time != 16.0).then_some(choice), at));
        vec![
            LadderSteps {
                ladder: Ladder::Samples,
                rungs: samples.collect(),
                start: 2,
            },
            LadderSteps {
                ladder: Ladder::LightSampling,
                rungs: lights.collect(),
                start: 1,
            },
        ]
    }

    /// The true points of combined rungs.
    fn truth(setting: &RungSetting) -> FrontierPoint {
        let n = setting
            .rung(Ladder::Samples)
            .map_or(16.0, |c| c.rung().parse().expect("a number"));
        let (factor, own) = match setting.rung(Ladder::LightSampling).map(|c| c.rung()) {
            Some("scattering") => (0.5, 0.001 + 1e-9),
            Some("both") => (2.0, 0.0),
            _ => (1.0, 0.001),
        };
        point(n * factor, 1.0 / n + own)
    }

    /// Surveyor that records its queries and answers by a rule: impossible settings, and a least
    /// share of a certain gain.
    struct RuleSurveyor<'a> {
        requested: Vec<String>,
        truth: &'a dyn Fn(&RungSetting) -> Option<FrontierPoint>,
        impossible: &'a [&'a str],
        sure: f64,
    }

    impl<'a> RuleSurveyor<'a> {
        fn of(truth: &'a dyn Fn(&RungSetting) -> Option<FrontierPoint>) -> Self {
            Self {
                requested: Vec::new(),
                truth,
                impossible: &[],
                sure: 1.0,
            }
        }
    }

    impl SettingMeasurer for RuleSurveyor<'_> {
        fn is_valid_setting(&self, setting: &RungSetting) -> bool {
            setting
                .rung(Ladder::Samples)
                .is_none_or(|samples| !self.impossible.contains(&samples.rung()))
        }

        fn measure_setting(&mut self, setting: &RungSetting) -> Option<FrontierPoint> {
            self.requested.push(setting.to_string());
            (self.truth)(setting)
        }

        fn is_certain_improvement(
            &self,
            setting: &RungSetting,
            other: &RungSetting,
            direction: WalkDirection,
        ) -> bool {
            let [new, old] =
                [setting, other].map(|setting| (self.truth)(setting).expect("measured"));
            match direction {
                WalkDirection::Faster => new.time < self.sure * old.time,
                WalkDirection::MoreExact => new.error < self.sure * old.error,
            }
        }
    }

    /// Protects: towards less time, the rung without an error is taken first. Towards less error,
    /// more samples precede the other ladder, whose gain would be half of the remaining error in
    /// the end. The walk ends at the ends of its ladders.
    #[test]
    fn walks_take_what_gives_most() {
        let known = |setting: &RungSetting| Some(truth(setting));
        let mut rule = RuleSurveyor::of(&known);
        let found = walk_frontier(
            &steps(),
            (&RungSetting::default(), point(16.0, 0.0635)),
            &mut rule,
        );
        let requested = rule.requested;
        assert_eq!(
            requested[..3],
            [
                "light-sampling=scattering",
                "light-sampling=scattering samples=4",
                "light-sampling=scattering samples=1"
            ]
        );
        assert_eq!(
            requested[3..],
            [
                "samples=64",
                "samples=256",
                "samples=1024",
                "light-sampling=both samples=1024"
            ]
        );
        assert_eq!(found.len(), requested.len());
        let front =
            pareto_front_indices(&found.iter().map(|(_, point)| *point).collect::<Vec<_>>());
        assert!(front.len() >= 5, "{found:?}");
    }

    /// Protects: a walk may start at another setting and keeps its rungs in the first steps; the
    /// scene's own sample count is a step like any other.
    #[test]
    fn walks_begin_where_they_are_told() {
        let mut steps = steps();
        steps[0].start = 1;
        let four = RungSetting::from_rung(RungChoice::parse("samples=4").expect("a rung"));
        let known = |setting: &RungSetting| Some(truth(setting));
        let mut rule = RuleSurveyor::of(&known);
        walk_frontier(&steps, (&four, truth(&four)), &mut rule);
        let requested = rule.requested;
        assert_eq!(
            requested[..2],
            [
                "light-sampling=scattering samples=4",
                "light-sampling=scattering samples=1"
            ]
        );
        assert_eq!(requested[2..5], ["as it is", "samples=64", "samples=256"]);
    }

    /// Protects: impossible settings are neither measured nor continued from; the walk takes the
    /// other ladder's steps.
    #[test]
    fn walks_go_around_what_is_impossible() {
        let known = |setting: &RungSetting| Some(truth(setting));
        let mut rule = RuleSurveyor {
            impossible: &["1", "256"],
            ..RuleSurveyor::of(&known)
        };
        walk_frontier(
            &steps(),
            (&RungSetting::default(), point(16.0, 0.0635)),
            &mut rule,
        );
        assert_eq!(
            rule.requested,
            [
                "light-sampling=scattering",
                "light-sampling=scattering samples=4",
                "samples=64",
                "light-sampling=both samples=64"
            ]
        );
    }

    /// Protects: an uncertain step is not taken and not tried twice; a walk ends where time is out.
    #[test]
    fn walks_end_without_time_or_certain_steps() {
        let known = |setting: &RungSetting| Some(truth(setting));
        let mut rule = RuleSurveyor {
            sure: 0.2,
            ..RuleSurveyor::of(&known)
        };
        let found = walk_frontier(
            &steps(),
            (&RungSetting::default(), point(16.0, 0.0635)),
            &mut rule,
        );
        // Faster: both ladders once; more exact: samples once, since lights promise too little.
        assert_eq!(
            (rule.requested.len(), found.len()),
            (3, 3),
            "{:?}",
            rule.requested
        );
        assert!(
            walk_frontier(
                &steps(),
                (&RungSetting::default(), point(16.0, 0.0635)),
                &mut RuleSurveyor::of(&|_| None)
            )
            .is_empty()
        );
    }
}
