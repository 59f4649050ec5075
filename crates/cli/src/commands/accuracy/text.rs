//! Report of `accuracy` as tables for the terminal, with a small plot of the Pareto frontier.

use raywright_core::accuracy::{
    AccuracyReport, ConfidenceInterval, FrontierSetting, LadderCostReport, LadderReport,
    MeasuredSetting, OutputFormatReport, RungCostReport, RungReport,
};
use raywright_core::bench::SampleQuantiles;
use raywright_io::format_bytes;
use raywright_io::report::{format_light_change, format_uncertain};

use super::file::AccuracyDocument;
use crate::clock::format_duration;
use crate::commands::explain::format_effect_costs;
use crate::scatter::draw_scatter_plot;
use crate::table::{
    ColumnAlignment, format_aligned_columns, format_significant_digits, wrap_paragraph,
};

const RIGHT: ColumnAlignment = ColumnAlignment::Right;
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
        "not measured, because this scene does not need it",
        report.not_called_for.iter().copied(),
    );
    text
}

/// Formats names as a paragraph after the label `words`; empty without names.
fn format_name_list<T: AsRef<str>>(words: &str, names: impl Iterator<Item = T>) -> String {
    let names: Vec<T> = names.collect();
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    if names.is_empty() {
        String::new()
    } else {
        format!(
            "\n{}\n",
            wrap_paragraph(&format!("{words}: {}", names.join(", ")))
        )
    }
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
        "error: root relMSE, the root of the mean of (I - R)² / (R² + 0.01); bias: the part of the error that more samples do not reduce; light: change of total light",
        "alone: root mean square difference from the ladder's most exact rung, with the same random numbers",
        "<: too small to be distinguished from the reference's noise; the number is the upper end of the interval",
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

/// Formats the names of a ladder's rungs that were not measured because the time was too short;
/// only the ladder's name if no rung was measured, `None` if all were. `rungs` has the name of each
/// rung, and whether it was not measured.
fn list_unmeasured_rungs<'a>(
    ladder: &str,
    rungs: impl Iterator<Item = (&'a str, bool)>,
) -> Option<String> {
    let (late, measured): (Vec<_>, Vec<_>) = rungs.partition(|(_, is_late)| *is_late);
    let names: Vec<String> = late
        .iter()
        .map(|(rung, _)| format!("{ladder}={rung}"))
        .collect();
    match (names.is_empty(), measured.is_empty()) {
        (true, _) => None,
        (false, true) => Some(ladder.to_owned()),
        (false, false) => Some(names.join(", ")),
    }
}

/// Formats a table of settings, each of which changes several rungs (quality levels) of the scene's
/// own setting. Their flags are in the last column, because they may be long.
fn format_rung_combinations(all: &[FrontierSetting]) -> String {
    if all.is_empty() {
        return String::new();
    }
    let heads = [
        "time", "x in use", "error", "bias", "light", "FLIP", "together",
    ]
    .map(str::to_owned);
    let figures = |candidate: &FrontierSetting| {
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
    let title = if stands {
        ladder.ladder.to_owned()
    } else {
        format!("{} (in use: {})", ladder.ladder, ladder.in_use)
    };
    let rows = rung_reports.into_iter().filter_map(|rung_report| {
        let mark = if rung_report.in_use { " *" } else { "" };
        Some(format_setting_row(
            format!("  {}{mark}", rung_report.rung),
            rung_report.measured.as_ref()?,
            rung_report.own_error.as_ref(),
        ))
    });
    [format_title_row(title)].into_iter().chain(rows).collect()
}

/// Builds a row of `N` cells with text in its first cell only.
fn format_title_row<const N: usize>(title: String) -> [String; N] {
    let mut row = std::array::from_fn(|_| String::new());
    row[0] = title;
    row
}

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

fn format_interval(interval: &ConfidenceInterval) -> String {
    format_uncertain(interval, |value| format_significant_digits(value, 2))
}

/// Formats a time in seconds: below a second with three digits in milliseconds, otherwise like
/// [`format_duration`].
fn format_precise_duration(seconds: f64) -> String {
    if seconds < 0.9995 {
        format!("{} ms", format_significant_digits(seconds * 1e3, 3))
    } else {
        format_duration(seconds)
    }
}

fn format_spread(spread: &SampleQuantiles) -> String {
    format!("±{:.0} %", 100.0 * spread.relative_half_spread())
}

/// Formats the table of ladders whose rungs (quality levels) change the time or the memory of a
/// render, but not the picture.
fn format_cost_only_table(report: &AccuracyReport) -> String {
    let mut rows = vec![
        [
            "same picture",
            "time",
            "",
            "x in use",
            "preparing",
            "memory",
        ]
        .map(str::to_owned),
    ];
    for LadderCostReport {
        ladder,
        rungs,
        in_use,
    } in report.prices.iter().filter(|price_report| {
        price_report
            .rungs
            .iter()
            .any(|rung| rung.rung_cost.is_some())
    }) {
        let stands = rungs.iter().any(|rung| rung.in_use);
        let title = if stands {
            (*ladder).to_owned()
        } else {
            format!("{ladder} (in use: {in_use})")
        };
        rows.push(format_title_row(title));
        rows.extend(rungs.iter().filter_map(format_cost_only_row));
    }
    let columns = [ColumnAlignment::Left, RIGHT, RIGHT, RIGHT, RIGHT, RIGHT];
    let table = if rows.len() > 1 {
        format!("\n{}", format_aligned_columns(columns, &rows))
    } else {
        String::new()
    };
    let rungs = |price_report: &LadderCostReport| {
        list_unmeasured_rungs(
            price_report.ladder,
            price_report
                .rungs
                .iter()
                .map(|rung| (rung.rung.as_str(), rung.rung_cost.is_none())),
        )
    };
    table + &format_name_list("no time for", report.prices.iter().filter_map(rungs))
}

fn format_cost_only_row(of: &RungCostReport) -> Option<[String; 6]> {
    let rung_cost = of.rung_cost.as_ref()?;
    let name = format!("  {}{}", of.rung, if of.in_use { " *" } else { "" });
    let bits = if rung_cost.same_bits {
        ""
    } else {
        "; THE PICTURE DIFFERS"
    };
    Some([
        name,
        format_precise_duration(rung_cost.seconds.median),
        format_spread(&rung_cost.seconds),
        format_significant_digits(rung_cost.ratio.median, 3),
        format_precise_duration(rung_cost.preparing.median),
        format!("{}{bits}", format_bytes(rung_cost.geometry)),
    ])
}

/// Formats the table of output formats: size and coding time of a file, and error of its pixel
/// values.
fn format_output_table(report: &AccuracyReport) -> String {
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
        let name = format!("  {}{}", output.rung, if output.in_use { " *" } else { "" });
        let coding = output
            .seconds
            .as_ref()
            .map(|spread| format_precise_duration(spread.median))
            .unwrap_or_default();
        let errors = [output.rmse, output.greatest, output.flip]
            .map(|error| format_significant_digits(error, 2));
        let [rmse, greatest, flip] = errors;
        [
            name,
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

/// Formats the settings on the Pareto frontier of error and time, as flags in a table and as points
/// of a plot.
fn format_pareto_frontier(document: &AccuracyDocument<'_>) -> String {
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
    let words = "worth their time: no other measured setting is both faster and nearer to the reference than a setting in this table; its flags are in the last column";
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

/// Formats the square root of a mean square error, and of the ends of its confidence interval.
fn format_root_mean_square(interval: &ConfidenceInterval) -> String {
    format_interval(&interval.map(f64::sqrt))
}

#[cfg(test)]
pub mod tests;
