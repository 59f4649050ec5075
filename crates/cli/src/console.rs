//! What the user reads: results on standard output, everything else on standard error.

use std::fmt;
use std::io::{self, Write};

use serde::Serialize;

use crate::failure::Failure;

/// Writes a result to standard output. A reader that has seen enough (`raywright schema | head`) is no failure.
pub fn print(text: impl AsRef<[u8]>) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_ref()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::stdout(&error)),
        _ => Ok(()),
    }
}

/// A value as indented JSON with a line break at its end.
pub fn json(value: &impl Serialize) -> String {
    // None of our structures has keys that are not text, the one thing that this can fail on.
    serde_json::to_string_pretty(value).unwrap_or_default() + "\n"
}

/// Writes one message to standard error. Nothing can be done, or said, where that fails.
pub fn tell(message: impl fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "{message}");
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
