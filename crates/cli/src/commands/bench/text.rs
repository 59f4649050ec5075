//! Tables of `bench`, as plain text and as Markdown.

use raywright_core::bench::{
    Crossover, PowerLaw, QueryCost, SceneComparison, Series, SeriesRow, Spread,
};
use raywright_io::human_bytes;

use super::report::{BenchFigures, BenchReport};
use crate::console;
use crate::table::{Align, Table, paragraph};

/// A table with a heading above and notes below.
struct TextSheet {
    heading: String,
    table: Table,
    notes: Vec<String>,
}

/// Formats the report for a terminal.
pub fn plain(report: &BenchReport) -> String {
    let preamble = report
        .preamble()
        .into_iter()
        .map(|line| paragraph(&line) + "\n");
    preamble
        .chain(sheets(report).iter().map(TextSheet::plain))
        .collect()
}

/// Formats the report as Markdown.
pub fn markdown(report: &BenchReport) -> String {
    let preamble = report.preamble().into_iter().map(|line| line + "\n");
    preamble
        .chain(sheets(report).iter().map(TextSheet::markdown))
        .collect()
}

fn sheets(report: &BenchReport) -> Vec<TextSheet> {
    match &report.measured {
        BenchFigures::Generated(series) => series
            .iter()
            .flat_map(|s| [of_series(s, report), upkeep_of_series(s)])
            .collect(),
        BenchFigures::Given { rows, .. } => vec![of_given(rows, report), upkeep_of_given(rows)],
    }
}

/// Headings of the columns with times of scan and tree, and with their ratio.
const TIMES: [&str; 3] = ["scan, ns/ray", "tree, ns/ray", "scan : tree"];

