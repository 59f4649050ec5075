//! What a pixel's squared error is relative to: the square of its true colour, as far as noisy
//! samples tell it.
//!
//! The product of two replicates' means is right on average, whatever their noise; but where light
//! is seldom found it is zero in one pixel and ten times the truth in the next, and an error
//! relative to that says nothing. So the more two replicates differ, the more the products of
//! neighbouring pixels count, whose mean is right where the colour changes slowly. A bright sample
//! raises the product together with the error: whoever weighs an error takes the weights from
//! replicates that are not in it, or says what that does.

pub(super) use crate::metrics::RELATIVE_FLOOR as FLOOR;

/// Pixels to each side that count as neighbours.
pub(super) const REACH: usize = 2;

/// Factors that make squared errors relative, per pixel and channel of rows of `width` pixels, by
/// the means of two replicates.
pub(super) fn weights(a: &[[f64; 3]], b: &[[f64; 3]], width: usize) -> Vec<[f64; 3]> {
    let own: Vec<[f64; 3]> = a
        .iter()
        .zip(b)
        .map(|(a, b)| core::array::from_fn(|i| a[i] * b[i]))
        .collect();
    let near = around(
        &around(&own, REACH, width, 1),
        REACH,
        own.len() / width,
        width,
    );
    let weight = |a: f64, b: f64, near: f64| {
        // One less the variance of both together over their squared mean.
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

/// Factors that make squared errors relative by the means of two replicates that are not in them,
/// per channel: near 1/(T² + 0.01) on average for a true colour T. 1/(ab + 0.01) is too large on
/// average, since ab is noisy: by its variance, which (a² − b²)²/4 has for a mean, over the square
/// of ab + 0.01. Neighbours would make the factors wrong where colours change.
pub(super) fn across(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|i| {
        let (relative_to, noise) = (
            (a[i] * b[i]).max(0.0) + FLOOR,
            (a[i] * a[i] - b[i] * b[i]) / 2.0,
        );
        relative_to / (relative_to * relative_to + noise * noise)
    })
}

/// Such factors by the means of the two replicates that are in them.
pub(super) fn within(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|i| 1.0 / ((a[i] + b[i]) * (a[i] + b[i]) / 4.0 + FLOOR))
}

/// Such factors by the means of four replicates: the products of two of them have the true colour's
/// square for a mean.
pub(super) fn among(four: [[f64; 3]; 4]) -> [f64; 3] {
    core::array::from_fn(|i| {
        let [a, b, c, d] = four.map(|mean| mean[i]);
        1.0 / (((a * b + c * d + (a + b) * (c + d)) / 6.0).max(0.0) + FLOOR)
    })
}

/// Means over neighbours to both sides, `reach` of them, along one axis: of so many pixels, `step`
/// apart.
pub(super) fn around(of: &[[f64; 3]], reach: usize, length: usize, step: usize) -> Vec<[f64; 3]> {
    let mean = |at: usize| {
        let place = at / step % length;
        let first = at - place * step;
        let range = place.saturating_sub(reach)..(place + reach + 1).min(length);
        let n = range.len() as f64;
        let mut sum = [0.0; 3];
        for other in range {
            sum = core::array::from_fn(|i| sum[i] + of[first + other * step][i]);
        }
        sum.map(|s| s / n)
    };
    (0..of.len()).map(mean).collect()
}
