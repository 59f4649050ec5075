//! Report of `accuracy` as tables for the terminal, with a small plot of the Pareto frontier.

mod cells;
mod costs;
mod frontier;
mod outputs;

use raywright_core::accuracy::{
    AccuracyReport, ConfidenceInterval, LadderReport, MeasuredSetting, MeasuredSettingWithFlags,
    RungReport,
};
use raywright_io::report::{format_light_change, format_uncertain};

use super::file::AccuracyDocument;
use crate::commands::explain::format_effect_costs;
use crate::numbers::format_significant_digits;
use crate::table::{ColumnAlignment, format_aligned_columns, wrap_paragraph};
use cells::{
    RIGHT, format_interval, format_ladder_title, format_name_list, format_precise_duration,
    format_root_mean_square, format_rung_name, format_title_row, list_unmeasured_rungs,
};
use costs::format_cost_only_table;
use frontier::format_pareto_frontier;
use outputs::format_output_table;

/// Alignments of the columns in the table of errors.
const COLUMNS: [ColumnAlignment; 8] = [
    ColumnAlignment::Left,
    RIGHT,
    RIGHT,
    RIGHT,
    RIGHT,
    RIGHT,
    RIGHT,
    RIGHT,
];

/// Formats the whole report: the recommendation, the Pareto frontier, the conditions, and the
/// tables of errors, of rungs that change time or memory only, of output formats, and of effects.
pub fn format_report(document: &AccuracyDocument<'_>) -> String {
    let report = document.report;
    let mut text = format!(
        "{}\n{}\n",
        document.scene,
        wrap_paragraph(&document.recommendation)
    );
    text += &format_pareto_frontier(document);
    text += "\n";
    document
        .circumstances
        .iter()
        .for_each(|line| text += &(wrap_paragraph(line) + "\n"));
    text += &format_rung_table(report);
    text += &format_cost_only_table(report);
    text += &format_output_table(report);
    text += &report
        .costs
        .as_ref()
        .map(format_effect_costs)
        .unwrap_or_default();
    text += &format_name_list(
        "not measured, because without effect on this scene",
        report.not_called_for.iter().copied(),
    );
    text
}

/// Formats the table of errors: each ladder with its rungs (quality levels). It leaves out rungs
/// that are slower and worse than the current rung, and rungs that were not measured because the
/// time was too short. Their names follow below the table.
fn format_rung_table(report: &AccuracyReport) -> String {
    let heads = [
        "", "time", "x in use", "error", "bias", "light", "FLIP", "alone",
    ];
    let mut rows = vec![
        heads.map(str::to_owned),
        format_setting_row("as it is".to_owned(), &report.own, None),
    ];
    let (samples, others): (Vec<_>, Vec<_>) = report
        .ladders
        .iter()
        .partition(|ladder| ladder.ladder == "samples");
    rows.extend(samples.iter().flat_map(|ladder| format_ladder_rows(ladder)));
    if let Some(base) = &report.base {
        rows.push(format_setting_row(
            format!("below: {} samples", base.samples),
            &base.measured,
            None,
        ));
    }
    rows.extend(others.iter().flat_map(|ladder| format_ladder_rows(ladder)));
    let notes = [
        "* in use",
        "error: root relMSE, the root of the mean of (I - R)² / (R² + 0.01) for the picture I and the reference R",
        "bias: the part of the error that more samples do not reduce; light: change of total light",
        "alone: root mean square difference from the ladder's most exact rung, with the same random numbers",
        "< before a number: too small to be distinguished from the reference's noise; the number is the upper end of the interval",
        "-o FILE.csv writes RMSE and the ends of all intervals",
    ];
    let mut text = format!("\n{}", format_aligned_columns(COLUMNS, &rows));
    notes
        .iter()
        .for_each(|note| text += &(wrap_paragraph(note) + "\n"));
    let all = report
        .ladders
        .iter()
        .flat_map(|ladder| ladder.rungs.iter().map(move |rung| (ladder, rung)));
    let beaten = all
        .filter(|(ladder, rung)| ladder.is_dominated(rung))
        .map(|(ladder, rung)| format!("{}={}", ladder.ladder, rung.rung));
    text += &format_name_list("slower and less exact than the rung in use", beaten);
    let late = report.ladders.iter().filter_map(|ladder| {
        let others = || ladder.rungs.iter().filter(|rung| !rung.in_use);
        list_unmeasured_rungs(
            ladder.ladder,
            others().map(|rung| (rung.rung.as_str(), rung.measured.is_none())),
        )
    });
    text += &format_name_list("no time for", late);
    text + &format_rung_combinations(&report.combinations)
}

/// Formats a table of settings, each of which changes several rungs (quality levels) of the scene's
/// own setting. Their flags are in the last column, because they may be long.
fn format_rung_combinations(all: &[MeasuredSettingWithFlags]) -> String {
    if all.is_empty() {
        return String::new();
    }
    let heads = [
        "time", "x in use", "error", "bias", "light", "FLIP", "together",
    ]
    .map(str::to_owned);
    let figures = |candidate: &MeasuredSettingWithFlags| {
        let [_, time, ratio, error, bias, light, flip, _] =
            format_setting_row(String::new(), &candidate.measured, None);
        [
            time,
            ratio,
            error,
            bias,
            light,
            flip,
            candidate.flags.join(" "),
        ]
    };
    let rows: Vec<[String; 7]> = [heads].into_iter().chain(all.iter().map(figures)).collect();
    format!(
        "\n{}",
        format_aligned_columns(
            [
                RIGHT,
                RIGHT,
                RIGHT,
                RIGHT,
                RIGHT,
                RIGHT,
                ColumnAlignment::Left
            ],
            &rows
        )
    )
}

/// Builds the rows of a ladder in the table of errors: its title and its measured rungs (quality
/// levels). Empty if only the current rung was measured.
fn format_ladder_rows(ladder: &LadderReport) -> Vec<[String; 8]> {
    let rung_reports: Vec<&RungReport> = ladder
        .rungs
        .iter()
        .filter(|rung| rung.measured.is_some() && !ladder.is_dominated(rung))
        .collect();
    if rung_reports.iter().all(|rung| rung.in_use) {
        return Vec::new();
    }
    let stands = ladder.rungs.iter().any(|rung| rung.in_use);
    let title = format_ladder_title(ladder.ladder, &ladder.in_use, stands);
    let rows = rung_reports.into_iter().filter_map(|rung_report| {
        Some(format_setting_row(
            format_rung_name(&rung_report.rung, rung_report.in_use),
            rung_report.measured.as_ref()?,
            rung_report.own_error.as_ref(),
        ))
    });
    [format_title_row(title)].into_iter().chain(rows).collect()
}

/// Builds the row of a measured setting in the table of errors. `own_error` is its difference from
/// the most exact rung of its ladder.
fn format_setting_row(
    name: String,
    measured: &MeasuredSetting,
    own_error: Option<&ConfidenceInterval>,
) -> [String; 8] {
    let errors = &measured.errors;
    [
        name,
        format_uncertain(&measured.seconds, format_precise_duration),
        format_uncertain(&measured.ratio, |value| format_significant_digits(value, 3)),
        format_root_mean_square(&errors.relmse),
        errors
            .bias
            .as_ref()
            .map(format_root_mean_square)
            .unwrap_or_default(),
        format_light_change(&errors.light),
        format_interval(&measured.flip),
        own_error.map(format_interval).unwrap_or_default(),
    ]
}

#[cfg(test)]
pub mod tests;
