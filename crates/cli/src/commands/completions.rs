//! `completions`: completion scripts for shells.

use clap::CommandFactory;

use crate::args::{Arguments, CompletionsArgs};
use crate::console;
use crate::failure::Failure;

/// Runs `completions`: prints the completion script of a shell.
pub fn run(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut command = Arguments::command();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "raywright", &mut script);
    console::print(String::from_utf8_lossy(&script))
}
