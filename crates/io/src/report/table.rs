//! Tables, formatted as text, Markdown or HTML.

use raywright_core::accuracy::ConfidenceInterval;

use super::plot::escape_xml;
use crate::masking::mask_to_one_line;

/// Alignment of the cells in a column of a [`Table`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnAlignment {
    /// For text.
    Left,
    /// For numbers.
    Right,
}

/// A row of a [`Table`]. In a row with fewer cells than columns, the last cell spans the remaining
/// columns.
#[derive(Clone, Debug, Default)]
pub struct TableRow {
    /// Cells; text between back quotes is code.
    pub cells: Vec<String>,
    /// Class of the row in an HTML page; empty for no class.
    pub class: &'static str,
    /// Tooltip of the row's first cell in an HTML page.
    pub tooltip: String,
}

impl TableRow {
    /// Creates a row with a class for HTML pages.
    pub fn with_class(class: &'static str, cells: impl IntoIterator<Item = String>) -> Self {
        Self {
            class,
            ..Self::from_iter(cells)
        }
    }
}

impl FromIterator<String> for TableRow {
    fn from_iter<I: IntoIterator<Item = String>>(cells: I) -> Self {
        Self {
            cells: cells.into_iter().collect(),
            ..Self::default()
        }
    }
}

/// A table of a report: rows of cells, and the alignment of each column. It can be written as text,
/// Markdown or HTML.
#[derive(Clone, Debug)]
pub struct Table {
    /// Alignment of the cells in each column.
    pub columns: Vec<ColumnAlignment>,
    /// Rows of the table. The first row consists of the headings; it is empty in a table without
    /// headings.
    pub rows: Vec<TableRow>,
}

impl Table {
    /// Creates a table from headings and rows.
    pub fn new<const N: usize>(
        columns: [ColumnAlignment; N],
        names: [&str; N],
        rows: impl IntoIterator<Item = TableRow>,
    ) -> Self {
        let names = names.map(str::to_owned).into_iter().collect();
        Self {
            columns: columns.to_vec(),
            rows: [names].into_iter().chain(rows).collect(),
        }
    }

    /// Removes the columns whose cells are all empty, headings not counted. The first column stays.
    #[must_use]
    pub fn without_empty_columns(mut self) -> Self {
        let is_full = |column: usize| {
            let mut cells = self.rows.iter().skip(1).map(|row| row.cells.get(column));
            column == 0 || cells.any(|cell| cell.is_some_and(|cell| !cell.is_empty()))
        };
        let kept: Vec<usize> = (0..self.columns.len()).filter(|&of| is_full(of)).collect();
        self.columns = kept.iter().map(|&of| self.columns[of]).collect();
        for row in &mut self.rows {
            let cells = kept.iter().filter_map(|&of| row.cells.get(of).cloned());
            row.cells = cells.collect();
        }
        self
    }

    /// Marks the rows below a heading (class `ladder`) by an indentation, and code by nothing.
    pub(super) fn with_text_marks(&self) -> Self {
        let (mut marked, mut indent) = (self.clone(), "");
        for row in &mut marked.rows {
            let before = if row.class == "ladder" { "" } else { indent };
            if row.class == "ladder" {
                indent = "  ";
            }
            if let Some(first) = row.cells.first_mut() {
                *first = format!("{before}{first}");
            }
            row.cells
                .iter_mut()
                .for_each(|cell| *cell = cell.replace('`', ""));
        }
        marked
    }

