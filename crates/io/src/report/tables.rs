//! Tables of the HTML report: settings on the frontier, rungs (quality levels) of each ladder (a
//! setting with ordered levels), ladders that cost only time and memory, and effects.

use raywright_core::accuracy::{
    ConfidenceInterval, EffectCost, EffectCosts, LadderReport, MeasuredSetting, OutputFormatReport,
    RungCost, RungReport,
};
use raywright_core::bench::SampleQuantiles;
use raywright_core::effects::EffectStatus;

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

    pub(super) fn rung_table(&self) -> String {
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
        let [time, ratio, error, rmse, bias, light, flip, alone] = SETTING_HEADINGS;
        let names = ["rung", time, ratio, error, rmse, bias, light, flip, alone];
        format!(
            "<h2>Rungs, changed one at a time</h2>\n<p class=\"soft\">Times are CPU times, summed over all threads, at the scene's \
             own picture size. Error: root relMSE, the root of the mean of (I − R)² / (R² + 0.01). Bias: the part of the error that more samples do not reduce. Light: the relative change of the total light. Alone: root mean square difference from the most exact rung of the same ladder, rendered with \
             the same random numbers. &lt;: indistinguishable from the noise of the reference.</p>\n\
             {}{beaten}{late}{absent}",
            Table::new([ColumnAlignment::Right; 9], names, rows)
                .without_empty_columns()
                .to_html()
        )
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

    /// Formats the table of the scene's effects, with the cost of each effect that can be switched
    /// off.
    pub(super) fn effect_table(&self) -> String {
        let costs = self.report.costs.as_ref();
        let present = self
            .effects
            .effects
            .iter()
            .filter(|finding| finding.status != EffectStatus::Absent);
        let rows = present.map(|finding| {
            let status = if finding.status == EffectStatus::Simulated {
                "simulated"
            } else {
                "left out"
            };
            let cost = costs.and_then(|costs| {
                costs
                    .effects
                    .iter()
                    .find(|cost| cost.effect == finding.effect.name())
            });
            let [time, rays, rmse, flip] = cost.map(effect_cells).unwrap_or_default();
            let message = format!("{status}: {}", finding.because);
            [
                finding.effect.name().to_owned(),
                time,
                rays,
                rmse,
                flip,
                message,
            ]
            .into_iter()
            .collect()
        });
        let mut columns = [ColumnAlignment::Right; 6];
        columns[5] = ColumnAlignment::Left;
        let names = [
            "effect",
            "added time",
            "added rays",
            "change of picture, RMSE",
            "FLIP",
            "status",
        ];
        format!(
            "<h2>Effects of the scene</h2>\n<p class=\"soft\">{}</p>\n{}",
            costs.map_or_else(
                || "The cost of each effect was not measured for lack of time.".to_owned(),
                describe_effect_costs
            ),
            Table::new(columns, names, rows)
                .without_empty_columns()
                .to_html()
        )
    }
}

/// Formats the cost of an effect: the change in time as median, least and greatest value of several
/// rounds, the change in the number of rays, and the two differences of the picture (RMSE and
/// FLIP).
fn effect_cells(effect_cost: &EffectCost) -> [String; 4] {
    let percent = |ratio: f64| format!("{:+.0} %", 100.0 * (ratio - 1.0));
    let time = format!(
        "{} ({} to {})",
        percent(effect_cost.ratio.median),
        percent(effect_cost.ratio.min),
        percent(effect_cost.ratio.max)
    );
    [
        time,
        percent(effect_cost.rays),
        format_number(effect_cost.rmse),
        format_number(effect_cost.flip),
    ]
}

fn describe_effect_costs(costs: &EffectCosts) -> String {
    let [width, height] = costs.size;
    let late = if costs.late.is_empty() {
        String::new()
    } else {
        format!("; not measured for lack of time: {}", costs.late.join(", "))
    };
    format!(
        "Rendered with and without each effect that can be switched off, in turns and with the same random numbers, at \
         {width}×{height}: the differences are the cost of the effect{late}."
    )
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

/// Formats the relative change of the picture's total light, in per cent; empty if the change is
/// indistinguishable from zero.
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
