//! Uncertainty of a picture: an estimate of its error against the true picture, from the replicates
//! of all pixels.
//!
//! A pixel's replicates give the variance v of its mean, which estimates the squared error e². Let
//! xᵣ be the deviation of the mean of replicate r of R from the truth. Then e² − v = 2/(R(R − 1)) ·
//! Σ xᵣxₛ over the pairs r < s, for any distribution: a rare bright sample is part of both e² and
//! v, and the rest are products of independent numbers. Their variance is 2 tr(C²)/(R(R − 1)) for
//! channels of covariance C. It has an unbiased estimate, too, because the differences of two pairs
//! of replicates are independent: (d·d′)²/4 has the mean tr(C²). Pixels are independent, because
//! each has its own scrambles. So both estimates are summed over the picture, and the sum is nearly
//! normal if many pixels contribute.
//!
//! The denominator of relative errors is itself estimated, in three variants. If it is the mean of
//! the replicates themselves, the relative error is wrong by about the inverse of their number: a
//! bright sample is part of error and denominator, and noise makes other pixels dark. So the
//! results with the means of pairs and of all four replicates are extrapolated to very many
//! replicates (Quenouille, "Notes on Bias in Estimation", 1956). This extrapolation is the
//! estimated value, accurate to a hundredth for even noise. The other two variants are the product
//! of the pair of replicates that is not part of the error, and the products of all four. Where
//! light is rarely found, the product of the pair gives too large an error, because the pair seldom
//! found light, and the products of all four too small an error. The standard error of the value is
//! half of the distance between both variants, or half of the distance of their geometric mean from
//! the value, whichever is more. The variant by the pair is also noisy; its noise is taken to be
//! the difference of both variants in each pixel. With fewer than four replicates no other pair
//! exists; then the value is a guess without an interval.
//!
//! The variance is a sum that few pixels may dominate, as at a lamp's ends. Then it is as uncertain
//! as a variance of fewer normal numbers, 2(Σq)²/Σq² for sums of q (Satterthwaite, "An Approximate
//! Distribution of Estimates of Variance Components", 1946), and Student's factor replaces the
//! normal one. `benches/calibration.rs` measures how often the intervals hold, and from how many
//! pixels on they are reliable.
//!
//! Where lamps are small and many, a pixel that is lit in a single replicate is not black; treated
//! as black, a few such pixels would dominate the error. The leave-one-out test
//! (`film::leave_one_out`) decides whether other pixels confirm such light, and gives the
//! denominator of its error; then the value is the geometric mean. Where light is not rare it needs
//! no confirmation: the means of replicates are accurate to a hundredth in a room lit through a
//! window, where the geometric mean is a tenth too small.
//!
//! Light that no sample found is in none of these estimates. But its possibility can be detected:
//! paths that scatter diffusely and then continue by a mirror or through glass hit lamps and suns
//! by chance alone. If many such paths were traced and few hit a lamp, most of that light is
//! missing. The number of hits is a Poisson number, known within a sixth at forty.

use core::ops::{AddAssign, Range};

use glam::DVec3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;

use super::estimate::ReplicateStats;
use super::leave_one_out::{LeaveOneOutStats, SingleReplicateBound};
use super::pixel_variance::{PixelVariance, squared_weighted_dot};
use super::relative_error::{REACH, relative_error_weights};
use super::{Film, ReplicateBuffer};
use crate::metrics::student_factor_95;

/// Greatest ratio of two estimates of the squared relative error: with each difference of a pair of
/// replicates relative to the other pair, and relative to the pair itself. Above this ratio light
/// is so rare that no denominator is accurate, unless other pixels confirm the light.
const MAX_WEIGHTING_RATIO: f64 = 4.0;

