//! Tables of `bench`, as plain text and as Markdown.

use raywright_core::bench::{
    Crossover, GeneratedSceneTimings, PowerLaw, QueryCost, ScanTreeTiming, SceneComparison,
};
use raywright_io::format_bytes;
use raywright_io::report::{ReportSection, format_median, format_three_digits};

use super::{BenchMeasurements, BenchReport};
use crate::console;
use crate::table::{ColumnAlignment, Table, wrap_paragraph};

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
            .flat_map(|s| [build_series_table(s, report), build_series_cost_table(s)])
            .collect(),
        BenchMeasurements::Given { rows, .. } => vec![
            build_scene_table(rows, report),
            build_scene_cost_table(rows),
        ],
    }
}

/// Headings of the columns with times of scan and tree, and with their ratio.
const TIME_HEADINGS: [&str; 3] = ["scan, ns/ray", "tree, ns/ray", "scan : tree"];

fn build_series_table(series: &GeneratedSceneTimings, report: &BenchReport) -> ReportSection {
    let [scan, tree, ratio] = TIME_HEADINGS;
    let names = [
        "N",
        "rays that hit",
        scan,
        tree,
        ratio,
        "nodes/ray",
        "tests/ray",
    ];
    let cells = |row: &ScanTreeTiming| {
        let [scan, tree, ratio] = format_time_cells(row);
        let [hits, nodes, tests] = format_traversal_cells(row);
        [
            row.primitives.to_string(),
            hits,
            scan,
            tree,
            ratio,
            nodes,
            tests,
        ]
        .into_iter()
        .collect()
    };
    let mut notes = Vec::new();
    notes.push(describe_crossover(series.crossover));
    notes.extend(series.tree_growth.map(|law| describe_growth("tree", &law)));
    notes.extend(series.scan_growth.map(|law| describe_growth("scan", &law)));
    notes.extend(describe_skipped_scans(series.rows.iter(), report));
    ReportSection {
        explanation: String::new(),
        title: capitalise(series.kind.name()),
        table: Table::new(
            [ColumnAlignment::Right; 7],
            names,
            series.rows.iter().map(cells),
        ),
        notes,
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

/// Builds the table of build times and memory of a series.
fn build_series_cost_table(series: &GeneratedSceneTimings) -> ReportSection {
    let names = [
        "N",
        "scan: build, ms",
        "bytes/N",
        "tree: build, ms",
        "bytes/N",
    ];
    let cells = |row: &ScanTreeTiming| {
        let per_primitive = |cost: Option<QueryCost>| {
            format_build_cost_cells(cost, |bytes| {
                format_three_digits(bytes as f64 / row.primitives as f64)
            })
        };
        let ([a, b], [c, d]) = (per_primitive(row.scan), per_primitive(Some(row.tree)));
        [row.primitives.to_string(), a, b, c, d]
            .into_iter()
            .collect()
    };
    ReportSection {
        explanation: String::new(),
        title: format!("{}: build and memory", capitalise(series.kind.name())),
        table: Table::new(
            [ColumnAlignment::Right; 5],
            names,
            series.rows.iter().map(cells),
        ),
        notes: vec![],
    }
}

fn build_scene_table(comparison: &SceneComparison, report: &BenchReport) -> ReportSection {
    let [scan, tree, ratio] = TIME_HEADINGS;
    let names = [
        "rays",
        "number",
        "that hit",
        scan,
        tree,
        ratio,
        "nodes/ray",
        "tests/ray",
    ];
    let cells = |name: &str, row: &ScanTreeTiming| {
        let [scan, tree, ratio] = format_time_cells(row);
        let [hits, nodes, tests] = format_traversal_cells(row);
        [
            name.to_owned(),
            row.tree.rays.to_string(),
            hits,
            scan,
            tree,
            ratio,
            nodes,
            tests,
        ]
        .into_iter()
        .collect()
    };
    let mut notes = vec![];
    if comparison.bounce.is_none() {
        notes.push("No camera ray hits an object, so that no bounce was measured.".to_owned());
    }
    notes.extend(describe_skipped_scans(
        [Some(&comparison.camera), comparison.bounce.as_ref()]
            .into_iter()
            .flatten(),
        report,
    ));
    let mut columns = [ColumnAlignment::Right; 8];
    columns[0] = ColumnAlignment::Left;
    let rows = [cells("camera", &comparison.camera)]
        .into_iter()
        .chain(comparison.bounce.iter().map(|row| cells("bounce", row)));
    ReportSection {
        explanation: String::new(),
        title: "Scan against tree".to_owned(),
        table: Table::new(columns, names, rows),
        notes,
    }
}

fn build_scene_cost_table(comparison: &SceneComparison) -> ReportSection {
    let row = &comparison.camera;
    let cells = |(name, cost): (&str, Option<QueryCost>)| {
        let [build, bytes] = format_build_cost_cells(cost, |bytes| format_bytes(bytes as u64));
        [name.to_owned(), build, bytes].into_iter().collect()
    };
    let structures = [("scan", row.scan), ("tree", Some(row.tree))];
    let names = ["structure", "build from objects, ms", "memory"];
    ReportSection {
        explanation: String::new(),
        title: format!("Build and memory, {} primitives", row.primitives),
        table: Table::new(
            [
                ColumnAlignment::Left,
                ColumnAlignment::Right,
                ColumnAlignment::Right,
            ],
            names,
            structures.into_iter().map(cells),
        ),
        notes: vec![],
    }
}

/// Formats the cells below the headings [`TIME_HEADINGS`].
fn format_time_cells(row: &ScanTreeTiming) -> [String; 3] {
    let scan = row.scan.map(|cost| format_median(&cost.nanoseconds));
    let ratio = row.ratio.as_ref().map(format_median);
    [
        scan.unwrap_or_else(|| "not run".to_owned()),
        format_median(&row.tree.nanoseconds),
        ratio.unwrap_or_else(|| "-".to_owned()),
    ]
}

/// Formats the cells for the share of rays that hit, and for the nodes and primitive tests of the
/// tree per ray.
fn format_traversal_cells(row: &ScanTreeTiming) -> [String; 3] {
    [
        format!("{:.1} %", row.hit_share * 100.0),
        format!("{:.1}", row.tree.nodes_per_ray),
        format!("{:.1}", row.tree.tests_per_ray),
    ]
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
        "The {label}'s time grows as N to the power {:.3} ± {:.3} (standard error; R² {:.4}; {} points from {} to {}).",
        law.exponent, law.standard_error, law.r_squared, law.points, law.from, law.to
    )
}

fn describe_skipped_scans<'a>(
    mut rows: impl Iterator<Item = &'a ScanTreeTiming>,
    report: &BenchReport,
) -> Option<String> {
    rows.any(|row| row.scan.is_none()).then(|| {
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
