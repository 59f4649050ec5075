//! `man`: manual pages, generated from the help texts.

use clap::CommandFactory;

use crate::args::{Arguments, ManArgs};
use crate::console;
use crate::failure::Failure;
use crate::suggest;

/// Runs `man`: prints the manual page of the program or of a command, as roff.
pub fn run(args: &ManArgs) -> Result<(), Failure> {
    let mut program = Arguments::command();
    program.build();
    let page = match &args.command {
        None => program,
        Some(name) => match program.find_subcommand(name) {
            Some(command) => command.clone(),
            None => {
                let names: Vec<&str> = program
                    .get_subcommands()
                    .map(clap::Command::get_name)
                    .collect();
                return Err(suggest::unknown_name_error("command", name, &names).into());
            }
        },
    };
    let mut roff = Vec::new();
    clap_mangen::Man::new(page)
        .render(&mut roff)
        .map_err(|error| Failure::from_stdout_error(&error))?;
    console::print(String::from_utf8_lossy(&roff))
}