/// Fewest pixels that must carry the error, that is have most of it. An error carried by fewer
/// pixels is doubtful if [`NOISY_PIXELS_PER_CARRIER`] times as many pixels are noisy, or if other
/// pixels hardly confirm the light.
const FEWEST: f64 = 40.0;
/// Ratio of noisy pixels to pixels that carry the error, above which few carriers are doubtful.
const NOISY_PIXELS_PER_CARRIER: f64 = 4.0;
/// Ratio that takes the place of [`MAX_WEIGHTING_RATIO`] for an error carried by few pixels.
const MAX_UNCONFIRMED_RATIO: f64 = 2.0;

/// Factor by which an estimate carried by few pixels must be below the requested error. In 1,600
/// pictures of 20 scenes, black ones excepted, the error was never more than three times the upper
/// end of the interval.
const FEW_PIXELS_MARGIN: f64 = 10.0;

/// Fewest hits of lamps by chance alone from which the light of such lamps is determined.
const FEWEST_FOUND: u64 = 40;

/// If fewer than one path in this number of samples may hit lamps by chance alone, the light of
/// these lamps is negligible.
const ONE_IN: u64 = 500;

/// Least number of replicates for an interval.
const MIN_REPLICATES: u32 = 4;

/// Number of pixel rows in a parallel work item.
const BAND_ROWS: usize = 32;

/// Estimate of a picture's error, with a confidence interval. In 95 of 100 renders, the interval
/// contains the true error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorEstimate {
    /// Most likely value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// Effective number of pixels that carry the error: (Σv)²/Σv² of their variances (Kish, "Survey
    /// Sampling", 1965).
    pub carriers: f64,
}

/// Error of a picture, estimated from its own samples without a reference picture. Light that no
/// sample found cannot be included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[doc(alias("variance", "standard error"))]
pub struct Uncertainty {
    /// Root mean squared error over pixels and channels, in radiance.
    pub rmse: ErrorEstimate,
    /// Root of the mean relative squared error, (I − R)²/(R² + 0.01).
    pub root_relmse: ErrorEstimate,
    /// Least number of replicates of a pixel.
    pub replicates: u32,
    /// Reason to doubt the interval of the relative error; `None` for a reliable interval.
    pub doubt: Option<EstimateDoubt>,
}

impl Uncertainty {
    /// Whether the relative error is below `error`, by the upper end of the interval. If few pixels
    /// carry the error, the upper end has to be far below.
    pub fn is_error_below(&self, error: f64) -> bool {
        let high = self.root_relmse.high;
        match self.doubt {
            None => high <= error,
            Some(EstimateDoubt::FewPixels) => high > 0.0 && FEW_PIXELS_MARGIN * high <= error,
            Some(_) => false,
        }
    }
}

/// Reason not to rely on the confidence interval of an [`ErrorEstimate`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EstimateDoubt {
    /// Fewer than four replicates.
    FewSamples,
    /// Lamps or small bright parts of the sky are hit through mirrors or glass by chance alone,
    /// with few hits so far: most of their light may be missing.
    LightByChance,
    /// A few pixels have most of the error, or a few samples in each of many pixels; or shadow rays
    /// were traced to lamps and the picture is black.
    FewPixels,
    /// The interval is too wide to be useful: for example, a few blocks of a denoised picture have
    /// most of its error.
    WideInterval,
}

/// Sums of the contributions of pixels to the picture's error estimate.
#[derive(Clone, Copy, Default)]
struct VarianceSum {
    /// Variance of the pixels' means, with each difference of a pair of replicates relative to the
    /// other pair.
    variance: f64,
    /// The same variance, relative to the products of all four replicates.
    by_four: f64,
    /// The same variance, relative to the squared mean of all replicates.
    by_mean: f64,
    /// The same variance, with each difference of a pair relative to the square of that pair's
    /// mean.
    by_pair_mean: f64,
    /// Squared products of two independent differences between replicates.
    product: f64,
    /// Uncertainty of the denominator where a single replicate found light: sum of squares of the
    /// part that is independent between pixels.
    event_uncertainty: f64,
    /// Sum of the part of this uncertainty that is common to all pixels.
    prior_uncertainty: f64,
    /// Sum over pixels of the squared variance.
    square: f64,
    /// Sum over pixels of the square root of the variance.
    root: f64,
    /// Sum over pixels of the squared difference between `variance` and `by_four`.
    squared_difference: f64,
    /// Sum over pixels of the squared products.
    product_square: f64,
}

