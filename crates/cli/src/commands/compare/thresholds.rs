//! Thresholds of `compare`: the measures of a difference that exceed the limits of its flags.

use raywright_core::metrics::{Comparison, CoverageErrors, PictureErrors};

use crate::args::CompareArgs;
use crate::table::format_four_digits;

/// Describes the measures of colour and coverage that exceed the given thresholds. NaN exceeds any
/// threshold.
pub fn list_exceeded_thresholds(args: &CompareArgs, comparison: &Comparison) -> Vec<String> {
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
        .flat_map(|coverage| list_exceeded_limits(args, "coverage: ", coverage));
    list_exceeded_limits(args, "", &colours)
        .into_iter()
        .chain(of_coverage)
        .collect()
}

/// Describes the measures that exceed the given thresholds, for colour or for coverage. `of` is put
/// before the name of each measure.
fn list_exceeded_limits(args: &CompareArgs, of: &str, figures: &CoverageErrors) -> Vec<String> {
    let above = [
        ("RMSE", figures.rmse, args.max_rmse),
        ("relMSE", figures.relmse, args.max_relmse),
        (
            "trimmed relMSE",
            figures.relmse_trimmed,
            args.max_relmse_trimmed,
        ),
        ("mean FLIP", figures.flip, args.max_flip),
    ];
    let above = above.into_iter().filter_map(|(name, value, limit)| {
        limit
            .filter(|&limit| value > limit || value.is_nan())
            .map(|limit| format!("{of}{name} {} is above {limit}", format_four_digits(value)))
    });
    let psnr = figures.psnr.unwrap_or(f64::INFINITY);
    let below = args.min_psnr.filter(|&limit| psnr < limit || psnr.is_nan());
    let below = below.map(|limit| {
        format!(
            "{of}PSNR {} dB is below {limit} dB",
            format_four_digits(psnr)
        )
    });
    let lost = figures.non_finite;
    let lost = (lost > 0 && args.has_threshold())
        .then(|| format!("{of}{lost} pixels have values that are not finite numbers"));
    above.chain(below).chain(lost).collect()
}
