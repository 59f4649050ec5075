//! Command line of Raywright: arguments, progress, tables, exit codes. Decisions about light are
//! made in `raywright_core`.
//!
//! A run has three stages: clap parses [`args`], `plan` resolves them after every check that needs
//! no scene, and a module of `commands` does the work with the libraries. Every error becomes a
//! [`failure::Failure`], whose message is printed once, in [`main_with`], and which decides the
//! exit code.
//!
//! ```
//! use clap::Parser;
//! use raywright_cli::args::Arguments;
//!
//! assert!(Arguments::try_parse_from(["raywright", "render", "room.scene.toml", "--size", "64x36"]).is_ok());
//! assert!(Arguments::try_parse_from(["raywright", "render", "--size", "64by36"]).is_err());
//! ```
//!
//! [`embedded`] is the interface for modules of other languages: the same arguments, with pictures
//! and reports in memory instead of files.
#![forbid(unsafe_code)]

pub mod args;
pub mod embedded;
pub mod failure;

mod beginning;
mod clock;
mod commands;
mod console;
mod interrupt;
mod machine;
mod memory;
mod notes;
mod origin;
mod plan;
mod preparation;
mod progress;
mod scatter;
mod scene_input;
mod stats;
mod suggest;
mod synonyms;
mod table;
mod targets;
mod threads;
mod watch;
mod words;

use std::ffi::OsString;
use std::panic::{self, AssertUnwindSafe};
use std::process::ExitCode;
use std::sync::Once;

use clap::Parser;

use args::Arguments;
use failure::{Exit, Failure};

/// Runs the whole program: parses the command line, executes the command, prints errors, and
/// returns the exit code.
pub fn main() -> ExitCode {
    main_with(std::env::args_os().collect()).into()
}

/// Runs the whole program with the given words of a command line, for a program in another
/// language. The first word is a program name. Returns the exit code.
pub fn main_with(words: Vec<OsString>) -> Exit {
    panic::set_hook(Box::new(report_panic));
    interrupt::outlive_file_limits();
    beginning::watch_memory();
    origin::set_words(&words);
    match panic::catch_unwind(AssertUnwindSafe(|| run(words))) {
        Ok(Ok(())) => Exit::Done,
        Ok(Err(failure)) => {
            console::print_message(failure.message.trim_end());
            failure.exit
        }
        Err(_) => Exit::Failed,
    }
}

fn run(words: Vec<OsString>) -> Result<(), Failure> {
    // The colour is chosen before the line is parsed, because errors of parsing are coloured too.
    console::set_colour(words::colour(&words));
    match Arguments::try_parse_from(words::with_command(words)) {
        Ok(arguments) => {
            console::set_colour(arguments.messages.color);
            commands::run(arguments.command, arguments.messages.verbosity())
        }
        Err(error) if error.use_stderr() => Err(wrong_words(&error)),
        Err(help) => console::print(help.render().to_string()),
    }
}

/// Converts clap's error for a malformed command line to a failure, with advice on flags of other
/// programs.
fn wrong_words(error: &clap::Error) -> Failure {
    let message = synonyms::explained(error).unwrap_or_else(|| error.render().to_string());
    Failure {
        exit: Exit::Usage,
        message,
    }
}

/// Panic handler: reports a bug in two lines instead of a trace, once for all threads.
fn report_panic(panic: &panic::PanicHookInfo<'_>) {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let cause = panic.payload_as_str().unwrap_or("no message");
        let place = panic.location().map(|l| format!(" ({}:{})", l.file(), l.line())).unwrap_or_default();
        console::print_message(format_args!(
            "error: this is a bug in raywright {}: {cause}{place}\n  Please report it with the command and the scene.",
            env!("CARGO_PKG_VERSION")
        ));
    });
}
