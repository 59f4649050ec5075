//! Plain tables for standard output: columns padded to their widest cell, two spaces apart; numbers short enough for them.

use crate::console::on_one_line;

/// On which side a column's cells touch its edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Text.
    Left,
    /// Numbers.
    Right,
}

/// Lays rows out in columns of text; every row has one cell a column. No spaces are left at the end of a line.
pub fn lay_out<const N: usize>(rows: &[[String; N]]) -> String {
    lay_out_aligned([Align::Left; N], rows)
}

/// Lays rows out in columns, each with its alignment. A cell with several lines would look like several rows, and is made one.
pub fn lay_out_aligned<const N: usize>(columns: [Align; N], rows: &[[String; N]]) -> String {
    let rows: Vec<[String; N]> = rows.iter().map(|row| row.each_ref().map(|cell| on_one_line(cell))).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let mut text = String::new();
    for row in &rows {
        let cell = |(i, cell): (usize, &String)| match columns[i] {
            Align::Left => format!("{cell:0$}", widths[i]),
            Align::Right => format!("{cell:>0$}", widths[i]),
        };
        let cells: Vec<String> = row.iter().enumerate().map(cell).collect();
        text += cells.join("  ").trim_end();
        text.push('\n');
    }
    text
}

/// A number with four significant digits.
pub fn short(value: f64) -> String {
    significant(value, 4)
}

/// A number with so many significant digits, zeros at its end left away.
pub fn significant(value: f64, digits: i32) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e4).contains(&magnitude) {
        let digits = (digits - 1 - magnitude.log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.0$e}", (digits - 1).max(0) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Widths count characters, not bytes, and lines have no trailing blanks.
    #[test]
    fn columns_line_up() {
        let rows = [["é", "1", "x"], ["abc", "100", ""]].map(|row| row.map(str::to_owned));
        assert_eq!(lay_out(&rows), "é    1    x\nabc  100\n");
        assert_eq!(lay_out_aligned([Align::Left, Align::Right, Align::Left], &rows), "é      1  x\nabc  100\n");
    }

    /// Numbers of any size keep four digits and lose empty ones.
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
            assert_eq!(short(value), text);
        }
        assert_eq!(short(f64::NAN), "NaN");
    }
}
