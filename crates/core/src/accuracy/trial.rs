//! The table of trials. A trial is one render of a setting on a region of the picture, reduced to
//! its time, rays and sums of errors. Every figure of the report is a function of the trials.

use super::estimate::{ConfidenceInterval, NORMAL, RESOLUTION, variance_of_sum};
use super::renderer::TimedFilm;
use super::setting::RungSetting;
use crate::film::{Film, Uncertainty};
use crate::metrics::RELATIVE_FLOOR;
use crate::picture::Picture;

/// What a trial renders.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Job {
    pub setting: RungSetting,
    pub region: Region,
    /// Number that is added to the seed.
    pub round: u64,
}

impl Job {
    /// Returns the job of a whole picture.
    pub fn whole(setting: &RungSetting) -> Self {
        Self {
            region: Region::Whole,
            ..Self::tiles(setting, 0)
        }
    }

    /// Returns the job of a round on tiles.
    pub fn tiles(setting: &RungSetting, round: u64) -> Self {
        Self {
            setting: setting.clone(),
            region: Region::Tiles,
            round,
        }
    }
}

/// Radiances of a region: for each tile and replicate, a list of pixels.
pub(super) type Replicates = Vec<Vec<Vec<[f32; 3]>>>;

/// Region of the picture that a trial renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Region {
    /// The whole picture, whose error the film itself claims.
    Whole,
    /// The tiles of the study, on which the errors are summed that a claim cannot see.
    Tiles,
}

/// Finished job with its figures.
pub(super) struct Trial {
    pub job: Job,
    /// Seconds of rendering, summed over all threads; infinite if the render took too long.
    pub seconds: f64,
    /// Wall-clock seconds, with preparation and denoising.
    pub wall: f64,
    /// Sums of errors for each tile of the study; empty for a whole picture.
    pub sums: Vec<TileSums>,
    /// Claim of a whole picture; `None` without random numbers or with a single replicate.
    pub claim: Option<Uncertainty>,
    /// The whole picture after denoising.
    pub denoised: Option<DenoisedTrial>,
    /// Whether other random numbers would change the picture.
    pub is_random: bool,
    /// The magnified part of a whole picture.
    pub detail: Option<Picture>,
}

/// Figures of a denoised whole picture.
pub(super) struct DenoisedTrial {
    pub claim: Uncertainty,
    /// Relative change of the summed radiance by denoising.
    pub light_change: f64,
    /// Seconds of denoising, summed over all threads.
    pub seconds: f64,
    /// The magnified part of the picture.
    pub detail: Picture,
}

impl Trial {
    /// Returns the trial of a finished film, without its errors.
    pub fn of_film(job: &Job, timed: &TimedFilm, wall: f64) -> Self {
        Self {
            seconds: timed.seconds,
            wall,
            is_random: timed.is_random,
            ..Self::too_long(job.clone())
        }
    }

    /// Returns the trial of a job that took too long.
    pub fn too_long(job: Job) -> Self {
        Self {
            job,
            seconds: f64::INFINITY,
            wall: 0.0,
            sums: Vec::new(),
            claim: None,
            denoised: None,
            is_random: false,
            detail: None,
        }
    }
}

/// Sums over the pixels of a tile. Errors are relative to the reference and averaged over channels.
#[derive(Clone, Debug, Default)]
pub(super) struct TileSums {
    pub pixels: f64,
    /// Squared errors of noise of a single picture.
    pub noise: f64,
    /// Squared differences from the exact picture that renders with other random numbers share.
    pub bias: f64,
    /// Variances of the sums of `bias` by noise.
    pub bias_variance: f64,
    /// Radiance of the picture, and of the exact picture.
    pub light: [f64; 2],
}

