//! Report of `accuracy` as comma-separated values, for spreadsheets and scripts: a line for each
//! rung (quality level of a setting), each effect and each combination of rungs. Columns that do
//! not apply to a kind of line are empty.

use raywright_core::accuracy::{AccuracyReport, MeasuredSettingWithFlags};
use raywright_io::report::{ColumnAlignment, Table};
use serde::Serialize;
use serde_json::{Value, json};

/// Columns, each with the places of its figure in the JSON of the different kinds of lines.
const COLUMNS: [(&str, &[&str]); 31] = [
    ("ladder", &["/ladder"]),
    ("rung", &["/rung", "/effect"]),
    ("in_use", &["/in_use"]),
    ("flags", &["/flag", "/flags"]),
    ("renders", &["/measured/renders"]),
    (
        "seconds",
        &[
            "/measured/seconds/value",
            "/seconds/median",
            "/seconds_without/median",
        ],
    ),
    (
        "seconds_low",
        &[
            "/measured/seconds/low",
            "/seconds/lower_quartile",
            "/seconds_without/lower_quartile",
        ],
    ),
    (
        "seconds_high",
        &[
            "/measured/seconds/high",
            "/seconds/upper_quartile",
            "/seconds_without/upper_quartile",
        ],
    ),
    ("ratio", &["/measured/ratio/value", "/ratio/median"]),
    ("ratio_low", &["/measured/ratio/low"]),
    ("ratio_high", &["/measured/ratio/high"]),
    ("rays", &["/measured/rays"]),
    ("rmse", &["/measured/errors/rmse/value", "/rmse"]),
    ("rmse_low", &["/measured/errors/rmse/low"]),
    ("rmse_high", &["/measured/errors/rmse/high"]),
    ("root_relmse", &["/measured/errors/root_relmse/value"]),
    ("root_relmse_low", &["/measured/errors/root_relmse/low"]),
    ("root_relmse_high", &["/measured/errors/root_relmse/high"]),
    ("bias", &["/measured/errors/bias/value"]),
    ("bias_low", &["/measured/errors/bias/low"]),
    ("bias_high", &["/measured/errors/bias/high"]),
    ("light", &["/measured/errors/light/value"]),
    ("light_low", &["/measured/errors/light/low"]),
    ("light_high", &["/measured/errors/light/high"]),
    ("flip", &["/flip"]),
    ("preparing_seconds", &["/cost/preparing"]),
    ("geometry_bytes", &["/cost/geometry"]),
    ("same_bits", &["/cost/same_bits"]),
    ("bytes_per_pixel", &["/bytes_per_pixel"]),
    ("greatest", &["/greatest"]),
    ("clipped", &["/clipped"]),
];

/// Formats the file. The lines describe:
/// - the scene's own setting;
/// - each rung (quality level) of each ladder;
/// - settings of several rungs (`together`);
/// - settings on the Pareto frontier of error and time (`frontier`);
/// - output formats (`output`);
/// - effects (`effect`).
pub fn format_csv(report: &AccuracyReport) -> String {
    let own = json!({ "rung": "", "in_use": true, "measured": report.own });
    let mut lines = vec![build_line("own", &own)];
    for ladder in &report.ladders {
        let rungs = ladder.rungs.iter();
        lines.extend(rungs.map(|rung| build_line(ladder.ladder, rung)));
    }
    lines.extend(report.outputs.iter().map(|of| build_line("output", of)));
    let effects = report.costs.iter().flat_map(|costs| &costs.effects);
    lines.extend(effects.map(|effect| build_line("effect", effect)));
    for (kind, settings) in [
        ("together", &report.combinations),
        ("frontier", &report.frontier),
    ] {
        lines.extend(settings.iter().map(|MeasuredSettingWithFlags { flags, measured }| {
            let (in_use, flags) = (flags.is_empty(), flags.join(" "));
            let line = json!({ "rung": "", "in_use": in_use, "flags": flags, "measured": measured });
            build_line(kind, &line)
        }));
    }
    let names = COLUMNS.map(|(name, _)| name);
    let rows = lines.iter().map(|line| {
        let cell = |(_, places): (_, &[&str])| {
            let mut found = places.iter().filter_map(|place| line.pointer(place));
            found.next().map(format_cell).unwrap_or_default()
        };
        COLUMNS.map(cell).into_iter().collect()
    });
    Table::new([ColumnAlignment::Left; COLUMNS.len()], names, rows).to_csv()
}

/// Converts an item of the report to the JSON of its line. Effects are always in use.
fn build_line(ladder: &str, item: &impl Serialize) -> Value {
    let mut line = json!({ "in_use": true, "ladder": ladder });
    if let (Value::Object(line), Ok(Value::Object(item))) = (&mut line, serde_json::to_value(item))
    {
        line.extend(item);
    }
    line
}

fn format_cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        // Whole numbers have no decimal point.
        Value::Number(number) => number
            .as_f64()
            .map(|number| number.to_string())
            .unwrap_or_default(),
        other => other.to_string(),
    }
}
