//! What the user reads: results on standard output, everything else on standard error, and nothing of it steers a terminal.

use std::borrow::Cow;
use std::env;
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use crate::args::ColorChoice;
use crate::failure::Failure;

/// Whether messages are coloured.
static COLOURED: AtomicBool = AtomicBool::new(false);

/// Decides about the colours of all messages that follow. Unless a flag says so, NO_COLOR (<https://no-color.org>) goes before
/// CLICOLOR_FORCE and CLICOLOR (<https://bixense.com/clicolors>), and these before what standard error is.
pub fn set_colour(choice: ColorChoice) {
    let variable = |name| env::var(name).ok().filter(|value| !value.is_empty());
    let coloured = match choice {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto if variable("NO_COLOR").is_some() => false,
        ColorChoice::Auto if variable("CLICOLOR_FORCE").is_some_and(|value| value != "0") => true,
        ColorChoice::Auto => variable("CLICOLOR").is_none_or(|value| value != "0") && io::stderr().is_terminal(),
    };
    COLOURED.store(coloured, Ordering::Relaxed);
}

/// Words that begin messages, and what a terminal shows them in: red, yellow, cyan, green.
const LABELS: [(&str, u8); 5] = [("error:", 31), ("warning:", 33), ("note:", 36), ("help:", 32), ("tip:", 32)];

/// The same text with its labels bold and coloured.
fn coloured(text: &str) -> String {
    let line = |line: &str| {
        let indent = line.len() - line.trim_start().len();
        let label = LABELS.iter().find(|(label, _)| line[indent..].starts_with(label));
        match label {
            Some((label, code)) => {
                format!("{}\u{1b}[1;{code}m{label}\u{1b}[0m{}", &line[..indent], &line[indent + label.len()..])
            }
            None => line.to_owned(),
        }
    };
    text.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

/// Characters in a line of standard output: those of the terminal, or as COLUMNS says; none where lines are not broken, since programs read
/// them.
pub fn width() -> Option<usize> {
    let told = env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let own = || terminal_size::terminal_size_of(io::stdout()).map(|(width, _)| usize::from(width.0));
    told.or_else(own).map(|width| width.max(NARROWEST))
}

/// Lines are not broken into shorter ones.
const NARROWEST: usize = 40;

/// Writes a result to standard output, masked. A reader that has seen enough (`raywright schema | head`) is no failure.
pub fn print(text: impl AsRef<str>) -> Result<(), Failure> {
    print_binary(masked(text.as_ref()).as_bytes())
}

/// Writes a picture to standard output, as it is.
pub fn print_binary(bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes.as_ref()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::stdout(&error)),
        _ => Ok(()),
    }
}

/// A value as indented JSON with a line break at its end. Characters that steer a terminal are written as their codes, so that names
/// are read back as they are and [`print`] finds nothing to mask.
pub fn json(value: &impl Serialize) -> String {
    // None of our structures has keys that are not text, the one thing that this can fail on.
    let text = serde_json::to_string_pretty(value).unwrap_or_default() + "\n";
    // Outside of texts JSON is ASCII, and within them it has codes for ASCII's control characters but one.
    replaced(&text, |c, out| *out += &format!("\\u{:04x}", u32::from(c))).into_owned()
}

/// Writes one message to standard error, masked. Nothing can be done, or said, where that fails.
pub fn tell(message: impl fmt::Display) {
    let message = message.to_string();
    let shown = masked(&message);
    let shown = if COLOURED.load(Ordering::Relaxed) { Cow::Owned(coloured(&shown)) } else { shown };
    let _ = writeln!(io::stderr().lock(), "{shown}");
}

/// Text that shows on a terminal and does nothing to it: names come out of files, and a name can hold an escape sequence. All that the
/// program prints comes through here.
pub fn masked(text: &str) -> Cow<'_, str> {
    replaced(text, |_, out| out.push(char::REPLACEMENT_CHARACTER))
}

/// The same on one line, for what others' lines follow.
pub fn on_one_line(text: &str) -> String {
    masked(&text.replace(['\n', '\t'], "\u{fffd}")).into_owned()
}

fn replaced(text: &str, put: impl Fn(char, &mut String)) -> Cow<'_, str> {
    if !text.chars().any(steers) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    text.chars().for_each(|c| if steers(c) { put(c, &mut out) } else { out.push(c) });
    Cow::Owned(out)
}

/// Whether a terminal obeys a character instead of showing it: control characters but line breaks and tabs, and those that turn the
/// direction of what follows (Unicode's Bidi_Control), by which text looks like another.
fn steers(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        c => c.is_control(),
    }
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
    /// Something the user should know although the picture is made: one message, whose further lines belong to it.
    pub fn warn(self, message: impl fmt::Display) {
        if self > Self::Quiet {
            tell(format_args!("warning: {message}"));
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

    /// Protects: nothing that a terminal obeys is printed, whatever stands in a name, and everything else is.
    #[test]
    fn what_steers_a_terminal_is_masked() {
        let name = "\u{1b}[31mré\u{9b}2J\u{7f}\u{7}\r\u{202e}d\u{2066}\n\t世";
        assert_eq!(masked(name), "�[31mré�2J���\u{fffd}d�\n\t世");
        assert_eq!(on_one_line("a\nb\u{1b}"), "a�b�");
        assert!(matches!(masked("plain, été\n"), Cow::Borrowed(_)));
    }

    /// Protects: labels alone are coloured, wherever a line begins with one.
    #[test]
    fn labels_stand_out() {
        let shown = coloured("error: no\n  tip: yes\nan error: in a line");
        assert_eq!(shown, "\u{1b}[1;31merror:\u{1b}[0m no\n  \u{1b}[1;32mtip:\u{1b}[0m yes\nan error: in a line");
    }

    /// Protects: JSON has names as they are, in codes that no terminal obeys.
    #[test]
    fn json_has_codes() {
        let name = "\u{1b}[31m\u{9b}2J\u{7f}\r\n\u{202e}é";
        let text = json(&name);
        assert_eq!(masked(&text), text);
        assert_eq!(serde_json::from_str::<String>(&text).expect("JSON"), name);
    }
}