    /// Formats the table as plain text, at most `room` characters wide. Columns are as wide as
    /// their widest cell and two spaces apart; lines have no trailing spaces. Line breaks in a cell
    /// are replaced, because a cell with several lines would look like several rows.
    ///
    /// If the table is too wide, the text of its last column is wrapped. If that is not enough, the
    /// columns that do not fit follow in a second table, which repeats the first column. A first
    /// column that leaves no room for another one is wrapped too.
    pub fn to_text(&self, room: Option<usize>) -> String {
        let one_line = |row: &TableRow| -> Vec<String> {
            row.cells
                .iter()
                .map(|cell| mask_to_one_line(cell))
                .collect()
        };
        let rows: Vec<Vec<String>> = self.rows.iter().map(one_line).collect();
        let (columns, room) = (&self.columns, room.unwrap_or(usize::MAX));
        let width = |column: usize| {
            // A cell that spans columns widens none of them.
            let is_alone =
                |row: &&Vec<String>| column + 1 < row.len() || row.len() == columns.len();
            let cells = rows
                .iter()
                .filter(is_alone)
                .filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let mut widths: Vec<usize> = (0..columns.len()).map(width).collect();
        let before: usize = widths
            .iter()
            .rev()
            .skip(1)
            .map(|width| width + GAP.len())
            .sum();
        let mut bands = vec![Vec::from_iter(0..columns.len())];
        let is_text = columns.last() == Some(&ColumnAlignment::Left);
        if (!is_text || before + LEAST_TEXT > room) && columns.len() > 1 {
            let widest = widths[1..]
                .iter()
                .max()
                .map_or(0, |width| GAP.len() + width);
            widths[0] = widths[0].min(room.saturating_sub(widest).max(LEAST_TEXT));
            bands.clear();
            let mut used = 0;
            for column in 1..columns.len() {
                let width = GAP.len() + widths[column];
                if bands.is_empty() || used + width > room {
                    bands.push(vec![0]);
                    used = widths[0];
                }
                bands
                    .last_mut()
                    .into_iter()
                    .for_each(|band| band.push(column));
                used += width;
            }
        }
        let band = |band: &Vec<usize>| -> String {
            let lines = rows
                .iter()
                .map(|row| format_line(row, &widths, columns, band, room));
            lines.collect()
        };
        bands.iter().map(band).collect::<Vec<_>>().join("\n")
    }

    /// Formats as Markdown. A vertical bar does not end its cell.
    pub fn to_markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<_> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let side = |column: &ColumnAlignment| {
            if *column == ColumnAlignment::Left {
                ":--".to_owned()
            } else {
                "--:".to_owned()
            }
        };
        let rule = line(&self.columns.iter().map(side).collect::<Vec<_>>());
        let mut lines: Vec<String> = self.rows.iter().map(|row| line(&row.cells)).collect();
        lines.insert(lines.len().min(1), rule);
        lines.concat()
    }

    /// Formats as an HTML table.
    pub fn to_html(&self) -> String {
        let Some((names, rows)) = self.rows.split_first() else {
            return String::new();
        };
        let name = |(i, name): (usize, &String)| {
            let is_text = self.columns.get(i) == Some(&ColumnAlignment::Left);
            format!(
                "<th{}>{}</th>",
                html_attribute("class", if is_text { "text" } else { "" }),
                escape_xml(name)
            )
        };
        let names: String = names.cells.iter().enumerate().map(name).collect();
        let rows: String = rows.iter().map(|row| self.row_html(row)).collect();
        format!(
            "<div class=\"wide\" tabindex=\"0\"><table><thead><tr>{names}</tr></thead><tbody>\n{rows}</tbody></table></div>\n"
        )
    }

    fn row_html(&self, row: &TableRow) -> String {
        let (count, columns) = (row.cells.len(), self.columns.len());
        let cell = |(i, cell): (usize, &String)| {
            let has_about = i == 0 && !row.tooltip.is_empty();
            let about = if has_about {
                html_attribute("title", &row.tooltip) + " tabindex=\"0\""
            } else {
                String::new()
            };
            let is_wide = i + 1 == count && count < columns;
            let span = is_wide.then(|| (columns - i).to_string());
            let span = html_attribute("colspan", &span.unwrap_or_default());
            let is_text = i > 0 && (is_wide || self.columns[i] == ColumnAlignment::Left);
            let class = html_attribute("class", if is_text { "text" } else { "" });
            let cell = match is_text || i == 0 {
                true => html_with_code(cell),
                false => keep_units(&escape_xml(cell)),
            };
            format!("<td{about}{span}{class}>{cell}</td>")
        };
        let class = html_attribute("class", row.class);
        let cells: String = row.cells.iter().enumerate().map(cell).collect();
        format!("<tr{class}>{cells}</tr>\n")
    }
}

/// Joins numbers and their units by no-break spaces: a line may end before an interval, and within
/// one.
fn keep_units(cell: &str) -> String {
    let joined = cell.replace(' ', "\u{a0}");
    ["±", "("]
        .iter()
        .fold(joined, |text, start| {
            text.replace(&format!("\u{a0}{start}"), &format!(" {start}"))
        })
        .replace("to\u{a0}", "to ")
}

/// Escapes a text for HTML. Text between back quotes becomes code.
pub(super) fn html_with_code(text: &str) -> String {
    let parts = text.split('`').map(escape_xml).enumerate();
    parts
        .map(|(i, part)| match i % 2 {
            1 => format!("<code>{part}</code>"),
            _ => part,
        })
        .collect()
}

