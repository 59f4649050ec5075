//! Recommendations of a report: the fastest setting with half the error of the scene's own setting,
//! and the fastest setting with the same error in less time.

use super::estimate::{ConfidenceInterval, SettingErrors};
use super::measurements::RelativeCost;
use super::report::{MeasuredSetting, Recommendation, Recommendations};
use super::setting::RungSetting;
use crate::ladder::Ladder;

/// Largest ratios of root errors that count as half the error. The first limits the estimate, the
/// second the upper end of its interval. Four times the samples halve noise within these limits.
const HALF: [f64; 2] = [0.55, 0.6];
/// Largest ratios of root errors that count as the same error. The first limits the estimate, the
/// second the upper end of its interval.
const SAME: [f64; 2] = [1.05, 1.05];
/// Largest ratio of times that counts as less time. It limits the upper end of the ratio's
/// interval.
const SOONER: f64 = 0.8;
/// Largest ratio of estimated squared bias to squared error of a recommended setting.
const MOST_BIAS: f64 = 0.25;
/// Largest ratio of squared bias to squared error, where the bias is at the upper end of its
/// confidence interval.
const SURE_BIAS: f64 = 0.5;
/// Largest relative difference between the summed radiance of a recommended setting and that of the
/// reference.
const MOST_LIGHT: f64 = 0.005;
/// Ratio of times up to which a setting counts as equally fast as the fastest. Of these settings,
/// the one with the fewest changes from the scene's own is recommended.
const NEAR: f64 = 1.1;
/// Largest needed time budget that a report names, as a multiple of the given budget.
const LONGEST: f64 = 60.0;

/// Measured setting that is considered for a recommendation.
#[derive(Clone, Debug)]
pub(super) struct RecommendationCandidate {
    pub setting: RungSetting,
    pub measured: MeasuredSetting,
    pub cost: RelativeCost,
    pub is_recommendable: bool,
}

/// Whether a setting may be recommended. A setting that differs from the scene's own only in noise
/// always may. Any other setting must satisfy two conditions:
///
/// - Its summed radiance equals the reference's, or is certainly closer to it than the scene's own.
/// - Its squared bias is small, or certainly smaller than the scene's own. This condition is waived
///   if denoising is the only biased change.
pub(super) fn is_recommendable(
    setting: &RungSetting,
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
    // The error of the denoiser falls with more samples as noise does, but the denoiser may change
    // the summed radiance.
    let is_filtered = setting.rung(Ladder::Reconstruction).is_some();
    let is_free = setting
        .without_ladder(Ladder::Reconstruction)
        .is_free_of_bias();
    if is_free && !is_filtered {
        true
    } else {
        has_light && (is_free || is_noise)
    }
}

/// Chooses the recommended settings among `all` measured ones. `budget` is the time budget of the
/// measurement in seconds.
pub(super) fn recommend_settings(
    mut all: Vec<RecommendationCandidate>,
    budget: f64,
) -> Recommendations {
    all.retain(|candidate| {
        candidate.setting != RungSetting::default() && candidate.is_recommendable
    });
    let length = |candidate: &RecommendationCandidate| candidate.setting.choices().len();
    all.sort_by(|a, b| a.cost.time.value.total_cmp(&b.cost.time.value));
    let find = |[value, high]: [f64; 2], most_time: f64| {
        let promises = |candidate: &&RecommendationCandidate| {
            candidate.cost.error.low > 0.0
                && candidate.cost.error.value <= value * value
                && candidate.cost.time.high <= most_time
        };
        let holds = |candidate: &&RecommendationCandidate| candidate.cost.error.high <= high * high;
        let found_candidate = all.iter().filter(promises).find(holds).map(|fastest| {
            let is_near = |candidate: &&RecommendationCandidate| {
                candidate.cost.time.value <= NEAR * fastest.cost.time.value
            };
            all.iter()
                .filter(promises)
                .filter(holds)
                .filter(is_near)
                .min_by_key(|candidate| length(candidate))
                .unwrap_or(fastest)
        });
        let advice = found_candidate.map(|candidate| Recommendation {
            flags: candidate.setting.flags(),
            time: candidate.cost.time,
            error: candidate.cost.error.map(f64::sqrt),
            measured: candidate.measured.clone(),
        });
        // The width of an interval falls with the square root of the time.
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

impl Recommendations {
    /// Whether a setting is one of the recommended ones.
    pub(super) fn contains(&self, setting: &RungSetting) -> bool {
        let recommended = [&self.half_the_error, &self.same_error];
        let flags = setting.flags();
        recommended
            .into_iter()
            .flatten()
            .any(|recommendation| recommendation.flags == flags)
    }
}

#[cfg(test)]
mod tests;
