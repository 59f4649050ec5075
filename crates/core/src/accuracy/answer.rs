//! The report's first sentences: which setting halves the error, and which has the same error in
//! less time.

use super::estimate::{Errors, Interval};
use super::measurements::RelativeCost;
use super::report::{Advice, Answer, Measured};
use super::setting::Setting;
use crate::ladder::Ladder;

/// Bounds on the ratio of errors that counts as half: of the estimate, and of its interval's upper
/// end. Four times the samples halve noise.
const HALF: [f64; 2] = [0.55, 0.6];
/// Bounds on the ratio that counts as the same error: of the estimate, and of its interval's upper
/// end.
const SAME: [f64; 2] = [1.05, 1.05];
/// Bound on the ratio of times that counts as less time, for the interval's upper end.
const SOONER: f64 = 0.8;
/// Largest share of bias in the squared error.
const MOST_BIAS: f64 = 0.25;
/// Largest share of bias by the upper end of its interval.
const SURE_BIAS: f64 = 0.5;
/// Largest relative change of the picture's total light.
const MOST_LIGHT: f64 = 0.005;
/// Largest ratio of times at which a simpler setting is named instead of a faster one.
const NEAR: f64 = 1.1;
/// Largest ratio of the needed budget to the given one that the report names.
const LONGEST: f64 = 60.0;

/// A setting considered as advice.
#[derive(Clone, Debug)]
pub(super) struct AdviceCandidate {
    pub setting: Setting,
    pub measured: Measured,
    pub cost: RelativeCost,
    pub is_sound: bool,
}

/// Whether a setting may be advised. Its light must be right and its bias small, or both surely
/// better than those of the setting in use. A setting that differs in noise alone is always sound.
pub(super) fn is_sound(setting: &Setting, measured: &Measured, own: &Measured) -> bool {
    let off = |light: &Interval| [light.low - 1.0, light.high - 1.0].map(f64::abs);
    let most_off = off(&measured.errors.light).into_iter().fold(0.0, f64::max);
    let has_light = most_off <= MOST_LIGHT
        || most_off
            < off(&own.errors.light)
                .into_iter()
                .fold(f64::INFINITY, f64::min);
    let Errors { bias, relmse, .. } = &measured.errors;
    let is_noise = bias.is_some_and(|bias| {
        let less = own.errors.bias.is_some_and(|own| bias.high < own.low);
        less || bias.value <= MOST_BIAS * relmse.value && bias.high <= SURE_BIAS * relmse.value
    });
    // The error of a filter falls with more samples as noise does, but the filter may change the
    // light.
    let is_filtered = setting.rung(Ladder::Reconstruction).is_some();
    let is_free = setting.without(Ladder::Reconstruction).is_free_of_bias();
    if is_free && !is_filtered {
        true
    } else {
        has_light && (is_free || is_noise)
    }
}

/// Chooses among measured settings. `budget` is the time of the measurement in seconds.
pub(super) fn answer(mut all: Vec<AdviceCandidate>, budget: f64) -> Answer {
    all.retain(|of| of.setting != Setting::default() && of.is_sound);
    let length = |of: &AdviceCandidate| of.setting.choices().len();
    all.sort_by(|a, b| a.cost.time.value.total_cmp(&b.cost.time.value));
    let find = |[value, high]: [f64; 2], most_time: f64| {
        let promises = |of: &&AdviceCandidate| {
            of.cost.error.low > 0.0
                && of.cost.error.value <= value * value
                && of.cost.time.high <= most_time
        };
        let holds = |of: &&AdviceCandidate| of.cost.error.high <= high * high;
        let found = all.iter().filter(promises).find(holds).map(|fastest| {
            let is_near =
                |of: &&AdviceCandidate| of.cost.time.value <= NEAR * fastest.cost.time.value;
            all.iter()
                .filter(promises)
                .filter(holds)
                .filter(is_near)
                .min_by_key(|of| length(of))
                .unwrap_or(fastest)
        });
        let advice = found.map(|of| Advice {
            flags: of.setting.flags(),
            time: of.cost.time,
            error: of.cost.error.map(f64::sqrt),
            measured: of.measured.clone(),
        });
        // Intervals shrink with the square root of the time.
        let needed = all.iter().filter(promises).map(|of| {
            let wide = libm::log(of.cost.error.high / of.cost.error.value)
                / libm::log(high * high / of.cost.error.value);
            wide * wide
        });
        let needed = needed.fold(f64::INFINITY, f64::min);
        let needed = (advice.is_none() && needed <= LONGEST).then_some(budget * needed);
        (advice, needed)
    };
    let (half, same) = (find(HALF, f64::INFINITY), find(SAME, SOONER));
    Answer {
        half_the_error: half.0,
        half_needs: half.1,
        same_error: same.0,
        same_needs: same.1,
    }
}

#[cfg(test)]
mod tests;
