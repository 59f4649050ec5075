//! What the user reads: results on standard output, everything else on standard error, and nothing
//! of it steers a terminal.

use std::borrow::Cow;
use std::env;
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use clap::ValueEnum;
pub use raywright_io::masking::on_one_line;
use raywright_io::masking::{masked, masked_json};
use serde::Serialize;

use crate::failure::Failure;

/// When messages are coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ColorChoice {
    /// Where a terminal shows them and no variable says otherwise
    #[default]
    Auto,
    /// Everywhere
    Always,
    /// Nowhere
    Never,
}

/// Whether messages are coloured.
static COLOURED: AtomicBool = AtomicBool::new(false);

/// Decides about the colours of all messages that follow. Unless a flag says so, NO_COLOR
/// (<https://no-color.org>) goes before CLICOLOR_FORCE and CLICOLOR
/// (<https://bixense.com/clicolors>), and these before what standard error is.
pub fn set_colour(choice: ColorChoice) {
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

/// Words that begin messages, and what a terminal shows them in: red, yellow, cyan, green.
const LABELS: [(&str, u8); 5] = [
    ("error:", 31),
    ("warning:", 33),
    ("note:", 36),
    ("help:", 32),
    ("tip:", 32),
];

/// The same text with its labels bold and coloured.
fn coloured(text: &str) -> String {
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

/// Characters in a line of standard output: those of the terminal, or as COLUMNS says; none where
/// lines are not broken, since programs read them.
pub fn width() -> Option<usize> {
    let told = env::var("COLUMNS")
        .ok()
        .and_then(|columns| columns.parse().ok());
    let own =
        || terminal_size::terminal_size_of(io::stdout()).map(|(width, _)| usize::from(width.0));
    told.or_else(own).map(|width| width.max(NARROWEST))
}

/// Lines are not broken into shorter ones.
const NARROWEST: usize = 40;

/// Writes a result to standard output, masked. A reader that has seen enough
/// (`raywright schema | head`) is no failure.
pub fn print(text: impl AsRef<str>) -> Result<(), Failure> {
    match write(masked(text.as_ref()).as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::stdout(&error)),
        _ => Ok(()),
    }
}

/// Writes a picture to standard output, as it is. Where nobody reads it to its end it is lost,
/// which is a failure.
pub fn print_picture(bytes: &[u8]) -> Result<(), Failure> {
    write(bytes).map_err(|error| Failure::stdout(&error))
}

fn write(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(bytes).and_then(|()| out.flush())
}

/// A value as indented JSON with a line break at its end. Characters that steer a terminal are
/// written as their codes, so that names are read back as they are and [`print`] finds nothing to
/// mask.
pub fn json(value: &impl Serialize) -> String {
    // None of our structures has keys that are not text, the one thing that this can fail on.
    let text = serde_json::to_string_pretty(value).unwrap_or_default() + "\n";
    masked_json(&text).into_owned()
}

/// Writes one message to standard error, masked. Nothing can be done, or said, where that fails.
pub fn tell(message: impl fmt::Display) {
    let message = message.to_string();
    let shown = masked(&message);
    let shown = if COLOURED.load(Ordering::Relaxed) {
        Cow::Owned(coloured(&shown))
    } else {
        shown
    };
    let _ = writeln!(io::stderr().lock(), "{shown}");
}

/// How much is said on standard error besides errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// Warnings, and what was written.
    #[default]
    Normal,
    /// Effects, accelerator, times and rays too.
    Verbose,
}

impl Verbosity {
    /// Something the user should know although the picture is made: one message, whose further
    /// lines belong to it.
    pub fn warn(self, message: impl fmt::Display) {
        if self > Self::Quiet {
            tell(format_args!("warning: {message}"));
        }
    }

    /// What was chosen or read in one way of several.
    pub fn note(self, message: impl fmt::Display) {
        if self > Self::Quiet {
            tell(format_args!("note: {message}"));
        }
    }

    /// What was done.
    pub fn say(self, message: impl fmt::Display) {
        if self > Self::Quiet {
            tell(message);
        }
    }

    /// What those want to know who ask for more.
    pub fn detail(self, message: impl fmt::Display) {
        if self == Self::Verbose {
            tell(message);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: labels alone are coloured, wherever a line begins with one.
    #[test]
    fn labels_stand_out() {
        let shown = coloured("error: no\n  tip: yes\nan error: in a line");
        assert_eq!(
            shown,
            "\u{1b}[1;31merror:\u{1b}[0m no\n  \u{1b}[1;32mtip:\u{1b}[0m yes\nan error: in a line"
        );
    }
}
