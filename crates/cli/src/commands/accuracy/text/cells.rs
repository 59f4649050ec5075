//! Cells of the tables of `accuracy`: figures with their intervals, and names of ladders and rungs.

use raywright_core::accuracy::ConfidenceInterval;
use raywright_io::report::format_uncertain;

use crate::numbers::{format_duration, format_significant_digits};
use crate::table::{ColumnAlignment, wrap_paragraph};

/// Alignment of a column of figures.
pub const RIGHT: ColumnAlignment = ColumnAlignment::Right;

/// Formats names as a paragraph after the label `words`; empty without names.
pub fn format_name_list<T: AsRef<str>>(words: &str, names: impl Iterator<Item = T>) -> String {
    let names: Vec<T> = names.collect();
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    if names.is_empty() {
        String::new()
    } else {
        format!(
            "\n{}\n",
            wrap_paragraph(&format!("{words}: {}", names.join(", ")))
        )
    }
}

/// Formats the names of a ladder's rungs that were not measured because the time was too short;
/// only the ladder's name if no rung was measured, `None` if all were. `rungs` has the name of each
/// rung, and whether it was not measured.
pub fn list_unmeasured_rungs<'a>(
    ladder: &str,
    rungs: impl Iterator<Item = (&'a str, bool)>,
) -> Option<String> {
    let (late, measured): (Vec<_>, Vec<_>) = rungs.partition(|(_, is_late)| *is_late);
    let names: Vec<String> = late
        .iter()
        .map(|(rung, _)| format!("{ladder}={rung}"))
        .collect();
    match (names.is_empty(), measured.is_empty()) {
        (true, _) => None,
        (false, true) => Some(ladder.to_owned()),
        (false, false) => Some(names.join(", ")),
    }
}

/// Builds a row of `N` cells with text in its first cell only.
pub fn format_title_row<const N: usize>(title: String) -> [String; N] {
    let mut row = std::array::from_fn(|_| String::new());
    row[0] = title;
    row
}

/// Formats the title of a ladder in a table: its name, and the rung in use unless the table marks
/// that rung.
pub fn format_ladder_title(ladder: &str, in_use: &str, is_marked: bool) -> String {
    if is_marked {
        ladder.to_owned()
    } else {
        format!("{ladder} (in use: {in_use})")
    }
}

/// Formats the name of a rung (quality level) in a table, with the mark `*` of the rung in use.
pub fn format_rung_name(rung: &str, in_use: bool) -> String {
    format!("  {rung}{}", if in_use { " *" } else { "" })
}

/// Formats the value of a figure and its confidence interval.
pub fn format_interval(interval: &ConfidenceInterval) -> String {
    format_uncertain(interval, |value| format_significant_digits(value, 2))
}

/// Formats a time in seconds: below a second with three digits in milliseconds, otherwise like
/// [`format_duration`].
pub fn format_precise_duration(seconds: f64) -> String {
    if seconds < 0.9995 {
        format!("{} ms", format_significant_digits(seconds * 1e3, 3))
    } else {
        format_duration(seconds)
    }
}

/// Formats the square root of a mean square error, and of the ends of its confidence interval.
pub fn format_root_mean_square(interval: &ConfidenceInterval) -> String {
    format_interval(&interval.map(f64::sqrt))
}
