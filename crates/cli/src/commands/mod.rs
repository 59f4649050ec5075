//! One module a command: it takes its arguments apart, calls the libraries and prints what they return.

mod check;
mod completions;
mod info;
mod man;
mod presets;

use crate::args::Command;
use crate::failure::Failure;

/// Runs one command.
pub fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::Info(args) => info::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Presets(args) => presets::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
    }
}
