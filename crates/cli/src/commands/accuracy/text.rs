//! Report of `accuracy` for the terminal: the sections of its page, and a small plot of the Pareto
//! frontier.

use super::file::AccuracyDocument;
use crate::console;
use crate::scatter::draw_scatter_plot;
use crate::table::wrap_paragraph;

/// Formats the whole report: the recommendation, the Pareto frontier with its plot, the conditions,
/// and the sections of rungs.
pub fn format_report(document: &AccuracyDocument<'_>) -> String {
    let (page, room) = (&document.page, console::line_width());
    let mut text = format!("{}\n{}\n", page.scene, wrap_paragraph(&page.recommendation));
    let sections = page.sections();
    let point = |&row: &usize| {
        let measured = &page.report.settings[row];
        let error = measured.errors.root_relmse.value;
        (measured.seconds.value, error)
    };
    let points: Vec<_> = page.report.frontier.iter().map(point).collect();
    text += &sections[0].to_text(room);
    text += &draw_scatter_plot(&points, "error", "time");
    text += "\n";
    for line in &page.circumstances {
        text += &(wrap_paragraph(line) + "\n");
    }
    for section in &sections[1..] {
        text += &section.to_text(room);
    }
    text
}

#[cfg(test)]
pub mod tests;
