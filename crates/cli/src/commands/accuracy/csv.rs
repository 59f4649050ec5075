//! A measurement as a table of comma-separated values, for spreadsheets and scripts: a line for
//! each rung, effect and combination. Columns that do not apply to a kind of line are empty.

use raywright_core::accuracy::{
    Candidate, EffectCost, Interval, Measured, OutputReport, Price, Report,
};
use raywright_core::bench::Spread;

use crate::table::{Align, Table, TableRow};

/// Names of the columns.
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
    "relmse",
    "relmse_low",
    "relmse_high",
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

/// One line.
struct Line([String; COLUMNS.len()]);

impl Line {
    fn new(ladder: &str, rung: &str, in_use: bool) -> Self {
        let line = Self(std::array::from_fn(|_| String::new()));
        line.with("ladder", ladder)
            .with("rung", rung)
            .with("in_use", in_use)
    }

    /// Sets a column.
    fn with(mut self, column: &str, value: impl ToString) -> Self {
        let at = COLUMNS
            .iter()
            .position(|&name| name == column)
            .expect("columns are named here alone");
        self.0[at] = value.to_string();
        self
    }

    /// Sets the columns of median and quartiles.
    fn seconds(self, of: &Spread) -> Self {
        self.with("seconds", of.median)
            .with("seconds_low", of.lower_quartile)
            .with("seconds_high", of.upper_quartile)
    }

    fn interval(self, column: &str, of: &Interval) -> Self {
        self.with(column, of.value)
            .with(&format!("{column}_low"), of.low)
            .with(&format!("{column}_high"), of.high)
    }

    fn measured(self, of: &Measured) -> Self {
        let e = &of.errors;
        let line = self
            .with("renders", of.renders)
            .with("tiles", of.tiles)
            .with("rays", of.rays)
            .with("flip", of.flip.value);
        let all = [
            ("seconds", &of.seconds),
            ("ratio", &of.ratio),
            ("rmse", &e.rmse),
            ("relmse", &e.relmse),
            ("light", &e.light),
        ];
        let line = all
            .into_iter()
            .fold(line, |line, (column, of)| line.interval(column, of));
        e.bias
            .iter()
            .fold(line, |line, bias| line.interval("bias", bias))
    }

    fn priced(self, of: &Price) -> Self {
        of.paid.iter().fold(self, |line, paid| {
            line.seconds(&paid.seconds)
                .with("ratio", paid.ratio.median)
                .with("preparing_seconds", paid.preparing.median)
                .with("geometry_bytes", paid.geometry)
                .with("same_bits", paid.same_bits)
        })
    }

    fn of_file(of: &OutputReport) -> Self {
        let line =
            Self::new("output", of.rung, of.in_use).with("bytes_per_pixel", of.bytes_per_pixel);
        let figures = [
            ("rmse", of.rmse),
            ("greatest", of.greatest),
            ("flip", of.flip),
            ("clipped", of.clipped),
        ];
        let line = figures
            .into_iter()
            .fold(line, |line, (column, value)| line.with(column, value));
        of.seconds.iter().fold(line, Self::seconds)
    }

    /// Line of an effect: the time without the effect, and the ratio of the time with it.
    fn of_effect(of: &EffectCost) -> Self {
        let line = Self::new("effect", of.effect, true).seconds(&of.seconds_without);
        line.with("ratio", of.ratio.median)
            .with("rmse", of.rmse)
            .with("flip", of.flip)
    }
}

/// Returns the table: the scene's own setting, each rung of each ladder, settings of several rungs
/// (`together`), those on the frontier (`frontier`), file contents (`output`), and effects
/// (`effect`).
pub fn csv(report: &Report) -> String {
    let mut lines = vec![Line::new("own", "", true).measured(&report.own)];
    for ladder in &report.ladders {
        lines.extend(ladder.rungs.iter().map(|rung| {
            let line = Line::new(ladder.ladder, &rung.rung, rung.in_use)
                .with("flags", rung.flag.as_deref().unwrap_or_default());
            let line = rung.measured.iter().fold(line, Line::measured);
            rung.own_error
                .iter()
                .fold(line, |line, own| line.with("own_error", own.value))
        }));
    }
    for ladder in &report.prices {
        lines.extend(
            ladder
                .rungs
                .iter()
                .map(|price| Line::new(ladder.ladder, &price.rung, price.in_use).priced(price)),
        );
    }
    lines.extend(report.outputs.iter().map(Line::of_file));
    lines.extend(
        report
            .costs
            .iter()
            .flat_map(|costs| &costs.effects)
            .map(Line::of_effect),
    );
    let candidate = |kind: &str, of: &Candidate| {
        let line = Line::new(kind, "", of.flags.is_empty()).with("flags", of.flags.join(" "));
        line.measured(&of.measured)
    };
    lines.extend(
        report
            .combinations
            .iter()
            .map(|of| candidate("together", of)),
    );
    lines.extend(report.frontier.iter().map(|of| candidate("frontier", of)));
    Table::new(
        [Align::Left; COLUMNS.len()],
        COLUMNS,
        lines.into_iter().map(|line| TableRow::from_iter(line.0)),
    )
    .csv()
}
