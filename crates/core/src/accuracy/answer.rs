//! What a reader wants to know first: which setting has half of the error, and which has the same error sooner.

use super::report::{Advice, Answer};
use super::setting::Setting;

/// Half of an error is at most this share of it: four times the samples halve it, give or take what noise the measurement has.
const HALF: f64 = 0.55;
/// The same error is at most this share of it.
const SAME: f64 = 1.05;
/// Less time is at most this share of it.
const SOONER: f64 = 0.8;

/// A setting beside the scene's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RelativeCost {
    /// Its time over that of the scene's own: the median of the rounds that both have.
    pub time: f64,
    /// The greatest of them; infinite where less than two say how far they may be apart.
    pub most_time: f64,
    /// Its mean squared error over that of the scene's own.
    pub error: f64,
}

/// Chooses among measured settings. A setting is sooner if every round says so.
pub(super) fn answer(settings: impl Iterator<Item = (Setting, RelativeCost)>) -> Answer {
    let mut all: Vec<(Setting, RelativeCost)> = settings.filter(|(setting, _)| *setting != Setting::default()).collect();
    // Of settings that take as long, the simpler one.
    all.sort_by(|(a, p), (b, q)| p.time.total_cmp(&q.time).then(a.choices().len().cmp(&b.choices().len())));
    let fastest = |most_error: f64, most_time: f64| {
        let is_right = |of: &RelativeCost| of.error <= most_error * most_error && of.most_time <= most_time;
        let (setting, of) = all.iter().find(|(_, of)| is_right(of))?;
        Some(Advice { flags: setting.flags(), time: of.time, error: of.error.sqrt() })
    };
    Answer { half_the_error: fastest(HALF, f64::INFINITY), same_error: fastest(SAME, SOONER) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ladder::Choice;

    fn cost(time: f64, root: f64) -> RelativeCost {
        RelativeCost { time, most_time: time, error: root * root }
    }

    fn setting(rung: &str, time: f64, root: f64) -> (Setting, RelativeCost) {
        (Setting::one(Choice::parse(rung).expect("a rung")), cost(time, root))
    }

    /// Protects: half of the error is named by the fastest setting that has it, the same error by the fastest that is clearly sooner, each
    /// with its own figures; the scene's own setting is no advice, and where nothing will do there is none.
    #[test]
    fn the_fastest_that_will_do_is_named() {
        let own = (Setting::default(), cost(1.0, 1.0));
        let all = [
            own.clone(),
            setting("samples=1024", 16.0, 0.25),
            setting("samples=256", 4.1, 0.52),
            setting("clamp=10", 0.7, 1.2),
            setting("sampler=stratified", 0.9, 0.9),
            setting("reconstruction=denoised", 0.25, 1.04),
            setting("light-sampling=lights", 0.3, 0.8),
        ];
        let found = answer(all.into_iter());
        let told = |advice: Option<Advice>| advice.map(|advice| (advice.flags.concat(), advice.time, advice.error));
        assert_eq!(told(found.half_the_error), Some(("--rung samples=256".to_owned(), 4.1, 0.52)));
        assert_eq!(told(found.same_error), Some(("--rung reconstruction=denoised".to_owned(), 0.25, 1.04)));
        assert_eq!(answer([own, setting("clamp=10", 0.7, 1.2), setting("build=high", 0.9, 0.9)].into_iter()), Answer::default());
    }

    /// Protects: what only some rounds say to be sooner, or a single one, is no advice; half of the error is one by its median.
    #[test]
    fn one_quick_round_is_no_advice() {
        let with = |name: &str, most_time: f64, root: f64| {
            let (setting, of) = setting(name, 0.5, root);
            (setting, RelativeCost { most_time, ..of })
        };
        for most_time in [0.9, f64::INFINITY] {
            let found = answer([with("clamp=10", most_time, 1.0), with("samples=64", most_time, 0.5)].into_iter());
            assert_eq!((found.same_error, found.half_the_error.map(|half| half.time)), (None, Some(0.5)));
        }
        assert!(answer([with("clamp=10", 0.8, 1.0)].into_iter()).same_error.is_some());
    }
}
