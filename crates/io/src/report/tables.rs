//! Sections of the report of an accuracy measurement: settings on the frontier, rungs (quality
//! levels) of each ladder (a setting with ordered levels), and several rungs together. Terminal and
//! page show the same sections.

use raywright_core::accuracy::{ConfidenceInterval, MeasuredSetting};

use super::numbers::{format_precise_duration, format_three_digits};
use super::page::AccuracyPage;
use super::section::ReportSection;
use super::table::{ColumnAlignment, Table, TableRow, format_uncertain};

fn format_interval(interval: ConfidenceInterval) -> String {
    format_uncertain(&interval, format_three_digits)
}

/// Returns columns of numbers, the first of text.
fn number_columns<const N: usize>() -> [ColumnAlignment; N] {
    let mut columns = [ColumnAlignment::Right; N];
    columns[0] = ColumnAlignment::Left;
    columns
}

impl AccuracyPage<'_> {
    /// Returns all sections of the report.
    pub fn sections(&self) -> Vec<ReportSection> {
        let sections = [self.combination_section()].into_iter().flatten();
        [self.frontier_section(), self.rung_section()]
            .into_iter()
            .chain(sections)
            .collect()
    }

    /// Returns the section of the settings on the frontier, each with its flags.
    fn frontier_section(&self) -> ReportSection {
        let report = self.report;
        let named = (1..).zip(&report.frontier);
        let mut named: Vec<_> = named.map(|(i, &row)| (format!("({i})"), row)).collect();
        if !report.frontier.contains(&0) {
            let seconds = |row: usize| report.settings[row].seconds.value;
            let place = named.partition_point(|(_, row)| seconds(*row) < seconds(0));
            named.insert(place, (String::new(), 0));
        }
        let rows = named.into_iter().map(|(number, row)| {
            let measured = &report.settings[row];
            // The section of rungs has the other measured values.
            let [time, ratio, error, _, light] = setting_cells(measured);
            let flags = match row {
                0 => self.describe_own(),
                _ => format!("`{}`", measured.name()),
            };
            TableRow::from_iter([number, time, ratio, error, light, flags])
        });
        let mut columns = number_columns::<6>();
        columns[5] = ColumnAlignment::Left;
        let [time, ratio, error, _, light] = SETTING_HEADINGS;
        let names = ["", time, ratio, error, light, "flags"];
        ReportSection {
            title: "Worth their time".to_owned(),
            explanation: format!(
                "The settings of which no other has less error in less time. Those that lose more light than the one in use, have much bias or an unknown \
                 error are only in the tables below. A number of samples that took too long follows from the others; fewer than 8 are not denoised. Take the first row whose error is small enough, or the last row within your time, and add its flags to `{}`",
                self.own_command
            ),
            table: Table::new(columns, names, rows).without_empty_columns(),
            notes: Vec::new(),
        }
    }

    /// Names the setting in use, and says why it is not among those worth their time.
    pub(super) fn describe_own(&self) -> String {
        let own = self.report.own();
        let flags = match own.flags.join(" ") {
            flags if flags.is_empty() => String::new(),
            flags => format!(" (`{flags}`)"),
        };
        let reason = match self.report.better_row() {
            _ if !own.errors.root_relmse.is_known() => {
                "; its error is not known, so that it cannot be compared".to_owned()
            }
            Some((row, ratios)) => {
                // As much as advice calls less time, and what no two renders are apart.
                let [time, error] = ratios.map(|ratio| match ratio {
                    ..=0.8 => "less",
                    ..=0.97 => "a little less",
                    _ => "the same",
                });
                let name = self.report.settings[row].name();
                format!("; `{name}` has {error} error in {time} time")
            }
            None => String::new(),
        };
        format!("in use{flags}{reason}")
    }

    /// Returns the section of the setting in use and of the measured rungs (quality levels) under the
    /// names of their ladders, and the lists of all other rungs.
    fn rung_section(&self) -> ReportSection {
        let report = self.report;
        let mut rows = vec![setting_row(report.own().name(), report.own())];
        for ladder in &report.ladders {
            let rungs = report.settings.iter().filter_map(|measured| {
                let choice = measured.single_rung()?;
                let is_row = choice.ladder().name() == ladder.ladder && !measured.is_dominated();
                is_row.then(|| TableRow {
                    tooltip: choice.rung_description().to_owned(),
                    ..setting_row(choice.rung().to_owned(), measured)
                })
            });
            let rungs: Vec<TableRow> = rungs.collect();
            if !rungs.is_empty() {
                let name = format!("{} (in use: {})", ladder.ladder, ladder.in_use);
                rows.push(TableRow::with_class("ladder", [name]));
                rows.extend(rungs);
            }
        }
        ReportSection {
            title: "Rungs, changed one at a time".to_owned(),
            explanation: "A rung is a quality level of a setting; the setting is a ladder. `--rung LADDER=RUNG` chooses a rung; `--spp`, `--denoise`, `--max-depth`, \
                 `--integrator` and `--precision` choose those of samples, reconstruction, path-length, integrator and precision. Times are CPU times, summed over all threads, at the scene's \
                 own picture size. Error: root relMSE, the root of the mean of (I - R)² / (R² + 0.01) for the picture I and the reference R. Bias: the part of the error that more samples do not reduce. Light: the relative change of the total light. \
                 <: indistinguishable from zero; the number is the upper end of the interval. Not known: the ends of the interval differ by more than a factor of 3. \
                 An empty cell of bias or light: indistinguishable from zero. ?: not measured."
                .to_owned(),
            table: setting_table("rung", rows),
            notes: self.list_other_rungs(),
        }
    }

    /// Returns the section of settings that each change several rungs; `None` without settings.
    fn combination_section(&self) -> Option<ReportSection> {
        let all = self.report.settings.iter();
        let rows = all.filter(|of| of.setting.choices().len() > 1);
        let rows: Vec<TableRow> = rows
            .map(|of| setting_row(format!("`{}`", of.name()), of))
            .collect();
        (!rows.is_empty()).then(|| ReportSection {
            title: "Settings of several rungs".to_owned(),
            explanation: String::new(),
            table: setting_table("flags", rows),
            notes: Vec::new(),
        })
    }

    /// Lists the rungs that the table of rungs leaves out: beaten, or not measured.
    fn list_other_rungs(&self) -> Vec<String> {
        let report = self.report;
        let dominated = report.settings.iter().filter(|of| of.is_dominated());
        let dominated: Vec<String> = dominated.map(|of| format!("`{}`", of.setting)).collect();
        let lists = [
            (
                "Slower and less accurate than the rung in use",
                dominated.join(", "),
            ),
            (
                "Not measured for lack of time",
                report
                    .unmeasured
                    .iter()
                    .map(|name| format!("`{name}`"))
                    .collect::<Vec<_>>()
                    .join(", "),
            ),
        ];
        lists
            .into_iter()
            .filter(|(_, names)| !names.is_empty())
            .map(|(words, names)| format!("{words}: {names}."))
            .collect()
    }
}

