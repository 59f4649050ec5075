//! Commands of the program, a module for each. A module resolves the arguments of its command,
//! calls the libraries and prints the results.

pub mod accuracy;
mod bench;
mod check;
pub mod compare;
mod documentation;
pub mod explain;
mod films;
mod info;
pub mod render;
mod stability;
mod stress;
mod thumbs;
mod view;

use crate::args::Command;
use crate::console::{self, Verbosity};
use crate::failure::Failure;
use crate::plan::RenderTask;
use crate::session::Session;

/// Runs a command; `None` renders the default preset.
pub fn run(command: Option<Command>, verbosity: Verbosity) -> Result<(), Failure> {
    let open = |threads| Session::open(threads, verbosity);
    match command.unwrap_or_else(|| Command::Render(Box::default())) {
        Command::Render(args) => {
            // `--frames all` loads the scene to learn the length of its animation.
            let session = open(args.machine.limits.threads)?;
            render::run(session, &RenderTask::new(*args)?)
        }
        Command::View(args) => view::run(open(args.render.machine.limits.threads)?, *args),
        Command::Merge(args) => films::run_merge(open(None)?, &args),
        Command::Denoise(args) => films::run_denoise(open(args.limits.threads)?, &args),
        Command::Explain(args) => explain::run(open(None)?, &args),
        Command::Compare(args) => compare::run(open(None)?, &args),
        Command::Info(args) => info::run(open(None)?, &args),
        Command::Check(args) => check::run(open(None)?, &args),
        Command::Accuracy(args) => accuracy::run(open(args.threads)?, &args),
        Command::Bench(args) => bench::run(open(Some(bench::THREADS))?, &args),
        Command::Stability(args) => stability::run(open(None)?, &args),
        Command::Stress(args) => stress::run(open(args.limits.threads)?, &args),
        Command::Thumbs(args) => thumbs::run(open(None)?, &args),
        Command::Presets(args) => documentation::print_presets(&args),
        Command::Schema => console::print(raywright_core::scene::SCHEMA),
        Command::Completions(args) => documentation::print_completions(&args),
        Command::Man(args) => documentation::print_manual(&args),
    }
}
