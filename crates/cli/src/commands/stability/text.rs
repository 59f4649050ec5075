//! Tables of `stability`, as plain text and as Markdown.

use super::{FormulaCost, HardCaseResult, StabilityReport};
use crate::table::{
    ColumnAlignment, Table, TableRow, format_aligned_columns, format_significant_digits,
};

/// Formats a row of the plain table, without the case's description and bound.
fn format_result_cells(row: &HardCaseResult) -> [String; 7] {
    let number =
        |value: Option<f64>, of: &dyn Fn(f64) -> String| value.map_or_else(|| "-".to_owned(), of);
    [
        row.case.to_owned(),
        row.setting.clone(),
        row.judged.to_string(),
        row.wrong.to_string(),
        number(row.margin, &|margin| format_significant_digits(margin, 3)),
        number(row.textbook_wrong, &format_percent),
        row.price.as_ref().map_or_else(
            || "-".to_owned(),
            |price| format!("{} ns", format_extra_time(price)),
        ),
    ]
}

pub(super) fn format_percent(share: f64) -> String {
    format!("{} %", format_significant_digits(100.0 * share, 3))
}

/// Formats the additional time of the library's formula with its spread, in nanoseconds.
fn format_extra_time(price: &FormulaCost) -> String {
    format!("{:+.1} ± {:.1}", price.more, price.spread)
}

const HEADINGS: [&str; 7] = [
    "case",
    "setting",
    "judged",
    "wrong",
    "margin",
    "textbook wrong",
    "costs more",
];

/// Formats the report as plain text: a line for each case in each setting, and the notes.
pub(super) fn format_plain(report: &StabilityReport) -> String {
    let rows: Vec<[String; 7]> = core::iter::once(HEADINGS.map(str::to_owned))
        .chain(report.rows.iter().map(format_result_cells))
        .collect();
    let columns = [
        ColumnAlignment::Left,
        ColumnAlignment::Left,
        ColumnAlignment::Right,
        ColumnAlignment::Right,
        ColumnAlignment::Right,
        ColumnAlignment::Right,
        ColumnAlignment::Right,
    ];
    format!(
        "{}{}",
        format_aligned_columns(columns, &rows),
        format_notes(report)
    )
}

/// Formats the notes below the table: cases that only tests verify, and parts that are not
/// measured.
pub(super) fn format_notes(report: &StabilityReport) -> String {
    let mut text = String::new();
    if !report.tested_only.is_empty() {
        text += &format!(
            "\nCases whose bounds only the test suite verifies: {}.\n",
            report.tested_only.join(", ")
        );
    }
    for [number, reason] in &report.left_out {
        text += &format!("\n{number}: {reason}\n");
    }
    text
}

/// Splits the rows of a report into groups of the same case, in their order.
pub(super) fn group_by_case(report: &StabilityReport) -> impl Iterator<Item = &[HardCaseResult]> {
    report.rows.chunk_by(|a, b| a.case == b.case)
}

/// Selects the rows of a case that were measured in a precision.
pub(super) fn filter_by_precision<'a>(
    rows: &'a [HardCaseResult],
    precision: &'a str,
) -> impl Iterator<Item = &'a HardCaseResult> + Clone {
    rows.iter()
        .filter(move |row| row.setting.starts_with(precision))
}

/// Formats the results of a case in a precision: the number of wrong results, and the least margin.
fn format_case_results(rows: &[HardCaseResult], precision: &str) -> String {
    let of = filter_by_precision(rows, precision);
    let wrong: u64 = of.clone().map(|row| row.wrong).sum();
    let judged: u64 = of.clone().map(|row| row.judged).sum();
    let margin = of.filter_map(|row| row.margin).reduce(f64::min);
    format!(
        "{wrong} of {judged}{}",
        margin
            .map(|margin| format!(", {}", format_significant_digits(margin, 3)))
            .unwrap_or_default()
    )
}

