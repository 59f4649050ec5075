//! Plain tables for standard output: columns padded to their widest cell, two spaces apart.

/// Where the text of a column stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// Lays rows out in columns; every row has one cell a column. No spaces are left at the end of a line.
pub fn lay_out<const N: usize>(columns: [Align; N], rows: &[[String; N]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for ((cell, &width), align) in row.iter().zip(&widths).zip(columns) {
            let padding = " ".repeat(width - cell.chars().count());
            let (before, after) = if align == Align::Left { ("", &*padding) } else { (&*padding, "") };
            line += &format!("{before}{cell}{after}  ");
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Widths count characters, not bytes, and lines have no trailing blanks.
    #[test]
    fn columns_line_up() {
        let rows = [["é".to_owned(), "1".to_owned(), "x".to_owned()], ["abc".to_owned(), "100".to_owned(), String::new()]];
        assert_eq!(lay_out([Align::Left, Align::Right, Align::Left], &rows), "é      1  x\nabc  100\n");
    }
}
