//! Tables of the HTML report: settings on the frontier, rungs (quality levels) of each ladder (a
//! setting with ordered levels), ladders that cost only time and memory, and file formats.

use raywright_core::accuracy::{
    ConfidenceInterval, LadderReport, MeasuredSetting, OutputFormatReport, RungCost, RungReport,
};
use raywright_core::bench::SampleQuantiles;

use super::page::{AccuracyPage, format_number};
use super::plot::escape_xml;
use super::table::{ColumnAlignment, Table, TableRow, format_uncertain};
use crate::limits::format_bytes;

fn format_interval(interval: ConfidenceInterval) -> String {
    format_uncertain(&interval, format_number)
}

/// Returns the HTML class of a row; rows of the scene's own setting have a class.
fn row_class(in_use: bool) -> &'static str {
    if in_use { "own" } else { "" }
}

/// Returns the heading row of a ladder (a setting with ordered quality levels).
fn ladder_heading(ladder: &str) -> TableRow {
    TableRow::with_class("ladder", [ladder.to_owned()])
}

/// Returns the row of a rung (a quality level of a setting) from its name, tooltip and further
/// cells.
fn rung_row(
    name: &str,
    about: &str,
    in_use: bool,
    cells: impl IntoIterator<Item = String>,
) -> TableRow {
    TableRow {
        tooltip: about.to_owned(),
        ..TableRow::with_class(
            row_class(in_use),
            [name.to_owned()].into_iter().chain(cells),
        )
    }
}