/// Formats the cost of a case in nanoseconds: the textbook's time in single precision, and the
/// additional time of the library's formula in both precisions.
fn format_costs(rows: &[HardCaseResult]) -> String {
    let price = |precision| filter_by_precision(rows, precision).find_map(|row| row.price);
    let (Some(robust), Some(reference)) = (price("robust"), price("reference")) else {
        return String::new();
    };
    format!(
        "{:.1}, {}, {}",
        robust.textbook,
        format_extra_time(&robust),
        format_extra_time(&reference)
    )
}

/// Builds the table for Markdown and HTML, with a line for each case.
pub(super) fn build_table(report: &StabilityReport) -> Table {
    let columns = [
        ColumnAlignment::Left,
        ColumnAlignment::Left,
        ColumnAlignment::Right,
        ColumnAlignment::Right,
        ColumnAlignment::Right,
        ColumnAlignment::Right,
    ];
    let heads = [
        "case",
        "what is hard, and the bound",
        "robust",
        "reference",
        "textbook",
        "ns",
    ];
    let rows = group_by_case(report).map(|rows| -> TableRow {
        let first = &rows[0];
        let textbook = first.textbook_wrong.map(format_percent).unwrap_or_default();
        let [robust, reference] =
            ["robust", "reference"].map(|precision| format_case_results(rows, precision));
        let words = format!("{} Bound: {}", first.hard, first.bound);
        [
            first.case.to_owned(),
            words,
            robust,
            reference,
            textbook,
            format_costs(rows),
        ]
        .into_iter()
        .collect()
    });
    Table::new(columns, heads, rows)
}

/// Explanation of the columns of the table, printed below it.
pub(super) const COLUMN_LEGEND: &str = "For each precision: number of wrong results and of judged results, for all kernels of the processor together, and the margin, bound divided by worst \
     error, unless results are only right or wrong. Textbook: share of results that its formulas get wrong. ns: CPU time of one thread for an ordinary \
     ray or sample by the textbook's formula in f32, and the additional time in `robust` and in `reference`.";

/// Formats the report as Markdown: the table, the explanation of its columns, and the notes.
pub(super) fn format_markdown(report: &StabilityReport) -> String {
    let mut table = build_table(report);
    table
        .rows
        .iter_mut()
        .flat_map(|row| &mut row.cells)
        .for_each(|cell| *cell = cell.replace('|', "\\|"));
    format!(
        "{}\n{COLUMN_LEGEND}\n{}",
        table.to_markdown(),
        format_notes(report)
    )
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Creates a report of a single case in both precisions, for tests.
    pub(crate) fn report() -> StabilityReport {
        let price = FormulaCost {
            what: "a test",
            textbook: 4.0,
            more: 1.25,
            spread: 0.5,
        };
        let row = |setting: &str, margin| HardCaseResult {
            case: "P07",
            hard: "Planes.",
            bound: "4u/|n·d|",
            setting: setting.to_owned(),
            judged: 1000,
            wrong: 0,
            margin: Some(margin),
            textbook_wrong: Some(0.25),
            price: Some(price),
            first_wrong: None,
        };
        StabilityReport {
            version: "1",
            processor: None,
            rows: vec![
                row("robust, avx2", 2.5),
                row("robust, portable", 3.0),
                row("reference", 50.0),
            ],
            tested_only: vec!["S07"],
            left_out: vec![["S21", "No fog."]],
            seconds: 1.0,
        }
    }

    /// Protects: tables have the measured values, their costs, the cases verified by tests alone
    /// and the parts left out; a vertical bar in a bound does not end its cell.
    #[test]
    fn tables_say_everything() {
        let report = report();
        for text in [format_plain(&report), format_markdown(&report)] {
            let words = [
                "P07",
                "robust",
                "1000",
                "2.5",
                "25 %",
                "+1.2 ± 0.5",
                "S07",
                "S21: No fog.",
            ];
            assert!(words.iter().all(|word| text.contains(word)), "{text}");
        }
        let page = format_markdown(&report);
        assert!(
            page.contains("4u/\\|n·d\\|") && page.contains("| 0 of 2000, 2.5 | 0 of 1000, 50 |"),
            "{page}"
        );
    }
}
