//! Mean radiance of a pixel and the standard error of this mean, estimated from the pixel's
//! replicates.

use super::relative_error::average_over_square;
use super::sums::COVERAGE_UNITS;
use super::{Film, FilmPart, ReplicateBuffer};

/// Statistics over the independent parts of a film's samples, in ascending order of replicates.
pub(super) struct ReplicateStats<'a> {
    /// Buffers of each independent part. Empty where the part has no samples.
    parts: Vec<Vec<&'a ReplicateBuffer>>,
    /// Whether all replicates have equal weight, whatever their number of samples. Under adaptive
    /// sampling, the number of samples depends on the colours of other replicates: weights by
    /// number would bias the mean.
    equal_weights: bool,
}

impl<'a> ReplicateStats<'a> {
    pub fn new(parts: impl Iterator<Item = Vec<&'a ReplicateBuffer>>, even: bool) -> Self {
        Self {
            parts: parts.collect(),
            equal_weights: even,
        }
    }

    fn buffers(&self) -> impl Iterator<Item = &'a ReplicateBuffer> {
        self.parts.iter().flatten().copied()
    }

    /// Returns the summed radiance and the number of samples of a pixel in each independent part in
    /// which it has samples.
    fn sampled_parts(&self, pixel: usize) -> impl Iterator<Item = ([f64; 3], f64)> {
        let total = move |part: &Vec<&ReplicateBuffer>| {
            part.iter().fold(([0.0; 3], 0.0), |(sum, count), buffer| {
                let own = buffer.pixel_total(pixel);
                (
                    core::array::from_fn(|i| sum[i] + own[i]),
                    count + f64::from(buffer.samples[pixel]),
                )
            })
        };
        self.parts
            .iter()
            .map(total)
            .filter(|&(_, count)| count > 0.0)
    }

    /// Returns the mean radiance of a pixel, black without samples, and its number of samples.
    /// Replicates are added in ascending order.
    #[inline]
    pub fn mean(&self, pixel: usize) -> ([f64; 3], f64) {
        let (mut sum, mut count, mut weights) = ([0.0; 3], 0_u64, 0.0);
        for buffer in self.buffers() {
            let (value, n) = (buffer.pixel_total(pixel), buffer.samples[pixel]);
            let weight = if self.equal_weights {
                1.0 / f64::from(n.max(1))
            } else {
                1.0
            };
            sum = core::array::from_fn(|i| sum[i] + weight * value[i]);
            weights += weight * f64::from(n);
            count += u64::from(n);
        }
        (sum.map(|s| s / weights.max(1.0)), count as f64)
    }

    /// Returns the coverage (alpha) of a pixel, 0 to 1.
    pub fn coverage(&self, pixel: usize) -> f64 {
        self.average_coverage(pixel, |buffer| &buffer.covered)
    }

    /// Returns the share of a pixel that the shadow on the studio's ground covers, 0 to 1.
    pub fn shadow_coverage(&self, pixel: usize) -> f64 {
        self.average_coverage(pixel, |buffer| &buffer.shadowed)
    }

    fn average_coverage(
        &self,
        pixel: usize,
        value_of: impl Fn(&ReplicateBuffer) -> &Vec<u32>,
    ) -> f64 {
        let (mut covered, mut weights) = (0.0, 0.0);
        for buffer in self.buffers() {
            let n = buffer.samples[pixel];
            let weight = if self.equal_weights {
                1.0 / f64::from(n.max(1))
            } else {
                1.0
            };
            covered += weight * (f64::from(value_of(buffer)[pixel]) / f64::from(COVERAGE_UNITS));
            weights += weight * f64::from(n);
        }
        covered / f64::max(weights, 1.0)
    }

    /// Returns the number of replicates in which a pixel has samples.
    pub fn replicate_count(&self, pixel: usize) -> u32 {
        self.sampled_parts(pixel).count() as u32
    }

    /// Overwrites `means` with the pixel's mean radiance in each replicate in which it has samples.
    pub fn collect_replicate_means(&self, pixel: usize, means: &mut Vec<[f64; 3]>) {
        means.clear();
        means.extend(
            self.sampled_parts(pixel)
                .map(|(sum, count)| sum.map(|sum| sum / count)),
        );
    }

    /// Returns the standard error of each pixel's mean radiance, per channel. The film has `pixels`
    /// pixels in rows of `width`. The error is −1, unknown, for a pixel with fewer than two
    /// replicates.
    ///
    /// Few replicates may all miss a rarely found light, or find equal amounts of it by chance.
    /// Their variance would then be far too small, or zero. Therefore the variance is compared with
    /// its mean over the pixel and its neighbours. A variance below the 0.1 % quantile for this
    /// number of replicates counts as chance; the 5 % quantile replaces it.
    ///
    /// - A black pixel without lit neighbours is compared with the mean of the whole picture,
    ///   unless its camera rays hit nothing.
    /// - A single quantile for comparison and replacement would give intervals that hold in 97.5 %
    ///   of pixels for even noise, but in 83 % for rare light.
    /// - The compared number is the variance of one sample, not of the mean: neighbours may have
    ///   other sample counts.
    ///
    /// Let m be the mean and t the quantile of Student's distribution with one degree of freedom
    /// less than replicates ([`student_factor_95`](crate::metrics::student_factor_95)), 3.18 for
    /// four replicates. Then m ± t·error contains the true mean in 95 % of pixels.
    pub fn standard_errors(&self, pixels: usize, width: usize) -> Vec<[f32; 3]> {
        let means: Vec<ReplicateDeviations> = (0..pixels)
            .map(|pixel| self.replicate_deviations(pixel))
            .collect();
        let known = |means: &ReplicateDeviations| means.replicates >= 2;
        let of_sample =
            |means: &ReplicateDeviations| means.variance().map(|variance| variance * means.samples);
        let of_samples: Vec<[f64; 3]> = means
            .iter()
            .map(|means| {
                if known(means) {
                    of_sample(means)
                } else {
                    [0.0; 3]
                }
            })
            .collect();
        let counts: Vec<[f64; 3]> = means
            .iter()
            .map(|means| [f64::from(u8::from(known(means))); 3])
            .collect();
        let of_picture: [f64; 3] = core::array::from_fn(|i| {
            let [sum, count] =
                [&of_samples, &counts].map(|of| of.iter().map(|value| value[i]).sum::<f64>());
            if count > 0.0 { sum / count } else { 0.0 }
        });
        let [sums, counts] = [&of_samples, &counts].map(|of| average_over_square(of, width));
        let error = |(pixel, means): (usize, &ReplicateDeviations)| {
            if !known(means) {
                return [-1.0; 3];
            }
            let [threshold, floor] =
                chi_square_quantiles(means.replicates - 1).map(|share| share / means.samples);
            let own = means.variance();
            core::array::from_fn(|i| {
                let near = sums[pixel][i] / counts[pixel][i];
                let near = if near == 0.0 && self.may_have_missed_light(pixel, i) {
                    of_picture[i]
                } else {
                    near
                };
                (if own[i] < threshold * near {
                    floor * near
                } else {
                    own[i]
                })
                .sqrt() as f32
            })
        };
        means.iter().enumerate().map(error).collect()
    }

    /// Whether a channel of a pixel is black in all replicates, but light is possible because
    /// camera rays hit a surface. Without counts of such hits, light is possible in every black
    /// pixel.
    fn may_have_missed_light(&self, pixel: usize, channel: usize) -> bool {
        let is_empty = |buffer: &ReplicateBuffer| {
            buffer
                .covered
                .get(pixel)
                .is_some_and(|&covered| covered == 0)
                || buffer.first_hits.get(pixel).is_some_and(|&n| n == 0)
        };
        let is_black = |buffer: &ReplicateBuffer| buffer.pixel_total(pixel)[channel] == 0.0;
        self.buffers().all(is_black) && !self.buffers().all(is_empty)
    }

    /// Returns the deviations of a pixel's replicates from the pixel's mean.
    pub fn replicate_deviations(&self, pixel: usize) -> ReplicateDeviations {
        let (mean, samples) = self.mean(pixel);
        let mut means = ReplicateDeviations {
            squared_deviations: [0.0; 3],
            replicates: self.replicate_count(pixel),
            samples,
        };
        for (sum, n) in self.sampled_parts(pixel) {
            let apart: [f64; 3] = core::array::from_fn(|i| sum[i] / n - mean[i]);
            let weight = if self.equal_weights {
                samples / f64::from(means.replicates)
            } else {
                n
            };
            means.squared_deviations = core::array::from_fn(|i| {
                means.squared_deviations[i] + weight * apart[i] * apart[i]
            });
        }
        means
    }
}

