//! Squared error of a picture, estimated without a reference from two noisy pictures of the same
//! view, the *pilots*. The noise of the picture I and of the pilots P₁ and P₂ is mutually
//! independent. So the expectation of (I − P₁)(I − P₂) is the squared error of I.
//!
//! The estimate serves denoised pictures. Their error is concentrated at few edges, which a sample
//! of tiles may miss. The bias of the scene's own rungs (quality levels) is not included, because
//! the pilots have it too.

use super::estimate::{BLOCK, ConfidenceInterval, relative_error_weight};
use super::tiles::variance_of_sum;
use crate::metrics::student_factor_95;
use crate::picture::Picture;

/// Two noisy pictures of full size with different random numbers.
#[derive(Clone, Debug)]
pub(super) struct PilotPicturePair(pub [Picture; 2]);

/// Squared errors of a picture: sums over blocks of 8 × 8 pixels, and the number of pixels.
#[derive(Clone, Debug)]
pub(super) struct PictureBlockErrors {
    relative: Vec<f64>,
    squared: Vec<f64>,
    pixels: f64,
}

impl PilotPicturePair {
    /// Estimates the squared errors of one setting, averaged over its `renders`. All pictures have
    /// the same size. `best` is the most accurate picture known. The denominators of the relative
    /// error come from it, because the pilots are too noisy for that.
    pub fn estimate_errors<'p>(
        &self,
        renders: impl Iterator<Item = &'p Picture>,
        best: &Picture,
    ) -> PictureBlockErrors {
        let [one, other] = &self.0;
        let width = one.width as usize;
        let columns = width.div_ceil(BLOCK);
        let blocks = columns * (one.height as usize).div_ceil(BLOCK);
        let (mut relative, mut squared, mut count) = (vec![0.0; blocks], vec![0.0; blocks], 0.0);
        for render in renders {
            count += 1.0;
            for (pixel, rgb) in render.rgb.iter().enumerate() {
                let block = pixel / width / BLOCK * columns + pixel % width / BLOCK;
                let channels = rgb
                    .iter()
                    .zip(&one.rgb[pixel])
                    .zip(&other.rgb[pixel])
                    .zip(&best.rgb[pixel]);
                for (((&value, &one), &other), &best) in channels {
                    let square =
                        (f64::from(value) - f64::from(one)) * (f64::from(value) - f64::from(other));
                    if square.is_finite() {
                        relative[block] += square * relative_error_weight(best);
                        squared[block] += square / 3.0;
                    }
                }
            }
        }
        relative
            .iter_mut()
            .chain(&mut squared)
            .for_each(|sum| *sum /= count);
        PictureBlockErrors {
            relative,
            squared,
            pixels: one.pixel_count() as f64,
        }
    }
}

impl PictureBlockErrors {
    /// Returns the mean over pixels of (I − R)² / (R² + 0.01), where I is the picture and R the
    /// exact picture.
    pub fn relmse(&self) -> ConfidenceInterval {
        mean_from_blocks(&self.relative, self.pixels)
    }

    /// Returns the mean squared error over pixels and channels.
    pub fn mse(&self) -> ConfidenceInterval {
        mean_from_blocks(&self.squared, self.pixels)
    }
}

/// Returns the sum of `blocks` divided by the number of pixels, with a confidence interval. The
/// width of the interval follows from the differences between neighbouring blocks.
fn mean_from_blocks(blocks: &[f64], pixels: f64) -> ConfidenceInterval {
    let value = blocks.iter().sum::<f64>() / pixels;
    if blocks.len() < 2 {
        return ConfidenceInterval {
            value: value.max(0.0),
            low: 0.0,
            high: f64::INFINITY,
        };
    }
    let steps = |power: i32| {
        blocks
            .windows(2)
            .map(|pair| (pair[0] - pair[1]).powi(power))
            .sum::<f64>()
    };
    // The degrees of freedom are few if few blocks hold most of the noise.
    let freedom = (3.0 * steps(2) * steps(2) / steps(4).max(1e-300)).clamp(1.0, 1e6);
    let error = student_factor_95(freedom as u32) * variance_of_sum(blocks).sqrt() / pixels;
    if value <= error {
        ConfidenceInterval::from_value_within_noise(value, error)
    } else {
        ConfidenceInterval::from_relative_error(value, error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::splitmix64;

    const SIZE: [u32; 2] = [96, 64];

    fn uniform(seed: u64, index: u64) -> f64 {
        (splitmix64(seed ^ splitmix64(index)) >> 11) as f64 / 2_f64.powi(53)
    }

    fn picture(value: impl Fn(u64) -> f64) -> Picture {
        let rgb = (0..u64::from(SIZE[0] * SIZE[1]))
            .map(|pixel| [0, 1, 2].map(|i| value(3 * pixel + i) as f32));
        Picture {
            rgb: rgb.collect(),
            ..Picture::new(SIZE[0], SIZE[1])
        }
    }

    /// Protects: pilots ten times as noisy as the picture's error estimate it without bias, and
    /// their intervals contain it in 90 to 99 of 100 cases. The picture of ones is wrong by 0.05
    /// everywhere, and by 0.5 in one block.
    #[test]
    fn noisy_pilots_tell_small_errors() {
        let judged = picture(|index| {
            if index / 3 % 96 < 8 && index / 288 < 8 {
                1.5
            } else {
                1.05
            }
        });
        let (truth, mut held, mut sum, mut relative) =
            ((0.05_f64.powi(2) * 95.0 + 0.25) / 96.0, 0, 0.0, 0.0);
        let best = picture(|_| 1.0);
        for seed in 0..400 {
            let noisy = |total: u64| {
                picture(move |index| 1.0 + 1.732 * (uniform(2 * seed + total, index) - 0.5))
            };
            let errors = PilotPicturePair([noisy(0), noisy(1)])
                .estimate_errors([&judged].into_iter(), &best);
            let mse = errors.mse();
            relative += errors.relmse().value / 400.0;
            held += u32::from(mse.low <= truth && truth <= mse.high);
            sum += mse.value / 400.0;
        }
        assert!(
            (sum / truth - 1.0).abs() < 0.1 && (360..=396).contains(&held),
            "{sum}, not {truth}; {held} of 400 hold"
        );
        assert!(
            (relative * 1.01 / sum - 1.0).abs() < 1e-6,
            "{relative} beside {sum}: all is relative to ones"
        );
    }
}
