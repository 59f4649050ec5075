//! Inner loops of the denoiser over rows of numbers, written for the compiler to vectorise.
//!
//! Each loop is a function of its own: the compiler then knows that outputs do not alias inputs.

use super::filter_rows::{FEATURES, GuideRow, PixelRow};

/// Writes the squared differences between the colours of two rows, relative to their noise. The row
/// `own` is read from column `x` on, the row `there` from column `beside` on.
#[inline(always)]
pub(super) fn colour_distances(
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
        to[i] = noise_relative_distance(square, variance[i], other[i], inverse);
    }
}

/// Returns the squared difference `square` of two colours relative to their noise. The squared
/// difference expected from noise is subtracted. The result is divided by the sum of both
/// variances, `own` and `there`, and multiplied by `inverse`.
#[inline(always)]
pub(super) fn noise_relative_distance(square: f32, own: f32, there: f32, inverse: f32) -> f32 {
    let less = if own < there { own } else { there };
    (square - own - less) / (1e-7 + own + there) * inverse
}

/// Writes for the first `length` entries of a row the mean of each number and its two neighbours.
/// At both ends, the number itself replaces the missing neighbour.
#[inline(always)]
pub(super) fn average_with_neighbours(to: &mut PixelRow, of: &PixelRow, length: usize) {
    const THIRD: f32 = 1.0 / 3.0;
    if length > 2 {
        let n = (length - 2).next_multiple_of(super::filter_rows::LANES);
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

/// Writes the weights of a row of neighbours. The weight of a neighbour falls with the greater of two
/// distances: the mean over three rows of colour differences, and the greatest difference of a
/// feature.
#[inline(always)]
pub(super) fn neighbour_weights(
    to: &mut [f32],
    [above, here, below]: [&[f32]; 3],
    (compared, x): (&GuideRow, usize),
    (other, beside): (&GuideRow, usize),
) {
    let n = to.len();
    let [above, here, below] = [&above[..n], &here[..n], &below[..n]];
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
        for [a, b, tolerance] in rows {
            let difference = a[i] - b[i];
            let forbidden = difference * difference * tolerance[i];
            apart = if forbidden > apart { forbidden } else { apart };
        }
        to[i] = weight_of_distance(apart, noise[i], inverse[i]);
    }
}

/// Returns the weight of a neighbour at the distance x = `apart`: (1 − x/4)⁴, or zero from 4 on. It
/// approximates exp(−x). The weight is reduced if the neighbour's variance, 1/`inverse`, is more
/// than twice the variance `noise` of the pixel.
#[inline(always)]
pub(super) fn weight_of_distance(apart: f32, noise: f32, inverse: f32) -> f32 {
    let close = 1.0 - apart * 0.25;
    let close = if close > 0.0 { close } else { 0.0 };
    let noisier = (2.0 * noise + 1e-8) * inverse;
    close * close * (close * close) * if noisier < 1.0 { noisier } else { 1.0 }
}

/// Adds the three channels of a row of colours, times the weights, to the sums.
#[inline(always)]
pub(super) fn add_weighted_colour([r, g, b]: [&mut [f32]; 3], weights: &[f32], of: [&[f32]; 3]) {
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

/// Adds the numbers `values` to the entries of `to`.
#[inline(always)]
pub(super) fn add_row(to: &mut [f32], values: &[f32]) {
    let to = &mut to[..values.len()];
    for i in 0..values.len() {
        to[i] += values[i];
    }
}

#[cfg(test)]
mod tests {
    use super::super::filter_rows::ROW;
    use super::*;
    use crate::hash::splitmix64;

    /// A pseudo-random number in [0, 1).
    fn number(seed: u64) -> f32 {
        (splitmix64(seed) >> 40) as f32 / (1_u32 << 24) as f32
    }

    fn random_row(seed: u64) -> PixelRow {
        core::array::from_fn(|i| number(splitmix64(seed) ^ i as u64))
    }

    /// Protects: each pixel of a row, the first and the last ones too, gets the mean of itself and
    /// its neighbours, in rows of one pixel, two, a multiple of the lanes, and the full length.
    #[test]
    fn means_of_three_reach_both_ends() {
        let row = random_row(1);
        for length in [1, 2, 3, 4, 15, 16, 17, 18, 19, 33, 100, ROW - 16, ROW - 14] {
            let mut means = [f32::NAN; ROW];
            average_with_neighbours(&mut means, &row, length);
            for (i, &found) in means[..length].iter().enumerate() {
                let neighbours = [i.saturating_sub(1), i, (i + 1).min(length - 1)];
                let mean = neighbours.map(|k| f64::from(row[k])).iter().sum::<f64>() / 3.0;
                assert!(
                    (f64::from(found) - mean).abs() < 1e-6,
                    "pixel {i} of {length}: {found} for {mean}"
                );
            }
        }
    }

    /// Protects: a weight follows the largest of the rows' mean difference and each of the features'
    /// differences, not the first one alone.
    #[test]
    fn weights_follow_the_largest_difference() {
        const X: usize = 3;
        const BESIDE: usize = 7;
        let [mut row, mut other] = [GuideRow::BLACK, GuideRow::BLACK];
        let length = 2 * (FEATURES + 1);
        let mut differences = [0.0_f32; ROW];
        // Pixel 2k is apart by one cause, k, alone; pixel 2k + 1 by nothing.
        for k in 0..FEATURES {
            row.features[k][X + 2 * k] = 1.0;
            row.tolerances[k][X + 2 * k] = 0.5 + k as f32 * 0.1;
        }
        differences[2 * FEATURES] = 2.0;
        row.noise = [1.0; ROW];
        other.inverse_noise = [1.0; ROW];
        let mut weights = [f32::NAN; ROW];
        neighbour_weights(
            &mut weights[..length],
            [&differences, &differences, &differences],
            (&row, X),
            (&other, BESIDE),
        );
        for (i, &weight) in weights[..length].iter().enumerate() {
            let apart = match i / 2 {
                _ if i % 2 == 1 => 0.0,
                k if k < FEATURES => 0.5 + k as f32 * 0.1,
                _ => 2.0,
            };
            let expected = (1.0 - apart / 4.0).powi(4);
            assert!(
                (weight - expected).abs() < 1e-6,
                "pixel {i}: {weight} for {expected}"
            );
        }
    }
}
