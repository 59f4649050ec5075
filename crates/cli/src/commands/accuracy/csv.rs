//! Report of `accuracy` as comma-separated values, for spreadsheets and scripts: a line for each
//! rung (quality level of a setting), each effect and each combination of rungs. Columns that do
//! not apply to a kind of line are empty.

use raywright_core::accuracy::{AccuracyReport, MeasuredSettingWithFlags};
use serde::Serialize;
use serde_json::{Map, Value, json};

/// Names of the columns. Figures with an interval have columns for its ends.
const COLUMNS: &str = "ladder,rung,in_use,flags,renders,seconds,seconds_low,seconds_high,ratio,ratio_low,ratio_high,rays,rmse,rmse_low,rmse_high,root_relmse,root_relmse_low,root_relmse_high,\
bias,bias_low,bias_high,light,light_low,light_high,flip,preparing_seconds,geometry_bytes,same_bits,bytes_per_pixel,greatest,clipped";

/// Formats the file. The lines describe:
/// - the scene's own setting;
/// - each rung (quality level) of each ladder;
/// - settings of several rungs (`together`);
/// - settings on the Pareto frontier of error and time (`frontier`);
/// - output formats (`output`);
/// - effects (`effect`).
pub fn format_csv(report: &AccuracyReport) -> String {
    let own = json!({ "measured": report.own });
    let mut lines = vec![COLUMNS.to_owned(), format_line("own", &own)];
    for ladder in &report.ladders {
        let rungs = ladder.rungs.iter();
        lines.extend(rungs.map(|rung| format_line(ladder.ladder, rung)));
    }
    lines.extend(report.outputs.iter().map(|of| format_line("output", of)));
    let effects = report.costs.iter().flat_map(|costs| &costs.effects);
    lines.extend(effects.map(|effect| format_line("effect", effect)));
    for (kind, settings) in [
        ("together", &report.combinations),
        ("frontier", &report.frontier),
    ] {
        let line = |of: &MeasuredSettingWithFlags| {
            let flags = of.flags.join(" ");
            let line =
                json!({ "in_use": of.flags.is_empty(), "flag": flags, "measured": of.measured });
            format_line(kind, &line)
        };
        lines.extend(settings.iter().map(line));
    }
    lines.join("\n") + "\n"
}

/// Formats an item of the report as a line. Effects are always in use.
fn format_line(ladder: &str, item: &impl Serialize) -> String {
    let mut cells = Map::new();
    collect_cells(json!({ "ladder": ladder, "in_use": true }), &mut cells);
    collect_cells(serde_json::to_value(item).unwrap_or_default(), &mut cells);
    let cell = |name| cells.get(name).map(format_cell).unwrap_or_default();
    COLUMNS.split(',').map(cell).collect::<Vec<_>>().join(",")
}

/// Adds the figures of an item of the report, each under the name of its column. A figure with an
/// interval has three.
fn collect_cells(item: Value, cells: &mut Map<String, Value>) {
    let Value::Object(item) = item else { return };
    for (key, value) in item {
        let name = match key.as_str() {
            "effect" => "rung",
            "flag" => "flags",
            "seconds_without" => "seconds",
            "preparing" => "preparing_seconds",
            "geometry" => "geometry_bytes",
            same => same,
        };
        let figure = ["value", "median"].iter().find_map(|key| value.get(key));
        let Some(figure) = figure.cloned() else {
            cells.insert(name.to_owned(), value.clone());
            collect_cells(value, cells);
            continue;
        };
        cells.insert(name.to_owned(), figure);
        for (end, keys) in [
            ("low", ["low", "lower_quartile"]),
            ("high", ["high", "upper_quartile"]),
        ] {
            let bound = keys.iter().find_map(|key| value.get(key)).cloned();
            cells.insert(format!("{name}_{end}"), bound.unwrap_or_default());
        }
    }
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
