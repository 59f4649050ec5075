//! Contributions of the rows of a film to the estimate of its error.

use core::ops::{AddAssign, Range};

use glam::DVec3;

use super::Film;
use super::error_estimate::ErrorEstimate;
use super::estimate::ReplicateStats;
use super::leave_one_out::{LeaveOneOutStats, weight_of_small_lamp};
use super::relative_error::{REACH, Surroundings, relative_error_weights};
use crate::metrics::student_factor_95;

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

// Sums of the variances of pixels, and the error of a picture that follows from them.

/// Greatest ratio of the squared relative errors without and with the bound for small lamps. Above it
/// light is rare: whether it is of small lamps or of bright samples decides its error.
const MAX_LAMP_RATIO: f64 = 4.0;

/// Ratio that takes the place of [`MAX_LAMP_RATIO`] for an error carried by few pixels.
const MAX_LAMP_RATIO_OF_FEW: f64 = 1.25;

/// Greatest ratio of two weightings by colours that may be true, for denoised pictures.
const MAX_WEIGHTING_RATIO: f64 = 3.0;

/// Squared relative error of a pixel's variance whose light is all rare, by the unknown true colour.
/// Chosen so that intervals of 32 scenes hold in 93 to 97 % of the claims.
const RARE_LIGHT_ERROR: f64 = 0.3;

/// Fewest pixels that must carry the error, that is have most of it. An error carried by fewer
/// pixels is doubtful if [`NOISY_PIXELS_PER_CARRIER`] times as many pixels are noisy, or if its
/// light is rare.
const FEWEST: f64 = 16.0;

/// Ratio of noisy pixels to pixels that carry the error, above which few carriers are doubtful.
const NOISY_PIXELS_PER_CARRIER: f64 = 4.0;

/// Sums of the contributions of pixels to the picture's error estimate.
#[derive(Clone, Copy, Default)]
pub(super) struct VarianceSum {
    /// Variance of the pixels' means: relative to the likeliest true colours and their variances,
    /// relative to the likeliest colours alone, and as the first with the bound for small lamps.
    variances: [f64; 3],
    /// Sum over pixels of the squared variance.
    square: f64,
    /// Sum over pixels of the square root of the variance.
    root: f64,
    /// Sum over pixels of the squared uncertainty of their weights: the difference of the first two
    /// variances, and the variance times the standard error of its weight.
    uncertainty: f64,
    /// Squared products of two independent differences between replicates; see [`PixelVariance`] for
    /// the others. Each with the sum of the squares over pixels.
    product: [f64; 2],
    neighbour_product: [f64; 2],
    square_product: f64,
}

impl AddAssign for VarianceSum {
    fn add_assign(&mut self, other: Self) {
        let add = |into: &mut [f64], of: &[f64]| {
            into.iter_mut().zip(of).for_each(|(into, of)| *into += of);
        };
        add(&mut self.variances, &other.variances);
        add(&mut self.product, &other.product);
        add(&mut self.neighbour_product, &other.neighbour_product);
        self.square_product += other.square_product;
        self.uncertainty += other.uncertainty;
        self.square += other.square;
        self.root += other.root;
    }
}

impl VarianceSum {
    /// Returns the sums for one pixel.
    pub fn from_pixel(pixel: PixelVariance) -> Self {
        let [variance, likeliest, bounded, deviation] = pixel.variances;
        let apart = likeliest - variance;
        Self {
            variances: [variance, likeliest, bounded],
            square: variance * variance,
            root: variance.sqrt(),
            uncertainty: apart * apart + deviation * deviation,
            product: [pixel.product, pixel.product * pixel.product],
            neighbour_product: [
                pixel.neighbour_product,
                pixel.neighbour_product * pixel.neighbour_product,
            ],
            square_product: pixel.square_product,
        }
    }

    /// Returns the variance of the pixels' means.
    pub fn variance(&self) -> f64 {
        self.variances[0]
    }

