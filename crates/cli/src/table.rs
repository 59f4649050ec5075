//! Plain tables for standard output: columns padded to their widest cell, two spaces apart.

/// Lays rows out in columns; every row has one cell a column. No spaces are left at the end of a line.
pub fn lay_out<const N: usize>(rows: &[[String; N]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        text += cells.join("  ").trim_end();
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
        let rows = [["é", "1", "x"], ["abc", "100", ""]].map(|row| row.map(str::to_owned));
        assert_eq!(lay_out(&rows), "é    1    x\nabc  100\n");
    }
}
