//! Sections of reports: a title, an explanation, a table and notes, formatted as text, Markdown or
//! HTML.

use super::plot::escape_xml;
use super::table::{Table, html_with_code, wrap_text};

/// A section of a report.
#[derive(Clone, Debug)]
pub struct ReportSection {
    /// Title above the section.
    pub title: String,
    /// Explanation above the table; empty: none. Text between back quotes is code.
    pub explanation: String,
    /// Table of the section.
    pub table: Table,
    /// Sentences below the table, each in a paragraph of its own.
    pub notes: Vec<String>,
}

impl ReportSection {
    /// Formats the section as plain text, at most `room` characters wide.
    pub fn to_text(&self, room: Option<usize>) -> String {
        let paragraph = |text: &String| wrap_text(text, 0, room.unwrap_or(usize::MAX)) + "\n";
        let explanation: String = self.explanation().map(paragraph).collect();
        let notes: String = self.notes.iter().map(paragraph).collect();
        let table = self.table.with_text_marks().to_text(room);
        format!("\n{}\n{explanation}{table}{notes}", self.title)
    }

    /// Formats the section as Markdown.
    pub fn to_markdown(&self) -> String {
        let explanation: String = self
            .explanation()
            .map(|text| format!("{text}\n\n"))
            .collect();
        let notes: String = self
            .notes
            .iter()
            .map(|note| format!("- {note}\n"))
            .collect();
        let gap = if notes.is_empty() { "" } else { "\n" };
        let table = self.table.to_markdown();
        format!("\n### {}\n\n{explanation}{table}{gap}{notes}", self.title)
    }

    /// Formats the section as HTML.
    pub fn to_html(&self) -> String {
        let explanation: String = self
            .explanation()
            .map(|text| format!("<p class=\"soft\">{}</p>\n", html_with_code(text)))
            .collect();
        let notes: String = self
            .notes
            .iter()
            .map(|note| format!("<p>{}</p>\n", html_with_code(note)))
            .collect();
        let (title, table) = (escape_xml(&self.title), self.table.to_html());
        format!("<h2>{title}</h2>\n{explanation}{table}{notes}")
    }

    fn explanation(&self) -> impl Iterator<Item = &String> {
        Some(&self.explanation)
            .filter(|text| !text.is_empty())
            .into_iter()
    }
}
