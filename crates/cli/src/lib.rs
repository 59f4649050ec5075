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

mod command_words;
mod commands;
mod console;
mod early_stage;
mod interrupt;
mod machine;
mod notes;
mod origin;
mod plan;
mod preparation;
mod progress;
mod scatter;
mod scene_input;
mod session;
mod stats;
mod suggest;
mod table;
mod targets;
mod threads;

use std::ffi::OsString;
use std::panic::{self, AssertUnwindSafe};
use std::process::ExitCode;
use std::sync::Once;
use std::thread;

use args::Arguments;
use failure::{Exit, Failure};

/// Runs the whole program: parses the command line, executes the command, prints errors, and
/// returns the exit code.
pub fn main() -> ExitCode {
    let run = || main_with(std::env::args_os().collect());
    if !has_small_stack() {
        return run().into();
    }
    match thread::Builder::new().stack_size(STACK_BYTES).spawn(run) {
        Ok(running) => running.join().unwrap_or(Exit::Failed),
        Err(cause) => {
            let failure = threads::thread_start_failure(&cause);
            console::print_message(failure.message);
            failure.exit
        }
    }
    .into()
}

/// Stack of a thread that runs the program, in bytes.
pub(crate) const STACK_BYTES: usize = 8 << 20;

/// Whether the first thread's stack is limited to less than [`STACK_BYTES`] (`ulimit -s`). The
/// program then runs on a thread of its own.
fn has_small_stack() -> bool {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Resource, getrlimit};
        getrlimit(Resource::Stack)
            .current
            .is_some_and(|bytes| bytes < STACK_BYTES as u64)
    }
    #[cfg(not(target_os = "linux"))]
    false
}

/// Runs the whole program with the given words of a command line, for a program in another
/// language. The first word is a program name. Returns the exit code.
pub fn main_with(words: Vec<OsString>) -> Exit {
    panic::set_hook(Box::new(report_panic));
    interrupt::ignore_file_size_signal();
    early_stage::install_heap_handler();
    origin::set_arguments(&words);
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
    console::set_colour_choice(command_words::find_colour_choice(&words));
    match Arguments::parse_line(command_words::insert_command(words)) {
        Ok(arguments) => {
            console::set_colour_choice(arguments.messages.color);
            commands::run(arguments.command, arguments.messages.verbosity())
        }
        Err(error) if error.use_stderr() => Err(usage_failure(&error)),
        Err(help) => console::print(help.render().to_string()),
    }
}

/// Converts clap's error for a malformed command line to a failure, with advice on flags of other
/// programs.
fn usage_failure(error: &clap::Error) -> Failure {
    // A misspelled flag is not meant as a value.
    let is_apt = |part: &&str| !part.starts_with("  tip: to pass '");
    let own = || {
        let text = error.render().to_string();
        text.split("\n\n")
            .filter(is_apt)
            .collect::<Vec<_>>()
            .join("\n\n")
    };
    let message = suggest::explain_foreign_name(error).unwrap_or_else(own);
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
