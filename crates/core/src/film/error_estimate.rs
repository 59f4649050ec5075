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
