//! Plain tables for standard output: columns padded to their widest cell, two spaces apart; numbers short enough for them.

use crate::console::{self, on_one_line};

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

/// Lays rows out in columns, each with its alignment, within the width of the terminal. A cell with several lines would look like several
/// rows, and is made one.
pub fn lay_out_aligned<const N: usize>(columns: [Align; N], rows: &[[String; N]]) -> String {
    lay_out_within(columns, rows, console::width())
}

/// Where a table is too wide, text in its last column is broken, or the columns that have no room follow in a table of their own, after the
/// first one once more.
fn lay_out_within<const N: usize>(columns: [Align; N], rows: &[[String; N]], room: Option<usize>) -> String {
    let rows: Vec<[String; N]> = rows.iter().map(|row| row.each_ref().map(|cell| on_one_line(cell))).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let room = room.unwrap_or(usize::MAX);
    let before = widths[..N - 1].iter().map(|width| width + GAP.len()).sum::<usize>();
    if columns[N - 1] == Align::Left && before + LEAST_TEXT <= room {
        return rows.iter().map(|row| line(row, &widths, &columns, &Vec::from_iter(0..N), room)).collect();
    }
    let mut bands: Vec<Vec<usize>> = Vec::new();
    let mut used = usize::MAX;
    for (column, width) in widths.iter().enumerate() {
        match bands.last_mut() {
            Some(band) if used + GAP.len() + width <= room => band.push(column),
            _ => {
                bands.push(if column == 0 { vec![0] } else { vec![0, column] });
                used = if column == 0 { 0 } else { widths[0] + GAP.len() };
                used += width;
                continue;
            }
        }
        used += GAP.len() + width;
    }
    let band = |band: &Vec<usize>| rows.iter().map(|row| line(row, &widths, &columns, band, room)).collect::<String>();
    bands.iter().map(band).collect::<Vec<_>>().join("\n")
}

/// Between columns.
const GAP: &str = "  ";
/// Characters of text that a line has at least, where it is broken.
const LEAST_TEXT: usize = 20;

/// Some of a row's cells in a line, of which the last one may go on in further lines below its beginning.
fn line(row: &[String], widths: &[usize], columns: &[Align], shown: &[usize], room: usize) -> String {
    let mut text = String::new();
    for (i, &column) in shown.iter().enumerate() {
        let (cell, width) = (&row[column], widths[column]);
        let is_last = i + 1 == shown.len();
        text += &match columns[column] {
            Align::Left if is_last => wrapped(cell, text.chars().count(), room),
            Align::Left => format!("{cell:width$}"),
            Align::Right => format!("{cell:>width$}"),
        };
        if !is_last {
            text += GAP;
        }
    }
    text.trim_end().to_owned() + "\n"
}

/// A text broken between words so that it fits beside so many characters, which further lines are indented by.
pub fn wrapped(text: &str, indent: usize, room: usize) -> String {
    let room = room.saturating_sub(indent).max(LEAST_TEXT);
    if text.chars().count() <= room {
        return text.to_owned();
    }
    let (mut lines, mut used): (Vec<String>, usize) = (vec![String::new()], 0);
    for word in text.split(' ') {
        let length = word.chars().count();
        match lines.last_mut() {
            Some(line) if line.is_empty() || used + 1 + length <= room => {
                let space = usize::from(!line.is_empty());
                *line += &" ".repeat(space);
                *line += word;
                used += space + length;
            }
            _ => {
                lines.push(word.to_owned());
                used = length;
            }
        }
    }
    lines.join(&format!("\n{}", " ".repeat(indent)))
}

/// A paragraph within the width of the terminal.
pub fn paragraph(text: &str) -> String {
    wrapped(text, 0, console::width().unwrap_or(usize::MAX))
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

    /// Protects: widths count characters, not bytes, and lines have no trailing blanks.
    #[test]
    fn columns_line_up() {
        let rows = [["é", "1", "x"], ["abc", "100", ""]].map(|row| row.map(str::to_owned));
        assert_eq!(lay_out(&rows), "é    1    x\nabc  100\n");
        assert_eq!(lay_out_aligned([Align::Left, Align::Right, Align::Left], &rows), "é      1  x\nabc  100\n");
    }

    /// Protects: a table that is too wide breaks the text of its last column below its beginning, or goes on below with the first column once
    /// more; nothing is lost.
    #[test]
    fn tables_fit() {
        let rows = [["a".to_owned(), "one two three four five six seven eight".to_owned()], ["b".to_owned(), "nine".to_owned()]];
        let text = lay_out_within([Align::Left; 2], &rows, Some(24));
        assert_eq!(text, "a  one two three four\n   five six seven eight\nb  nine\n");
        let rows = [["N", "first one", "second", "third"], ["10", "1", "2", "3"]].map(|row| row.map(str::to_owned));
        let text = lay_out_within([Align::Right; 4], &rows, Some(22));
        assert_eq!(text, " N  first one  second\n10          1       2\n\n N  third\n10      3\n");
        assert_eq!(lay_out_within([Align::Right; 4], &rows, None).lines().count(), 2);
    }

    /// Protects: numbers of any size keep four digits and lose empty ones.
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
