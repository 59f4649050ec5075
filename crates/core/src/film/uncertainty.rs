//! How far a picture probably is from the true one: what its replicates say of all its pixels together.
//!
//! A pixel's replicates give the variance of its mean, which is the squared error to be expected there. The mean of these over the
//! picture is an estimate of its mean squared error, and the better the more pixels share in it: pixels are independent, since each
//! has scrambles of its own. Were errors normal, the error that was made over the one that is estimated would be distributed as a
//! ratio of two mean squares with n and n(R − 1) degrees of freedom for n pixels of equal variance in R replicates, whose logarithm
//! has a variance near 2R/((R − 1)n). Variances are not equal, so n is the number of equal ones that would say as much: (Σv)²/Σv² of
//! the true variances (Kish, "Survey Sampling", 1965), of which those estimated have (R − 1)/(R + 1).

use serde::Serialize;

use super::Film;
use super::estimate::{Means, mean};

/// 97.5 % of normal values are below.
const Z: f64 = 1.959_963_984_540_054;

/// Fewer pixels that share the error say too little of it.
const FEWEST: f64 = 40.0;

/// Keeps the relative error of dark pixels finite, as in [`crate::metrics::Errors::relmse`].
const FLOOR: f64 = 0.01;

/// A number with the interval that holds what it estimates in 95 of 100 renders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The most likely value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Pixels of equal variance that would say as much.
    pub pixels: f64,
}

/// How far a picture is from the true one, as far as its own samples can tell: light that none of them found can't be estimated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Uncertainty {
    /// Root of the mean squared error over pixels and channels, in radiance.
    pub rmse: Estimate,
    /// Root of the mean relative squared error, (I − R)²/(R² + 0.01).
    pub root_relmse: Estimate,
    /// Whether enough pixels share in the error for the intervals to mean what they say. Otherwise a few carry most of it, as where
    /// light is rarely found: its samples may be too few, or too many.
    pub converged: bool,
}

/// Sums of pixels' variances, and of their squares.
#[derive(Default)]
struct Sum {
    variance: f64,
    square: f64,
}

impl Sum {
    fn add(&mut self, variance: f64) {
        self.variance += variance;
        self.square += variance * variance;
    }

    /// Of the root of the mean over so many numbers.
    fn estimate(&self, numbers: f64, replicates: f64) -> Estimate {
        let mean_square = self.variance / numbers;
        let pixels = if self.square > 0.0 {
            self.variance * self.variance / self.square * (replicates + 1.0) / (replicates - 1.0)
        } else {
            f64::INFINITY
        };
        let width = Z * (2.0 * replicates / ((replicates - 1.0) * pixels)).sqrt();
        let root = |factor: f64| (mean_square * factor).sqrt();
        Estimate { value: root(1.0), low: root(libm::exp(-width)), high: root(libm::exp(width)), pixels }
    }
}

impl Film {
    /// How far the picture so far is from the true one; none where chance has no part, and where pixels have fewer than two
    /// replicates.
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        let planes = self.there();
        let (mut absolute, mut relative, mut replicates) = (Sum::default(), Sum::default(), u32::MAX);
        for pixel in 0..self.plan.pixels() {
            let means = Means::of(&planes, pixel);
            replicates = replicates.min(means.replicates);
            if !self.plan.random || means.replicates < 2 {
                return None;
            }
            let colour = mean(&planes, pixel).0;
            let variance = means.between.map(|b| b / (means.samples * f64::from(means.replicates - 1)));
            absolute.add(variance.iter().sum());
            // The square of a mean is on average too large by the mean's variance.
            relative.add((0..3).map(|i| variance[i] / ((colour[i] * colour[i] - variance[i]).max(0.0) + FLOOR)).sum());
        }
        let (numbers, replicates) = (3.0 * self.plan.pixels() as f64, f64::from(replicates));
        let (rmse, root_relmse) = (absolute.estimate(numbers, replicates), relative.estimate(numbers, replicates));
        let converged = rmse.pixels.min(root_relmse.pixels) >= FEWEST;
        Some(Uncertainty { rmse, root_relmse, converged })
    }
}
