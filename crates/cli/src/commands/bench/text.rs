//! Tables of `bench`, as plain text and as Markdown.

use raywright_core::bench::{
    Crossover, FIT_FROM, GeneratedSceneTimings, PowerLaw, QueryCost, ScanTreeTiming, SceneComparison,
};
use raywright_io::format_bytes;
use raywright_io::report::{ReportSection, format_median, format_three_digits};

use super::{BenchMeasurements, BenchReport};
use crate::console;
use crate::table::{ColumnAlignment, Table, TableRow, wrap_paragraph};

/// Formats the report for a terminal.
pub fn format_plain(report: &BenchReport) -> String {
    let room = console::line_width();
    let preamble = report.format_preamble().into_iter();
    preamble
        .map(|line| wrap_paragraph(&line) + "\n")
        .chain(
            build_sections(report)
                .iter()
                .map(|section| section.to_text(room)),
        )
        .collect()
}

/// Formats the report as Markdown.
pub fn format_markdown(report: &BenchReport) -> String {
    let preamble = report.format_preamble().into_iter();
    preamble
        .map(|line| line + "\n")
        .chain(
            build_sections(report)
                .iter()
                .map(ReportSection::to_markdown),
        )
        .collect()
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

/// Returns the sections of times, and of build times and memory, of a series of generated scenes.
fn series_sections(series: &GeneratedSceneTimings, report: &BenchReport) -> [ReportSection; 2] {
    let title = capitalise(series.kind.name());
    let rows: Vec<&ScanTreeTiming> = series.rows.iter().collect();
    let size = |row: &ScanTreeTiming| row.primitives.to_string();
    let times = rows.iter().map(|row| (vec![size(row)], *row)).collect();
    let growth = |label, law: Option<PowerLaw>| law.map(|law| describe_growth(label, &law));
    let mut notes = vec![describe_crossover(series.crossover)];
    notes.extend(growth("tree", series.tree_growth));
    notes.extend(growth("scan", series.scan_growth));
    notes.extend(describe_skipped_scans(&rows, report));
    let costs = rows.iter().map(|row| {
        let cells = |cost| {
            format_build_cost_cells(cost, |bytes| {
                format_three_digits(bytes as f64 / row.primitives as f64)
            })
        };
        let cells = [cells(row.scan), cells(Some(row.tree))].concat();
        [size(row)].into_iter().chain(cells).collect()
    });
    let names = [
        "N",
        "scan: build, ms",
        "bytes/N",
        "tree: build, ms",
        "bytes/N",
    ];
    [
        section(title.clone(), time_table(&["N"], times), notes),
        section(
            format!("{title}: build and memory"),
            Table::new([ColumnAlignment::Right; 5], names, costs),
            Vec::new(),
        ),
    ]
}

/// Returns the sections of times, and of build times and memory, of a given scene.
fn scene_sections(comparison: &SceneComparison, report: &BenchReport) -> Vec<ReportSection> {
    let camera = &comparison.camera;
    let named = [("camera", camera)].into_iter();
    let named: Vec<_> = named
        .chain(comparison.bounce.iter().map(|row| ("bounce", row)))
        .collect();
    let rows: Vec<&ScanTreeTiming> = named.iter().map(|(_, row)| *row).collect();
    let times = named.iter().map(|(name, row)| {
        let cells = vec![(*name).to_owned(), row.tree.rays.to_string()];
        (cells, *row)
    });
    let mut table = time_table(&["rays", "number"], times.collect());
    table.columns[0] = ColumnAlignment::Left;
    let mut notes = Vec::new();
    if comparison.bounce.is_none() {
        notes.push("No camera ray hits an object, so that no bounce was measured.".to_owned());
    }
    notes.extend(describe_skipped_scans(&rows, report));
    let structures = [("scan", camera.scan), ("tree", Some(camera.tree))];
    let costs = structures.into_iter().map(|(name, cost)| {
        let cells = format_build_cost_cells(cost, |bytes| format_bytes(bytes as u64));
        [name.to_owned()].into_iter().chain(cells).collect()
    });
    let mut columns = [ColumnAlignment::Right; 3];
    columns[0] = ColumnAlignment::Left;
    let names = ["structure", "build from objects, ms", "memory"];
    vec![
        section("Scan against tree".to_owned(), table, notes),
        section(
            format!("Build and memory, {} primitives", camera.primitives),
            Table::new(columns, names, costs),
            Vec::new(),
        ),
    ]
}

fn section(title: String, table: Table, notes: Vec<String>) -> ReportSection {
    ReportSection {
        explanation: String::new(),
        title,
        table,
        notes,
    }
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
    Table {
        columns: vec![ColumnAlignment::Right; first.len() + 6],
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

/// Formats two cells: the build time in milliseconds with its spread, and the memory in bytes as
/// `memory` formats it.
fn format_build_cost_cells(
    cost: Option<QueryCost>,
    memory: impl Fn(usize) -> String,
) -> [String; 2] {
    cost.map_or_else(
        || ["not run".to_owned(), "-".to_owned()],
        |cost| [format_median(&cost.build_milliseconds), memory(cost.bytes)],
    )
}

fn describe_growth(label: &str, law: &PowerLaw) -> String {
    format!(
        "The {label}'s time grows as N to the power {:.3} ± {:.3} (standard error), from N = {FIT_FROM} on.",
        law.exponent, law.standard_error
    )
}

fn describe_skipped_scans(rows: &[&ScanTreeTiming], report: &BenchReport) -> Option<String> {
    rows.iter().any(|row| row.scan.is_none()).then(|| {
        format!(
            "Scans not run: a single timing sample would take much longer than {} ms.",
            format_three_digits(report.sample_seconds * 1e3)
        )
    })
}

fn capitalise(word: &str) -> String {
    let mut letters = word.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().chain(letters).collect())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests;
