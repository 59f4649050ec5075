//! Report of `stability`: tables as plain text and as Markdown, a plot of margins, and an HTML page
//! with plot and table.

use core::cmp::Ordering;

use raywright_io::report::{
    ErrorMarginPlot, ErrorMarginRow, ReportSection, ThemeColour, escape_xml, format_percent,
    format_significant_digits, html_document,
};

use crate::commands::stability::{CaseReport, StabilityReport};
use crate::console;
use crate::origin::command_line;
use crate::table::{ColumnAlignment, Table};

const TITLE: &str = "Margins of the hard cases: error bound over worst error";

/// Explanation of the columns of the table.
const COLUMN_LEGEND: &str = "For each precision: number of wrong results and of judged results, for all kernels of the processor together, and the margin, bound divided by worst \
     error, unless results are only right or wrong. Textbook: share of results that its formulas get wrong. ns: CPU time of one thread for an ordinary \
     ray or sample by the textbook's formula in f32, and the additional time in `robust` and in `reference`.";

/// Names of the precisions, and their colours in the plot.
const PRECISIONS: [(&str, ThemeColour); 2] = [
    ("robust", ThemeColour::First),
    ("reference", ThemeColour::Second),
];

impl CaseReport {
    /// Returns the numbers of wrong and of judged results of all settings that begin with a
    /// precision, and their least margin.
    fn results(&self, precision: &str) -> (u64, u64, Option<f64>) {
        let settings = self.settings.iter();
        let of = settings.filter(|result| result.setting.starts_with(precision));
        of.fold((0, 0, None), |(wrong, judged, margin), result| {
            let margins = [margin, result.margin].into_iter().flatten();
            let margin = margins.reduce(f64::min);
            (wrong + result.wrong, judged + result.judged, margin)
        })
    }

    fn format_results(&self, precision: &str) -> String {
        let (wrong, judged, margin) = self.results(precision);
        let margin = margin.map(|margin| format!(", {}", format_significant_digits(margin, 3)));
        format!("{wrong} of {judged}{}", margin.unwrap_or_default())
    }

    /// Formats the cost in nanoseconds: the textbook's time in single precision, and the additional
    /// time of the library's formula, with its spread, in both precisions.
    fn format_costs(&self) -> String {
        let Some(price) = &self.price else {
            return String::new();
        };
        let more = [0, 1].map(|i| format!(", {:+.1} ± {:.1}", price.more[i], price.spread[i]));
        format!("{:.1}{}", price.textbook, more.concat())
    }

    fn format_textbook(&self) -> String {
        self.textbook_wrong.map(format_percent).unwrap_or_default()
    }

    /// Builds the line of the case in the plot. The margin in a precision is absent if a result
    /// exceeds the bound.
    fn margin_row(&self) -> ErrorMarginRow {
        let (wrong, judged, _) = self.results("");
        let margins = PRECISIONS.into_iter().filter_map(|(name, colour)| {
            let (wrong, _, margin) = self.results(name);
            Some((colour, margin.filter(|_| wrong == 0)?))
        });
        let margins: Vec<_> = margins.collect();
        ErrorMarginRow {
            name: self.case.to_owned(),
            description: self.hard.trim_end_matches('.').to_owned(),
            message: match wrong {
                0 if margins.is_empty() => format!("none of {judged} wrong"),
                0 => String::new(),
                _ => format!("{wrong} of {judged} beyond the bound"),
            },
            margins,
            is_broken: wrong > 0,
            right_text: self.format_textbook(),
        }
    }
}

/// Builds the section with a line for each case, described by `words` below the heading
/// `words_heading`, and notes: cases that only tests verify, and parts that are not measured.
fn build_section(
    report: &StabilityReport,
    words_heading: &str,
    words: fn(&CaseReport) -> String,
) -> ReportSection {
    use ColumnAlignment::{Left, Right};
    let row = |case: &CaseReport| {
        let results = PRECISIONS.map(|(precision, _)| case.format_results(precision));
        let cells = [[case.case.to_owned(), words(case)], results];
        let last = [case.format_textbook(), case.format_costs()];
        cells.into_iter().flatten().chain(last).collect()
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
    let left_out = report.left_out.iter();
    let mut notes: Vec<_> = left_out
        .map(|[number, reason]| format!("{number}: {reason}"))
        .collect();
    if !report.tested_only.is_empty() {
        let cases = report.tested_only.join(", ");
        notes.insert(
            0,
            format!("Cases whose bounds only the test suite verifies: {cases}."),
        );
    }
    ReportSection {
        title: "Results".to_owned(),
        explanation: COLUMN_LEGEND.to_owned(),
        table: Table::new(columns, heads, report.cases.iter().map(row)),
        notes,
    }
}

/// Builds the section for Markdown and HTML.
fn build_page_section(report: &StabilityReport) -> ReportSection {
    build_section(report, "what is hard, and the bound", |case| {
        format!("{} Bound: {}", case.hard, case.bound)
    })
}

/// Formats the report as plain text: a line for each case with its name, the worst first.
pub(super) fn format_plain(report: &StabilityReport) -> String {
    let mut report = report.clone();
    let rank = |case: &CaseReport| {
        let (wrong, _, margin) = case.results("");
        let is_known = case
            .settings
            .iter()
            .all(|result| result.wrong <= case.known_wrong);
        (is_known, wrong == 0, margin.unwrap_or(f64::INFINITY))
    };
    report
        .cases
        .sort_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(Ordering::Equal));
    build_section(&report, "name", |case| case.name.to_owned()).to_text(console::line_width())
}

