//! `presets`: a list of the built-in scenes, or the text of one of them.

use raywright_io::presets;

use crate::args::PresetsArgs;
use crate::console;
use crate::failure::Failure;
use crate::table::format_columns;

/// Runs `presets`: prints a table of names and titles, or the text of a preset.
pub fn run(args: &PresetsArgs) -> Result<(), Failure> {
    match &args.name {
        Some(name) => {
            console::print(presets::get(name.strip_prefix("preset:").unwrap_or(name))?.text)
        }
        None => {
            let rows: Vec<[String; 2]> = presets::list()
                .into_iter()
                .map(|preset| [format!("preset:{}", preset.name), preset.title])
                .collect();
            console::print(format_columns(&rows))
        }
    }
}