impl AddAssign for VarianceSum {
    fn add_assign(&mut self, other: Self) {
        self.variance += other.variance;
        self.by_four += other.by_four;
        self.by_mean += other.by_mean;
        self.by_pair_mean += other.by_pair_mean;
        self.product += other.product;
        self.event_uncertainty += other.event_uncertainty;
        self.prior_uncertainty += other.prior_uncertainty;
        self.square += other.square;
        self.root += other.root;
        self.squared_difference += other.squared_difference;
        self.product_square += other.product_square;
    }
}

impl VarianceSum {
    /// Returns the sums for one pixel.
    fn from_pixel(
        PixelVariance {
            variance,
            by_four: among,
            by_mean: own,
            by_pair_mean: seen,
            product,
            event_uncertainty: unsure,
            prior_uncertainty: prior,
        }: PixelVariance,
    ) -> Self {
        let difference = variance - among;
        let (square, apart, product_square) = (
            variance * variance,
            difference * difference,
            product * product,
        );
        let (unsure, root) = (unsure * unsure, variance.sqrt());
        Self {
            variance,
            by_four: among,
            by_mean: own,
            by_pair_mean: seen,
            product,
            event_uncertainty: unsure,
            prior_uncertainty: prior,
            square,
            root,
            squared_difference: apart,
            product_square,
        }
    }

    /// Whether too few pixels have most of the error, compared with the number of noisy pixels. The
    /// latter is (Σ√v)²/Σv for the pixels' variances v, which also counts pixels of little noise.
    fn is_dominated_by_few_pixels(&self) -> bool {
        let (carriers, noisy) = (
            self.squared_variance() / self.square,
            self.root * self.root / self.variance,
        );
        carriers < FEWEST
            && (carriers < noisy / NOISY_PIXELS_PER_CARRIER
                || self.variance > MAX_UNCONFIRMED_RATIO * self.by_pair_mean)
    }

    /// Whether light is so rare that two replicates seldom find the same light.
    fn is_light_rare(&self) -> bool {
        self.variance > MAX_WEIGHTING_RATIO * self.by_pair_mean
    }

    /// Returns the geometric mean of the variance relative to the other pair of replicates, and of
    /// the variance relative to the products of all four.
    fn geometric_mean(&self) -> f64 {
        (self.variance * self.by_four).sqrt()
    }

    /// Extrapolates the variance to very many replicates, from the variances relative to the means
    /// of two and of four replicates: the bias is nearly inverse to the number of replicates.
    fn extrapolate_to_many_replicates(&self) -> f64 {
        (2.0 * self.by_mean - self.by_pair_mean).max(self.by_mean / 2.0)
    }