    /// Whether too few pixels have most of the error, compared with the number of noisy pixels. The
    /// latter is (Σ√v)²/Σv for the pixels' variances v, which also counts pixels of little noise.
    pub fn is_dominated_by_few_pixels(&self) -> bool {
        let [variance, _, bounded] = self.variances;
        let (carriers, noisy) = (self.carriers(), self.root * self.root / variance);
        carriers < FEWEST
            && (carriers < noisy / NOISY_PIXELS_PER_CARRIER
                || variance > MAX_LAMP_RATIO_OF_FEW * bounded)
    }

    /// Whether light is so rare that its error is unknown, unless other pixels tell small lamps from
    /// bright samples.
    pub fn is_light_rare(&self) -> bool {
        self.variances[0] > MAX_LAMP_RATIO * self.variances[2]
    }

    /// Whether the true colours are so uncertain that two weightings of the error differ widely.
    pub fn are_weightings_apart(&self) -> bool {
        self.variances[1] > MAX_WEIGHTING_RATIO * self.variances[0]
    }

    /// Estimates the root of the mean squared error over `pixels` pixels and three channels, with
    /// its interval. `lamps` is the share of rare light that is of small lamps.
    pub fn estimate_root_mean(&self, lamps: f64, pixels: f64, replicates: f64) -> ErrorEstimate {
        let [variance, likeliest, bounded] = self.variances;
        if variance <= 0.0 {
            return ErrorEstimate {
                value: 0.0,
                low: 0.0,
                high: 0.0,
                carriers: f64::INFINITY,
            };
        }
        let middle = (variance * likeliest).sqrt();
        let mean_square = middle * libm::pow(bounded / variance, lamps) / (3.0 * pixels);
        // At least the variance of the sum if all channels had equal variances.
        let minimum = 2.0 * replicates / (3.0 * (replicates - 1.0) * pixels);
        let of_own = 1.0 / (2.0 * replicates * (replicates - 1.0));
        // Coloured noise is less alike in the three channels than grey noise.
        let of_near = if self.square_product > 0.0 {
            2.0 * replicates / (replicates - 1.0) * self.product[0] / self.square_product
        } else {
            0.0
        };
        let [own, near] = [(self.product, of_own), (self.neighbour_product, of_near)]
            .map(|([sum, square], share)| (share * sum, 2.0 * sum * sum / square));
        let rarity = 1.0 - bounded / variance;
        let (products, freedom) = if near.0 > own.0 && rarity > 0.0 {
            (own.0 + (near.0 - own.0) * (2.0 * rarity).min(1.0), near.1)
        } else {
            own
        };
        let spread = (products / (middle * middle)).max(minimum)
            + self.uncertainty / (middle * middle)
            + RARE_LIGHT_ERROR * rarity / self.carriers()
            + (libm::log(likeliest / variance) / 2.0).powi(2);
        // Degrees of freedom of the sum, rounded down; infinite without any contribution.
        let factor = student_factor_95(if freedom.is_finite() {
            freedom as u32
        } else {
            u32::MAX
        });
        let width = factor * spread.sqrt();
        let root = |factor: f64| (mean_square * factor).sqrt();
        ErrorEstimate {
            value: root(1.0),
            low: root(libm::exp(-width)),
            high: root(libm::exp(width)),
            carriers: self.carriers(),
        }
    }

    /// Returns the effective number of pixels that carry the error.
    fn carriers(&self) -> f64 {
        self.variances[0] * self.variances[0] / self.square
    }
}

// Contribution of one pixel to the error estimate of the picture: the variance of the pixel's
// mean, relative to estimates of its squared true colour, and squared products of differences
// between replicates.

/// The three ways to divide four replicates into two pairs: indices of the first pair, then of the
/// second pair.
const PAIRINGS: [[usize; 4]; 3] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]];

