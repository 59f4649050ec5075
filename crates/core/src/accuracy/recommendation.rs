//! The report's first sentences: which setting halves the error, and which has the same error in
//! less time.

use super::estimate::{ConfidenceInterval, SettingErrors};
use super::measurements::RelativeCost;
use super::report::{Advice, MeasuredSetting, Recommendations};
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
    pub measured: MeasuredSetting,
    pub cost: RelativeCost,
    pub is_sound: bool,
}

/// Whether a setting may be advised. Its light must be right and its bias small, or both surely
/// better than those of the setting in use. A setting that differs in noise alone is always sound.
pub(super) fn is_sound(
    setting: &Setting,
    measured: &MeasuredSetting,
    own_measured: &MeasuredSetting,
) -> bool {
    let off = |light: &ConfidenceInterval| [light.low - 1.0, light.high - 1.0].map(f64::abs);
    let most_off = off(&measured.errors.light).into_iter().fold(0.0, f64::max);
    let has_light = most_off <= MOST_LIGHT
        || most_off
            < off(&own_measured.errors.light)
                .into_iter()
                .fold(f64::INFINITY, f64::min);
    let SettingErrors { bias, relmse, .. } = &measured.errors;
    let is_noise = bias.is_some_and(|bias| {
        let less = own_measured
            .errors
            .bias
            .is_some_and(|interval| bias.high < interval.low);
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
pub(super) fn recommend(mut all: Vec<AdviceCandidate>, budget: f64) -> Recommendations {
    all.retain(|candidate| candidate.setting != Setting::default() && candidate.is_sound);
    let length = |candidate: &AdviceCandidate| candidate.setting.choices().len();
    all.sort_by(|a, b| a.cost.time.value.total_cmp(&b.cost.time.value));
    let find = |[value, high]: [f64; 2], most_time: f64| {
        let promises = |candidate: &&AdviceCandidate| {
            candidate.cost.error.low > 0.0
                && candidate.cost.error.value <= value * value
                && candidate.cost.time.high <= most_time
        };
        let holds = |candidate: &&AdviceCandidate| candidate.cost.error.high <= high * high;
        let found_candidate = all.iter().filter(promises).find(holds).map(|fastest| {
            let is_near = |candidate: &&AdviceCandidate| {
                candidate.cost.time.value <= NEAR * fastest.cost.time.value
            };
            all.iter()
                .filter(promises)
                .filter(holds)
                .filter(is_near)
                .min_by_key(|candidate| length(candidate))
                .unwrap_or(fastest)
        });
        let advice = found_candidate.map(|candidate| Advice {
            flags: candidate.setting.flags(),
            time: candidate.cost.time,
            error: candidate.cost.error.map(f64::sqrt),
            measured: candidate.measured.clone(),
        });
        // Intervals shrink with the square root of the time.
        let needed = all.iter().filter(promises).map(|candidate| {
            let wide = libm::log(candidate.cost.error.high / candidate.cost.error.value)
                / libm::log(high * high / candidate.cost.error.value);
            wide * wide
        });
        let needed = needed.fold(f64::INFINITY, f64::min);
        let needed = (advice.is_none() && needed <= LONGEST).then_some(budget * needed);
        (advice, needed)
    };
    let (half, same) = (find(HALF, f64::INFINITY), find(SAME, SOONER));
    Recommendations {
        half_the_error: half.0,
        half_needs: half.1,
        same_error: same.0,
        same_needs: same.1,
    }
}

#[cfg(test)]
mod tests;