    /// Estimates the root of the mean squared error over `pixels` pixels and three channels, with
    /// its interval; `sum` is the variance summed over all of them.
    fn estimate_root_mean(&self, sum: f64, pixels: f64, replicates: f64) -> ErrorEstimate {
        if self.variance <= 0.0 {
            return ErrorEstimate {
                value: 0.0,
                low: 0.0,
                high: 0.0,
                carriers: f64::INFINITY,
            };
        }
        let mean_square = sum / (3.0 * pixels);
        // At least the variance of the sum if all channels had equal variances.
        let minimum = 2.0 * replicates / (3.0 * (replicates - 1.0) * pixels);
        let products = (self.product
            / (2.0 * replicates * (replicates - 1.0))
            / (self.by_four * self.by_four))
            .max(minimum);
        let weights = self.squared_difference / self.squared_variance();
        let apart = [self.variance / self.by_four, self.geometric_mean() / sum]
            .map(|ratio| libm::log(ratio).abs() / 2.0);
        let relative_to = apart[0].max(apart[1]);
        let (chance, prior) = (
            self.event_uncertainty / (self.variance * self.by_four),
            self.prior_uncertainty / self.geometric_mean(),
        );
        // Uncertainties common to all pixels may have the same sign and add up; independent causes
        // add as squares.
        let alike = relative_to + prior;
        let spread = products + weights + chance + alike * alike;
        // Degrees of freedom of the sum, rounded down; infinite without any contribution.
        let freedom = 2.0 * self.product * self.product / self.product_square;
        let factor = student_factor_95(if freedom.is_finite() {
            freedom as u32
        } else {
            u32::MAX
        });
        let width = factor * spread.sqrt();
        let root = |factor: f64| (mean_square * factor).sqrt();
        let carriers = self.squared_variance() / self.square;
        ErrorEstimate {
            value: root(1.0),
            low: root(libm::exp(-width)),
            high: root(libm::exp(width)),
            carriers,
        }
    }

    fn squared_variance(&self) -> f64 {
        self.variance * self.variance
    }
}

/// Contributions of the pixels in a few rows to the error estimate.
struct RowVariances {
    /// Errors in radiance.
    absolute: Vec<PixelVariance>,
    /// Errors relative to the true colour.
    relative: Vec<PixelVariance>,
}

impl Film {
    /// Estimates the error of the picture so far; `None` without random sampling, or if a pixel has
    /// fewer than two replicates.
    pub fn estimate_uncertainty(&self) -> Option<Uncertainty> {
        self.estimate_uncertainty_and_rarity()
            .map(|(uncertainty, _)| uncertainty)
    }

    /// Estimates the error, and returns whether light is rare, even if other pixels confirm the
    /// light. A filter that spreads such light would hide its error.
    pub(crate) fn estimate_uncertainty_and_rarity(&self) -> Option<(Uncertainty, bool)> {
        if !self.plan.random {
            return None;
        }
        let planes = self.replicate_stats();
        let fewest = (0..self.plan.pixel_count())
            .map(|pixel| planes.replicate_count(pixel))
            .min()?;
        if fewest < 2 {
            return None;
        }
        let height = self.plan.crop.height as usize;
        let bands = || (0..height.div_ceil(BAND_ROWS)).into_par_iter();
        let rows = |band: usize| band * BAND_ROWS..((band + 1) * BAND_ROWS).min(height);
        // Collected in order, so that the sums do not depend on the order of completion.
        let of_bands: Vec<([VarianceSum; 2], LeaveOneOutStats)> = bands()
            .map(|band| self.sum_variances_of_rows(&planes, rows(band), fewest))
            .collect();
        let (mut sums, mut leave_one_out) =
            ([VarianceSum::default(); 2], LeaveOneOutStats::default());
        for (of_band, again_in_band) in of_bands {
            sums.iter_mut()
                .zip(of_band)
                .for_each(|(sum, of)| *sum += of);
            leave_one_out += again_in_band;
        }
        let [absolute, relative] = sums;
        let (is_rare, is_confirmed) = (
            relative.is_light_rare(),
            leave_one_out.confirms_enough_light(),
        );
        let mut vouched = VarianceSum::default();
        if is_rare || is_confirmed {
            let bands: Vec<VarianceSum> = bands()
                .map(|band| self.sum_confirmed_light(&planes, rows(band), fewest))
                .collect();
            bands.into_iter().for_each(|of_band| vouched += of_band);
        }
        let is_few = if is_confirmed {
            vouched.is_dominated_by_few_pixels()
        } else {
            relative.is_dominated_by_few_pixels()
        };
        let (pixels, replicates) = (self.plan.pixel_count() as f64, f64::from(fewest));
        let rmse = absolute.estimate_root_mean(absolute.variance, pixels, replicates);
        let root_relmse = if is_rare && is_confirmed {
            vouched.estimate_root_mean(vouched.geometric_mean(), pixels, replicates)
        } else {
            relative.estimate_root_mean(
                relative.extrapolate_to_many_replicates(),
                pixels,
                replicates,
            )
        };
        let doubts = [
            (fewest < MIN_REPLICATES, EstimateDoubt::FewSamples),
            (self.has_too_few_chance_hits(), EstimateDoubt::LightByChance),
            (
                is_few
                    || is_rare && !is_confirmed
                    || relative.variance == 0.0 && self.is_black_despite_lights(),
                EstimateDoubt::FewPixels,
            ),
        ];
        let doubt = doubts
            .into_iter()
            .find_map(|(is, doubt)| is.then_some(doubt));
        Some((
            Uncertainty {
                rmse,
                root_relmse,
                replicates: fewest,
                doubt,
            },
            is_rare && vouched.is_light_rare(),
        ))
    }

