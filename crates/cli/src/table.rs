//! Plain tables for standard output, within the terminal's width, and numbers with few digits.

pub use raywright_io::report::{ColumnAlignment, Table, TableRow, wrap_text};

use crate::console;

/// Formats rows as left-aligned columns, within the terminal's width. Every row has a cell for each
/// column.
pub fn format_columns<const N: usize>(rows: &[[String; N]]) -> String {
    format_aligned_columns([ColumnAlignment::Left; N], rows)
}

/// Formats rows as columns with the given alignments, within the terminal's width. Every row has a
/// cell for each column.
pub fn format_aligned_columns<const N: usize>(
    columns: [ColumnAlignment; N],
    rows: &[[String; N]],
) -> String {
    Table {
        columns: columns.to_vec(),
        rows: rows
            .iter()
            .map(|row| row.iter().cloned().collect())
            .collect(),
    }
    .to_text(console::line_width())
}

/// Wraps a paragraph at the terminal's width.
pub fn wrap_paragraph(text: &str) -> String {
    wrap_text(text, 0, console::line_width().unwrap_or(usize::MAX))
}