/// Formats the report as Markdown.
pub(super) fn format_markdown(report: &StabilityReport) -> String {
    build_page_section(report).to_markdown()
}

/// Builds the plot of margins, with a line for each case.
pub(super) fn build_margin_plot(report: &StabilityReport) -> ErrorMarginPlot {
    let processor = report.processor.iter().map(|name| format!(" · {name}"));
    ErrorMarginPlot {
        title: TITLE.to_owned(),
        circumstances: format!(
            "Margin: error bound divided by worst error; a bound is kept where the margin is above 1{}",
            processor.collect::<String>()
        ),
        right_heading: "textbook wrong".to_owned(),
        legend: PRECISIONS
            .map(|(name, colour)| (colour, name.to_owned()))
            .to_vec(),
        rows: report.cases.iter().map(CaseReport::margin_row).collect(),
    }
}

/// Builds the HTML page with plot and table.
pub(super) fn build_page(report: &StabilityReport) -> String {
    let mut plot = build_margin_plot(report);
    let circumstances = escape_xml(&plot.circumstances);
    plot.title.clear();
    let body = format!(
        "<p class=\"answer\">{circumstances}</p>\n<figure><div class=\"wide\" tabindex=\"0\">{}</div></figure>\n{}\
         <p class=\"soft\">Made by <code>{}</code></p>\n",
        plot.to_svg(),
        build_page_section(report).to_html(),
        escape_xml(&command_line()),
    );
    html_document(TITLE, &body, "")
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::commands::stability::{FormulaCost, SettingResult};

    /// Creates a report of a single case in both precisions, for tests.
    pub(crate) fn report() -> StabilityReport {
        let result = |setting: &str, margin| SettingResult {
            setting: setting.to_owned(),
            judged: 1000,
            wrong: 0,
            margin: Some(margin),
            first_wrong: None,
        };
        let case = CaseReport {
            case: "P07",
            name: "planes",
            hard: "Planes.",
            bound: "4u/|n·d|",
            known_wrong: 0,
            textbook_wrong: Some(0.25),
            price: Some(FormulaCost {
                what: "a test",
                textbook: 4.0,
                more: [1.25, 2.0],
                spread: [0.5, 0.25],
            }),
            settings: vec![
                result("robust, avx2", 2.5),
                result("robust, portable", 3.0),
                result("reference", 50.0),
            ],
        };
        StabilityReport {
            version: "1",
            processor: None,
            cases: vec![case],
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
                "+1.2 ± 0.5, +2.0 ± 0.2",
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
        let with = |case, margin, wrong, known_wrong| {
            let mut own = report.cases[0].clone();
            (own.case, own.name, own.known_wrong) = (case, case, known_wrong);
            own.settings.truncate(1);
            (own.settings[0].margin, own.settings[0].wrong) = (margin, wrong);
            own
        };
        let cases = vec![
            with("exact", None, 0, 0),
            with("wide", Some(9.0), 0, 0),
            with("known", Some(5.0), 9, 9),
            with("narrow", Some(1.5), 0, 0),
            with("broken", Some(7.0), 1, 0),
        ];
        let text = format_plain(&StabilityReport { cases, ..report });
        let names = ["broken", "known", "narrow", "wide", "exact"];
        let places = names.map(|name| text.find(name).expect("a line"));
        assert!(places.is_sorted(), "{text}");
    }

    /// Protects: the place of a case in the plain table follows its least margin of all settings.
    #[test]
    fn the_worst_setting_places_its_case() {
        let report = report();
        let with = |name, margins: &[f64]| {
            let mut own = report.cases[0].clone();
            own.name = name;
            own.settings.truncate(margins.len());
            for (result, margin) in own.settings.iter_mut().zip(margins) {
                result.margin = Some(*margin);
            }
            own
        };
        let cases = vec![with("even", &[2.0]), with("worse", &[1.5, 9.0])];
        let text = format_plain(&StabilityReport { cases, ..report });
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
        report.cases[0].settings[1].wrong = 3;
        let broken = report.cases[0].margin_row();
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
