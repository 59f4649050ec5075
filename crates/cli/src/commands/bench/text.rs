//! The tables of `bench`, as plain text and as Markdown.

use raywright_core::bench::{Cost, Crossover, Given, PowerLaw, Row, Series, Spread};
use raywright_io::human_bytes;

use super::report::{Measured, Report};
use crate::table::{Align, lay_out_aligned};

/// A table with what is to be said below it.
struct Sheet<const N: usize> {
    heading: String,
    columns: [Align; N],
    /// The first row names the columns.
    rows: Vec<[String; N]>,
    notes: Vec<String>,
}

/// The report for a terminal.
pub fn plain(report: &Report) -> String {
    let mut text = report.preamble().join("\n") + "\n";
    match &report.measured {
        Measured::Generated(series) => series.iter().for_each(|s| text += &of_series(s, report).plain()),
        Measured::Given { rows, .. } => text += &of_given(rows, report).plain(),
    }
    text
}

/// The report for a document.
pub fn markdown(report: &Report) -> String {
    let mut text = report.preamble().join("\n") + "\n";
    match &report.measured {
        Measured::Generated(series) => series.iter().for_each(|s| text += &of_series(s, report).markdown()),
        Measured::Given { rows, .. } => text += &of_given(rows, report).markdown(),
    }
    text
}

fn of_series(series: &Series, report: &Report) -> Sheet<9> {
    let names =
        ["N", "rays that hit", "scan, ns/ray", "tree, ns/ray", "scan : tree", "nodes/ray", "tests/ray", "build, ms", "bytes/N"];
    let cells = |row: &Row| {
        let [hits, scan, tree, ratio, nodes, tests] = shared(row);
        let build = rounded(row.tree.build_milliseconds.median);
        let bytes = rounded(row.tree.bytes as f64 / row.primitives as f64);
        [row.primitives.to_string(), hits, scan, tree, ratio, nodes, tests, build, bytes]
    };
    let mut notes = vec![match series.crossover {
        Some(Crossover::Always) => "The tree is ahead at every N measured.".to_owned(),
        Some(Crossover::At(n)) => format!(
            "The tree is ahead from N = {} on (interpolated; before, the two are level or the scan is ahead).",
            rounded(n)
        ),
        Some(Crossover::Never) => "The tree is not ahead at the largest N measured.".to_owned(),
        None => "The scan was not timed, so there is no crossover.".to_owned(),
    }];
    notes.extend(series.tree_growth.map(|law| growth("tree", &law)));
    notes.extend(series.scan_growth.map(|law| growth("scan", &law)));
    notes.extend(left_out(series.rows.iter(), report));
    Sheet {
        heading: capitalised(series.kind.name()),
        columns: [Align::Right; 9],
        rows: [names.map(str::to_owned)].into_iter().chain(series.rows.iter().map(cells)).collect(),
        notes,
    }
}

fn of_given(given: &Given, report: &Report) -> Sheet<8> {
    let names = ["rays", "how many", "that hit", "scan, ns/ray", "tree, ns/ray", "scan : tree", "nodes/ray", "tests/ray"];
    let cells = |name: &str, row: &Row| {
        let [hits, scan, tree, ratio, nodes, tests] = shared(row);
        [name.to_owned(), row.tree.rays.to_string(), hits, scan, tree, ratio, nodes, tests]
    };
    let mut rows = vec![names.map(str::to_owned), cells("camera", &given.camera)];
    rows.extend(given.bounce.iter().map(|row| cells("bounce", row)));
    let tree = &given.camera.tree;
    let build = tree.build_milliseconds;
    let mut notes = vec![format!(
        "{} primitives, {}; objects to tree in {} ms{}.",
        given.camera.primitives,
        human_bytes(tree.bytes as u64),
        rounded(build.median),
        spread(&build)
    )];
    if given.bounce.is_none() {
        notes.push("The camera sees nothing, so there are no bounces.".to_owned());
    }
    notes.extend(left_out([Some(&given.camera), given.bounce.as_ref()].into_iter().flatten(), report));
    let columns = [Align::Left, Align::Right, Align::Right, Align::Right, Align::Right, Align::Right, Align::Right, Align::Right];
    Sheet { heading: "Scan against tree".to_owned(), columns, rows, notes }
}

/// Cells that every table has.
fn shared(row: &Row) -> [String; 6] {
    let time = |cost: &Cost| format!("{}{}", rounded(cost.nanoseconds.median), spread(&cost.nanoseconds));
    [
        format!("{:.1} %", row.hit_share * 100.0),
        row.scan.as_ref().map_or_else(|| "not run".to_owned(), time),
        time(&row.tree),
        row.ratio.as_ref().map_or_else(|| "-".to_owned(), |ratio| format!("{}{}", rounded(ratio.median), spread(ratio))),
        format!("{:.1}", row.tree.nodes_per_ray),
        format!("{:.1}", row.tree.tests_per_ray),
    ]
}

fn growth(what: &str, law: &PowerLaw) -> String {
    format!(
        "The {what}'s time grows as N to the {:.3} ± {:.3} (standard error; R² {:.4}; {} points from {} to {}).",
        law.exponent, law.standard_error, law.r_squared, law.points, law.from, law.to
    )
}

fn left_out<'a>(mut rows: impl Iterator<Item = &'a Row>, report: &Report) -> Option<String> {
    rows.any(|row| row.scan.is_none()).then(|| {
        format!("Not run: a sample of the scan would take much longer than {} ms.", rounded(report.sample_seconds * 1e3))
    })
}

/// Half the distance of the quartiles, in percent.
fn spread(of: &Spread) -> String {
    format!(" ±{:>4.1} %", of.relative() * 100.0)
}

/// Three significant digits.
pub fn rounded(x: f64) -> String {
    if !x.is_finite() {
        return "-".to_owned();
    }
    let whole = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    let step = 10_f64.powi(whole - 2);
    format!("{:.*}", (2 - whole).clamp(0, 6) as usize, if whole > 2 { (x / step).round() * step } else { x })
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

impl<const N: usize> Sheet<N> {
    fn plain(&self) -> String {
        format!("\n{}\n{}{}\n", self.heading, lay_out_aligned(self.columns, &self.rows), self.notes.join("\n"))
    }

    fn markdown(&self) -> String {
        let line = |cells: &[String; N]| format!("| {} |\n", cells.join(" | "));
        let rule = self.columns.map(|column| if column == Align::Left { ":--".to_owned() } else { "--:".to_owned() });
        let mut text = format!("\n### {}\n\n", self.heading);
        for (i, row) in self.rows.iter().enumerate() {
            text += &line(row);
            if i == 0 {
                text += &line(&rule);
            }
        }
        text.push('\n');
        self.notes.iter().for_each(|note| text += &format!("- {note}\n"));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: three significant digits, whatever the size, and no digits that were not measured.
    #[test]
    fn numbers_are_rounded_to_three_digits() {
        let cases =
            [(0.0, "0.00"), (0.001_234, "0.00123"), (1.2345, "1.23"), (12.345, "12.3"), (123.45, "123"), (12_345.0, "12300")];
        for (x, text) in cases {
            assert_eq!(rounded(x), text);
        }
        assert_eq!(rounded(f64::NAN), "-");
    }
}
