//! Plot of `bench`: time per ray against the number N of primitives, for linear scan and tree. A
//! mark shows the least N at which the tree is faster.

use raywright_core::bench::{
    GeneratedPrimitive, GeneratedSceneTimings, PowerLaw, QueryCost, ScanTreeTiming,
};
use raywright_io::report::{Plot, PlotAxis, PlotLine, PlotPoint, ThemeColour};

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
            tick: Some(format_count_tick),
        },
        y: PlotAxis {
            label: "time per ray: median, and range of the repeats".to_owned(),
            tick: Some(format_time_tick),
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
        let time = cost(row)?.nanoseconds;
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

/// Formats 10 to the power `exponent` as a label on the axis of counts: 1, 10, 100, 1 000 …
fn format_count_tick(exponent: i32) -> String {
    let zeros = exponent.max(0) as usize;
    let digits: Vec<char> = format!("1{}", "0".repeat(zeros)).chars().collect();
    let groups: Vec<String> = digits
        .rchunks(3)
        .rev()
        .map(|group| group.iter().collect())
        .collect();
    groups.join("\u{2009}")
}

/// Formats 10 to the power `exponent`, in nanoseconds, as a label in the unit that fits.
fn format_time_tick(exponent: i32) -> String {
    let (unit, name) = match exponent {
        ..3 => (0, "ns"),
        3..6 => (3, "µs"),
        6..9 => (6, "ms"),
        _ => (9, "s"),
    };
    format!("{} {name}", 10_f64.powi(exponent - unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the labels of the axes match the scale of the lines.
    #[test]
    fn ticks_read_as_numbers_with_units() {
        assert_eq!(
            [0, 2, 3, 6].map(format_count_tick),
            ["1", "100", "1\u{2009}000", "1\u{2009}000\u{2009}000"]
        );
        assert_eq!(
            [-1, 0, 2, 3, 7, 9].map(format_time_tick),
            ["0.1 ns", "1 ns", "100 ns", "1 µs", "10 ms", "1 s"]
        );
    }
}