/// Contribution of a pixel to the error estimate of the picture, see
/// [`uncertainty`](super::uncertainty).
#[derive(Clone, Copy, Default)]
pub(super) struct PixelVariance {
    /// Variance of the pixel's mean with four weights: relative to the likeliest true colour and its
    /// variance, relative to the likeliest colour alone, as the first but at most with the weight of
    /// a small lamp, and times the standard error of the first weight.
    pub variances: [f64; 4],
    /// Squared products of the differences of two disjoint pairs of replicates.
    pub product: f64,
    /// Products of the squared differences of two disjoint pairs: `product` where noise is grey.
    pub square_product: f64,
    /// Product of the variance with the variance of the pixel's neighbours, relative to their own
    /// colour: estimates `product` where a bright sample is so rare that hardly any pixel has two.
    pub neighbour_product: f64,
}

impl PixelVariance {
    /// Adds the absolute variance of the pixel's mean, in squared radiance; all weights are 1. The
    /// other arguments are those of [`Self::add_relative_variance`].
    pub fn add_absolute_variance(
        &mut self,
        at: [DVec3; 4],
        around: &Surroundings,
        shares: [f64; 2],
    ) {
        let weights = [DVec3::ONE, DVec3::ONE, DVec3::ONE, DVec3::ZERO];
        self.add(at, around, shares, |_, _| weights);
    }

    /// Adds the variance of the pixel's mean, relative to the squared true colour. `at` holds the
    /// means of four replicates, `around` what the neighbours say about the true colour. `shares`
    /// are the factors on each of the three [`PAIRINGS`], in the variance and in the products.
    /// `most` is the weight of a small lamp.
    pub fn add_relative_variance(
        &mut self,
        at: [DVec3; 4],
        around: &Surroundings,
        most: DVec3,
        shares: [f64; 2],
    ) {
        self.add(at, around, shares, |own, noise| {
            let [weight, likeliest, deviation] = around.weights(own, noise);
            [weight, likeliest, weight.min(most), deviation]
        });
    }

    /// Adds a variance. `weigh` returns the four weights of a squared difference, given the mean of
    /// replicates that are not part of it, and the variance of that mean over the variance of the
    /// mean of four.
    ///
    /// The difference of two replicates has twice the variance of one. An eighth of the squared
    /// difference therefore estimates the variance of the mean of four.
    fn add(
        &mut self,
        at: [DVec3; 4],
        around: &Surroundings,
        shares: [f64; 2],
        weigh: impl Fn(DVec3, f64) -> [DVec3; 4],
    ) {
        let [of_all, ..] = weigh(at.iter().sum::<DVec3>() / 4.0, 1.0);
        let before = self.variances[0];
        for [a, b, c, d] in PAIRINGS.map(|pairing| pairing.map(|r| at[r])) {
            let (one, two) = (a - b, c - d);
            let [of_one, of_two] = [c + d, a + b].map(|sum| weigh(sum / 2.0, 2.0));
            for ((variance, of_one), of_two) in self.variances.iter_mut().zip(of_one).zip(of_two) {
                let sum = (of_one * one * one + of_two * two * two).element_sum();
                *variance += shares[0] * sum / 16.0;
            }
            let [dot, square, other] =
                [one * two, one * one, two * two].map(|of| (of_all * of).element_sum());
            self.product += shares[1] * dot * dot;
            self.square_product += shares[1] * square * other;
        }
        let [of_near, ..] = weigh(around.mean, 0.0);
        let near = (of_near * around.noise).element_sum() * shares[0] / shares[1];
        self.neighbour_product += (self.variances[0] - before) * near;
    }
}

/// Returns (Σᵢ √(uᵢ·vᵢ)·aᵢ·bᵢ)², summed over the channels i. The differences are a = `one` and b =
/// `two`, their weights u = `of_one` and v = `of_two`.
pub(super) fn squared_weighted_dot(
    one: [f64; 3],
    two: [f64; 3],
    of_one: [f64; 3],
    of_two: [f64; 3],
) -> f64 {
    let dot: f64 = (0..3)
        .map(|i| (of_one[i] * of_two[i]).sqrt() * one[i] * two[i])
        .sum();
    dot * dot
}
