//! Texts about the program itself: `completions`, `man` and `presets`.

use clap::{Command, CommandFactory};
use raywright_io::presets;

use crate::args::{Arguments, CompletionsArgs, ManArgs, PresetsArgs};
use crate::failure::Failure;
use crate::table::format_columns;
use crate::{console, suggest};

/// Runs `completions`: prints the completion script of a shell.
pub fn print_completions(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(
        args.shell,
        &mut Arguments::command(),
        "raywright",
        &mut script,
    );
    console::print(String::from_utf8_lossy(&script))
}

/// Runs `man`: prints the manual page of the program or of a command, as roff.
pub fn print_manual(args: &ManArgs) -> Result<(), Failure> {
    let mut page = Arguments::command();
    page.build();
    if let Some(name) = &args.command {
        let names: Vec<&str> = page.get_subcommands().map(Command::get_name).collect();
        let unknown = suggest::unknown_name_error("command", name, &names);
        page = page.find_subcommand(name).cloned().ok_or(unknown)?;
    }
    let mut roff = Vec::new();
    clap_mangen::Man::new(page)
        .render(&mut roff)
        .map_err(|error| Failure::from_stdout_error(&error))?;
    console::print(String::from_utf8_lossy(&roff))
}

/// Runs `presets`: prints a table of names and titles, or the text of a preset.
pub fn print_presets(args: &PresetsArgs) -> Result<(), Failure> {
    if let Some(name) = &args.name {
        let name = name.strip_prefix("preset:").unwrap_or(name);
        return console::print(presets::get(name)?.text);
    }
    let row = |preset: presets::Preset| [format!("preset:{}", preset.name), preset.title];
    let rows: Vec<[String; 2]> = presets::list().into_iter().map(row).collect();
    console::print(format_columns(&rows))
}
