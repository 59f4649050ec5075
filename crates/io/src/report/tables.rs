//! Sections of the report of an accuracy measurement: settings on the frontier, rungs (quality
//! levels) of each ladder (a setting with ordered levels), ladders that cost only time and memory,
//! file formats, and effects. Terminal and page show the same sections.

use raywright_core::accuracy::{
    ConfidenceInterval, EffectCost, EffectCosts, LadderReport, MeasuredSetting,
    MeasuredSettingWithFlags, OutputFormatReport, RungReport,
};
use raywright_core::effects::{EffectAssessment, EffectReport, EffectStatus};

use super::numbers::{format_budget, format_change, format_number, format_precise_duration};
use super::page::AccuracyPage;
use super::section::ReportSection;
use super::table::{ColumnAlignment, Table, TableRow, format_uncertain};
use crate::limits::format_bytes;

fn format_interval(interval: ConfidenceInterval) -> String {
    format_uncertain(&interval, format_number)
}

/// Returns the class of a row; rows of the scene's own setting have a class.
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

/// Returns columns of numbers, the first of text.
fn number_columns<const N: usize>() -> [ColumnAlignment; N] {
    let mut columns = [ColumnAlignment::Right; N];
    columns[0] = ColumnAlignment::Left;
    columns
}

impl AccuracyPage<'_> {
    /// Returns the section of the settings on the frontier, each with its flags; `None` without
    /// settings.
    pub fn frontier_section(&self) -> Option<ReportSection> {
        if self.report.frontier.is_empty() {
            return None;
        }
        let named = (1..).zip(self.report.frontier.iter().zip(&self.flags));
        let rows = named.map(|(i, (candidate, flags))| {
            // The section of rungs has the other measured values.
            let [time, ratio, error, _, _, light] = setting_cells(&candidate.measured);
            let cells = [
                format!("({i})"),
                time,
                ratio,
                error,
                light,
                format!("`{flags}`"),
            ];
            TableRow::with_class(row_class(candidate.flags.is_empty()), cells)
        });
        let mut columns = number_columns::<6>();
        columns[5] = ColumnAlignment::Left;
        let [time, ratio, error, _, _, light] = SETTING_HEADINGS;
        let names = ["", time, ratio, error, light, "flags"];
        Some(ReportSection {
            title: "Worth their time".to_owned(),
            explanation: format!(
                "For each setting in this table, no other measured setting is both faster and more accurate. The first row whose \
                 error is small enough is the fastest setting for that error; the last row within a time is the most accurate setting for that time. The flags \
                 are appended to `{}`",
                self.own_command
            ),
            table: Table::new(columns, names, rows).without_empty_columns(),
            notes: Vec::new(),
        })
    }

    /// Returns all other sections: rungs, rungs that cost only time and memory, file formats, and
    /// effects.
    pub fn detail_sections(&self) -> Vec<ReportSection> {
        let costs = self.report.costs.as_ref();
        [
            Some(self.rung_section()),
            self.combination_section(),
            self.cost_section(),
            Some(self.output_section()),
        ]
        .into_iter()
        .flatten()
        .chain([effect_section(costs, &self.effects, true)])
        .collect()
    }

    /// Returns the section of the measured rungs (quality levels), and the lists of all other rungs.
    fn rung_section(&self) -> ReportSection {
        ReportSection {
            title: "Rungs, changed one at a time".to_owned(),
            explanation: "A rung is a quality level of a setting; the setting is a ladder. Times are CPU times, summed over all threads, at the scene's \
                 own picture size. Error: root relMSE, the root of the mean of (I - R)² / (R² + 0.01) for the picture I and the reference R. Bias: the part of the error that more samples do not reduce. Light: the relative change of the total light. \
                 <: indistinguishable from zero; the number is the upper end of the interval. Not known: the ends of the interval differ by more than a factor of 3."
                .to_owned(),
            table: setting_table("rung", self.rung_rows()),
            notes: self.list_other_rungs(),
        }
    }

    /// Returns the rows of all measured rungs: the setting in use, the numbers of samples, the other
    /// ladders.
    fn rung_rows(&self) -> Vec<TableRow> {
        let own = setting_cells(&self.report.own);
        let own = TableRow::with_class("own", ["as it is".to_owned()].into_iter().chain(own));
        let ladders = self.report.ladders.iter();
        [own]
            .into_iter()
            .chain(ladders.flat_map(|ladder| self.ladder_rows(ladder)))
            .collect()
    }

    /// Returns the section of settings that each change several rungs; `None` without settings.
    fn combination_section(&self) -> Option<ReportSection> {
        let row = |candidate: &MeasuredSettingWithFlags| {
            let cells = setting_cells(&candidate.measured);
            [candidate.name()].into_iter().chain(cells).collect()
        };
        (!self.report.combinations.is_empty()).then(|| ReportSection {
            title: "Several rungs, changed together".to_owned(),
            explanation: String::new(),
            table: setting_table("rungs", self.report.combinations.iter().map(row)),
            notes: Vec::new(),
        })
    }

    /// Lists the rungs that the table of rungs leaves out: beaten, not measured, and without effect.
    fn list_other_rungs(&self) -> Vec<String> {
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
        let absent = self.report.inapplicable.iter();
        let lists = [
            (
                "Slower and less accurate than the rung in use",
                named(&|ladder, rung| ladder.is_dominated(rung)),
            ),
            (
                "Not measured for lack of time",
                named(&|_, rung| rung.measured.is_none()),
            ),
            (
                "Without effect on this scene, and not measured",
                absent.map(ToString::to_string).collect(),
            ),
        ];
        lists
            .into_iter()
            .filter(|(_, names)| !names.is_empty())
            .map(|(words, names)| format!("{words}: {}.", names.join(", ")))
            .chain(self.report.sufficient_budget.map(|seconds| {
                let budget = format_budget(seconds);
                format!("What is not known, `--budget {budget}` would probably make known.")
            }))
            .collect()
    }

    /// Returns the rows of a ladder for all measured rungs (its quality levels). Rungs that are
    /// slower and less accurate than the current rung are left out.
    fn ladder_rows(&self, ladder: &LadderReport) -> Vec<TableRow> {
        let rung_reports: Vec<&RungReport> = ladder
            .rungs
            .iter()
            .filter(|rung| !ladder.is_dominated(rung) && rung.measured.is_some())
            .filter(|rung| rung.cost.is_none())
            .collect();
        if rung_reports.iter().all(|rung| rung.in_use) {
            return Vec::new();
        }
        let row = |rung_report: &RungReport| {
            Some(rung_row(
                &rung_report.rung,
                rung_report.about,
                rung_report.in_use,
                setting_cells(rung_report.measured.as_ref()?),
            ))
        };
        [ladder_heading(ladder.ladder)]
            .into_iter()
            .chain(rung_reports.into_iter().filter_map(row))
            .collect()
    }

    /// Returns the section of the ladders (settings with ordered levels) that change time and
    /// memory, but not the picture; `None` without ladders.
    fn cost_section(&self) -> Option<ReportSection> {
        let mut rows = Vec::new();
        for ladder in &self.report.ladders {
            let costs: Vec<TableRow> = ladder.rungs.iter().filter_map(cost_row).collect();
            let heading = costs.first().map(|_| ladder_heading(ladder.ladder));
            rows.extend(heading.into_iter().chain(costs));
        }
        let names = ["rung", "CPU time", "× in use", "preparing", "memory"];
        (!rows.is_empty()).then(|| ReportSection {
            title: "Rungs that change no picture".to_owned(),
            explanation: "These rungs change only time and memory. Their pictures are checked to be equal bit by bit.".to_owned(),
            table: Table::new(number_columns(), names, rows),
            notes: Vec::new(),
        })
    }

    /// Returns the section of the picture data that is kept by each file format.
    fn output_section(&self) -> ReportSection {
        let row = |output: &OutputFormatReport| {
            let coding = output.seconds.as_ref();
            let [rmse, greatest, flip] =
                [output.rmse, output.greatest, output.flip].map(format_number);
            let cells = [
                output.bytes_per_pixel.to_string(),
                coding
                    .map(|seconds| format_precise_duration(seconds.median))
                    .unwrap_or_default(),
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
            "coding",
            "RMSE",
            "greatest",
            "FLIP",
            "clipped",
        ];
        ReportSection {
            title: "Precision of the file formats".to_owned(),
            explanation: "Differences of the stored display values (0 to 1) from the computed values. Clipped: share of \
                 pixels with a channel at its largest value, whose detail is lost if the exposure is raised or lowered later."
                .to_owned(),
            table: Table::new(number_columns(), names, self.report.outputs.iter().map(row)),
            notes: Vec::new(),
        }
    }
}

