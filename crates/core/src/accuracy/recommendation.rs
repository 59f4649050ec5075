//! The settings on the Pareto front of time and error, and the recommended ones among the settings
//! of a report.

use super::estimate::{ConfidenceInterval, NORMAL, RESOLUTION, SettingErrors};
use super::report::{MeasuredSetting, Recommendation, Recommendations};
use crate::ladder::Ladder;

/// Largest ratio of root errors that counts as the same error, and as half the error: what two seeds
/// of one setting differ by. Four times the samples halve noise within it
/// (`benches/runs/2026-11-27-advice.md`, as all limits of this file).
const SAME: f64 = 1.0 + NORMAL * RESOLUTION;
const HALF: f64 = 0.5 * SAME;
/// Factors on these limits that the upper end of an interval may reach: of certain advice, and of
/// advice of the same error.
const DOUBT: [f64; 2] = [1.1, 1.3];
/// Largest ratio of times that counts as less time.
const SOONER: f64 = 0.8;
/// Largest ratios of bias to error of a recommended setting: of the estimate, and of the upper end of
/// its interval.
const MOST_BIAS: [f64; 2] = [0.5, 0.7];
/// Largest relative difference between the summed radiance of a recommended setting and that of the
/// reference.
const MOST_LIGHT: f64 = 0.005;

/// Whether a setting may be recommended. A setting that differs from the scene's own only in noise
/// always may. Any other setting must satisfy two conditions:
///
/// - Its summed radiance equals the reference's, or is certainly closer to it than the scene's own.
/// - Its bias is small, or certainly smaller than the scene's own. This condition is waived
///   if denoising is the only biased change: the claim of a denoised picture contains its bias.
pub(super) fn is_recommendable(measured: &MeasuredSetting, own_measured: &MeasuredSetting) -> bool {
    let setting = &measured.setting;
    let off = |light: &ConfidenceInterval| [light.low - 1.0, light.high - 1.0].map(f64::abs);
    let most_off = off(&measured.errors.light).into_iter().fold(0.0, f64::max);
    let own_off = off(&own_measured.errors.light)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let has_light = most_off <= MOST_LIGHT || most_off < own_off;
    let SettingErrors {
        bias, root_relmse, ..
    } = &measured.errors;
    let is_noise = bias.is_some_and(|bias| {
        let own_bias = own_measured.errors.bias;
        own_bias.is_some_and(|own| bias.high < own.low)
            || [bias.value, bias.high]
                .iter()
                .zip(MOST_BIAS)
                .all(|(bias, most)| *bias <= most * root_relmse.value)
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

/// Returns the rows of the settings on the Pareto front of time and error, by ascending time: of the
/// recommendable ones with known errors, and of the one in use, which is the first. A setting is left
/// out if another is better in time or error and at least equal in the other. Of equal settings the
/// one with the fewest changes remains.
pub(super) fn pareto_front(settings: &[MeasuredSetting]) -> Vec<usize> {
    let point = |row: usize| {
        let measured = &settings[row];
        [measured.seconds.value, measured.errors.root_relmse.value]
    };
    let changes = |row: usize| settings[row].setting.choices().len();
    let is_eligible = |&row: &usize| {
        let measured = &settings[row];
        let errors = [measured.errors.root_relmse, measured.error_ratio];
        row == 0
            || is_recommendable(measured, &settings[0]) && errors.iter().any(|of| of.is_known())
    };
    let mut order: Vec<usize> = (0..settings.len()).filter(is_eligible).collect();
    order.sort_by_key(|&row| changes(row));
    // Whether one row is at most as slow and as wrong as another, and whether it is clearly less so.
    let compare = |one: usize, other: usize| {
        let (one, other) = (point(one), point(other));
        let covers = (0..2).all(|i| one[i] <= other[i] * (1.0 + RESOLUTION));
        let is_less = (0..2).any(|i| one[i] < other[i] * (1.0 - RESOLUTION));
        (covers, covers && is_less)
    };
    // The simplest of equal rows stays.
    let mut kept: Vec<usize> = Vec::new();
    for row in order {
        if !kept.iter().any(|&other| compare(other, row).0) {
            kept.push(row);
        }
    }
    let is_beaten = |&row: &usize| kept.iter().any(|&other| compare(other, row).1);
    let mut front: Vec<usize> = kept.iter().copied().filter(|row| !is_beaten(row)).collect();
    front.sort_by(|&a, &b| point(a)[0].total_cmp(&point(b)[0]));
    front
}

/// Chooses the recommended settings: from the front, and a faster one with bias from all. An error is
/// about half if the estimate is, since an error on the front is known; it is the same if its upper
/// end is, too.
pub(super) fn recommend_settings(settings: &[MeasuredSetting], front: &[usize]) -> Recommendations {
    let is_within = |row: usize, limit: f64, doubt: f64| {
        let error = settings[row].error_ratio;
        row != 0 && error.is_known() && error.value <= limit && error.high <= doubt * limit
    };
    let time = |row: usize| settings[row].ratio.value;
    let mut all = front.iter().copied();
    let half = all.clone().find(|&row| is_within(row, HALF, f64::INFINITY));
    let same = all.find(|&row| is_within(row, SAME, DOUBT[1]) && time(row) <= SOONER);
    let faster = |limit: f64, than: f64| {
        let rows = 0..settings.len();
        let biased = rows.filter(|&row| {
            let of = &settings[row];
            of.errors.root_relmse.is_known() && !is_recommendable(of, &settings[0])
        });
        biased
            .filter(|&row| is_within(row, limit, DOUBT[1]) && time(row) <= SOONER * than)
            .min_by(|&a, &b| time(a).total_cmp(&time(b)))
    };
    let biased = faster(SAME, same.map_or(1.0, time));
    let biased = biased.or_else(|| faster(HALF, half.map(time)?));
    let advice = |row: Option<usize>, limit: f64| {
        row.map(|row| Recommendation {
            row,
            certain: is_within(row, limit, DOUBT[0]),
        })
    };
    Recommendations {
        half_the_error: advice(half, HALF),
        same_error: advice(same, SAME),
        biased: advice(biased, SAME),
    }
}

#[cfg(test)]
mod tests;
