//! Table of `accuracy` about the formats of output files: size, coding time, and error of the values.

use raywright_core::accuracy::{AccuracyReport, OutputFormatReport};

use super::cells::{RIGHT, format_precise_duration, format_rung_name};
use crate::numbers::format_significant_digits;
use crate::table::{ColumnAlignment, format_aligned_columns, wrap_paragraph};

/// Formats the table of output formats: size and coding time of a file, and error of its pixel
/// values.
pub fn format_output_table(report: &AccuracyReport) -> String {
    let heads = [
        "file contents",
        "bytes a pixel",
        "coding",
        "RMSE",
        "greatest",
        "FLIP",
        "clipped",
    ]
    .map(str::to_owned);
    let row = |output: &OutputFormatReport| {
        let coding = output
            .seconds
            .as_ref()
            .map(|spread| format_precise_duration(spread.median))
            .unwrap_or_default();
        let errors = [output.rmse, output.greatest, output.flip]
            .map(|error| format_significant_digits(error, 2));
        let [rmse, greatest, flip] = errors;
        [
            format_rung_name(output.rung, output.in_use),
            output.bytes_per_pixel.to_string(),
            coding,
            rmse,
            greatest,
            flip,
            format!("{:.1} %", 100.0 * output.clipped),
        ]
    };
    let rows: Vec<[String; 7]> = [heads]
        .into_iter()
        .chain(report.outputs.iter().map(row))
        .collect();
    let columns = [
        ColumnAlignment::Left,
        RIGHT,
        RIGHT,
        RIGHT,
        RIGHT,
        RIGHT,
        RIGHT,
    ];
    let note = "errors of display values, 0 to 1, against the computed values; clipped: pixels with a channel at its maximum";
    format!(
        "\n{}{}\n",
        format_aligned_columns(columns, &rows),
        wrap_paragraph(note)
    )
}
