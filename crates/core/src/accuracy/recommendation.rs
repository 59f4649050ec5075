//! The settings on the Pareto front of time and error, and the recommended ones among the settings
//! of a report.

use super::estimate::{ConfidenceInterval, NORMAL, RESOLUTION, SettingErrors};
use super::report::{MeasuredSetting, Recommendation, Recommendations};
use super::setting::RungSetting;
use crate::ladder::Ladder;

/// Largest ratio of root errors that counts as the same error, and as half the error: what two seeds
/// of one setting differ by. Four times the samples halve noise within it
/// (`benches/runs/2026-11-27-advice.md`, as all limits of this file).
const SAME: f64 = 1.0 + NORMAL * RESOLUTION;
pub(super) const HALF: f64 = 0.5 * SAME;
/// Factors on these limits that the upper end of an interval may reach: of certain advice, and of
/// advice of the same error.
const DOUBT: [f64; 2] = [1.1, 1.3];
/// Largest ratio of times that counts as less time.
const SOONER: f64 = 0.8;
/// Largest ratios of squared bias to squared error of a recommended setting: of the estimate, and of
/// the upper end of its interval.
const MOST_BIAS: [f64; 2] = [0.25, 0.5];
/// Largest relative difference between the summed radiance of a recommended setting and that of the
/// reference.
const MOST_LIGHT: f64 = 0.005;

/// Measured setting that is considered for a recommendation.
#[derive(Clone, Debug)]
pub(super) struct RecommendationCandidate {
    pub setting: RungSetting,
    pub measured: MeasuredSetting,
    /// Squared error over that of the setting in use.
    pub error: ConfidenceInterval,
    pub is_recommendable: bool,
}

/// Whether a setting may be recommended. A setting that differs from the scene's own only in noise
/// always may. Any other setting must satisfy two conditions:
///
/// - Its summed radiance equals the reference's, or is certainly closer to it than the scene's own.
/// - Its squared bias is small, or certainly smaller than the scene's own. This condition is waived
///   if denoising is the only biased change: the claim of a denoised picture contains its bias.
pub(super) fn is_recommendable(
    setting: &RungSetting,
    measured: &MeasuredSetting,
    own_measured: &MeasuredSetting,
) -> bool {
    let off = |light: &ConfidenceInterval| [light.low - 1.0, light.high - 1.0].map(f64::abs);
    let most_off = off(&measured.errors.light).into_iter().fold(0.0, f64::max);
    let own_off = off(&own_measured.errors.light)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let has_light = most_off <= MOST_LIGHT || most_off < own_off;
    let SettingErrors { bias, relmse, .. } = &measured.errors;
    let is_noise = bias.is_some_and(|bias| {
        let own_bias = own_measured.errors.bias;
        own_bias.is_some_and(|own| bias.high < own.low)
            || bias.value <= MOST_BIAS[0] * relmse.value && bias.high <= MOST_BIAS[1] * relmse.value
    });
    let is_denoised = setting.rung(Ladder::Reconstruction).is_some();
    match setting
        .without_ladder(Ladder::Reconstruction)
        .is_free_of_bias()
    {
        true => has_light || !is_denoised,
        false => has_light && is_noise,
    }
}

/// Returns the places of the settings on the Pareto front of time and error, by ascending time: of
/// the recommendable ones with known errors, and of the one in use. A setting is left out if another
/// is better in time or error and at least equal in the other. Of equal settings the one with the
/// fewest changes remains.
pub(super) fn pareto_front(candidates: &[RecommendationCandidate]) -> Vec<usize> {
    let point = |at: usize| {
        let measured = &candidates[at].measured;
        [measured.seconds.value, measured.errors.relmse.value]
    };
    let changes = |at: usize| candidates[at].setting.choices().len();
    let is_eligible = |&at: &usize| {
        let candidate = &candidates[at];
        let error = candidate.error.map(f64::sqrt);
        changes(at) == 0 || candidate.is_recommendable && error.is_known()
    };
    let mut order: Vec<usize> = (0..candidates.len()).filter(is_eligible).collect();
    order.sort_by_key(|&at| changes(at));
    let is_beaten = |place: usize| {
        let own = point(order[place]);
        order.iter().enumerate().any(|(other, &at)| {
            let other_point = point(at);
            let limit = |i: usize, sign: f64| own[i] * (1.0 + sign * RESOLUTION);
            let at_most = (0..2).all(|i| other_point[i] <= limit(i, 1.0));
            let less = (0..2).any(|i| other_point[i] < limit(i, -1.0));
            at_most && (less || other < place)
        })
    };
    let mut front: Vec<usize> = (0..order.len())
        .filter(|&at| !is_beaten(at))
        .map(|at| order[at])
        .collect();
    front.sort_by(|&a, &b| point(a)[0].total_cmp(&point(b)[0]));
    front
}

/// Chooses the recommended settings: from the front, and a faster one with bias from all. An error is
/// about half if the estimate is, since an error on the front is known; it is the same if its upper
/// end is, too.
pub(super) fn recommend_settings(
    candidates: &[RecommendationCandidate],
    front: &[usize],
) -> Recommendations {
    let is_within = |candidate: &&RecommendationCandidate, limit: f64, doubt: f64| {
        let error = candidate.error.map(f64::sqrt);
        candidate.setting != RungSetting::default()
            && error.value <= limit
            && error.high <= doubt * limit
    };
    let advice = |candidate: &RecommendationCandidate, limit: f64| Recommendation {
        flags: candidate.setting.flags(),
        time: candidate.measured.ratio,
        error: candidate.error.map(f64::sqrt),
        certain: is_within(&candidate, limit, DOUBT[0]),
        measured: candidate.measured.clone(),
    };
    let time = |candidate: &RecommendationCandidate| candidate.measured.ratio.value;
    let mut all = front.iter().map(|&at| &candidates[at]);
    let half = all.clone().find(|of| is_within(of, HALF, f64::INFINITY));
    let same = all.find(|of| is_within(of, SAME, DOUBT[1]) && time(of) <= SOONER);
    let faster = |limit: f64, than: f64| {
        let biased = candidates.iter().filter(|of| !of.is_recommendable);
        biased
            .filter(|of| is_within(of, limit, DOUBT[1]) && time(of) <= SOONER * than)
            .min_by(|a, b| time(a).total_cmp(&time(b)))
    };
    let biased = faster(SAME, same.map_or(1.0, time));
    let biased = biased.or_else(|| faster(HALF, half.map(time)?));
    Recommendations {
        half_the_error: half.map(|of| advice(of, HALF)),
        same_error: same.map(|of| advice(of, SAME)),
        biased: biased.map(|of| advice(of, SAME)),
    }
}

#[cfg(test)]
mod tests;
