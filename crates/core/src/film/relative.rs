//! Denominators of relative squared errors: the square of a pixel's true colour, estimated from
//! noisy samples.
//!
//! The product of two replicates' means is an unbiased estimate of that square, whatever their
//! noise. But where light is rarely found, the product is zero in one pixel and ten times the truth
//! in the next, and a relative error by this denominator means nothing. So the more two replicates
//! differ, the more the mean product of the neighbouring pixels counts, which is accurate where the
//! colour changes slowly. A bright sample raises the product together with the error. An error is
//! therefore weighted by replicates that are not part of the error, or the bias is accounted for.

use glam::DVec3;

pub(super) use crate::metrics::RELATIVE_FLOOR as FLOOR;

/// Number of neighbouring pixels on each side that are averaged.
pub(super) const REACH: usize = 2;

/// Returns the factors that turn squared errors into relative squared errors, by pixel and channel.
/// The squared true colours are estimated from the means `a` and `b` of two replicates, in rows of
/// `width` pixels.
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

/// Returns the factors that turn squared errors into relative squared errors, by channel, from the
/// means a and b of two replicates that are not part of the error. They are near 1/(T² + 0.01) on
/// average for a true colour T. The mean of 1/(ab + 0.01) is too large because ab is noisy; the
/// excess is the variance of ab, estimated by (a² − b²)²/4, over the square of ab + 0.01.
/// Neighbouring pixels are not used: they would bias the factors where colours change.
pub(super) fn weights_from_independent_pair(a: DVec3, b: DVec3) -> DVec3 {
    let (relative_to, noise) = ((a * b).max(DVec3::ZERO) + FLOOR, (a * a - b * b) / 2.0);
    relative_to / (relative_to * relative_to + noise * noise)
}

/// Returns the factors that turn squared errors into relative squared errors, by channel, from the
/// means of the two replicates in the error: 1/(m² + 0.01) for their mean m.
pub(super) fn weights_from_same_pair(a: DVec3, b: DVec3) -> DVec3 {
    1.0 / ((a + b) * (a + b) / 4.0 + FLOOR)
}

/// Returns the factors that turn squared errors into relative squared errors, by channel, from the
/// means of four replicates: the mean of their pairwise products estimates the square of the true
/// colour.
pub(super) fn weights_from_four([a, b, c, d]: [DVec3; 4]) -> DVec3 {
    1.0 / (((a * b + c * d + (a + b) * (c + d)) / 6.0).max(DVec3::ZERO) + FLOOR)
}

/// Returns for each pixel the mean of the pixel and up to `reach` neighbours on both sides along
/// one axis. The axis has `length` pixels, which are `step` entries apart in the list.
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