fn of_series(series: &Series, report: &BenchReport) -> TextSheet {
    let [scan, tree, ratio] = TIMES;
    let names = [
        "N",
        "rays that hit",
        scan,
        tree,
        ratio,
        "nodes/ray",
        "tests/ray",
    ];
    let cells = |row: &SeriesRow| {
        let [scan, tree, ratio] = times(row);
        let [hits, nodes, tests] = visits(row);
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
    notes.push(lead(series.crossover));
    notes.extend(series.tree_growth.map(|law| growth("tree", &law)));
    notes.extend(series.scan_growth.map(|law| growth("scan", &law)));
    notes.extend(left_out(series.rows.iter(), report));
    TextSheet {
        heading: capitalised(series.kind.name()),
        table: Table::new([Align::Right; 7], names, series.rows.iter().map(cells)),
        notes,
    }
}

fn lead(crossover: Option<Crossover>) -> String {
    match crossover {
        Some(Crossover::Always) => "The tree is ahead of the scan at every N measured.".to_owned(),
        Some(Crossover::At(n)) => format!(
            "The tree is ahead of the scan from N = {} on (interpolated; before, the two are level or the scan is ahead).",
            rounded(n)
        ),
        Some(Crossover::Never) => {
            "The tree is not ahead of the scan at the largest N measured.".to_owned()
        }
        None => "The scan was not timed, so there is no crossover.".to_owned(),
    }
}

/// Builds the table of build times and memory of a series.
fn upkeep_of_series(series: &Series) -> TextSheet {
    let names = [
        "N",
        "scan: build, ms",
        "bytes/N",
        "tree: build, ms",
        "bytes/N",
    ];
    let cells = |row: &SeriesRow| {
        let per_primitive = |cost: Option<QueryCost>| {
            upkeep(cost, |bytes| rounded(bytes as f64 / row.primitives as f64))
        };
        let ([a, b], [c, d]) = (per_primitive(row.scan), per_primitive(Some(row.tree)));
        [row.primitives.to_string(), a, b, c, d]
            .into_iter()
            .collect()
    };
    TextSheet {
        heading: format!("{}: build and memory", capitalised(series.kind.name())),
        table: Table::new([Align::Right; 5], names, series.rows.iter().map(cells)),
        notes: vec![],
    }
}

fn of_given(comparison: &SceneComparison, report: &BenchReport) -> TextSheet {
    let [scan, tree, ratio] = TIMES;
    let names = [
        "rays",
        "how many",
        "that hit",
        scan,
        tree,
        ratio,
        "nodes/ray",
        "tests/ray",
    ];
    let cells = |name: &str, row: &SeriesRow| {
        let [scan, tree, ratio] = times(row);
        let [hits, nodes, tests] = visits(row);
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
        notes.push("The camera sees nothing, so there are no bounces.".to_owned());
    }
    notes.extend(left_out(
        [Some(&comparison.camera), comparison.bounce.as_ref()]
            .into_iter()
            .flatten(),
        report,
    ));
    let mut columns = [Align::Right; 8];
    columns[0] = Align::Left;
    let rows = [cells("camera", &comparison.camera)]
        .into_iter()
        .chain(comparison.bounce.iter().map(|row| cells("bounce", row)));
    TextSheet {
        heading: "Scan against tree".to_owned(),
        table: Table::new(columns, names, rows),
        notes,
    }
}

fn upkeep_of_given(comparison: &SceneComparison) -> TextSheet {
    let row = &comparison.camera;
    let cells = |(name, cost): (&str, Option<QueryCost>)| {
        let [build, bytes] = upkeep(cost, |bytes| human_bytes(bytes as u64));
        [name.to_owned(), build, bytes].into_iter().collect()
    };
    let structures = [("scan", row.scan), ("tree", Some(row.tree))];
    let names = ["structure", "objects to structure, ms", "memory"];
    TextSheet {
        heading: format!("Build and memory, {} primitives", row.primitives),
        table: Table::new(
            [Align::Left, Align::Right, Align::Right],
            names,
            structures.into_iter().map(cells),
        ),
        notes: vec![],
    }
}

/// Formats the cells below the headings [`TIMES`].
fn times(row: &SeriesRow) -> [String; 3] {
    let time = |cost: Option<QueryCost>| {
        cost.map_or_else(
            || "not run".to_owned(),
            |cost| {
                format!(
                    "{}{}",
                    rounded(cost.nanoseconds.median),
                    spread(&cost.nanoseconds)
                )
            },
        )
    };
    let ratio = |ratio: Option<Spread>| {
        ratio.map_or_else(
            || "-".to_owned(),
            |ratio| format!("{}{}", rounded(ratio.median), spread(&ratio)),
        )
    };
    [time(row.scan), time(Some(row.tree)), ratio(row.ratio)]
}

/// Formats the cells for the share of rays that hit, and for the nodes and primitive tests of the
/// tree per ray.
fn visits(row: &SeriesRow) -> [String; 3] {
    [
        format!("{:.1} %", row.hit_share * 100.0),
        format!("{:.1}", row.tree.nodes_per_ray),
        format!("{:.1}", row.tree.tests_per_ray),
    ]
}

/// Formats the cells for the build time with its spread, and for the memory.
fn upkeep(cost: Option<QueryCost>, memory: impl Fn(usize) -> String) -> [String; 2] {
    cost.map_or_else(
        || ["not run".to_owned(), "-".to_owned()],
        |cost| {
            let build = cost.build_milliseconds;
            [
                format!("{}{}", rounded(build.median), spread(&build)),
                memory(cost.bytes),
            ]
        },
    )
}

fn growth(label: &str, law: &PowerLaw) -> String {
    format!(
        "The {label}'s time grows as N to the {:.3} ± {:.3} (standard error; R² {:.4}; {} points from {} to {}).",
        law.exponent, law.standard_error, law.r_squared, law.points, law.from, law.to
    )
}

fn left_out<'a>(
    mut rows: impl Iterator<Item = &'a SeriesRow>,
    report: &BenchReport,
) -> Option<String> {
    rows.any(|row| row.scan.is_none()).then(|| {
        format!(
            "Not run: a sample of it would take much longer than {} ms.",
            rounded(report.sample_seconds * 1e3)
        )
    })
}

