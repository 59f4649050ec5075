//! What a reader wants to know first: which setting has half of the error, and which has the same
//! error sooner.

use super::estimate::{Errors, Interval};
use super::measurements::RelativeCost;
use super::report::{Advice, Answer, Measured};
use super::setting::Setting;
use crate::ladder::Ladder;

/// Half of an error is at most this share of it, and by its interval at most the second: four times
/// the samples halve noise.
const HALF: [f64; 2] = [0.55, 0.6];
/// The same error is at most this share of it, by its interval too.
const SAME: [f64; 2] = [1.05, 1.05];
/// Less time is at most this share of it, by its interval.
const SOONER: f64 = 0.8;
/// What does not go away with more samples may be at most this share of a squared error.
const MOST_BIAS: f64 = 0.25;
/// By its interval it may be at most this.
const SURE_BIAS: f64 = 0.5;
/// Light may change by this share.
const MOST_LIGHT: f64 = 0.005;
/// A simpler setting that takes up to so many times as long is named instead.
const NEAR: f64 = 1.1;
/// A measurement that would take longer than so many times its budget is not promised.
const LONGEST: f64 = 60.0;

/// A setting beside the scene's own.
#[derive(Clone, Debug)]
pub(super) struct AdviceCandidate {
    pub setting: Setting,
    pub measured: Measured,
    pub cost: RelativeCost,
    pub is_sound: bool,
}

/// Whether a setting may be advised: it has the picture's light and little error that more samples
/// leave, as surely as was measured, or surely less of both kinds of fault than the setting in use,
/// or it differs from that in noise alone.
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
    // A filter's error goes away with more samples as noise does, but it may take light with it.
    let is_filtered = setting.rung(Ladder::Reconstruction).is_some();
    let is_free = setting.without(Ladder::Reconstruction).is_free_of_bias();
    if is_free && !is_filtered {
        true
    } else {
        has_light && (is_free || is_noise)
    }
}

/// Chooses among measured settings; `budget` in seconds is what they had.
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
        // Intervals shrink with the root of the time.
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
