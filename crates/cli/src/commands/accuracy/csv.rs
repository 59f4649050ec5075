//! A measurement as one table of comma-separated values, for spreadsheets and scripts: a line for each rung, effect and combination, in
//! columns that are empty where a kind of line has nothing to say.

use raywright_core::accuracy::{EffectCost, Measured, OutputReport, Price, Report};
use raywright_core::bench::Spread;

use crate::table::{Align, Table, TableRow};

/// Names of the columns.
const COLUMNS: [&str; 27] = [
    "ladder",
    "rung",
    "in_use",
    "flags",
    "renders",
    "seconds",
    "seconds_lower_quartile",
    "seconds_upper_quartile",
    "ratio",
    "rays",
    "rmse",
    "rmse_low",
    "rmse_high",
    "bias",
    "noise",
    "relmse",
    "relmse_low",
    "relmse_high",
    "flip",
    "percentile_99_9",
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
        let line = Self(Default::default());
        line.with("ladder", ladder).with("rung", rung).with("in_use", in_use)
    }

    /// Fills a column.
    fn with(mut self, column: &str, value: impl ToString) -> Self {
        let at = COLUMNS.iter().position(|&name| name == column).expect("columns are named here alone");
        self.0[at] = value.to_string();
        self
    }

    fn seconds(self, of: &Spread) -> Self {
        self.with("seconds", of.median)
            .with("seconds_lower_quartile", of.lower_quartile)
            .with("seconds_upper_quartile", of.upper_quartile)
    }

    fn measured(self, of: &Measured) -> Self {
        let e = &of.errors;
        let all = [
            ("ratio", of.ratio.median),
            ("rmse", e.rmse.value),
            ("rmse_low", e.rmse.low),
            ("rmse_high", e.rmse.high),
            ("bias", e.bias),
            ("relmse", e.relmse.value),
            ("relmse_low", e.relmse.low),
            ("relmse_high", e.relmse.high),
            ("flip", of.flip),
            ("percentile_99_9", e.percentile_99_9),
        ];
        let line = self.seconds(&of.seconds).with("renders", of.renders).with("rays", of.rays);
        let line = all.into_iter().fold(line, |line, (column, value)| line.with(column, value));
        e.noise.into_iter().fold(line, |line, noise| line.with("noise", noise))
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
        let line = Self::new("output", of.rung, of.in_use).with("bytes_per_pixel", of.bytes_per_pixel);
        let figures = [("rmse", of.rmse), ("greatest", of.greatest), ("flip", of.flip), ("clipped", of.clipped)];
        let line = figures.into_iter().fold(line, |line, (column, value)| line.with(column, value));
        of.seconds.iter().fold(line, Self::seconds)
    }

    /// What an effect adds: its time without it, and the ratio with it.
    fn of_effect(of: &EffectCost) -> Self {
        let line = Self::new("effect", of.effect, true).seconds(&of.seconds_without);
        line.with("ratio", of.ratio.median).with("rmse", of.rmse).with("flip", of.flip)
    }
}

/// The scene's own setting, each rung of each ladder, the settings worth their time (`frontier`), what files keep (`output`), and what
/// effects add (`effect`).
pub fn csv(report: &Report) -> String {
    let mut lines = vec![Line::new("own", "", true).measured(&report.own)];
    for ladder in &report.ladders {
        lines.extend(ladder.rungs.iter().map(|rung| {
            let line = Line::new(ladder.ladder, &rung.rung, rung.in_use).with("flags", rung.flag.as_deref().unwrap_or_default());
            let line = rung.measured.iter().fold(line, Line::measured);
            rung.own_error.into_iter().fold(line, |line, own| line.with("own_error", own))
        }));
    }
    for ladder in &report.prices {
        lines.extend(ladder.rungs.iter().map(|price| Line::new(ladder.ladder, &price.rung, price.in_use).priced(price)));
    }
    lines.extend(report.outputs.iter().map(Line::of_file));
    lines.extend(report.costs.iter().flat_map(|costs| &costs.effects).map(Line::of_effect));
    lines.extend(report.frontier.iter().map(|candidate| {
        let line = Line::new("frontier", "", candidate.flags.is_empty()).with("flags", candidate.flags.join(" "));
        line.measured(&candidate.measured)
    }));
    Table::new([Align::Left; COLUMNS.len()], COLUMNS, lines.into_iter().map(|line| TableRow::from_iter(line.0))).csv()
}
