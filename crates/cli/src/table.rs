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

/// Formats a number with four significant digits.
pub fn format_four_digits(value: f64) -> String {
    format_significant_digits(value, 4)
}

/// Formats a number with `digits` significant digits, without trailing zeros.
pub fn format_significant_digits(value: f64, digits: i32) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e4).contains(&magnitude) {
        let digits = (digits - 1 - magnitude.log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        format!("{value:.0$e}", (digits - 1).max(0) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: numbers of any size have four digits and no trailing zeros.
    #[test]
    fn numbers_are_short() {
        let cases = [
            (0.0, "0"),
            (0.25, "0.25"),
            (1.0, "1"),
            (10.0, "10"),
            (2500.0, "2500"),
            (31.41592, "31.42"),
            (0.0012345, "0.001234"),
            (2.5e-7, "2.500e-7"),
            (9999.4, "9999"),
            (12345.6, "1.235e4"),
        ];
        for (value, text) in cases {
            assert_eq!(format_four_digits(value), text);
        }
        assert_eq!(format_four_digits(f64::NAN), "NaN");
    }
}