impl Film {
    /// Returns the mean radiance of each pixel of a tile, one list for each net of independent
    /// samples; `None` if a replicate of the tile is incomplete.
    pub(crate) fn tile_replicates(&self, tile: u32) -> Option<Vec<Vec<[f32; 3]>>> {
        let part = FilmPart {
            tiles: tile..tile + 1,
            ..self.full_part()
        };
        let together = self.plan.replicates_per_net();
        let means = |first: u32| {
            let buffers: Vec<ReplicateBuffer> = (first..first + together)
                .map(|replicate| self.tile_buffer(tile, replicate))
                .collect();
            let mean = |pixel: usize| {
                let samples: f64 = buffers.iter().map(|b| f64::from(b.samples[pixel])).sum();
                let total = |channel: usize| -> f64 {
                    buffers.iter().map(|b| b.pixel_total(pixel)[channel]).sum()
                };
                [0, 1, 2].map(|channel| (total(channel) / samples.max(1.0)) as f32)
            };
            (0..self.plan().tile_pixel_count(tile) as usize)
                .map(mean)
                .collect()
        };
        (self.unfinished_tiles(&part) == 0).then(|| {
            part.replicates
                .step_by(together as usize)
                .map(means)
                .collect()
        })
    }
}

/// Returns the 0.1 % and the 5 % quantile of the ratio of an estimated variance to the true
/// variance. These are quantiles of χ² divided by `freedom`, the degrees of freedom.
///
/// Values for up to three degrees are tabulated. For more degrees, an approximation is accurate to
/// 0.01 (Wilson, Hilferty, "The Distribution of Chi-Square", 1931).
fn chi_square_quantiles(freedom: u32) -> [f64; 2] {
    const FEW: [[f64; 2]; 4] = [
        [0.0, 0.0],
        [0.000_002, 0.003_932],
        [0.001_001, 0.051_293],
        [0.008_099, 0.117_282],
    ];
    FEW.get(freedom as usize).copied().unwrap_or_else(|| {
        let spread = 2.0 / (9.0 * f64::from(freedom));
        [3.090_232, 1.644_854].map(|quantile| (1.0 - spread - quantile * spread.sqrt()).powi(3))
    })
}

/// Squared deviations of a pixel's replicates from the pixel's mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReplicateDeviations {
    /// Weighted sum over replicates of the squared deviation, per channel. The weights are all
    /// equal or proportional to the replicates' sample counts; their sum is the number of samples.
    pub squared_deviations: [f64; 3],
    /// Number of replicates with samples.
    pub replicates: u32,
    /// Number of samples in all replicates.
    pub samples: f64,
}

impl ReplicateDeviations {
    /// Returns the variance of the pixel's mean m per channel: Σ nᵣ(mᵣ − m)² / (n(R − 1)). The sum
    /// is over the pixel's R replicates; replicate r has nᵣ samples of mean mᵣ, and n is the sum of
    /// all nᵣ.
    pub fn variance(&self) -> [f64; 3] {
        self.squared_deviations
            .map(|b| b / (self.samples * f64::from(self.replicates - 1)))
    }
}
