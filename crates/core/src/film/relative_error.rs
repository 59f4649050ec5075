//! Denominators of relative squared errors: estimates of the squared true colour of a pixel from
//! noisy samples.
//!
//! The product of two replicates' means is an unbiased estimate of the squared true colour,
//! whatever the noise. But where light is rarely found, this product is zero in one pixel and ten
//! times too large in the next. A relative error with such a denominator means nothing. Therefore
//! neighbouring pixels contribute to the denominator: the more two replicates differ, the more
//! their mean product over the neighbours counts. This mean is accurate where the colour changes
//! slowly.
//!
//! A bright sample increases product and error together. An error is therefore weighted by
//! replicates that are not part of the error, or the bias is accounted for.

use glam::DVec3;

pub(super) use crate::metrics::RELATIVE_FLOOR as FLOOR;

/// Number of neighbouring pixels on each side that contribute to an average.
pub(super) const REACH: usize = 2;

/// Returns for each pixel and channel the factor that converts a squared error to a relative
/// squared error. The squared true colours are estimated from `a` and `b`, the means of two
/// replicates, in rows of `width` pixels.
pub(super) fn relative_error_weights(
    a: &[[f64; 3]],
    b: &[[f64; 3]],
    width: usize,
) -> Vec<[f64; 3]> {
    let own: Vec<[f64; 3]> = a
        .iter()
        .zip(b)
        .map(|(a, b)| core::array::from_fn(|i| a[i] * b[i]))
        .collect();
    let near = average_along_axis(
        &average_along_axis(&own, REACH, width, 1),
        REACH,
        own.len() / width,
        width,
    );
    let weight = |a: f64, b: f64, near: f64| {
        // One minus the ratio of the squared difference of both replicates to their squared sum.
        let (square, difference) = ((a + b) * (a + b), (a - b) * (a - b));
        let sure = if square > difference {
            1.0 - difference / square
        } else {
            0.0
        };
        1.0 / ((sure * a * b + (1.0 - sure) * near).max(0.0) + FLOOR)
    };
    let pixels = a.iter().zip(b).zip(near);
    pixels
        .map(|((a, b), near)| core::array::from_fn(|i| weight(a[i], b[i], near[i])))
        .collect()
}

/// Returns for each channel the factor that converts a squared error to a relative squared error.
/// `a` and `b` are the means of two replicates that are not part of the error. The factor is near
/// 1/(T² + 0.01) on average, for the true colour T.
///
/// Because ab is noisy, the mean of 1/(ab + 0.01) would be too large. The relative excess is the
/// variance of ab, estimated by (a² − b²)²/4, over (ab + 0.01)². Neighbouring pixels are not used:
/// they would bias the factors where colours change.
pub(super) fn weights_from_independent_pair(a: DVec3, b: DVec3) -> DVec3 {
    let (relative_to, noise) = ((a * b).max(DVec3::ZERO) + FLOOR, (a * a - b * b) / 2.0);
    relative_to / (relative_to * relative_to + noise * noise)
}

/// Returns for each channel the factor that converts a squared error to a relative squared error:
/// 1/(m² + 0.01). m is the mean of `a` and `b`, the two replicates in the error.
pub(super) fn weights_from_same_pair(a: DVec3, b: DVec3) -> DVec3 {
    1.0 / ((a + b) * (a + b) / 4.0 + FLOOR)
}

/// Returns for each channel the factor that converts a squared error to a relative squared error,
/// from the means of four replicates. The mean of their pairwise products estimates the squared
/// true colour.
pub(super) fn weights_from_four_replicates([a, b, c, d]: [DVec3; 4]) -> DVec3 {
    1.0 / (((a * b + c * d + (a + b) * (c + d)) / 6.0).max(DVec3::ZERO) + FLOOR)
}

/// Returns for each pixel the mean over the pixel and up to `reach` neighbours on both sides along
/// one axis. The axis has `length` pixels, which are `step` entries apart in the list `of`.
pub(super) fn average_along_axis(
    of: &[[f64; 3]],
    reach: usize,
    length: usize,
    step: usize,
) -> Vec<[f64; 3]> {
    let mean = |position: usize| {
        let index = position / step % length;
        let first = position - index * step;
        let range = index.saturating_sub(reach)..(index + reach + 1).min(length);
        let n = range.len() as f64;
        let mut sum = [0.0; 3];
        for other in range {
            sum = core::array::from_fn(|i| sum[i] + of[first + other * step][i]);
        }
        sum.map(|s| s / n)
    };
    (0..of.len()).map(mean).collect()
}
