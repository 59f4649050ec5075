//! Denominators of relative squared errors: estimates of the true colour of a pixel from noisy
//! samples.
//!
//! A bright sample is part of error and colour, so that an error is relative to replicates that are
//! not part of it. Where light is rarely found, these replicates are black in one pixel and ten
//! times too bright in the next: a relative error by them alone means nothing. Therefore
//! neighbouring pixels contribute to the colour, as far as their differences are noise.

use core::ops::Range;

use glam::DVec3;

pub(super) use crate::metrics::RELATIVE_FLOOR as FLOOR;

/// Number of neighbouring pixels on each side that contribute to an average.
pub(super) const REACH: usize = 2;

/// What the neighbours of a pixel say about its true colour.
#[derive(Clone, Copy)]
pub(super) struct Surroundings {
    /// Mean radiance of the neighbours.
    pub mean: DVec3,
    /// Variance by noise of the mean radiance of a neighbour.
    pub noise: DVec3,
    /// The same variance, averaged over the pixel too.
    noise_with_pixel: DVec3,
    /// Variance of the true colours of the pixel and its neighbours.
    contrast: DVec3,
    /// Number of neighbours.
    count: f64,
}

impl Surroundings {
    /// Returns the surroundings of each pixel, from the means of four replicates in rows of `width`
    /// pixels.
    pub fn from_replicates(four: &[Vec<[f64; 3]>], width: usize) -> Vec<Self> {
        let pixels = four[0].len();
        let [mut means, mut squares, mut noises] = [(); 3].map(|()| vec![[0.0; 3]; pixels]);
        for pixel in 0..pixels {
            let at = [0, 1, 2, 3].map(|r: usize| DVec3::from(four[r][pixel]));
            let mean = at.iter().sum::<DVec3>() / 4.0;
            let noise = at.iter().map(|at| (at - mean) * (at - mean)).sum::<DVec3>() / 12.0;
            (means[pixel], squares[pixel]) = (mean.into(), (mean * mean).into());
            noises[pixel] = noise.into();
        }
        let near = [&means, &squares, &noises].map(|of| average_over_square(of, width));
        let surroundings = |pixel: usize| {
            let [mean, square, noise] = near.each_ref().map(|of| DVec3::from(of[pixel]));
            let [own, own_noise] = [&means, &noises].map(|of| DVec3::from(of[pixel]));
            let all = (neighbours(pixel % width, width).len()
                * neighbours(pixel / width, pixels / width).len()) as f64;
            let count = (all - 1.0).max(1.0);
            Self {
                mean: (mean * all - own) / count,
                noise: ((noise * all - own_noise) / count).max(DVec3::ZERO),
                noise_with_pixel: noise,
                contrast: if all > 1.0 {
                    ((square - mean * mean) * all / count - noise).max(DVec3::ZERO)
                } else {
                    DVec3::MAX
                },
                count,
            }
        };
        (0..pixels).map(surroundings).collect()
    }

    /// Returns factors that convert a squared error to a relative squared error, per channel. `own`
    /// is the mean radiance of the pixel in replicates that are not part of the error; its variance
    /// is `noise` times that of four replicates.
    ///
    /// The true colour T is taken to be normally distributed about the neighbours' mean. The factors
    /// are the inverse of T² + 0.01 for the likeliest T with twice its variance added, since the
    /// inverse of a noisy square is too large on average; the same inverse without the variance; and
    /// twice the standard error of the first by the noise of the neighbours' mean: the pixels that
    /// carry an error share neighbours.
    pub fn weights(&self, own: DVec3, noise: f64) -> [DVec3; 3] {
        let noise = noise * self.noise_with_pixel;
        let share = noise / (noise + self.contrast).max(DVec3::splat(f64::MIN_POSITIVE));
        let colour = (own + share * (self.mean - own)).max(DVec3::ZERO);
        let square = colour * colour + FLOOR;
        let weight = 1.0 / (square + 2.0 * share * self.contrast);
        let deviation = DVec3::from((self.noise / self.count).to_array().map(f64::sqrt));
        [
            weight,
            1.0 / square,
            4.0 * colour * share * deviation * weight * weight,
        ]
    }
}

/// Returns for each pixel and channel the factor that converts a squared error to a relative
/// squared error. The squared true colours are estimated from `a` and `b`, the means of two
/// replicates, in rows of `width` pixels: by their product, which is unbiased, and the more they
/// differ, by its mean over the neighbours.
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
    let near = average_over_square(&own, width);
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

/// Returns the positions along an axis of `length` pixels that are at most [`REACH`] from a position.
fn neighbours(position: usize, length: usize) -> Range<usize> {
    position.saturating_sub(REACH)..(position + REACH + 1).min(length)
}

/// Returns for each pixel the mean over the square of the pixel and its neighbours, in rows of
/// `width` pixels.
pub(super) fn average_over_square(of: &[[f64; 3]], width: usize) -> Vec<[f64; 3]> {
    let rows = average_along_axis(of, width, 1);
    average_along_axis(&rows, of.len() / width, width)
}

/// Returns for each pixel the mean over the pixel and its neighbours along one axis. The axis has
/// `length` pixels, which are `step` entries apart in the list `of`.
fn average_along_axis(of: &[[f64; 3]], length: usize, step: usize) -> Vec<[f64; 3]> {
    let mean = |position: usize| {
        let index = position / step % length;
        let first = position - index * step;
        let range = neighbours(index, length);
        let n = range.len() as f64;
        let mut sum = [0.0; 3];
        for other in range {
            sum = core::array::from_fn(|i| sum[i] + of[first + other * step][i]);
        }
        sum.map(|s| s / n)
    };
    (0..of.len()).map(mean).collect()
}
