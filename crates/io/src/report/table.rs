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
        let cell = |row: &TableRow, column: usize| {
            row.cells.get(column).is_some_and(|cell| !cell.is_empty())
        };
        let is_kept =
            |column: usize| column == 0 || self.rows.iter().skip(1).any(|row| cell(row, column));
        let kept: Vec<bool> = (0..self.columns.len()).map(is_kept).collect();
        let mut of_columns = kept.iter();
        self.columns.retain(|_| of_columns.next() == Some(&true));
        for row in &mut self.rows {
            let mut of_cells = kept.iter();
            row.cells.retain(|_| of_cells.next() == Some(&true));
        }
        self
    }

    /// Marks the rows by their classes as text: rows in use (`own`) by an asterisk, and rows below a
    /// heading (`ladder`) by an indentation.
    pub(super) fn with_text_marks(&self) -> Self {
        let (mut marked, mut indent) = (self.clone(), "");
        for row in &mut marked.rows {
            let mark = if row.class == "own" { " *" } else { "" };
            let before = if row.class == "ladder" { "" } else { indent };
            if row.class == "ladder" {
                indent = "  ";
            }
            if let Some(first) = row.cells.first_mut() {
                *first = format!("{before}{first}{mark}");
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
        let columns = &self.columns;
        // A cell that spans columns widens none of them.
        let is_spanning =
            |row: &[String], column| column + 1 == row.len() && row.len() < columns.len();
        let width = |column: usize| {
            rows.iter()
                .filter(|row| !is_spanning(row, column))
                .filter_map(|row| Some(row.get(column)?.chars().count()))
                .max()
                .unwrap_or(0)
        };
        let mut widths: Vec<usize> = (0..columns.len()).map(width).collect();
        let room = room.unwrap_or(usize::MAX);
        let all = Vec::from_iter(0..columns.len());
        let before = widths.split_last().map_or(0, |(_, others)| {
            others.iter().map(|width| width + GAP.len()).sum::<usize>()
        });
        if columns.last() == Some(&ColumnAlignment::Left) && before + LEAST_TEXT <= room {
            return rows
                .iter()
                .map(|row| format_line(row, &widths, columns, &all, room))
                .collect();
        }
        let widest = widths
            .iter()
            .skip(1)
            .max()
            .map_or(0, |width| GAP.len() + width);
        if let Some(first) = widths.first_mut() {
            *first = (*first).min(room.saturating_sub(widest).max(LEAST_TEXT));
        }
        let first = widths.first().copied().unwrap_or(0);
        let (mut bands, mut used) = (vec![Vec::from_iter(all.first().copied())], first);
        for column in all.into_iter().skip(1) {
            let width = GAP.len() + widths[column];
            let mut band = bands.pop().unwrap_or_default();
            if used + width > room && band.len() > 1 {
                bands.push(core::mem::replace(&mut band, vec![0]));
                used = first;
            }
            band.push(column);
            bands.push(band);
            used += width;
        }
        let band = |band: &Vec<usize>| {
            rows.iter()
                .map(|row| format_line(row, &widths, columns, band, room))
                .collect::<String>()
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
            let typed = cell
                .strip_prefix('`')
                .and_then(|cell| cell.strip_suffix('`'));
            let cell = match typed {
                Some(typed) => format!("<code>{}</code>", escape_xml(typed)),
                None if is_text || i == 0 => escape_xml(cell),
                None => keep_units(&escape_xml(cell)),
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
        let is_last = i + 1 == shown.len();
        if is_last
            && columns[column] == ColumnAlignment::Left
            && text.chars().count() + longest_word(cell) > room
        {
            // If the last cell has no room beside the other cells, its text goes into the lines
            // below them.
            return format!("{}\n  {}\n", text.trim_end(), wrap_text(cell, 2, room));
        }
        let is_spanning = column + 1 == row.len() && row.len() < columns.len();
        text += &match columns[column] {
            _ if is_spanning => wrap_text(cell, text.chars().count(), room),
            ColumnAlignment::Left if is_last => wrap_text(cell, text.chars().count(), room),
            ColumnAlignment::Left => {
                let words = cell.trim_start();
                let indent = cell.chars().count() - words.chars().count();
                let name = " ".repeat(indent) + &wrap_text(words, indent, width);
                let (above, last) = name.rsplit_once('\n').unwrap_or(("", &name));
                let line_end = if above.is_empty() { "" } else { "\n" };
                format!("{above}{line_end}{last:width$}")
            }
            ColumnAlignment::Right => format!("{cell:>width$}"),
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
