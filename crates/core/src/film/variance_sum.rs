//! Sums of the variances of pixels, and the error of a picture that follows from them.

use core::ops::AddAssign;

use super::error_estimate::ErrorEstimate;
use super::pixel_variance::PixelVariance;
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

/// Sums of the contributions of pixels to the picture's error estimate.
#[derive(Clone, Copy, Default)]
pub(super) struct VarianceSum {
    /// Variance of the pixels' means, with each difference of a pair of replicates relative to the
    /// other pair.
    pub variance: f64,
    /// The same variance, relative to the products of all four replicates.
    pub by_four: f64,
    /// The same variance, relative to the squared mean of all replicates.
    pub by_mean: f64,
    /// The same variance, with each difference of a pair relative to the square of that pair's
    /// mean.
    pub by_pair_mean: f64,
    /// Squared products of two independent differences between replicates.
    pub product: f64,
    /// Uncertainty of the denominator where a single replicate found light: sum of squares of the
    /// part that is independent between pixels.
    pub event_uncertainty: f64,
    /// Sum of the part of this uncertainty that is common to all pixels.
    pub prior_uncertainty: f64,
    /// Sum over pixels of the squared variance.
    pub square: f64,
    /// Sum over pixels of the square root of the variance.
    pub root: f64,
    /// Sum over pixels of the squared difference between `variance` and `by_four`.
    pub squared_difference: f64,
    /// Sum over pixels of the squared products.
    pub product_square: f64,
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
    pub fn from_pixel(
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
    pub fn is_dominated_by_few_pixels(&self) -> bool {
        let (carriers, noisy) = (
            self.squared_variance() / self.square,
            self.root * self.root / self.variance,
        );
        carriers < FEWEST
            && (carriers < noisy / NOISY_PIXELS_PER_CARRIER
                || self.variance > MAX_UNCONFIRMED_RATIO * self.by_pair_mean)
    }

    /// Whether light is so rare that two replicates seldom find the same light.
    pub fn is_light_rare(&self) -> bool {
        self.variance > MAX_WEIGHTING_RATIO * self.by_pair_mean
    }

    /// Returns the geometric mean of the variance relative to the other pair of replicates, and of
    /// the variance relative to the products of all four.
    pub fn geometric_mean(&self) -> f64 {
        (self.variance * self.by_four).sqrt()
    }

    /// Extrapolates the variance to very many replicates, from the variances relative to the means
    /// of two and of four replicates: the bias is nearly inverse to the number of replicates.
    pub fn extrapolate_to_many_replicates(&self) -> f64 {
        (2.0 * self.by_mean - self.by_pair_mean).max(self.by_mean / 2.0)
    }

    /// Estimates the root of the mean squared error over `pixels` pixels and three channels, with
    /// its interval; `sum` is the variance summed over all of them.
    pub fn estimate_root_mean(&self, sum: f64, pixels: f64, replicates: f64) -> ErrorEstimate {
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

    pub fn squared_variance(&self) -> f64 {
        self.variance * self.variance
    }
}
