//! Tables of `bench`, as plain text and as Markdown.

use raywright_core::bench::{
    Crossover, FIT_FROM, GeneratedPrimitive, GeneratedSceneTimings, PowerLaw, QueryCost,
    ScanTreeTiming, SceneComparison,
};
use raywright_io::report::{
    Plot, PlotAxis, PlotLine, PlotPoint, ReportSection, ThemeColour, format_median, format_power,
    format_seconds, format_three_digits,
};

use super::{BenchMeasurements, BenchReport};
use crate::console;
use crate::table::{ColumnAlignment, Table, TableRow, wrap_paragraph};

/// Formats the report for a terminal, or as Markdown.
pub fn format_report(report: &BenchReport, is_markdown: bool) -> String {
    let room = console::line_width();
    let line = |line: String| match is_markdown {
        true => line + "\n",
        false => wrap_paragraph(&line) + "\n",
    };
    let section = |section: &ReportSection| match is_markdown {
        true => section.to_markdown(),
        false => section.to_text(room),
    };
    let preamble = report.format_preamble().into_iter().map(line);
    let sections = build_sections(report);
    preamble.chain(sections.iter().map(section)).collect()
}

fn build_sections(report: &BenchReport) -> Vec<ReportSection> {
    match &report.measured {
        BenchMeasurements::Generated(series) => series
            .iter()
            .flat_map(|series| series_sections(series, report))
            .collect(),
        BenchMeasurements::Given { rows, .. } => scene_sections(rows, report),
    }
}

/// Builds the sections of a kind of generated primitives: times, and build times with memory.
fn series_sections(series: &GeneratedSceneTimings, report: &BenchReport) -> Vec<ReportSection> {
    let rows = series.rows.iter();
    let rows: Vec<_> = rows
        .map(|row| (vec![row.primitives.to_string()], row))
        .collect();
    let growth = |label, law: Option<PowerLaw>| law.map(|law| describe_growth(label, &law));
    let mut notes = vec![describe_crossover(series.crossover)];
    notes.extend(growth("tree", series.tree_growth));
    notes.extend(growth("scan", series.scan_growth));
    let all: Vec<_> = series.rows.iter().collect();
    let name = series.kind.name();
    let title = name[..1].to_uppercase() + &name[1..];
    build_pair(title, (&["N"], rows), &all, notes, report)
}

/// Builds the sections of a given scene, with a row for each kind of rays.
fn scene_sections(comparison: &SceneComparison, report: &BenchReport) -> Vec<ReportSection> {
    let camera = &comparison.camera;
    let bounce = comparison.bounce.iter().map(|row| ("bounce", row));
    let named = [("camera", camera)].into_iter().chain(bounce);
    let rows: Vec<_> = named
        .map(|(name, row)| (vec![name.to_owned(), row.tree.rays.to_string()], row))
        .collect();
    let note = "No camera ray hits an object, so that no bounce was measured.".to_owned();
    let notes = comparison.bounce.map_or(vec![note], |_| Vec::new());
    let title = format!("Scan against tree, {} primitives", camera.primitives);
    build_pair(title, (&["rays", "number"], rows), &[camera], notes, report)
}

/// Builds the section of the times of rows, and that of the builds and the memory of `built`.
fn build_pair(
    title: String,
    (first, rows): (&[&str], Vec<(Vec<String>, &ScanTreeTiming)>),
    built: &[&ScanTreeTiming],
    mut notes: Vec<String>,
    report: &BenchReport,
) -> Vec<ReportSection> {
    if rows.iter().any(|(_, row)| row.scan.is_none()) {
        notes.push(format!(
            "Scans not run: a single timing sample would take much longer than {} ms.",
            format_three_digits(report.sample_seconds * 1e3)
        ));
    }
    let costs = built.iter().map(|row| {
        let cells = |cost: Option<QueryCost>| {
            cost.map_or_else(
                || ["not run".to_owned(), "-".to_owned()],
                |cost| {
                    let bytes = cost.bytes as f64 / row.primitives as f64;
                    let build = format_median(&cost.build_milliseconds);
                    [build, format_three_digits(bytes)]
                },
            )
        };
        let cells = [cells(row.scan), cells(Some(row.tree))].concat();
        let size = row.primitives.to_string();
        [size].into_iter().chain(cells).collect()
    });
    let names = [
        "N",
        "scan: build, ms",
        "bytes/N",
        "tree: build, ms",
        "bytes/N",
    ];
    let section = |title, table, notes| ReportSection {
        explanation: String::new(),
        title,
        table,
        notes,
    };
    vec![
        section(title.clone(), time_table(first, rows), notes),
        section(
            format!("{title}: build and memory"),
            Table::new([ColumnAlignment::Right; 5], names, costs),
            Vec::new(),
        ),
    ]
}

/// Returns the table of times and tests. Each row has its own cells, below the headings `first`.
fn time_table(first: &[&str], rows: Vec<(Vec<String>, &ScanTreeTiming)>) -> Table {
    let names = [
        "rays that hit",
        "scan, ns/ray",
        "tree, ns/ray",
        "scan : tree",
        "nodes/ray",
        "tests/ray",
    ];
    let cells = |(own, row): (Vec<String>, &ScanTreeTiming)| -> TableRow {
        let scan = row.scan.map(|cost| format_median(&cost.nanoseconds));
        let ratio = row.ratio.as_ref().map(format_median);
        let cells = [
            format!("{:.1} %", row.hit_share * 100.0),
            scan.unwrap_or_else(|| "not run".to_owned()),
            format_median(&row.tree.nanoseconds),
            ratio.unwrap_or_else(|| "-".to_owned()),
            format!("{:.1}", row.tree.nodes_per_ray),
            format!("{:.1}", row.tree.tests_per_ray),
        ];
        own.into_iter().chain(cells).collect()
    };
    let names = first.iter().chain(&names).map(|&name| name.to_owned());
    let mut columns = vec![ColumnAlignment::Right; first.len() + 6];
    if first.len() > 1 {
        columns[0] = ColumnAlignment::Left;
    }
    Table {
        columns,
        rows: [names.collect()]
            .into_iter()
            .chain(rows.into_iter().map(cells))
            .collect(),
    }
}

fn describe_crossover(crossover: Option<Crossover>) -> String {
    match crossover {
        Some(Crossover::Always) => {
            "The tree is faster than the scan at every measured N.".to_owned()
        }
        Some(Crossover::At(n)) => format!(
            "The tree is faster than the scan from N = {} on (interpolated); below, the scan is as fast or faster.",
            format_three_digits(n)
        ),
        Some(Crossover::Never) => {
            "The tree is not faster than the scan at the largest measured N.".to_owned()
        }
        None => "The scan, which tests every primitive, was not timed: from which N on the tree is faster is not known.".to_owned(),
    }
}

fn describe_growth(label: &str, law: &PowerLaw) -> String {
    format!(
        "The {label}'s time grows as N to the power {:.3} ± {:.3} (standard error), from N = {FIT_FROM} on.",
        law.exponent, law.standard_error
    )
}

// Plot of `bench`: time per ray against the number N of primitives, for linear scan and tree. A
// mark shows the least N at which the tree is faster.

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

#[cfg(test)]
mod tests;