/// Headings of the values of a measured setting.
const SETTING_HEADINGS: [&str; 5] = ["CPU time", "× in use", "error", "bias", "light"];

/// Returns the table of measured settings, with the heading of the first column.
fn setting_table(first: &str, rows: impl IntoIterator<Item = TableRow>) -> Table {
    let [time, ratio, error, bias, light] = SETTING_HEADINGS;
    let names = [first, time, ratio, error, bias, light];
    Table::new(number_columns(), names, rows).without_empty_columns()
}

/// Returns the row of a measured setting under a name.
fn setting_row(name: String, measured: &MeasuredSetting) -> TableRow {
    [name].into_iter().chain(setting_cells(measured)).collect()
}

/// Returns the cells of a measured setting, in the order of [`SETTING_HEADINGS`]. An
/// uncertain bias is given as a bound, unless the bound is above the error and says nothing.
fn setting_cells(measured: &MeasuredSetting) -> [String; 5] {
    let errors = &measured.errors;
    let bias = errors.bias.map_or("?".to_owned(), |bias| {
        let bound = ConfidenceInterval { low: 0.0, ..bias };
        match bias.is_known() && !bias.includes_zero() {
            true => format_interval(bias),
            false if bias.high < errors.root_relmse.value => format_interval(bound),
            false => String::new(),
        }
    });
    [
        format_uncertain(&measured.seconds, format_precise_duration),
        format_interval(measured.ratio),
        format_interval(errors.root_relmse),
        bias,
        format_light_change(&errors.light),
    ]
}

/// Formats the change of a picture's mean radiance relative to the reference, in per cent.
/// `interval` is the ratio of the two. The text is empty if the ratio is indistinguishable from 1, and `?`
/// if it is unknown.
fn format_light_change(interval: &ConfidenceInterval) -> String {
    if !interval.value.is_finite() {
        return "?".to_owned();
    }
    let is_known = interval.low > 1.0 || interval.high < 1.0;
    let change = format!("{:+.1} %", 100.0 * (interval.value - 1.0));
    if is_known && !change.ends_with("0.0 %") {
        change
    } else {
        String::new()
    }
}
