//! Pareto frontier of `accuracy`: the settings that are worth their time, as a table and a plot.

use raywright_core::accuracy::MeasuredSetting;
use raywright_io::report::format_uncertain;

use super::super::file::AccuracyDocument;
use super::cells::{RIGHT, format_precise_duration, format_root_mean_square};
use crate::numbers::format_significant_digits;
use crate::scatter::draw_scatter_plot;
use crate::table::{ColumnAlignment, format_aligned_columns, wrap_paragraph};

/// Formats the settings on the Pareto frontier of error and time, as flags in a table and as points
/// of a plot.
pub fn format_pareto_frontier(document: &AccuracyDocument<'_>) -> String {
    let points: Vec<&MeasuredSetting> = document
        .report
        .frontier
        .iter()
        .map(|candidate| &candidate.measured)
        .collect();
    if points.is_empty() {
        return String::new();
    }
    let rows = document
        .report
        .frontier
        .iter()
        .zip(&document.flags)
        .map(|(candidate, flags)| {
            let measured = &candidate.measured;
            let time = format_uncertain(&measured.seconds, format_precise_duration);
            [
                time,
                format_uncertain(&measured.ratio, |value| format_significant_digits(value, 3)),
                format_root_mean_square(&measured.errors.relmse),
                flags.clone(),
            ]
        });
    let heads = ["time", "x in use", "error", "flags"].map(str::to_owned);
    let rows: Vec<[String; 4]> = [heads].into_iter().chain(rows).collect();
    let place =
        |measured: &&MeasuredSetting| (measured.seconds.value, measured.errors.relmse.value.sqrt());
    let words = "settings worth their time: no other measured setting is both faster and nearer to the reference than a setting in this table; its flags are in the last column";
    let table = format_aligned_columns([RIGHT, RIGHT, RIGHT, ColumnAlignment::Left], &rows);
    let plot = draw_scatter_plot(
        &points.iter().map(place).collect::<Vec<_>>(),
        "error",
        "time",
    );
    let plot = if plot.is_empty() {
        plot
    } else {
        format!("\n{plot}")
    };
    format!(
        "\n{}\n  {}\n{table}{plot}",
        wrap_paragraph(words),
        document.own_command
    )
}
