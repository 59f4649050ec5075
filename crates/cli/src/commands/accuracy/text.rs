//! Report of `accuracy` for the terminal: the sections of its page, and a small plot of the Pareto
//! frontier.

use raywright_core::accuracy::MeasuredSettingWithFlags;

use super::file::AccuracyDocument;
use crate::console;
use crate::scatter::draw_scatter_plot;
use crate::table::wrap_paragraph;

/// Formats the whole report: the recommendation, the Pareto frontier, the conditions, and the
/// sections of rungs, of output formats and of effects.
pub fn format_report(document: &AccuracyDocument<'_>) -> String {
    let (page, room) = (&document.page, console::line_width());
    let recommendation = wrap_paragraph(&page.recommendation);
    let mut text = format!("{}\n{recommendation}\n", page.scene);
    if let Some(frontier) = page.frontier_section() {
        let point = |candidate: &MeasuredSettingWithFlags| {
            let measured = &candidate.measured;
            let error = measured.errors.relmse.value.sqrt();
            (measured.seconds.value, error)
        };
        let points: Vec<_> = page.report.frontier.iter().map(point).collect();
        text += &frontier.to_text(room);
        text += &draw_scatter_plot(&points, "error", "time");
    }
    text += "\n";
    for line in &page.circumstances {
        text += &(wrap_paragraph(line) + "\n");
    }
    for section in page.detail_sections() {
        text += &section.to_text(room);
    }
    text
}

#[cfg(test)]
pub mod tests;
