//! Greedy walks and Pareto fronts of points with known time and error.

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
        let [new, old] = [setting, other].map(|setting| (self.truth)(setting).expect("measured"));
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
    let front = pareto_front_indices(&found.iter().map(|(_, point)| *point).collect::<Vec<_>>());
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
