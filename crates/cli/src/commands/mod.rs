//! One module a command: it takes its arguments apart, calls the libraries and prints what they return.

mod completions;
mod man;

use crate::args::Command;
use crate::failure::Failure;

/// Runs one command.
pub fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
    }
}
