//! Plain tables for standard output, within the terminal's width.

pub use raywright_io::report::{ColumnAlignment, Table, TableRow, wrap_text};

use crate::console;

/// Formats rows as left-aligned columns, within the terminal's width. Every row has a cell for each
/// column.
pub fn format_columns<const N: usize>(rows: &[[String; N]]) -> String {
    let rows = rows.iter().map(|row| row.iter().cloned().collect());
    Table {
        columns: vec![ColumnAlignment::Left; N],
        rows: rows.collect(),
    }
    .to_text(console::line_width())
}

/// Formats named texts as two columns. Rows without text are left out.
pub fn format_rows<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> String {
    let rows = rows.into_iter().filter(|(_, text)| !text.is_empty());
    let rows: Vec<_> = rows.map(|(name, text)| [name.to_owned(), text]).collect();
    format_columns(&rows)
}

/// Wraps a paragraph at the terminal's width.
pub fn wrap_paragraph(text: &str) -> String {
    wrap_text(text, 0, console::line_width().unwrap_or(usize::MAX))
}
