//! Report of `accuracy` as comma-separated values, for spreadsheets and scripts: a line for each
//! rung (quality level of a setting), each effect and each combination of rungs. Columns that do
//! not apply to a kind of line are empty.

use raywright_core::accuracy::{
    AccuracyReport, ConfidenceInterval, EffectCost, MeasuredSetting, MeasuredSettingWithFlags,
    OutputFormatReport, RungCostReport,
};
use raywright_core::bench::SampleQuantiles;

use crate::table::{ColumnAlignment, Table, TableRow};

/// Names of the columns, in their order.
const COLUMNS: [&str; 33] = [
    "ladder",
    "rung",
    "in_use",
    "flags",
    "renders",
    "seconds",
    "seconds_low",
    "seconds_high",
    "tiles",
    "ratio",
    "ratio_low",
    "ratio_high",
    "rays",
    "rmse",
    "rmse_low",
    "rmse_high",
    "root_relmse",
    "root_relmse_low",
    "root_relmse_high",
    "bias",
    "bias_low",
    "bias_high",
    "light",
    "light_low",
    "light_high",
    "flip",
    "own_error",
    "preparing_seconds",
    "geometry_bytes",
    "same_bits",
    "bytes_per_pixel",
    "greatest",
    "clipped",
];

/// A line of the file: the text of each column, empty where the column does not apply.
struct CsvLine([String; COLUMNS.len()]);

impl CsvLine {
    fn new(ladder: &str, rung: &str, in_use: bool) -> Self {
        let line = Self(std::array::from_fn(|_| String::new()));
        line.with_column("ladder", ladder)
            .with_column("rung", rung)
            .with_column("in_use", in_use)
    }

    /// Sets the text of the column named `column`.
    fn with_column(mut self, column: &str, value: impl ToString) -> Self {
        let position = COLUMNS
            .iter()
            .position(|&name| name == column)
            .expect("every column name is an entry of COLUMNS");
        self.0[position] = value.to_string();
        self
    }

    /// Sets the three columns of the time: its median and its quartiles in seconds.
    fn with_seconds(self, spread: &SampleQuantiles) -> Self {
        self.with_column("seconds", spread.median)
            .with_column("seconds_low", spread.lower_quartile)
            .with_column("seconds_high", spread.upper_quartile)
    }

    fn with_interval(self, column: &str, interval: &ConfidenceInterval) -> Self {
        self.with_column(column, interval.value)
            .with_column(&format!("{column}_low"), interval.low)
            .with_column(&format!("{column}_high"), interval.high)
    }

    fn with_measured_setting(self, measured: &MeasuredSetting) -> Self {
        let errors = &measured.errors;
        let line = self
            .with_column("renders", measured.renders)
            .with_column("tiles", measured.tiles)
            .with_column("rays", measured.rays)
            .with_column("flip", measured.flip.value);
        let all = [
            ("seconds", &measured.seconds),
            ("ratio", &measured.ratio),
            ("rmse", &errors.rmse),
            ("root_relmse", &errors.relmse.map(f64::sqrt)),
            ("light", &errors.light),
        ];
        let line = all.into_iter().fold(line, |line, (column, interval)| {
            line.with_interval(column, interval)
        });
        errors.bias.iter().fold(line, |line, bias| {
            line.with_interval("bias", &bias.map(f64::sqrt))
        })
    }

    fn with_rung_cost(self, of: &RungCostReport) -> Self {
        of.rung_cost.iter().fold(self, |line, rung_cost| {
            line.with_seconds(&rung_cost.seconds)
                .with_column("ratio", rung_cost.ratio.median)
                .with_column("preparing_seconds", rung_cost.preparing.median)
                .with_column("geometry_bytes", rung_cost.geometry)
                .with_column("same_bits", rung_cost.same_bits)
        })
    }

    fn from_output_report(output: &OutputFormatReport) -> Self {
        let line = Self::new("output", output.rung, output.in_use)
            .with_column("bytes_per_pixel", output.bytes_per_pixel);
        let figures = [
            ("rmse", output.rmse),
            ("greatest", output.greatest),
            ("flip", output.flip),
            ("clipped", output.clipped),
        ];
        let line = figures.into_iter().fold(line, |line, (column, value)| {
            line.with_column(column, value)
        });
        output.seconds.iter().fold(line, Self::with_seconds)
    }

    /// Creates the line of an effect: the render time without the effect, and the ratio of the time
    /// with the effect to the time without.
    fn from_effect_cost(effect_cost: &EffectCost) -> Self {
        let line = Self::new("effect", effect_cost.effect, true)
            .with_seconds(&effect_cost.seconds_without);
        line.with_column("ratio", effect_cost.ratio.median)
            .with_column("rmse", effect_cost.rmse)
            .with_column("flip", effect_cost.flip)
    }
}

/// Formats the file. The lines describe:
/// - the scene's own setting;
/// - each rung (quality level) of each ladder;
/// - settings of several rungs (`together`);
/// - settings on the Pareto frontier of error and time (`frontier`);
/// - output formats (`output`);
/// - effects (`effect`).
pub fn format_csv(report: &AccuracyReport) -> String {
    let mut lines = vec![CsvLine::new("own", "", true).with_measured_setting(&report.own)];
    for ladder in &report.ladders {
        lines.extend(ladder.rungs.iter().map(|rung| {
            let line = CsvLine::new(ladder.ladder, &rung.rung, rung.in_use)
                .with_column("flags", rung.flag.as_deref().unwrap_or_default());
            let line = rung
                .measured
                .iter()
                .fold(line, CsvLine::with_measured_setting);
            rung.own_error.iter().fold(line, |line, interval| {
                line.with_column("own_error", interval.value)
            })
        }));
    }
    for ladder in &report.prices {
        lines.extend(ladder.rungs.iter().map(|price| {
            CsvLine::new(ladder.ladder, &price.rung, price.in_use).with_rung_cost(price)
        }));
    }
    lines.extend(report.outputs.iter().map(CsvLine::from_output_report));
    lines.extend(
        report
            .costs
            .iter()
            .flat_map(|costs| &costs.effects)
            .map(CsvLine::from_effect_cost),
    );
    let candidate = |kind: &str, each_candidate: &MeasuredSettingWithFlags| {
        let line = CsvLine::new(kind, "", each_candidate.flags.is_empty())
            .with_column("flags", each_candidate.flags.join(" "));
        line.with_measured_setting(&each_candidate.measured)
    };
    lines.extend(
        report
            .combinations
            .iter()
            .map(|each_candidate| candidate("together", each_candidate)),
    );
    lines.extend(
        report
            .frontier
            .iter()
            .map(|each_candidate| candidate("frontier", each_candidate)),
    );
    Table::new(
        [ColumnAlignment::Left; COLUMNS.len()],
        COLUMNS,
        lines.into_iter().map(|line| TableRow::from_iter(line.0)),
    )
    .to_csv()
}
