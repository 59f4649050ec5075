//! Contributions of the rows of a film to the estimate of its error.

use core::ops::Range;

use glam::DVec3;

use super::Film;
use super::estimate::ReplicateStats;
use super::leave_one_out::{LeaveOneOutStats, weight_of_small_lamp};
use super::pixel_variance::{PixelVariance, squared_weighted_dot};
use super::relative_error::{REACH, Surroundings, relative_error_weights};
use super::variance_sum::VarianceSum;

/// Contributions of the pixels in a few rows to the error estimate.
struct RowVariances {
    /// Errors in radiance.
    absolute: Vec<PixelVariance>,
    /// Errors relative to the true colour.
    relative: Vec<PixelVariance>,
}

impl Film {
    /// Returns the means of the pixels in some rows, one list for each replicate.
    fn collect_row_means(
        &self,
        planes: &ReplicateStats<'_>,
        rows: Range<usize>,
        replicates: u32,
    ) -> Vec<Vec<[f64; 3]>> {
        let width = self.plan.crop.width as usize;
        let mut means = vec![Vec::with_capacity(rows.len() * width); replicates as usize];
        let mut each = Vec::new();
        for pixel in rows.start * width..rows.end * width {
            planes.collect_replicate_means(pixel, &mut each);
            means
                .iter_mut()
                .zip(&each)
                .for_each(|(means, &mean)| means.push(mean));
        }
        means
    }

    /// Returns the sums over the pixels of some rows, absolute in radiance and relative, and the
    /// statistics of the leave-one-out test.
    pub(super) fn sum_variances_of_rows(
        &self,
        planes: &ReplicateStats<'_>,
        rows: Range<usize>,
        replicates: u32,
    ) -> ([VarianceSum; 2], LeaveOneOutStats) {
        let width = self.plan.crop.width as usize;
        // Includes the rows of neighbouring pixels.
        let first = rows.start.saturating_sub(REACH);
        let last = (rows.end + REACH).min(self.plan.crop.height as usize);
        let means = self.collect_row_means(planes, first..last, replicates);
        let [absolute, relative] = [(); 2].map(|()| vec![PixelVariance::default(); means[0].len()]);
        let mut band = RowVariances { absolute, relative };
        let inner = (rows.start - first) * width..(rows.end - first) * width;
        let mut leave_one_out = LeaveOneOutStats::default();
        match pairing_weights(replicates) {
            None => band.estimate_from_two_replicates(&means, width),
            Some(shares) => {
                for four in means.chunks_exact(4) {
                    let around = Surroundings::from_replicates(four, width);
                    for pixel in inner.clone() {
                        let at = [0, 1, 2, 3].map(|r: usize| four[r][pixel]);
                        leave_one_out.add_pixel(at, around[pixel].mean);
                        band.add_pixel(pixel, at, &around[pixel], shares);
                    }
                }
            }
        }
        let sums = [&band.absolute, &band.relative]
            .map(|pixels| sum_pixel_variances(&pixels[inner.clone()]));
        (sums, leave_one_out)
    }
}

/// Returns the factor on each of the three pairings of four replicates, in the variance of the mean
/// and in the mean of products; `None` for fewer than four replicates.
fn pairing_weights(replicates: u32) -> Option<[f64; 2]> {
    let fours = replicates / 4;
    (fours > 0)
        .then(|| [4.0 / f64::from(replicates), 1.0].map(|share| share / f64::from(3 * fours)))
}

/// Returns the sums over some pixels.
fn sum_pixel_variances(pixels: &[PixelVariance]) -> VarianceSum {
    let mut sum = VarianceSum::default();
    pixels
        .iter()
        .for_each(|&pixel| sum += VarianceSum::from_pixel(pixel));
    sum
}

impl RowVariances {
    /// Adds the variance of a pixel's mean from the means of four replicates; equal means
    /// contribute nothing. `shares` are the results of [`pairing_weights`].
    fn add_pixel(
        &mut self,
        pixel: usize,
        four: [[f64; 3]; 4],
        around: &Surroundings,
        shares: [f64; 2],
    ) {
        if four[1..].iter().any(|other| *other != four[0]) {
            let at = four.map(DVec3::from);
            self.absolute[pixel].add_absolute_variance(at, around, shares);
            let most = weight_of_small_lamp(at);
            self.relative[pixel].add_relative_variance(at, around, most, shares);
        }
    }

    /// Estimates the variances of the pixels' means from two or three replicates: by the
    /// differences of the first two, relative to the means of these two. In products, the
    /// difference of the neighbouring pixel serves as the second, independent difference.
    fn estimate_from_two_replicates(&mut self, means: &[Vec<[f64; 3]>], width: usize) {
        let (a, b) = (&means[0], &means[1]);
        let weights = relative_error_weights(a, b, width);
        for pixel in 0..a.len() {
            let beside = if (pixel + 1).is_multiple_of(width) {
                pixel.saturating_sub(1)
            } else {
                pixel + 1
            };
            let one: [f64; 3] = core::array::from_fn(|i| a[pixel][i] - b[pixel][i]);
            let two: [f64; 3] = core::array::from_fn(|i| a[beside][i] - b[beside][i]);
            // A quarter of the squared difference estimates the variance of two replicates' mean.
            let share = 2.0 / means.len() as f64 / 4.0;
            let value_of = |weights: [f64; 3], beside: [f64; 3]| {
                let variance = share * (0..3).map(|i| weights[i] * one[i] * one[i]).sum::<f64>();
                PixelVariance {
                    variances: [variance, variance, variance, 0.0],
                    product: squared_weighted_dot(one, two, weights, beside),
                    ..PixelVariance::default()
                }
            };
            self.absolute[pixel] = value_of([1.0; 3], [1.0; 3]);
            self.relative[pixel] = value_of(weights[pixel], weights[beside]);
        }
    }
}
