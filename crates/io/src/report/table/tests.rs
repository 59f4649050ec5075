//! Tests of tables.

use super::*;

fn table<const N: usize>(columns: [ColumnAlignment; N], rows: &[[&str; N]]) -> Table {
    Table {
        columns: columns.to_vec(),
        rows: rows
            .iter()
            .map(|row| row.map(str::to_owned).into_iter().collect())
            .collect(),
    }
}

/// Protects: numbers have their uncertainty where it exceeds the last digit: as a share, or by
/// distant ends; a number indistinguishable from zero is given by its upper end.
#[test]
fn numbers_say_what_they_may_be_off_by() {
    let describe = |value, low, high| {
        format_uncertain(&ConfidenceInterval { value, low, high }, |number| {
            format!("{number:.2}")
        })
    };
    assert_eq!(describe(0.5, 0.4951, 0.5049), "0.50");
    assert_eq!(describe(0.5, 0.4949, 0.5049), "0.50 ±1 %");
    assert_eq!(describe(0.5, 0.4, 0.6), "0.50 ±20 %");
    assert_eq!(describe(0.5, 0.3, 0.8), "0.50 (0.30 to 0.80)");
    assert_eq!(describe(0.5, 0.0, 0.8), "<0.80");
    assert_eq!(describe(0.5, 0.3, 1.0), "not known");
    assert_eq!(describe(0.5, 0.0, f64::INFINITY), "not known");
    assert_eq!(describe(0.0, 0.0, 0.0), "0.00");
}

/// Protects: widths count characters, not bytes, and lines have no trailing blanks.
#[test]
fn columns_line_up() {
    let rows = [["é", "1", "x"], ["abc", "100", ""]];
    assert_eq!(
        table([ColumnAlignment::Left; 3], &rows).to_text(None),
        "é    1    x\nabc  100\n"
    );
    assert_eq!(
        table(
            [
                ColumnAlignment::Left,
                ColumnAlignment::Right,
                ColumnAlignment::Left
            ],
            &rows
        )
        .to_text(None),
        "é      1  x\nabc  100\n"
    );
}

/// Protects: in a table that is too wide, the last column's text is wrapped below its start, or
/// the further columns follow below with the first one repeated; a long word without room goes
/// below the others; names that leave no room for a number are wrapped; nothing is lost.
#[test]
fn tables_fit() {
    let text = table(
        [ColumnAlignment::Left; 2],
        &[
            ["a", "one two three four five six seven eight"],
            ["b", "nine"],
        ],
    )
    .to_text(Some(24));
    assert_eq!(
        text,
        "a  one two three four\n   five six seven eight\nb  nine\n"
    );
    let long = table(
        [ColumnAlignment::Left; 3],
        &[["a", "eight ch", "x"], ["b", "c", "a-word-of-twenty-three"]],
    )
    .to_text(Some(34));
    assert_eq!(long, "a  eight ch  x\nb  c\n  a-word-of-twenty-three\n");
    let numbers = table(
        [ColumnAlignment::Right; 4],
        &[["N", "first one", "second", "third"], ["10", "1", "2", "3"]],
    );
    assert_eq!(
        numbers.to_text(Some(22)),
        " N  first one  second\n10          1       2\n\n N  third\n10      3\n"
    );
    assert_eq!(numbers.to_text(None).lines().count(), 2);
    let mut names = table(
        [ColumnAlignment::Left, ColumnAlignment::Right],
        &[["rung", "CPU time"], ["  one two three four five", "1 s"]],
    );
    let heading = "a ladder (in use: its third rung)".to_owned();
    names.rows.insert(1, [heading].into_iter().collect());
    assert_eq!(
        names.to_text(Some(31)),
        "rung                   CPU time\n\
         a ladder (in use: its third\n\
         rung)\n  one two three four\n  five                      1 s\n"
    );
}

/// Protects: exactly the columns that are empty in all rows are removed.
#[test]
fn empty_columns_are_left_out() {
    let rows = [
        ["rung", "time", "bias", "light"],
        ["a", "1", "", ""],
        ["b", "", "", "2"],
    ];
    let table = table(
        [
            ColumnAlignment::Left,
            ColumnAlignment::Right,
            ColumnAlignment::Right,
            ColumnAlignment::Left,
        ],
        &rows,
    )
    .without_empty_columns();
    let rows = table.rows.iter().map(|row| row.cells.join(","));
    assert_eq!(
        rows.collect::<Vec<_>>(),
        ["rung,time,light", "a,1,", "b,,2"]
    );
    assert_eq!(
        table.columns,
        [
            ColumnAlignment::Left,
            ColumnAlignment::Right,
            ColumnAlignment::Left
        ]
    );
}

/// Protects: a table has the same rows in every format; a page has classes and tooltips of
/// rows, code in `<code>`, a last cell that spans the rest of a short row, and all names
/// escaped.
#[test]
fn every_notation_has_the_rows() {
    let mut table = table(
        [
            ColumnAlignment::Left,
            ColumnAlignment::Right,
            ColumnAlignment::Left,
        ],
        &[["rung", "x", "flags"], ["a<b", "1", "`--spp 4`"]],
    );
    assert_eq!(
        table.to_markdown(),
        "| rung | x | flags |\n| :-- | --: | :-- |\n| a<b | 1 | `--spp 4` |\n"
    );
    table.rows[1].tooltip = "\"what\"".to_owned();
    table
        .rows
        .push(TableRow::with_class("ladder", ["all".to_owned()]));
    table.rows.push(TableRow::with_class(
        "",
        ["c".to_owned(), "no time".to_owned()],
    ));
    let rows = "<tr><td title=\"&quot;what&quot;\" tabindex=\"0\">a&lt;b</td><td>1</td><td class=\"text\"><code>--spp 4</code></td></tr>\n\
        <tr class=\"ladder\"><td colspan=\"3\">all</td></tr>\n\
        <tr><td>c</td><td colspan=\"2\" class=\"text\">no time</td></tr>\n";
    let html = table.to_html();
    assert!(
        html.contains("<th class=\"text\">rung</th><th>x</th><th class=\"text\">flags</th>")
            && html.contains(rows),
        "{html}"
    );
}
