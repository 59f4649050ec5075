//! Commands of the program, a module for each. A module resolves the arguments of its command,
//! calls the libraries and prints the results.

pub mod accuracy;
mod bench;
mod check;
pub mod compare;
mod completions;
mod denoise;
pub mod explain;
mod info;
mod man;
mod merge;
mod presets;
pub mod render;
mod stability;
mod stress;
mod thumbs;
mod view;

use crate::args::Command;
use crate::console::{self, Verbosity};
use crate::failure::Failure;
use crate::plan::RenderTask;
use crate::threads::Threads;

/// Runs a command; `None` renders the default preset.
pub fn run(command: Option<Command>, verbosity: Verbosity) -> Result<(), Failure> {
    let command = command.unwrap_or_else(|| Command::Render(Box::default()));
    // Commands without a flag for threads use rayon's global pool, which is built here: rayon
    // panics if it has to start the pool implicitly and the system refuses a thread.
    if matches!(
        command,
        Command::Merge(_)
            | Command::Explain(_)
            | Command::Compare(_)
            | Command::Info(_)
            | Command::Check(_)
            | Command::Bench(_)
            | Command::Stability(_)
    ) {
        Threads::new(None)?;
    }
    match command {
        Command::Render(args) => render::run(&RenderTask::new(*args, verbosity)?),
        Command::View(args) => view::run(*args, verbosity),
        Command::Merge(args) => merge::run(&args, verbosity),
        Command::Denoise(args) => denoise::run(&args, verbosity),
        Command::Explain(args) => explain::run(&args, verbosity),
        Command::Compare(args) => compare::run(&args),
        Command::Info(args) => info::run(&args, verbosity),
        Command::Check(args) => check::run(&args, verbosity),
        Command::Accuracy(args) => accuracy::run(&args, verbosity),
        Command::Bench(args) => bench::run(&args, verbosity),
        Command::Stability(args) => stability::run(&args, verbosity),
        Command::Stress(args) => stress::run(&args, verbosity),
        Command::Thumbs(args) => thumbs::run(&args, verbosity),
        Command::Presets(args) => presets::run(&args),
        Command::Schema => console::print(raywright_core::scene::SCHEMA),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
    }
}