impl TileSums {
    /// Sums the errors of a tile.
    ///
    /// - `own`: the replicates of the setting; a single one without random numbers.
    /// - `exact`: the replicates of the exact picture. They may have the random numbers of `own`.
    /// - `truth`: a picture that is independent of both, for the denominators of relative errors.
    pub fn new(own: &[Vec<[f32; 3]>], exact: &[Vec<[f32; 3]>], truth: &[[f32; 3]]) -> Self {
        let mut sums = Self {
            pixels: truth.len() as f64,
            ..Self::default()
        };
        let pairs = own.len().max(exact.len());
        let (mut values, mut apart) = (vec![0.0; own.len()], vec![0.0; pairs]);
        for (pixel, colour) in truth.iter().enumerate() {
            let (mut bias, mut variance) = (0.0, 0.0);
            for (i, &reference) in colour.iter().enumerate() {
                let value = |of: &[Vec<[f32; 3]>], r: usize| f64::from(of[r % of.len()][pixel][i]);
                let weight = relative_error_weight(reference);
                values
                    .iter_mut()
                    .enumerate()
                    .for_each(|(r, v)| *v = value(own, r));
                apart.iter_mut().enumerate().for_each(|(r, a)| {
                    *a = value(own, r) - value(exact, r);
                });
                let (mean, mut noise) = mean_and_variance(&values);
                let (difference, spread) = mean_and_variance(&apart);
                if !(mean + noise + difference + spread).is_finite() {
                    continue;
                }
                noise /= own.len() as f64;
                let spread = spread / pairs as f64;
                let exact_mean = (0..exact.len()).map(|r| value(exact, r)).sum::<f64>();
                sums.light[0] += mean;
                sums.light[1] += exact_mean / exact.len() as f64;
                sums.noise += weight * noise;
                // The square of the mean contains the variance of the mean.
                bias += weight * (difference * difference - spread);
                variance += weight * spread;
            }
            // Variance of a squared mean minus its variance; the channels count as fully correlated.
            sums.bias += bias;
            sums.bias_variance += 2.0 * variance * variance + 4.0 * bias.max(0.0) * variance;
        }
        sums
    }

    /// Returns the sums of a tile that stands for `weight` tiles.
    pub fn scale(self, weight: f64) -> Self {
        Self {
            pixels: weight * self.pixels,
            noise: weight * self.noise,
            bias: weight * self.bias,
            bias_variance: weight * weight * self.bias_variance,
            light: self.light.map(|sum| weight * sum),
        }
    }
}

/// Returns the mean of some numbers, and their unbiased variance; zero for a single one.
pub(crate) fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, squares / (count - 1.0).max(1.0))
}

/// Returns 1/(3(R² + 0.01)) for the reference value R of a channel. The sum over the three channels
/// of this weight times the squared error is a pixel's relative squared error.
fn relative_error_weight(reference: f32) -> f64 {
    let reference = f64::from(reference);
    1.0 / (3.0 * (reference * reference + RELATIVE_FLOOR))
}

/// Returns the mean squared bias over the picture from the tiles of one or more rounds, with its
/// interval. `share` is the share of the picture's tiles, 0 to 1, that were rendered: the choice of
/// tiles adds to the uncertainty.
pub(super) fn mean_bias(tiles: &[&TileSums], share: f64) -> ConfidenceInterval {
    let sum = |value: &dyn Fn(&TileSums) -> f64| tiles.iter().map(|of| value(of)).sum::<f64>();
    let pixels = sum(&|tile| tile.pixels);
    let value = sum(&|tile| tile.bias) / pixels;
    let residuals = tiles.iter().map(|tile| tile.bias - value * tile.pixels);
    let chosen = (1.0 - share) * variance_of_sum(&residuals.collect::<Vec<_>>());
    let error = (sum(&|tile| tile.bias_variance) + chosen).sqrt() / pixels;
    // The reference's own noise is in what errors are relative to.
    let error = libm::hypot(error, 2.0 * RESOLUTION * value);
    let half = NORMAL * error;
    ConfidenceInterval {
        value: value.max(0.0),
        low: (value - half).max(0.0),
        high: value.max(0.0) + half,
    }
}

/// Returns the replicates of the tiles of a film; `None` if one of the tiles is incomplete.
pub(super) fn replicates_of(film: &Film, tiles: &[u32]) -> Option<Replicates> {
    tiles
        .iter()
        .map(|&tile| film.tile_replicates(tile))
        .collect()
}