/// Formats an attribute of an HTML element; empty for an empty value.
fn html_attribute(name: &str, value: &str) -> String {
    if value.is_empty() {
        return String::new();
    }
    format!(" {name}=\"{}\"", escape_xml(value))
}

/// Space between two columns of plain text.
const GAP: &str = "  ";
/// Least width of wrapped text, in characters.
const LEAST_TEXT: usize = 20;

/// Formats a row as a line of plain text; `shown` are the indices of its columns. The text of the
/// last cell may continue in further lines below its start.
fn format_line(
    row: &[String],
    widths: &[usize],
    columns: &[ColumnAlignment],
    shown: &[usize],
    room: usize,
) -> String {
    let mut text = String::new();
    for (i, &column) in shown.iter().enumerate() {
        let (cell, width) = (row.get(column).map_or("", String::as_str), widths[column]);
        let (is_last, is_left) = (
            i + 1 == shown.len(),
            columns[column] == ColumnAlignment::Left,
        );
        // A name may have ended in a further line.
        let line = text.rsplit('\n').next().unwrap_or_default();
        let start = line.chars().count();
        if is_last && is_left && start + longest_word(cell) > room {
            // If the last cell has no room beside the other cells, its text goes into the lines
            // below them.
            return format!("{}\n  {}\n", text.trim_end(), wrap_text(cell, 2, room));
        }
        let is_spanning = column + 1 == row.len() && row.len() < columns.len();
        text += &match is_left {
            _ if is_spanning || is_last && is_left => wrap_text(cell, start, room),
            false => format!("{cell:>width$}"),
            true => {
                let words = cell.trim_start();
                let indent = cell.chars().count() - words.chars().count();
                let name = " ".repeat(indent) + &wrap_text(words, indent, width);
                let (above, last) = name.rsplit_once('\n').unwrap_or(("", &name));
                let line_end = if above.is_empty() { "" } else { "\n" };
                format!("{above}{line_end}{last:width$}")
            }
        };
        if !is_last {
            text += GAP;
        }
    }
    text.trim_end().to_owned() + "\n"
}

fn longest_word(text: &str) -> usize {
    text.split(' ')
        .map(|word| word.chars().count())
        .max()
        .unwrap_or(0)
}

/// Wraps a text between words to lines of at most `room` characters. All lines but the first are
/// indented by `indent` characters.
pub fn wrap_text(text: &str, indent: usize, room: usize) -> String {
    let room = room.saturating_sub(indent).max(LEAST_TEXT);
    if text.chars().count() <= room {
        return text.to_owned();
    }
    let line_end = format!("\n{}", " ".repeat(indent));
    // The first word begins the first line.
    let (mut lines, mut used) = (String::new(), room);
    for word in text.split(' ') {
        let length = word.chars().count();
        let is_first = lines.is_empty();
        let fits = used + 1 + length <= room;
        lines += match fits {
            _ if is_first => "",
            true => " ",
            false => &line_end,
        };
        lines += word;
        used = if fits { used + 1 + length } else { length };
    }
    lines
}

/// Formats a value with its confidence interval. `number` formats each number. There are five
/// forms:
///
/// - an interval whose ends differ by more than a factor of three: `not known`
/// - a value that is indistinguishable from zero: `<` and the upper end
/// - an interval whose ends have the same text as the value: the value alone
/// - an uncertainty below 30 %: the value and the percentage, as in `1.2 ±5 %`
/// - any other interval: the value and both ends, as in `1.2 (0.6 to 2.4)`
pub fn format_uncertain(interval: &ConfidenceInterval, number: impl Fn(f64) -> String) -> String {
    if !interval.is_known() {
        return "not known".to_owned();
    }
    let value = number(interval.value);
    if interval.includes_zero() && interval.high > 0.0 {
        return format!("<{}", number(interval.high));
    }
    if number(interval.low) == value && number(interval.high) == value {
        return value;
    }
    match interval.relative_half_width() {
        share if share < MAX_SHARE => {
            format!(
                "{value} ±{} %",
                if share < 0.01 {
                    "1".to_owned()
                } else {
                    format!("{:.0}", 100.0 * share)
                }
            )
        }
        _ => format!(
            "{value} ({} to {})",
            number(interval.low),
            number(interval.high)
        ),
    }
}

/// Relative uncertainty from which on the ends of the interval are written, not a percentage.
const MAX_SHARE: f64 = 0.3;

#[cfg(test)]
mod tests;