/// Headings of the values of a measured setting.
const SETTING_HEADINGS: [&str; 6] = ["CPU time", "× in use", "error", "RMSE", "bias", "light"];

/// Returns the table of measured settings, with the heading of the first column.
fn setting_table(first: &str, rows: impl IntoIterator<Item = TableRow>) -> Table {
    let [time, ratio, error, rmse, bias, light] = SETTING_HEADINGS;
    let names = [first, time, ratio, error, rmse, bias, light];
    Table::new(number_columns(), names, rows).without_empty_columns()
}

/// Returns the cells of a measured setting, in the order of [`SETTING_HEADINGS`]. An
/// uncertain bias is given as a bound, unless the bound is above the error and says nothing.
fn setting_cells(measured: &MeasuredSetting) -> [String; 6] {
    let errors = &measured.errors;
    let bias = errors.bias.and_then(|bias| {
        let bound = ConfidenceInterval { low: 0.0, ..bias };
        match bias.map(f64::sqrt).is_known() && !bias.includes_zero() {
            true => Some(bias),
            false => (bias.high < errors.relmse.value).then_some(bound),
        }
    });
    [
        format_uncertain(&measured.seconds, format_precise_duration),
        format_interval(measured.ratio),
        format_interval(errors.relmse.map(f64::sqrt)),
        format_interval(errors.rmse),
        bias.map(|bias| format_interval(bias.map(f64::sqrt)))
            .unwrap_or_default(),
        format_light_change(&errors.light),
    ]
}