/// Returns the mean of replicates, pixel by pixel.
pub(super) fn mean_of_replicates(replicates: &[Vec<[f32; 3]>]) -> Vec<[f32; 3]> {
    let count = replicates.len() as f32;
    let mean = |pixel: usize| {
        core::array::from_fn(|i| replicates.iter().map(|of| of[pixel][i]).sum::<f32>() / count)
    };
    (0..replicates[0].len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::splitmix64;

    fn uniform(index: u64) -> f32 {
        ((splitmix64(index) >> 11) as f64 / 2_f64.powi(53)) as f32
    }

    /// Protects: noise and bias of a tile are told apart: replicates of a grey of 0.55 with uniform
    /// noise of variance 1/12, beside an exact 0.5, and beside the same noise, where only the bias
    /// is left.
    #[test]
    fn noise_and_bias_are_told_apart() {
        let replicate = |grey: f32, seed: u64| -> Vec<[f32; 3]> {
            let pixel = |index: u64| [grey + uniform(4096 * seed + index) - 0.5; 3];
            (0..1024).map(pixel).collect()
        };
        let set = |grey, seed: u64| {
            (0..4)
                .map(|r| replicate(grey, seed + r))
                .collect::<Vec<_>>()
        };
        let truth = vec![[0.5; 3]; 1024];
        let weight = 1024.0 / 0.26;
        let apart = TileSums::new(&set(0.55, 0), &set(0.5, 10), &truth);
        let paired = TileSums::new(&set(0.55, 0), &set(0.5, 0), &truth);
        for sums in [&apart, &paired] {
            let noise = sums.noise / weight;
            assert!((noise * 48.0 - 1.0).abs() < 0.05, "{noise}");
        }
        let bias = mean_bias(&[&paired], 1.0);
        assert!(
            (bias.value / (0.0025 / 0.26) - 1.0).abs() < 1e-3,
            "{bias:?}"
        );
        // Twice the resolution of an error on both sides.
        assert!(bias.high < 1.28 * bias.low && bias.high > 1.2 * bias.low);
        let rough = mean_bias(&[&apart], 1.0);
        assert!(
            rough.low < bias.value && bias.value < rough.high,
            "{rough:?}"
        );
        // The noise of a single picture is part of its difference, that of the exact one is not.
        let single = TileSums::new(&set(0.55, 0)[..1], &set(0.5, 10), &truth);
        let square = single.bias / weight;
        assert!((square / (0.0025 + 1.0 / 12.0) - 1.0).abs() < 0.05 && single.noise == 0.0);
    }

    /// Protects: the interval of a bias contains it in 19 of 20 choices of twelve tiles of sixty, also where a
    /// quarter of the tiles have most of it.
    #[test]
    fn few_tiles_tell_their_doubt() {
        let held = |case: &u64| {
            let tile = |tile: u64| {
                let number = |k: u64| f64::from(uniform(200 * case + 2 * tile + k));
                let size = if number(0) < 0.25 { 20.0 } else { 1.0 };
                TileSums {
                    pixels: 1.0,
                    bias: size * (0.7 + 0.6 * number(1)),
                    ..TileSums::default()
                }
            };
            let all: Vec<TileSums> = (0..60).map(tile).collect();
            let truth = all.iter().map(|of| of.bias).sum::<f64>() / 60.0;
            let bias = mean_bias(&all[..12].iter().collect::<Vec<_>>(), 0.2);
            bias.low <= truth && truth <= bias.high
        };
        let count = (0..1000).filter(held).count();
        assert!((940..=990).contains(&count), "{count} of 1000");
    }

    /// Protects: the interval of a bias contains it in nine of ten cases, where it is a tenth of the
    /// noise, and where there is none.
    #[test]
    fn intervals_of_bias_hold() {
        for grey in [0.5, 0.53] {
            let held = |case: &u64| {
                let replicate = |grey: f32, seed: u64| -> Vec<[f32; 3]> {
                    let pixel =
                        |index: u64| [grey + uniform(64 * (16 * case + seed) + index) - 0.5; 3];
                    (0..64).map(pixel).collect()
                };
                let set = |grey, seed: u64| (0..4).map(|r| replicate(grey, seed + r)).collect();
                let (own, exact): (Vec<_>, Vec<_>) = (set(grey, 0), set(0.5, 4));
                let sums = TileSums::new(&own, &exact, &[[0.5; 3]; 64]);
                let bias = mean_bias(&[&sums], 1.0);
                let truth = f64::from(grey - 0.5).powi(2) / 0.26;
                bias.low <= truth && truth <= bias.high
            };
            let count = (0..1000).filter(held).count();
            assert!(count >= 900, "{grey}: {count} of 1000");
        }
    }
}