impl AccuracyPage<'_> {
    /// Formats the table of the settings on the frontier, each with its flags.
    pub(super) fn frontier_table(&self) -> String {
        if self.report.frontier.is_empty() {
            return String::new();
        }
        let named = (1..).zip(self.report.frontier.iter().zip(self.flags));
        let rows = named.map(|(i, (candidate, flags))| {
            // The table of rungs shows the other measured values.
            let [time, ratio, error, _, _, light, ..] =
                self.setting_cells(&candidate.measured, None);
            let cells = [
                format!("({i})"),
                format!("`{flags}`"),
                time,
                ratio,
                error,
                light,
            ];
            TableRow::with_class(row_class(candidate.flags.is_empty()), cells)
        });
        let mut columns = [ColumnAlignment::Right; 6];
        columns[1] = ColumnAlignment::Left;
        let [time, ratio, error, _, _, light, ..] = SETTING_HEADINGS;
        let names = ["", "flags", time, ratio, error, light];
        format!(
            "<h2>Worth their time</h2>\n<p>For each setting in this table, no other measured setting is both faster and more accurate. The first row whose \
             error is small enough is the fastest setting for that error; the last row within a time is the most accurate setting for that time. The flags \
             are appended to <code>{}</code></p>\n{}",
            escape_xml(self.own_command),
            Table::new(columns, names, rows)
                .without_empty_columns()
                .to_html(),
        )
    }

    /// Formats the table of the measured rungs (quality levels), and the lists of all other rungs.
    pub(super) fn rung_table(&self) -> String {
        let [time, ratio, error, rmse, bias, light, flip, alone] = SETTING_HEADINGS;
        let names = ["rung", time, ratio, error, rmse, bias, light, flip, alone];
        format!(
            "<h2>Rungs, changed one at a time</h2>\n<p class=\"soft\">A rung is a quality level of a setting; the setting is a ladder. Times are CPU times, summed over all threads, at the scene's \
             own picture size. Error: root relMSE, the root of the mean of (I − R)² / (R² + 0.01) for the picture I and the reference R. Bias: the part of the error that more samples do not reduce. Light: the relative change of the total light. Alone: root mean square difference from the most exact rung of the same ladder, rendered with \
             the same random numbers. &lt;: indistinguishable from the noise of the reference.</p>\n\
             {}{}",
            Table::new([ColumnAlignment::Right; 9], names, self.rung_rows())
                .without_empty_columns()
                .to_html(),
            self.unlisted_rungs_html()
        )
    }

    /// Returns the rows of all measured rungs: the scene's own setting, the numbers of samples, the
    /// other ladders, and rungs that were changed together.
    fn rung_rows(&self) -> Vec<TableRow> {
        let named = |name: String, measured: &MeasuredSetting| {
            [name].into_iter().chain(self.setting_cells(measured, None))
        };
        let mut rows = vec![TableRow::with_class(
            "own",
            named("as it is".to_owned(), &self.report.own),
        )];
        let (samples, others): (Vec<_>, Vec<_>) = self
            .report
            .ladders
            .iter()
            .partition(|ladder| ladder.ladder == "samples");
        rows.extend(
            samples
                .into_iter()
                .flat_map(|ladder| self.ladder_rows(ladder)),
        );
        let base = self.report.base.as_ref();
        rows.extend(base.map(|base| {
            TableRow::with_class(
                "ladder",
                named(
                    format!("all below: {} samples", base.samples),
                    &base.measured,
                ),
            )
        }));
        rows.extend(
            others
                .into_iter()
                .flat_map(|ladder| self.ladder_rows(ladder)),
        );
        if !self.report.combinations.is_empty() {
            rows.push(ladder_heading("several rungs changed together"));
            rows.extend(self.report.combinations.iter().map(|candidate| {
                TableRow::with_class("", named(candidate.name(), &candidate.measured))
            }));
        }
        rows
    }

    /// Formats the lists of rungs that the table of rungs leaves out: beaten, not measured, and
    /// without effect.
    fn unlisted_rungs_html(&self) -> String {
        let named = |which: &dyn Fn(&LadderReport, &RungReport) -> bool| -> Vec<String> {
            let all = self
                .report
                .ladders
                .iter()
                .flat_map(|ladder| ladder.rungs.iter().map(move |rung| (ladder, rung)));
            all.filter(|(ladder, rung)| which(ladder, rung))
                .map(|(ladder, rung)| format!("{}={}", ladder.ladder, rung.rung))
                .collect()
        };
        let line = |words: &str, names: Vec<String>| match names.as_slice() {
            [] => String::new(),
            names => format!("<p>{words}: {}.</p>\n", escape_xml(&names.join(", "))),
        };
        let beaten = line(
            "Slower and less accurate than the rung in use",
            named(&|ladder, rung| ladder.is_dominated(rung)),
        );
        let late = line(
            "Not measured for lack of time",
            named(&|_, rung| rung.measured.is_none()),
        );
        let absent = match self.report.not_called_for.as_slice() {
            [] => String::new(),
            names => format!(
                "<p class=\"soft\">Without effect on this scene, and not measured: {}.</p>\n",
                names.join(", ")
            ),
        };
        beaten + &late + &absent
    }

    /// Returns the rows of a ladder for all measured rungs (its quality levels). Rungs that are
    /// slower and less accurate than the current rung are left out.
    fn ladder_rows(&self, ladder: &LadderReport) -> Vec<TableRow> {
        let rung_reports: Vec<&RungReport> = ladder
            .rungs
            .iter()
            .filter(|rung| !ladder.is_dominated(rung) && rung.measured.is_some())
            .collect();
        if rung_reports.iter().all(|rung| rung.in_use) {
            return Vec::new();
        }
        let row = |rung_report: &RungReport| {
            Some(rung_row(
                &rung_report.rung,
                rung_report.about,
                rung_report.in_use,
                self.setting_cells(rung_report.measured.as_ref()?, rung_report.own_error),
            ))
        };
        [ladder_heading(ladder.ladder)]
            .into_iter()
            .chain(rung_reports.into_iter().filter_map(row))
            .collect()
    }

    /// Returns the cells of a measured setting, in the order of [`SETTING_HEADINGS`].
    fn setting_cells(
        &self,
        measured: &MeasuredSetting,
        own_error: Option<ConfidenceInterval>,
    ) -> [String; 8] {
        let errors = &measured.errors;
        [
            format_uncertain(&measured.seconds, format_duration),
            format_interval(measured.ratio),
            format_interval(errors.relmse.map(f64::sqrt)),
            format_interval(errors.rmse),
            errors
                .bias
                .map(|bias| format_interval(bias.map(f64::sqrt)))
                .unwrap_or_default(),
            format_light_change(&errors.light),
            format_interval(measured.flip),
            own_error.map(format_interval).unwrap_or_default(),
        ]
    }

    /// Formats the median time of a render, with its relative spread in per cent.
    fn format_time(&self, spread: &SampleQuantiles) -> String {
        format!(
            "{} ±{:.0} %",
            format_duration(spread.median),
            spread.relative_half_spread() * 100.0
        )
    }

    /// Returns the cells of a rung that changes no picture: time, its ratio, preparation and memory.
    fn cost_cells(&self, rung_cost: &RungCost) -> Vec<String> {
        let bits = if rung_cost.same_bits {
            ""
        } else {
            ", DIFFERENT PICTURE"
        };
        let memory = format_bytes(rung_cost.geometry) + bits;
        vec![
            self.format_time(&rung_cost.seconds),
            format_number(rung_cost.ratio.median),
            format_duration(rung_cost.preparing.median),
            memory,
        ]
    }

    /// Formats the table of the ladders (settings with ordered levels) that change time and memory,
    /// but not the picture.
    pub(super) fn cost_table(&self) -> String {
        let mut rows = Vec::new();
        for ladder in &self.report.prices {
            rows.push(ladder_heading(ladder.ladder));
            rows.extend(ladder.rungs.iter().map(|price| {
                let cells = price.rung_cost.as_ref().map_or_else(
                    || vec!["not measured".to_owned()],
                    |rung_cost| self.cost_cells(rung_cost),
                );
                rung_row(&price.rung, price.about, price.in_use, cells)
            }));
        }
        if rows.is_empty() {
            return String::new();
        }
        let names = ["rung", "CPU time", "× in use", "preparing", "memory"];
        format!(
            "<h2>Rungs that change no picture</h2>\n<p class=\"soft\">These rungs change only time and memory. Their pictures are checked to be equal bit by bit.</p>\n{}",
            Table::new([ColumnAlignment::Right; 5], names, rows).to_html()
        )
    }

    /// Formats the table of the picture data that is kept by each file format.
    pub(super) fn output_table(&self) -> String {
        let row = |output: &OutputFormatReport| {
            let coding = output
                .seconds
                .map(|seconds| format_number(seconds.median * 1e3))
                .unwrap_or_default();
            let [rmse, greatest, flip] =
                [output.rmse, output.greatest, output.flip].map(format_number);
            let cells = [
                output.bytes_per_pixel.to_string(),
                coding,
                rmse,
                greatest,
                flip,
                format!("{:.1} %", 100.0 * output.clipped),
            ];
            rung_row(output.rung, output.about, output.in_use, cells)
        };
        let names = [
            "rung",
            "bytes a pixel",
            "coding, CPU ms",
            "RMSE",
            "greatest",
            "FLIP",
            "clipped",
        ];
        format!(
            "<h2>Precision of the file formats</h2>\n<p class=\"soft\">Differences of the stored display values (0 to 1) from the computed values. Clipped: share of \
             pixels with a channel at its largest value, whose detail is lost if the exposure is raised or lowered later.</p>\n{}",
            Table::new(
                [ColumnAlignment::Right; 7],
                names,
                self.report.outputs.iter().map(row)
            )
            .to_html()
        )
    }
}

/// Headings of the values of a measured setting.
const SETTING_HEADINGS: [&str; 8] = [
    "CPU time",
    "× in use",
    "error",
    "RMSE",
    "bias",
    "light",
    "FLIP",
    "alone",
];

/// Formats the change of a picture's mean radiance relative to the reference, in per cent.
/// `interval` is the ratio of the two. The text is empty if the ratio is indistinguishable from 1.
pub fn format_light_change(interval: &ConfidenceInterval) -> String {
    let is_known = interval.low > 1.0 || interval.high < 1.0;
    let change = format!("{:+.1} %", 100.0 * (interval.value - 1.0));
    if is_known && !change.ends_with("0.0 %") {
        change
    } else {
        String::new()
    }
}

/// Formats a time, given in seconds, with three significant digits and its unit.
fn format_duration(seconds: f64) -> String {
    if seconds < 0.9995 {
        format!("{} ms", format_number(1e3 * seconds))
    } else {
        format!("{} s", format_number(seconds))
    }
}
