//! Estimates with their confidence intervals, from sums over tiles.

use serde::Serialize;

use crate::metrics::student_factor_95;

/// Greatest ratio of the two ends of an interval whose value counts as known: with a wider one a
/// reader cannot tell a setting from one of four times the samples.
const WIDEST: f64 = 3.0;

/// Least relative standard error of a time or an error: that of two renders shortly after one another
/// on a quiet machine, and by the seed of another picture (`benches/runs/2026-11-29-accuracy.md`).
/// Differences below it count as none.
pub(super) const RESOLUTION: f64 = 0.03;

/// Half width of the 95 % interval of a normal number, in standard errors.
pub(super) const NORMAL: f64 = 1.96;

/// Estimated value of a measured quantity, with its confidence interval of about 95 %. The error of
/// a single render has its own type, [`ErrorEstimate`](crate::film::ErrorEstimate).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(into = "ReportedInterval")]
pub struct ConfidenceInterval {
    /// Estimated value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// An interval as files report it.
#[derive(Serialize)]
struct ReportedInterval {
    value: f64,
    low: f64,
    high: f64,
    known: bool,
}

impl From<ConfidenceInterval> for ReportedInterval {
    fn from(interval: ConfidenceInterval) -> Self {
        let ConfidenceInterval { value, low, high } = interval;
        Self {
            value,
            low,
            high,
            known: interval.is_known(),
        }
    }
}

impl ConfidenceInterval {
    /// Interval of a value of which nothing is known.
    pub const UNKNOWN: Self = Self {
        value: f64::NAN,
        low: 0.0,
        high: f64::INFINITY,
    };

    /// Returns the interval of a number without uncertainty.
    pub fn from_exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// Returns the interval of a positive value whose logarithm has the standard error `sigma`.
    pub(super) fn from_logarithm(value: f64, sigma: f64) -> Self {
        let spread = libm::exp(NORMAL * sigma);
        Self {
            value,
            low: value / spread,
            high: value * spread,
        }
    }

    /// Whether the interval contains zero. The value may then be noise alone.
    pub fn includes_zero(&self) -> bool {
        self.low <= 0.0
    }

    /// Whether the ends differ by at most a factor of three. An interval that begins at zero is a
    /// bound, which is known if it is finite.
    pub fn is_known(&self) -> bool {
        self.value.is_finite()
            && self.high.is_finite()
            && (self.includes_zero() || self.high <= WIDEST * self.low)
    }

    /// Returns the interval after applying a non-decreasing function to the value and to both ends.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            value: f(self.value),
            low: f(self.low),
            high: f(self.high),
        }
    }

    /// Returns the standard error of the logarithm of a positive value; infinite if the interval
    /// begins at zero.
    pub(super) fn logarithmic_error(&self) -> f64 {
        if self.high == self.low {
            return 0.0;
        }
        libm::log(self.high / self.low.max(0.0)) / (2.0 * NORMAL)
    }

    /// Returns the product of two positive values whose uncertainties are independent.
    pub(super) fn multiply(&self, other: &Self) -> Self {
        let value = self.value * other.value;
        if self.includes_zero() || other.includes_zero() {
            return Self {
                value,
                low: self.low * other.low,
                high: self.high * other.high,
            };
        }
        // Each side by its own width: the low end of a claim may be wider than its high end.
        let factor =
            |one: f64, other: f64| libm::exp(libm::hypot(libm::log(one), libm::log(other)));
        Self {
            value,
            low: value / factor(self.value / self.low, other.value / other.low),
            high: value * factor(self.high / self.value, other.high / other.value),
        }
    }

    /// Returns the ratio of two positive values whose uncertainties are independent.
    pub(super) fn divide(&self, other: &Self) -> Self {
        self.multiply(&Self {
            value: 1.0 / other.value,
            low: 1.0 / other.high,
            high: 1.0 / other.low,
        })
    }

    /// Returns the sum of two values of at least zero whose uncertainties are independent.
    pub(super) fn add(&self, other: &Self) -> Self {
        let value = self.value + other.value;
        let below = libm::hypot(self.value - self.low, other.value - other.low);
        let above = libm::hypot(self.high - self.value, other.high - other.value);
        Self {
            value,
            low: (value - below).max(self.low.max(other.low)),
            high: value + above,
        }
    }

    /// Returns the relative uncertainty of the value: half the width of the interval divided by the
    /// value.
    pub fn relative_half_width(&self) -> f64 {
        0.5 * (self.high - self.low) / self.value
    }
}

