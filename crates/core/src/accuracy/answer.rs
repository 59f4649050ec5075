//! What a reader wants to know first: which setting has half of the error, and which has the same error sooner.

use super::frontier::Point;
use super::report::{Advice, Answer};
use super::setting::Setting;

/// Half of an error is at most this share of it: four times the samples halve it, give or take what noise the measurement has.
const HALF: f64 = 0.55;
/// The same error is at most this share of it.
const SAME: f64 = 1.05;
/// Less time is at most this share of it.
const SOONER: f64 = 0.8;

/// Chooses among measured settings, each with time and squared error over those of the scene's own.
pub(super) fn answer(settings: impl Iterator<Item = (Setting, Point)>) -> Answer {
    let mut all: Vec<(Setting, Point)> = settings.filter(|(setting, _)| *setting != Setting::default()).collect();
    // Of settings that take as long, the simpler one.
    all.sort_by(|(a, p), (b, q)| p.time.total_cmp(&q.time).then(a.choices().len().cmp(&b.choices().len())));
    let fastest = |most_error: f64, most_time: f64| {
        let is_right = |point: &Point| point.error <= most_error * most_error && point.time <= most_time;
        let (setting, point) = all.iter().find(|(_, point)| is_right(point))?;
        Some(Advice { flags: setting.flags(), time: point.time, error: point.error.sqrt() })
    };
    Answer { half_the_error: fastest(HALF, f64::INFINITY), same_error: fastest(SAME, SOONER) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ladder::Choice;

    fn setting(rung: &str, time: f64, root: f64) -> (Setting, Point) {
        (Setting::one(Choice::parse(rung).expect("a rung")), Point { time, error: root * root })
    }

    /// Protects: half of the error is named by the fastest setting that has it, the same error by the fastest that is clearly sooner, each
    /// with its own figures; the scene's own setting is no advice, and where nothing will do there is none.
    #[test]
    fn the_fastest_that_will_do_is_named() {
        let own = (Setting::default(), Point { time: 1.0, error: 1.0 });
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
}
