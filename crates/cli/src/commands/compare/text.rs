//! Table of `compare`: a row for each measure of the difference of two pictures.

use raywright_core::metrics::{Comparison, WorstPixel};
use raywright_core::picture::{DataWindow, Encoding};
use raywright_io::report::format_four_digits;

use crate::table::format_rows;

/// Formats the table of a comparison. Rows without text are left out. The texts of three rows are
/// given: the data windows, the display settings, and the result of the test for noise.
pub fn format_table(comparison: &Comparison, [place, shown, noise]: [String; 3]) -> String {
    let errors = &comparison.errors;
    let identical = if comparison.identical {
        "yes, bit for bit"
    } else {
        "no"
    };
    let rows = [
        ("pixels", describe_pixels(comparison)),
        ("place", place),
        ("shown by", shown),
        ("identical", identical.to_owned()),
        ("RMSE", format_four_digits(errors.rmse)),
        (
            "relMSE",
            format!(
                "{} ({} without the worst 0.1 % of the pixels)",
                format_four_digits(errors.relmse),
                format_four_digits(errors.relmse_trimmed)
            ),
        ),
        ("PSNR", format_psnr(errors.psnr)),
        (
            "FLIP",
            format!(
                "mean {}, largest {}",
                format_four_digits(comparison.flip.mean),
                format_four_digits(comparison.flip.maximum)
            ),
        ),
        ("differ", describe_differing_shares(comparison)),
        (
            "worst",
            errors
                .worst
                .as_ref()
                .map(describe_worst_pixel)
                .unwrap_or_default(),
        ),
        (
            "coverage",
            describe_coverage(comparison).unwrap_or_default(),
        ),
        ("noise", noise),
        ("not finite", describe_non_finite(errors.non_finite)),
    ];
    format_rows(rows)
}

/// Describes the size of the compared pictures and the numbers of their pixels.
fn describe_pixels(comparison: &Comparison) -> String {
    let numbers = match comparison.encoding {
        Encoding::Linear => "linear radiance",
        Encoding::Display => "display values 0 to 1",
    };
    format!("{}x{}, {numbers}", comparison.width, comparison.height)
}

/// Formats a peak signal-to-noise ratio in decibels; `None` is the ratio of equal pictures.
fn format_psnr(psnr: Option<f64>) -> String {
    psnr.map_or("infinite".to_owned(), |psnr| {
        format!("{} dB", format_four_digits(psnr))
    })
}

/// Describes the shares of pixels that differ at all and by more than some display codes; empty if
/// no pixel differs.
fn describe_differing_shares(comparison: &Comparison) -> String {
    let shares: Vec<String> = comparison
        .beyond
        .iter()
        .filter(|beyond| beyond.share > 0.0)
        .map(|beyond| {
            let percent = format_four_digits(100.0 * beyond.share);
            match beyond.codes {
                0 => format!("{percent} % of the pixels"),
                codes => format!("{percent} % by more than {codes}/255"),
            }
        })
        .collect();
    shares.join(", ")
}

/// Describes the pixel with the largest difference: its place, and its colour in both pictures.
fn describe_worst_pixel(worst: &WorstPixel) -> String {
    let colour = |rgb: [f32; 3]| rgb.map(|v| format_four_digits(f64::from(v))).join(" ");
    format!(
        "{}, {}: {} against {}",
        worst.x,
        worst.y,
        colour(worst.picture),
        colour(worst.reference)
    )
}

/// Describes the difference in coverage; `None` if the coverage of no pixel differs.
fn describe_coverage(comparison: &Comparison) -> Option<String> {
    let (largest, errors) = (
        comparison.coverage.filter(|&largest| largest != 0.0)?,
        comparison.coverage_errors?,
    );
    Some(format!(
        "differs by up to {}, RMSE {}, mean FLIP {}",
        format_four_digits(largest),
        format_four_digits(errors.rmse),
        format_four_digits(errors.flip)
    ))
}

/// Describes the number of pixels whose values are not finite; empty for none.
fn describe_non_finite(pixels: usize) -> String {
    if pixels == 0 {
        String::new()
    } else {
        format!("{pixels} pixels, left out of all measures")
    }
}

/// Describes the data windows of two pictures; `None` if neither picture has a window.
pub fn describe_data_windows(windows: [Option<DataWindow>; 2]) -> Option<String> {
    match windows {
        [None, None] => None,
        [Some(one), Some(_)] => Some(format_data_window(one)),
        [Some(one), None] => Some(format!(
            "{}, compared with an uncropped picture",
            format_data_window(one)
        )),
        [None, Some(other)] => Some(format!(
            "an uncropped picture, compared with {}",
            format_data_window(other)
        )),
    }
}

/// Formats the rectangle of a crop: its left and top edge, and the size of the whole picture.
pub fn format_data_window(
    DataWindow {
        origin: [x, y],
        full: [width, height],
    }: DataWindow,
) -> String {
    format!("at {x}, {y} of {width}x{height} pixels")
}
