//! Tables of the page: settings on the frontier, rungs, ladders without error, effects.

use raywright_core::accuracy::{
    ConfidenceInterval, EffectCost, EffectCosts, LadderReport, MeasuredSetting, OutputReport,
    RungCost, RungReport,
};
use raywright_core::bench::Spread;
use raywright_core::effects::EffectStatus;

use super::page::{Page, number};
use super::plot::escape_xml;
use super::table::{Align, Table, TableRow, format_uncertain};
use crate::limits::human_bytes;

fn interval(interval: ConfidenceInterval) -> String {
    format_uncertain(&interval, number)
}

/// Class of rows for the current setting.
fn own(in_use: bool) -> &'static str {
    if in_use { "own" } else { "" }
}

/// Heading row of a ladder.
fn heading(ladder: &str) -> TableRow {
    TableRow::of_class("ladder", [ladder.to_owned()])
}

/// Row of a rung, with its tooltip and its cells.
fn rung(
    name: &str,
    about: &str,
    in_use: bool,
    cells: impl IntoIterator<Item = String>,
) -> TableRow {
    TableRow {
        about: about.to_owned(),
        ..TableRow::of_class(own(in_use), [name.to_owned()].into_iter().chain(cells))
    }
}

impl Page<'_> {
    /// Table of the settings on the frontier, each with its command.
    pub(super) fn frontier(&self) -> String {
        if self.report.frontier.is_empty() {
            return String::new();
        }
        let named = (1..).zip(self.report.frontier.iter().zip(self.flags));
        let rows = named.map(|(i, (candidate, flags))| {
            // The other cells are in the table of rungs.
            let [time, ratio, error, _, _, light, ..] = self.cells(&candidate.measured, None);
            let cells = [
                format!("({i})"),
                format!("`{flags}`"),
                time,
                ratio,
                error,
                light,
            ];
            TableRow::of_class(own(candidate.flags.is_empty()), cells)
        });
        let mut columns = [Align::Right; 6];
        columns[1] = Align::Left;
        let [time, ratio, error, _, _, light, ..] = HEADS;
        let names = ["", "flags", time, ratio, error, light];
        format!(
            "<h2>Worth their time</h2>\n<p>No setting that was measured is both faster and nearer to the reference. The first row whose \
             error is small enough is the cheapest setting for that error; the last one within a time is the best for that time. The flags \
             stand behind <code>{}</code></p>\n{}",
            escape_xml(self.own_command),
            Table::new(columns, names, rows)
                .without_empty_columns()
                .html(),
        )
    }

    pub(super) fn rungs(&self) -> String {
        let named = |name: String, measured: &MeasuredSetting| {
            [name].into_iter().chain(self.cells(measured, None))
        };
        let mut rows = vec![TableRow::of_class(
            "own",
            named("as it is".to_owned(), &self.report.own),
        )];
        let (samples, others): (Vec<_>, Vec<_>) = self
            .report
            .ladders
            .iter()
            .partition(|ladder| ladder.ladder == "samples");
        rows.extend(samples.into_iter().flat_map(|ladder| self.rows_of(ladder)));
        let base = self.report.base.as_ref();
        rows.extend(base.map(|base| {
            TableRow::of_class(
                "ladder",
                named(
                    format!("all below: {} samples", base.samples),
                    &base.measured,
                ),
            )
        }));
        rows.extend(others.into_iter().flat_map(|ladder| self.rows_of(ladder)));
        if !self.report.combinations.is_empty() {
            rows.push(heading("together, beside the scene as it is"));
            rows.extend(self.report.combinations.iter().map(|candidate| {
                TableRow::of_class("", named(candidate.name(), &candidate.measured))
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
            "Slower and worse than what is in use",
            named(&|ladder, rung| ladder.beats(rung)),
        );
        let late = line("No time for", named(&|_, rung| rung.measured.is_none()));
        let absent = match self.report.not_called_for.as_slice() {
            [] => String::new(),
            names => format!(
                "<p class=\"soft\">Not called for by this scene, and not measured: {}.</p>\n",
                names.join(", ")
            ),
        };
        let [time, ratio, error, rmse, bias, light, flip, alone] = HEADS;
        let names = ["rung", time, ratio, error, rmse, bias, light, flip, alone];
        format!(
            "<h2>Every rung, one at a time</h2>\n<p class=\"soft\">Times are those of all threads at the scene's \
             own size. Error: root relMSE, the root of the mean of (I − R)² / (R² + 0.01). Bias: the part of it that more samples leave. Light: what is gone of it, or added. Alone: root mean square difference to the ladder's most exact rung with \
             the same random numbers. &lt;: too small to be told from the reference's noise.</p>\n\
             {}{beaten}{late}{absent}",
            Table::new([Align::Right; 9], names, rows)
                .without_empty_columns()
                .html()
        )
    }

    /// Rows of a ladder for all measured rungs, except rungs that are slower and worse than the
    /// current rung.
    fn rows_of(&self, ladder: &LadderReport) -> Vec<TableRow> {
        let rung_reports: Vec<&RungReport> = ladder
            .rungs
            .iter()
            .filter(|rung| !ladder.beats(rung) && rung.measured.is_some())
            .collect();
        if rung_reports.iter().all(|rung| rung.in_use) {
            return Vec::new();
        }
        let row = |rung_report: &RungReport| {
            Some(rung(
                &rung_report.rung,
                rung_report.about,
                rung_report.in_use,
                self.cells(rung_report.measured.as_ref()?, rung_report.own_error),
            ))
        };
        [heading(ladder.ladder)]
            .into_iter()
            .chain(rung_reports.into_iter().filter_map(row))
            .collect()
    }

    fn cells(
        &self,
        measured: &MeasuredSetting,
        own_error: Option<ConfidenceInterval>,
    ) -> [String; 8] {
        let errors = &measured.errors;
        [
            format_uncertain(&measured.seconds, spoken),
            interval(measured.ratio),
            interval(errors.relmse.map(f64::sqrt)),
            interval(errors.rmse),
            errors
                .bias
                .map(|bias| interval(bias.map(f64::sqrt)))
                .unwrap_or_default(),
            light_change(&errors.light),
            interval(measured.flip),
            own_error.map(interval).unwrap_or_default(),
        ]
    }

    /// Formats the time of a render, with its relative spread.
    fn time(&self, spread: &Spread) -> String {
        format!(
            "{} ±{:.0} %",
            spoken(spread.median),
            spread.relative() * 100.0
        )
    }

    fn cost_cells(&self, rung_cost: &RungCost) -> Vec<String> {
        let bits = if rung_cost.same_bits {
            ""
        } else {
            ", ANOTHER PICTURE"
        };
        let memory = human_bytes(rung_cost.geometry) + bits;
        vec![
            self.time(&rung_cost.seconds),
            number(rung_cost.ratio.median),
            spoken(rung_cost.preparing.median),
            memory,
        ]
    }

    /// Table of the ladders that change no picture.
    pub(super) fn prices(&self) -> String {
        let mut rows = Vec::new();
        for ladder in &self.report.prices {
            rows.push(heading(ladder.ladder));
            rows.extend(ladder.rungs.iter().map(|price| {
                let cells = price.rung_cost.as_ref().map_or_else(
                    || vec!["no time".to_owned()],
                    |rung_cost| self.cost_cells(rung_cost),
                );
                rung(&price.rung, price.about, price.in_use, cells)
            }));
        }
        if rows.is_empty() {
            return String::new();
        }
        let names = ["rung", "CPU time", "× in use", "preparing", "memory"];
        format!(
            "<h2>What changes no picture</h2>\n<p class=\"soft\">Rungs that cost time and memory alone. Their pictures are the same bits, which is checked.</p>\n{}",
            Table::new([Align::Right; 5], names, rows).html()
        )
    }

    /// Table of the picture data that each file format keeps.
    pub(super) fn outputs(&self) -> String {
        let row = |output: &OutputReport| {
            let coding = output
                .seconds
                .map(|seconds| number(seconds.median * 1e3))
                .unwrap_or_default();
            let [rmse, greatest, flip] = [output.rmse, output.greatest, output.flip].map(number);
            let cells = [
                output.bytes_per_pixel.to_string(),
                coding,
                rmse,
                greatest,
                flip,
                format!("{:.1} %", 100.0 * output.clipped),
            ];
            rung(output.rung, output.about, output.in_use, cells)
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
            "<h2>What a file keeps</h2>\n<p class=\"soft\">Differences of display values, 0 to 1, from those that were computed. Clipped: \
             pixels with a channel as bright as can be, which is lost where the picture is exposed again.</p>\n{}",
            Table::new(
                [Align::Right; 7],
                names,
                self.report.outputs.iter().map(row)
            )
            .html()
        )
    }

    /// Table of the scene's effects, and the cost of each effect that can be switched off.
    pub(super) fn effects(&self) -> String {
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
            let [time, rays, rmse, flip] = cost.map(added).unwrap_or_default();
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
        let mut columns = [Align::Right; 6];
        columns[5] = Align::Left;
        let names = [
            "effect",
            "adds to time",
            "to rays",
            "changes, RMSE",
            "FLIP",
            "status",
        ];
        format!(
            "<h2>What the scene calls for</h2>\n<p class=\"soft\">{}</p>\n{}",
            costs.map_or_else(
                || "There was no time to measure what each costs.".to_owned(),
                how_measured
            ),
            Table::new(columns, names, rows)
                .without_empty_columns()
                .html()
        )
    }
}

/// Formats the cost of an effect: time as median and range over the rounds, rays, and the changes
/// of the picture.
fn added(effect_cost: &EffectCost) -> [String; 4] {
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
        number(effect_cost.rmse),
        number(effect_cost.flip),
    ]
}

fn how_measured(costs: &EffectCosts) -> String {
    let [width, height] = costs.size;
    let late = if costs.late.is_empty() {
        String::new()
    } else {
        format!("; no time for {}", costs.late.join(", "))
    };
    format!(
        "Rendered with and without each effect that can be switched off, in turns and with the same random numbers, at \
         {width}×{height}: what the effect adds{late}."
    )
}

/// Headings for a measured setting.
const HEADS: [&str; 8] = [
    "CPU time",
    "× in use",
    "error",
    "RMSE",
    "bias",
    "light",
    "FLIP",
    "alone",
];

/// Formats the relative change of the picture's light, in per cent; empty if indistinguishable from
/// zero.
pub fn light_change(interval: &ConfidenceInterval) -> String {
    let is_known = interval.low > 1.0 || interval.high < 1.0;
    let change = format!("{:+.1} %", 100.0 * (interval.value - 1.0));
    if is_known && !change.ends_with("0.0 %") {
        change
    } else {
        String::new()
    }
}

/// Formats a time with three digits.
fn spoken(seconds: f64) -> String {
    if seconds < 0.9995 {
        format!("{} ms", number(1e3 * seconds))
    } else {
        format!("{} s", number(seconds))
    }
}
