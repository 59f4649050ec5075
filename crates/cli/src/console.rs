//! Text output of the program: results on standard output, everything else on standard error. No
//! output contains control characters of terminals.

use std::borrow::Cow;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::{env, fmt};

use clap::ValueEnum;
use raywright_core::bvh::stdout_was_closed;
pub use raywright_io::masking::mask_to_one_line;
use raywright_io::masking::{escape_controls_in_json, mask_control_characters};
use serde::Serialize;

use crate::failure::Failure;

/// Value of `--color`: when messages are coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ColorChoice {
    /// On a terminal, unless an environment variable decides otherwise
    #[default]
    Auto,
    /// Everywhere
    Always,
    /// Nowhere
    Never,
}

/// Whether messages on standard error are coloured.
static COLOURED: AtomicBool = AtomicBool::new(false);

/// Decides whether later messages are coloured. The flag takes precedence, then NO_COLOR
/// (<https://no-color.org>), then CLICOLOR_FORCE and CLICOLOR (<https://bixense.com/clicolors>),
/// then whether standard error is a terminal.
pub fn set_colour_choice(choice: ColorChoice) {
    let variable = |name| env::var(name).ok().filter(|value| !value.is_empty());
    let coloured = match choice {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto if variable("NO_COLOR").is_some() => false,
        ColorChoice::Auto if variable("CLICOLOR_FORCE").is_some_and(|value| value != "0") => true,
        ColorChoice::Auto => {
            variable("CLICOLOR").is_none_or(|value| value != "0") && io::stderr().is_terminal()
        }
    };
    COLOURED.store(coloured, Ordering::Relaxed);
}

/// Labels at the start of messages, each with the ANSI code of its colour: red, yellow, cyan or
/// green.
const LABELS: [(&str, u8); 5] = [
    ("error:", 31),
    ("warning:", 33),
    ("note:", 36),
    ("help:", 32),
    ("tip:", 32),
];

/// Returns the text with the label at the start of each line bold and coloured.
fn colour_labels(text: &str) -> String {
    let line = |line: &str| {
        let indent = line.len() - line.trim_start().len();
        let label = LABELS
            .iter()
            .find(|(label, _)| line[indent..].starts_with(label));
        match label {
            Some((label, code)) => {
                format!(
                    "{}\u{1b}[1;{code}m{label}\u{1b}[0m{}",
                    &line[..indent],
                    &line[indent + label.len()..]
                )
            }
            None => line.to_owned(),
        }
    };
    text.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

/// Returns the line width of standard output in characters, from COLUMNS or the terminal. `None`
/// without either: another program then reads the output, and no line is wrapped.
pub fn line_width() -> Option<usize> {
    let from_environment = env::var("COLUMNS")
        .ok()
        .and_then(|columns| columns.parse().ok());
    let own =
        || terminal_size::terminal_size_of(io::stdout()).map(|(width, _)| usize::from(width.0));
    from_environment
        .or_else(own)
        .map(|width| width.max(LEAST_WIDTH))
}

/// Least line width in characters, for narrower terminals too.
const LEAST_WIDTH: usize = 40;

/// Writes a result to standard output, with control characters masked. A reader that closes the
/// pipe early (`raywright schema | head`) is no failure.
pub fn print(text: impl AsRef<str>) -> Result<(), Failure> {
    match write_stdout(mask_control_characters(text.as_ref()).as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::from_stdout_error(&error))
        }
        _ => Ok(()),
    }
}

/// Writes the bytes of a picture file to standard output, unchanged. A reader that closes the pipe
/// before the last byte is a failure, because the picture is lost.
pub fn write_picture_to_stdout(bytes: &[u8]) -> Result<(), Failure> {
    write_stdout(bytes).map_err(|error| Failure::from_stdout_error(&error))
}

fn write_stdout(bytes: &[u8]) -> io::Result<()> {
    if stdout_was_closed() {
        return Err(io::Error::other(
            "standard output is closed; redirect it to a file or a program",
        ));
    }
    let mut out = io::stdout().lock();
    out.write_all(bytes).and_then(|()| out.flush())
}

/// Formats a value as indented JSON with a final line break. Control characters in texts become
/// JSON escapes, so that a reader gets the texts unchanged and [`print`] finds nothing to mask.
pub fn format_json(value: &impl Serialize) -> String {
    // Serialization fails only for maps whose keys are no text, and no structure in this program
    // has such a map.
    let text = serde_json::to_string_pretty(value).unwrap_or_default() + "\n";
    escape_controls_in_json(&text).into_owned()
}

/// Writes a report to standard output as JSON, or as the text that `text` returns.
pub fn print_report<T: Serialize>(
    as_json: bool,
    report: &T,
    text: impl FnOnce() -> String,
) -> Result<(), Failure> {
    print(if as_json { format_json(report) } else { text() })
}

/// Writes a message to standard error, with control characters masked. A failed write is ignored.
pub fn print_message(message: impl fmt::Display) {
    let message = message.to_string();
    let shown = mask_control_characters(&message);
    let shown = if COLOURED.load(Ordering::Relaxed) {
        Cow::Owned(colour_labels(&shown))
    } else {
        shown
    };
    let _ = writeln!(io::stderr().lock(), "{shown}");
}

/// Amount of messages on standard error in addition to errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// No message but errors.
    Quiet,
    /// Also warnings, and the names of written files.
    #[default]
    Normal,
    /// Also notes, effects, accelerator, times and ray counts.
    Verbose,
}

impl Verbosity {
    /// Prints a warning, which may have several lines.
    pub fn print_warning(self, message: impl fmt::Display) {
        if self > Self::Quiet {
            print_message(format_args!("warning: {message}"));
        }
    }

    /// Prints a note about a choice that the program made automatically.
    pub fn print_note(self, message: impl fmt::Display) {
        if self > Self::Quiet {
            print_message(format_args!("note: {message}"));
        }
    }

    /// Prints a message about the result of the run, such as the names of written files.
    pub fn print_result_message(self, message: impl fmt::Display) {
        if self > Self::Quiet {
            print_message(message);
        }
    }

    /// Prints a message, in verbose runs only.
    pub fn print_detail(self, message: impl fmt::Display) {
        if self == Self::Verbose {
            print_message(message);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: only labels at the beginning of a line are coloured.
    #[test]
    fn labels_stand_out() {
        let shown = colour_labels("error: no\n  tip: yes\nan error: in a line");
        assert_eq!(
            shown,
            "\u{1b}[1;31merror:\u{1b}[0m no\n  \u{1b}[1;32mtip:\u{1b}[0m yes\nan error: in a line"
        );
    }
}
