//! Thresholds of `compare`: the measures of a difference that exceed the limits of its flags.

use raywright_core::metrics::{Comparison, CoverageErrors, PictureErrors};
use raywright_io::report::format_four_digits;

/// Limits of the measures of a difference, each from a flag; `None` without the flag.
pub struct Thresholds {
    pub max_rmse: Option<f64>,
    pub max_relmse: Option<f64>,
    pub max_relmse_trimmed: Option<f64>,
    /// Largest mean of FLIP, a perceptual difference from 0 to 1.
    pub max_flip: Option<f64>,
    /// Least peak signal-to-noise ratio, in decibels.
    pub min_psnr: Option<f64>,
    /// Whether any flag sets a limit. Pixels that are not finite then exceed the limits.
    pub has_any: bool,
}

/// Describes the measures of colour and coverage that exceed the given thresholds. NaN exceeds any
/// threshold.
pub fn list_exceeded_thresholds(limits: &Thresholds, comparison: &Comparison) -> Vec<String> {
    let PictureErrors {
        non_finite,
        rmse,
        relmse,
        relmse_trimmed,
        psnr,
        ..
    } = comparison.errors;
    let colours = CoverageErrors {
        non_finite,
        rmse,
        relmse,
        relmse_trimmed,
        psnr,
        flip: comparison.flip.mean,
    };
    let of_coverage = comparison
        .coverage_errors
        .iter()
        .flat_map(|coverage| list_exceeded_limits(limits, "coverage: ", coverage));
    list_exceeded_limits(limits, "", &colours)
        .into_iter()
        .chain(of_coverage)
        .collect()
}

/// Describes the measures that exceed the given thresholds, for colour or for coverage. `of` is put
/// before the name of each measure.
fn list_exceeded_limits(limits: &Thresholds, of: &str, figures: &CoverageErrors) -> Vec<String> {
    let above = [
        ("RMSE", figures.rmse, limits.max_rmse),
        ("relMSE", figures.relmse, limits.max_relmse),
        (
            "trimmed relMSE",
            figures.relmse_trimmed,
            limits.max_relmse_trimmed,
        ),
        ("mean FLIP", figures.flip, limits.max_flip),
    ];
    let above = above.into_iter().filter_map(|(name, value, limit)| {
        limit
            .filter(|&limit| value > limit || value.is_nan())
            .map(|limit| format!("{of}{name} {} is above {limit}", format_four_digits(value)))
    });
    let psnr = figures.psnr.unwrap_or(f64::INFINITY);
    let below = limits
        .min_psnr
        .filter(|&limit| psnr < limit || psnr.is_nan());
    let below = below.map(|limit| {
        format!(
            "{of}PSNR {} dB is below {limit} dB",
            format_four_digits(psnr)
        )
    });
    let lost = figures.non_finite;
    let lost = (lost > 0 && limits.has_any)
        .then(|| format!("{of}{lost} pixels have values that are not finite numbers"));
    above.chain(below).chain(lost).collect()
}