/// Returns the row of a rung that changes no picture: time, its ratio, preparation and memory; `None`
/// for another rung.
fn cost_row(rung: &RungReport) -> Option<TableRow> {
    let (cost, measured) = (rung.cost.as_ref()?, rung.measured.as_ref()?);
    let [time, ratio, ..] = setting_cells(measured);
    let bits = if cost.same_bits {
        ""
    } else {
        ", DIFFERENT PICTURE"
    };
    let preparing = format_precise_duration(cost.preparing);
    let memory = format_bytes(cost.geometry) + bits;
    let cells = [time, ratio, preparing, memory];
    Some(rung_row(&rung.rung, rung.about, rung.in_use, cells))
}

/// Returns the section of a scene's effects with the cost of each that can be switched off, the most
/// expensive first. `with_status` adds the reason of each effect, and effects without a cost.
pub fn effect_section(
    costs: Option<&EffectCosts>,
    effects: &EffectReport,
    with_status: bool,
) -> ReportSection {
    let all = costs
        .map(|costs| costs.effects.as_slice())
        .unwrap_or_default();
    let place = |finding: &&EffectAssessment| {
        let is_own = |cost: &EffectCost| cost.effect == finding.effect.name();
        all.iter().position(is_own).unwrap_or(usize::MAX)
    };
    let mut present: Vec<&EffectAssessment> = effects
        .effects
        .iter()
        .filter(|finding| finding.status != EffectStatus::Absent)
        .filter(|finding| with_status || place(finding) < all.len())
        .collect();
    present.sort_by_key(place);
    let rows = present.into_iter().map(|finding| {
        let cost = all.get(place(&finding));
        let [time, rays, rmse, flip] = cost.map(effect_cells).unwrap_or_default();
        let status = match finding.status {
            _ if !with_status => String::new(),
            EffectStatus::Simulated => format!("simulated: {}", finding.because),
            _ => format!("left out: {}", finding.because),
        };
        let name = finding.effect.name().to_owned();
        [name, time, rays, rmse, flip, status].into_iter().collect()
    });
    let mut columns = number_columns::<6>();
    columns[5] = ColumnAlignment::Left;
    let names = [
        "effect",
        "added time",
        "added rays",
        "change of picture, RMSE",
        "FLIP",
        "status",
    ];
    ReportSection {
        title: "Effects of the scene".to_owned(),
        explanation: costs.map_or_else(
            || "The cost of each effect was not measured for lack of time.".to_owned(),
            describe_effect_costs,
        ),
        table: Table::new(columns, names, rows).without_empty_columns(),
        notes: Vec::new(),
    }
}

/// Formats the cost of an effect: the change in time as median, least and greatest value of several
/// rounds, the change in the number of rays, and the two differences of the picture (RMSE and
/// FLIP).
fn effect_cells(cost: &EffectCost) -> [String; 4] {
    let ratio = &cost.ratio;
    let [median, min, max, rays] =
        [ratio.median, ratio.min, ratio.max, cost.rays].map(format_change);
    [
        format!("{median} ({min} to {max})"),
        rays,
        format_number(cost.rmse),
        format_number(cost.flip),
    ]
}

/// Describes how the costs of effects were measured, in a sentence.
fn describe_effect_costs(costs: &EffectCosts) -> String {
    let [width, height] = costs.size;
    let late = if costs.late.is_empty() {
        String::new()
    } else {
        format!(
            "; not measured for lack of time (give a larger --budget): {}",
            costs.late.join(", ")
        )
    };
    format!(
        "The scene was rendered with and without each effect that can be switched off, in turns and with the same random numbers, at \
         {width}x{height} pixels, in {} of CPU time with all effects: the differences are the cost of the effect{late}.",
        format_precise_duration(costs.seconds.median)
    )
}

/// Formats the change of a picture's mean radiance relative to the reference, in per cent.
/// `interval` is the ratio of the two. The text is empty if the ratio is indistinguishable from 1.
fn format_light_change(interval: &ConfidenceInterval) -> String {
    let is_known = interval.low > 1.0 || interval.high < 1.0;
    let change = format!("{:+.1} %", 100.0 * (interval.value - 1.0));
    if is_known && !change.ends_with("0.0 %") {
        change
    } else {
        String::new()
    }
}