/// Errors of a setting over the whole picture: differences from the exact picture, as roots of means
/// over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SettingErrors {
    /// Root of the mean of (I − R)² / (R² + 0.01) for picture I and exact picture R.
    pub root_relmse: ConfidenceInterval,
    /// Part of `root_relmse` that more samples do not reduce. `None` if it is unknown.
    pub bias: Option<ConfidenceInterval>,
    /// Ratio of the summed radiance of the picture to that of the reference.
    pub light: ConfidenceInterval,
}

/// Returns the ratio of two sums over tiles, numerator and denominator of each tile given. The
/// differences between tiles give its interval. A single tile, of a picture of at most 8 by 8
/// pixels, gives none.
pub(super) fn ratio_of_sums(tiles: &[[f64; 2]]) -> ConfidenceInterval {
    let [above, below] = [0, 1].map(|i| tiles.iter().map(|tile| tile[i]).sum::<f64>());
    if above == below || above == 0.0 {
        return ConfidenceInterval::from_exact(if above == below { 1.0 } else { 0.0 });
    }
    let ratio = above / below;
    if !(ratio.is_finite() && ratio > 0.0) {
        return ConfidenceInterval::UNKNOWN;
    }
    let residuals = tiles.iter().map(|tile| tile[0] - ratio * tile[1]);
    let variance = variance_of_sum(&residuals.collect::<Vec<_>>());
    // What rounding leaves of equal ratios.
    if variance <= (1e-7 * above).powi(2) {
        return ConfidenceInterval::from_exact(ratio);
    }
    ConfidenceInterval::from_logarithm(ratio, variance.sqrt() / above)
}

/// Returns the variance of a sum by the differences of its terms from their mean, widened by Student's
/// factor for the number of terms, at least two, that carry it: fewer than all where a few dominate
/// (Satterthwaite, "An Approximate Distribution of Estimates of Variance Components", 1946).
pub(super) fn variance_of_sum(differences: &[f64]) -> f64 {
    let [sum, of_squares] =
        [2, 4].map(|power| differences.iter().map(|x| x.powi(power)).sum::<f64>());
    if sum == 0.0 {
        return 0.0;
    }
    let most = (differences.len() as f64).max(2.0);
    let count = (3.0 * sum * sum / of_squares).clamp(2.0, most);
    let widening = student_factor_95((count - 1.0) as u32) / NORMAL;
    sum * count / (count - 1.0) * widening * widening
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::splitmix64;

    /// Protects: an interval of a factor above three is not known, a bound is, and sums, products
    /// and ratios of values have the uncertainty of both.
    #[test]
    fn wide_intervals_are_unknown() {
        let interval = |value, low, high| ConfidenceInterval { value, low, high };
        assert!(interval(1.0, 0.6, 1.79).is_known() && !interval(1.0, 0.5, 1.8).is_known());
        assert!(interval(1.0, 0.0, 2.0).is_known() && !ConfidenceInterval::UNKNOWN.is_known());
        let value = ConfidenceInterval::from_logarithm(2.0, 0.3);
        let product = value.multiply(&ConfidenceInterval::from_logarithm(3.0, 0.4));
        assert!((product.value - 6.0).abs() < 1e-12);
        assert!((product.logarithmic_error() - 0.5).abs() < 1e-9);
        // A value that may only be too high stays so.
        let skewed = interval(1.0, 0.5, 1.1).multiply(&ConfidenceInterval::from_exact(2.0));
        assert!((skewed.low - 1.0).abs() < 1e-9 && (skewed.high - 2.2).abs() < 1e-9);
        let ratio = value.divide(&value);
        assert!(ratio.value == 1.0 && ratio.logarithmic_error() > 0.42);
        let sum = interval(4.0, 1.0, 7.0).add(&interval(5.0, 1.0, 9.0));
        assert_eq!((sum.value, sum.low, sum.high), (9.0, 4.0, 14.0));
        let json = serde_json::to_value(interval(1.0, 0.1, 2.0)).expect("numbers");
        assert_eq!(json["known"], false);
    }

    /// Protects: the interval of a ratio of sums contains the truth in nine of ten cases, also
    /// where a tenth of the tiles have most of both sums.
    #[test]
    fn ratios_of_tiles_hold() {
        let uniform = |index: u64| (splitmix64(index) >> 11) as f64 / 2_f64.powi(53);
        let held = |case: &u64| {
            let tile = |tile: u64| {
                let size = if tile.is_multiple_of(10) { 20.0 } else { 1.0 };
                let noise = |k: u64| 0.7 + 0.6 * uniform(1000 * case + 2 * tile + k);
                [0.5 * size * noise(0), size * noise(1)]
            };
            let ratio = ratio_of_sums(&(0..40).map(tile).collect::<Vec<_>>());
            ratio.low <= 0.5 && 0.5 <= ratio.high
        };
        let count = (0..1000).filter(held).count();
        assert!((900..=998).contains(&count), "{count} of 1000");
    }
}
