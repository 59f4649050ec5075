//! `stability` as a plot of margins, and as an HTML page with this plot and the table.

use super::text::{
    COLUMN_LEGEND, build_page_table, filter_by_precision, format_notes, group_by_case,
};
use super::{HardCaseResult, StabilityReport};
use raywright_io::report::{
    ErrorMarginPlot, ErrorMarginRow, ThemeColour, format_percent, html_document,
};

use crate::origin::command_line;

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
mod tests {
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
