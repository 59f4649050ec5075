//! Loops over rows that the compiler vectorises.
//!
//! Each is a function of its own, so that the compiler knows that outputs do not alias inputs.

use super::rows::{Compared, FEATURES, PixelRow};

/// Squared differences of colours relative to the noise of these variances.
#[inline(always)]
pub(super) fn compare(
    to: &mut [f32],
    (own, x): (&[PixelRow; 3], usize),
    (there, beside): (&[PixelRow; 3], usize),
    [variance, other]: [&[f32]; 2],
    inverse: f32,
) {
    let n = to.len();
    let [r, g, b] = [&own[0][x..][..n], &own[1][x..][..n], &own[2][x..][..n]];
    let [s, h, c] = [
        &there[0][beside..][..n],
        &there[1][beside..][..n],
        &there[2][beside..][..n],
    ];
    let (variance, other) = (&variance[..n], &other[..n]);
    for i in 0..n {
        let [red, green, blue] = [r[i] - s[i], g[i] - h[i], b[i] - c[i]];
        let square = red * red + green * green + blue * blue;
        to[i] = relate(square, variance[i], other[i], inverse);
    }
}

/// A squared difference relative to the noise of two variances.
#[inline(always)]
pub(super) fn relate(square: f32, own: f32, there: f32, inverse: f32) -> f32 {
    let less = if own < there { own } else { there };
    (square - own - less) / (1e-7 + own + there) * inverse
}

/// Means of three along a row of a length; the ends count twice.
#[inline(always)]
pub(super) fn average(to: &mut PixelRow, of: &PixelRow, length: usize) {
    const THIRD: f32 = 1.0 / 3.0;
    if length > 2 {
        let n = (length - 2).next_multiple_of(super::rows::LANES);
        let (before, here, behind) = (&of[..n], &of[1..][..n], &of[2..][..n]);
        let to = &mut to[1..][..n];
        for i in 0..n {
            to[i] = (before[i] + here[i] + behind[i]) * THIRD;
        }
    }
    for i in [0, length - 1] {
        to[i] = (of[i.saturating_sub(1)] + of[i] + of[(i + 1).min(length - 1)]) * THIRD;
    }
}

/// Weights of neighbours: of the mean of three rows of differences, at least zero and a share of
/// the pixel's own difference, and of the largest difference of a feature.
#[inline(always)]
pub(super) fn weigh(
    to: &mut [f32],
    [above, here, below]: [&[f32]; 3],
    (own, share): (&[f32], f32),
    (compared, x): (&Compared, usize),
    (other, beside): (&Compared, usize),
) {
    let n = to.len();
    let [above, here, below, own] = [&above[..n], &here[..n], &below[..n], &own[..n]];
    let row = |k: usize| {
        [
            &compared.features[k][x..][..n],
            &other.features[k][beside..][..n],
            &compared.tolerances[k][x..][..n],
        ]
    };
    let rows: [[&[f32]; 3]; FEATURES] = [row(0), row(1), row(2), row(3), row(4), row(5), row(6)];
    let (noise, inverse) = (
        &compared.noise[x..][..n],
        &other.inverse_noise[beside..][..n],
    );
    for i in 0..n {
        let mean = (above[i] + here[i] + below[i]) * (1.0 / 3.0);
        let mut apart = if mean > 0.0 { mean } else { 0.0 };
        let minimum = share * own[i];
        apart = if minimum > apart { minimum } else { apart };
        for [a, b, tolerance] in rows {
            let difference = a[i] - b[i];
            let forbidden = difference * difference * tolerance[i];
            apart = if forbidden > apart { forbidden } else { apart };
        }
        to[i] = close(apart, noise[i], inverse[i]);
    }
}

/// The weight of a distance, exp(-x) with finite support, reduced if the noise is more than
/// doubled.
#[inline(always)]
pub(super) fn close(apart: f32, noise: f32, inverse: f32) -> f32 {
    let close = 1.0 - apart * 0.25;
    let close = if close > 0.0 { close } else { 0.0 };
    let noisier = (2.0 * noise + 1e-8) * inverse;
    close * close * (close * close) * if noisier < 1.0 { noisier } else { 1.0 }
}

/// Adds the weighted channels of a colour.
#[inline(always)]
pub(super) fn add_weighed([r, g, b]: [&mut [f32]; 3], weights: &[f32], of: [&[f32]; 3]) {
    for (to, values) in [r, g, b].into_iter().zip(of) {
        add_product(to, weights, values);
    }
}

#[inline(always)]
fn add_product(to: &mut [f32], weights: &[f32], values: &[f32]) {
    let n = weights.len();
    let (to, values) = (&mut to[..n], &values[..n]);
    for i in 0..n {
        to[i] += weights[i] * values[i];
    }
}

/// Adds numbers.
#[inline(always)]
pub(super) fn add(to: &mut [f32], values: &[f32]) {
    let to = &mut to[..values.len()];
    for i in 0..values.len() {
        to[i] += values[i];
    }
}
