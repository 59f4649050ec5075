//! Report of `stability`: tables as plain text and as Markdown, a plot of margins, and an HTML page
//! with plot and table.

use core::cmp::Ordering;

use raywright_io::report::{
    ErrorMarginPlot, ErrorMarginRow, ThemeColour, format_percent, format_significant_digits,
    html_document,
};

use crate::commands::stability::{FormulaCost, HardCaseResult, StabilityReport};
use crate::console;
use crate::origin::command_line;
use crate::table::{ColumnAlignment, Table, TableRow};

/// Formats the additional time of the library's formula with its spread, in nanoseconds.
fn format_extra_time(price: &FormulaCost) -> String {
    format!("{:+.1} ± {:.1}", price.more, price.spread)
}

/// Formats the report as plain text: a line for each case with its name, the worst first, and the
/// notes.
pub(super) fn format_plain(report: &StabilityReport) -> String {
    let mut cases: Vec<_> = group_by_case(report).collect();
    let least_margin = |rows: &&[HardCaseResult]| {
        let margins = rows.iter().filter_map(|row| row.margin);
        let is_held = rows.iter().all(|row| row.wrong == 0);
        let is_unknown = rows.iter().any(HardCaseResult::is_unknown);
        (!is_unknown, is_held, margins.fold(f64::INFINITY, f64::min))
    };
    cases.sort_by(|a, b| {
        least_margin(a)
            .partial_cmp(&least_margin(b))
            .unwrap_or(Ordering::Equal)
    });
    let table = build_table(cases, "name", |row| row.name.to_owned());
    table.to_text(console::line_width()) + &format_notes(report)
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

/// Builds a table with a line for each case, described by `words` below the heading `words_heading`.
fn build_table<'a>(
    cases: impl IntoIterator<Item = &'a [HardCaseResult]>,
    words_heading: &str,
    words: fn(&HardCaseResult) -> String,
) -> Table {
    use ColumnAlignment::{Left, Right};
    let row = |rows: &[HardCaseResult]| -> TableRow {
        let first = &rows[0];
        let cells = [
            first.case.to_owned(),
            words(first),
            format_case_results(rows, "robust"),
            format_case_results(rows, "reference"),
            first.textbook_wrong.map(format_percent).unwrap_or_default(),
            format_costs(rows),
        ];
        cells.into_iter().collect()
    };
    let heads = [
        "case",
        words_heading,
        "robust",
        "reference",
        "textbook",
        "ns",
    ];
    let columns = [Left, Left, Right, Right, Right, Right];
    Table::new(columns, heads, cases.into_iter().map(row))
}

/// Builds the table for Markdown and HTML.
pub(super) fn build_page_table(report: &StabilityReport) -> Table {
    build_table(
        group_by_case(report),
        "what is hard, and the bound",
        |row| format!("{} Bound: {}", row.hard, row.bound),
    )
}

/// Explanation of the columns of the table, printed below it.
pub(super) const COLUMN_LEGEND: &str = "For each precision: number of wrong results and of judged results, for all kernels of the processor together, and the margin, bound divided by worst \
     error, unless results are only right or wrong. Textbook: share of results that its formulas get wrong. ns: CPU time of one thread for an ordinary \
     ray or sample by the textbook's formula in f32, and the additional time in `robust` and in `reference`.";

