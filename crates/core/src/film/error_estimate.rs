//! Estimate of an error, with its confidence interval.

use serde::Serialize;

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

/// Greatest ratio of the upper end of an interval to the value at which both say something.
const WIDEST: f64 = 100.0;

/// Ratio of the one-sided 95 % quantile of the normal distribution to the two-sided 95 % quantile.
const ONE_SIDED: f64 = 0.839;

impl ErrorEstimate {
    /// Returns the bound that the true error exceeds in 5 of 100 renders, where the interval is
    /// log-normal above the value. Of renders that end at the first bound below an error, which may
    /// be so by chance, 10 in 100 exceed that error. The value itself without an interval.
    pub(crate) fn one_sided_bound(&self) -> f64 {
        if !self.high.is_finite() {
            return self.value;
        }
        if self.value == 0.0 {
            return self.high;
        }
        self.value * libm::pow(self.high / self.value, ONE_SIDED)
    }

    /// Whether the interval reaches so far up that the estimate says nothing. Beside an estimate of
    /// zero, the upper end is a bound.
    pub fn is_meaningless(&self) -> bool {
        !self.high.is_finite() || self.value > 0.0 && self.high > WIDEST * self.value
    }
}