/// Formats half the interquartile range in percent of the median.
fn spread(spread: &Spread) -> String {
    format!(" ±{:>4.1} %", spread.relative() * 100.0)
}

/// Formats a number with three significant digits; `-` for infinity and NaN.
pub fn rounded(x: f64) -> String {
    if !x.is_finite() {
        return "-".to_owned();
    }
    let whole = if x == 0.0 {
        0
    } else {
        x.abs().log10().floor() as i32
    };
    let step = 10_f64.powi(whole - 2);
    format!(
        "{:.*}",
        (2 - whole).clamp(0, 6) as usize,
        if whole > 2 {
            (x / step).round() * step
        } else {
            x
        }
    )
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().chain(letters).collect())
        .unwrap_or_default()
}

impl TextSheet {
    fn plain(&self) -> String {
        let notes: String = self
            .notes
            .iter()
            .map(|note| paragraph(note) + "\n")
            .collect();
        format!(
            "\n{}\n{}{notes}",
            self.heading,
            self.table.text(console::width())
        )
    }

    fn markdown(&self) -> String {
        let notes: String = self
            .notes
            .iter()
            .map(|note| format!("- {note}\n"))
            .collect();
        let gap = if notes.is_empty() { "" } else { "\n" };
        format!(
            "\n### {}\n\n{}{gap}{notes}",
            self.heading,
            self.table.markdown()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: numbers of any size have three significant digits, and none that was not measured.
    #[test]
    fn numbers_are_rounded_to_three_digits() {
        let cases = [
            (0.0, "0.00"),
            (0.001_234, "0.00123"),
            (1.2345, "1.23"),
            (12.345, "12.3"),
            (123.45, "123"),
            (12_345.0, "12300"),
        ];
        for (x, text) in cases {
            assert_eq!(rounded(x), text);
        }
        assert_eq!(rounded(f64::NAN), "-");
    }

    fn spread(median: f64) -> Spread {
        Spread {
            median,
            lower_quartile: 0.95 * median,
            upper_quartile: 1.05 * median,
            min: 0.5 * median,
            max: 2.0 * median,
        }
    }

    fn cost(nanoseconds: f64, build_milliseconds: f64, bytes: usize) -> QueryCost {
        let (nanoseconds, build_milliseconds) = (spread(nanoseconds), spread(build_milliseconds));
        QueryCost {
            nanoseconds,
            rays: 400,
            nodes_per_ray: 7.25,
            tests_per_ray: 2.5,
            build_milliseconds,
            bytes,
        }
    }

    /// Protects: each figure of a row is in its column: scan before tree, their ratio, shares in
    /// percent, and for a whole scene's structures time and memory.
    #[test]
    fn figures_are_in_their_columns() {
        let row = SeriesRow {
            primitives: 1000,
            hit_share: 0.625,
            scan: Some(cost(800.0, 1.0, 2000)),
            tree: cost(50.0, 5.0, 6 << 20),
            ratio: Some(spread(16.0)),
        };
        assert_eq!(times(&row), ["800 ± 5.0 %", "50.0 ± 5.0 %", "16.0 ± 5.0 %"]);
        assert_eq!(visits(&row), ["62.5 %", "7.2", "2.5"]);
        let comparison = SceneComparison {
            camera: row,
            bounce: None,
        };
        let sheet = upkeep_of_given(&comparison);
        assert_eq!(sheet.heading, "Build and memory, 1000 primitives");
        let rows: Vec<String> = sheet
            .table
            .rows
            .iter()
            .map(|row| row.cells.join(" | "))
            .collect();
        assert_eq!(
            rows[1..],
            ["scan | 1.00 ± 5.0 % | 2 KiB", "tree | 5.00 ± 5.0 % | 6 MiB"]
        );
        let untimed = SeriesRow {
            scan: None,
            ratio: None,
            ..row
        };
        assert_eq!(times(&untimed), ["not run", "50.0 ± 5.0 %", "-"]);
    }
}