/// Formats the report as Markdown: the table, the explanation of its columns, and the notes.
pub(super) fn format_markdown(report: &StabilityReport) -> String {
    let mut table = build_page_table(report);
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

const TITLE: &str = "Margins of the hard cases: error bound over worst error";

/// Names of the precisions, and their colours in the plot.
const PRECISIONS: [(&str, ThemeColour); 2] = [
    ("robust", ThemeColour::First),
    ("reference", ThemeColour::Second),
];

/// Builds the plot of margins, with a line for each case.
pub(super) fn build_margin_plot(report: &StabilityReport) -> ErrorMarginPlot {
    let machine = report
        .processor
        .as_ref()
        .map(|name| format!(" · {name}"))
        .unwrap_or_default();
    ErrorMarginPlot {
        title: TITLE.to_owned(),
        circumstances: format!(
            "margin: error bound divided by worst error; a bound is kept where the margin is above 1{machine}"
        ),
        right_heading: "textbook wrong".to_owned(),
        legend: PRECISIONS
            .map(|(name, colour)| (colour, name.to_owned()))
            .to_vec(),
        rows: group_by_case(report).map(build_margin_row).collect(),
    }
}

/// Builds the line of a case in the plot. The margin in a precision is the least of all kernels and
/// parts; it is absent if a result exceeds the bound.
fn build_margin_row(rows: &[HardCaseResult]) -> ErrorMarginRow {
    let least = |precision: &str| {
        let is_held = filter_by_precision(rows, precision).all(|row| row.wrong == 0);
        filter_by_precision(rows, precision)
            .filter_map(|row| row.margin)
            .reduce(f64::min)
            .filter(|_| is_held)
    };
    let margins: Vec<(ThemeColour, f64)> = PRECISIONS
        .into_iter()
        .filter_map(|(name, colour)| Some((colour, least(name)?)))
        .collect();
    let (wrong, judged) = rows.iter().fold((0, 0), |(wrong, judged), row| {
        (wrong + row.wrong, judged + row.judged)
    });
    let message = match wrong {
        0 if margins.is_empty() => format!("none of {judged} wrong"),
        0 => String::new(),
        _ => format!("{wrong} of {judged} beyond the bound"),
    };
    ErrorMarginRow {
        name: rows[0].case.to_owned(),
        description: rows[0].hard.trim_end_matches('.').to_owned(),
        margins,
        message,
        is_broken: wrong > 0,
        right_text: rows[0]
            .textbook_wrong
            .map(format_percent)
            .unwrap_or_default(),
    }
}

/// Builds the HTML page with plot and table.
pub(super) fn build_page(report: &StabilityReport) -> String {
    let plot = ErrorMarginPlot {
        title: String::new(),
        ..build_margin_plot(report)
    }
    .to_svg();
    let machine = report
        .processor
        .as_ref()
        .map(|name| format!("<p class=\"soft\">{}</p>\n", escape_html(name)))
        .unwrap_or_default();
    let rest: String = format_notes(report)
        .lines()
        .filter(|line| !line.is_empty())
        .map(|line| format!("<p>{}</p>\n", escape_html(line)))
        .collect();
    let body = format!(
        "<p class=\"answer\">Margin: error bound divided by worst error. A bound is kept where the margin is above 1.</p>\n\
         <figure><div class=\"wide\" tabindex=\"0\">{plot}</div></figure>\n<h2>In figures</h2>\n{}<p class=\"soft\">{}</p>\n<h2>Not measured</h2>\n{rest}\
         <h2>How it was measured</h2>\n{machine}<p class=\"soft\">Made by <code>{}</code></p>\n",
        build_page_table(report).to_html(),
        escape_html(COLUMN_LEGEND),
        escape_html(&command_line()),
    );
    html_document(TITLE, &body, "")
}

/// Escapes text for HTML, and removes backticks.
fn escape_html(text: &str) -> String {
    raywright_io::report::escape_xml(text).replace('`', "")
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
            name: "planes",
            hard: "Planes.",
            bound: "4u/|n·d|",
            setting: setting.to_owned(),
            judged: 1000,
            wrong: 0,
            known_wrong: 0,
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
                "of 1000",
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

    /// Protects: the plain table has a line a case with its name; the worst is first, and a known
    /// broken bound comes before those that are held.
    #[test]
    fn the_worst_case_is_first() {
        let report = report();
        let with = |case, margin, wrong, known_wrong| HardCaseResult {
            case,
            name: case,
            margin,
            wrong,
            known_wrong,
            ..report.rows[0].clone()
        };
        let rows = vec![
            with("exact", None, 0, 0),
            with("wide", Some(9.0), 0, 0),
            with("known", Some(5.0), 9, 9),
            with("narrow", Some(1.5), 0, 0),
            with("broken", Some(7.0), 1, 0),
        ];
        let text = format_plain(&StabilityReport { rows, ..report });
        let names = ["broken", "known", "narrow", "wide", "exact"];
        let places = names.map(|name| text.find(name).expect("a line"));
        assert!(places.is_sorted(), "{text}");
    }

    /// Protects: the place of a case in the plain table follows its least margin of all settings.
    #[test]
    fn the_worst_setting_places_its_case() {
        let report = report();
        let with = |case, margin| HardCaseResult {
            case,
            margin: Some(margin),
            ..report.rows[0].clone()
        };
        let rows = vec![with("even", 2.0), with("worse", 1.5), with("worse", 9.0)];
        let text = format_plain(&StabilityReport { rows, ..report });
        assert!(text.find("worse") < text.find("even"), "{text}");
    }
}

#[cfg(test)]
mod page_tests {
    use super::*;
    use crate::commands::stability::text::tests::report;

    /// Protects: a case has a single line with its least margin in each precision, and shows
    /// results beyond the bound; the page has plot, table and notes.
    #[test]
    fn margins_are_the_least() {
        let mut report = report();
        let plot = build_margin_plot(&report);
        assert_eq!(
            plot.rows[0].margins,
            [(ThemeColour::First, 2.5), (ThemeColour::Second, 50.0)]
        );
        assert!(
            !plot.rows[0].is_broken
                && plot.rows[0].message.is_empty()
                && plot.rows[0].right_text == "25 %"
        );
        report.rows[1].wrong = 3;
        let broken = build_margin_row(&report.rows);
        assert!(
            broken.is_broken && broken.message == "3 of 3000 beyond the bound",
            "{}",
            broken.message
        );
        assert_eq!(broken.margins, [(ThemeColour::Second, 50.0)]);
        let page = build_page(&report);
        assert!(
            page.contains("<svg")
                && page.contains("4u/|n·d|")
                && page.contains("S21: No fog.")
                && page.contains("not held"),
            "{page}"
        );
    }
}
