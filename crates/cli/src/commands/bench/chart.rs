//! Plot of `bench`: time per ray against the number N of primitives, for linear scan and tree. A
//! mark shows the least N at which the tree is faster.

use raywright_core::bench::{
    GeneratedPrimitive, GeneratedSceneTimings, PowerLaw, QueryCost, ScanTreeTiming,
};
use raywright_io::report::{
    Plot, PlotAxis, PlotLine, PlotPoint, ThemeColour, format_power, format_seconds,
};

use super::BenchReport;

/// Draws the lines of all series in a plot and returns its SVG text.
pub fn draw_bench_plot(series: &[GeneratedSceneTimings], report: &BenchReport) -> String {
    let scans = series
        .iter()
        .map(|s| build_series_line(s, "scan", ThemeColour::First, s.scan_growth, |row| row.scan));
    let trees = series.iter().map(|s| {
        build_series_line(s, "tree", ThemeColour::Second, s.tree_growth, |row| {
            Some(row.tree)
        })
    });
    let machine = report
        .processor
        .as_deref()
        .map(|name| format!(" · {name}"))
        .unwrap_or_default();
    Plot {
        title: "Time to find the closest hit of a ray".to_owned(),
        subtitle: "scan: every primitive tested · tree: a hierarchy of boxes".to_owned(),
        circumstances: format!("one thread, {}{machine}", report.clock),
        x: PlotAxis {
            label: "N, number of primitives, which fill the same share of space for every N"
                .to_owned(),
            tick: Some(format_power),
        },
        y: PlotAxis {
            label: "time per ray: median, and range of the repeats".to_owned(),
            tick: Some(format_seconds),
        },
        lines: scans.chain(trees).collect(),
        is_falling: false,
    }
    .to_svg()
}

fn build_series_line(
    series: &GeneratedSceneTimings,
    name: &str,
    colour: ThemeColour,
    growth: Option<PowerLaw>,
    cost: fn(&ScanTreeTiming) -> Option<QueryCost>,
) -> PlotLine {
    let exponent = growth
        .map(|law| format!(": grows as N^{:.2}", law.exponent))
        .unwrap_or_default();
    let point = |row: &ScanTreeTiming| {
        let time = cost(row)?.nanoseconds.scale(1e-9);
        Some(PlotPoint {
            x: row.primitives as f64,
            y: time.median,
            spread: [time.min, time.max],
            ..PlotPoint::default()
        })
    };
    PlotLine {
        name: format!("{name}, {}{exponent}", series.kind.name()),
        colour,
        is_dashed: series.kind == GeneratedPrimitive::Triangles,
        is_unjoined: false,
        points: series.rows.iter().filter_map(point).collect(),
    }
}
