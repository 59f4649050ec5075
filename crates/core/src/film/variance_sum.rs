//! Sums of the variances of pixels, and the error of a picture that follows from them.

use core::ops::AddAssign;

use super::error_estimate::ErrorEstimate;
use super::pixel_variance::PixelVariance;
use crate::metrics::student_factor_95;

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