    /// Whether many paths can hit lamps or suns only by chance, through mirrors or glass, with too
    /// few hits to determine their light.
    pub(crate) fn has_too_few_chance_hits(&self) -> bool {
        let is_common = self.counters.unaided.saturating_mul(ONE_IN) > self.counters.samples;
        is_common && self.counters.found < FEWEST_FOUND
    }

    /// Whether shadow rays were traced to lamps or the sky, and no sample found any light.
    pub(super) fn is_black_despite_lights(&self) -> bool {
        let is_black = |buffer: &ReplicateBuffer| {
            (0..self.plan.pixel_count()).all(|pixel| buffer.pixel_total(pixel) == [0.0; 3])
        };
        self.counters.shadow > 0 && self.buffers.iter().flatten().all(is_black)
    }

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
    fn sum_variances_of_rows(
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
                    for pixel in inner.clone() {
                        let at = [0, 1, 2, 3].map(|r: usize| four[r][pixel]);
                        leave_one_out.add_pixel(at);
                        band.add_pixel(pixel, at, shares);
                    }
                }
            }
        }
        let sums = [&band.absolute, &band.relative]
            .map(|pixels| sum_pixel_variances(&pixels[inner.clone()]));
        (sums, leave_one_out)
    }

    /// Returns the relative sum over the pixels of some rows, with the weights of confirmed light
    /// where a single replicate found light; zero for fewer than four replicates.
    fn sum_confirmed_light(
        &self,
        planes: &ReplicateStats<'_>,
        rows: Range<usize>,
        replicates: u32,
    ) -> VarianceSum {
        let Some(shares) = pairing_weights(replicates) else {
            return VarianceSum::default();
        };
        let means = self.collect_row_means(planes, rows, replicates);
        let mut pixels = vec![PixelVariance::default(); means[0].len()];
        for four in means.chunks_exact(4) {
            for (pixel, sum) in pixels.iter_mut().enumerate() {
                let at = [0, 1, 2, 3].map(|r: usize| four[r][pixel]);
                let once = SingleReplicateBound::from_means(at);
                sum.add_relative_variance(at.map(DVec3::from), Some(once), shares);
            }
        }
        sum_pixel_variances(&pixels)
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
    fn add_pixel(&mut self, pixel: usize, four: [[f64; 3]; 4], shares: [f64; 2]) {
        if four[1..].iter().any(|other| *other != four[0]) {
            let at = four.map(DVec3::from);
            self.absolute[pixel].add_absolute_variance(at, shares);
            self.relative[pixel].add_relative_variance(at, None, shares);
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
                    variance,
                    by_four: variance,
                    by_mean: variance,
                    by_pair_mean: variance,
                    product: squared_weighted_dot(one, two, weights, beside),
                    event_uncertainty: 0.0,
                    prior_uncertainty: 0.0,
                }
            };
            self.absolute[pixel] = value_of([1.0; 3], [1.0; 3]);
            self.relative[pixel] = value_of(weights[pixel], weights[beside]);
        }
    }
}
