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
    let report = page.report;
    let others = report.frontier.iter().filter(|row| **row != 0);
    let rows = others.map(|&row| (&report.settings[row], 'o'));
    // The setting in use is drawn last, above others.
    let rows = rows.chain([(report.own(), 'x')]);
    let known = rows.filter(|(of, _)| of.errors.root_relmse.value.is_finite());
    let points = known.map(|(of, mark)| (of.seconds.value, of.errors.root_relmse.value, mark));
    let points: Vec<_> = points.collect();
    text += &sections[0].to_text(room);
    text += &draw_scatter_plot(&points, "error", "time (x: in use)");
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
