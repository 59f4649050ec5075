//! `check`: whether a file can be rendered, and everything that stands in the way if not. Who names no precision renders in the
//! default one, so that what its numbers lose is a problem here too.

use raywright_core::{Settings, collapsed};

use crate::args::CheckArgs;
use crate::console::{self, Verbosity};
use crate::failure::Failure;
use crate::notes::Notes;
use crate::scene_input;

/// Reads and validates the file; problems are the error.
pub fn run(args: &CheckArgs, verbosity: Verbosity) -> Result<(), Failure> {
    // Nothing waits: every warning is what the command is for.
    let loaded = scene_input::read(&args.scene, &args.changes, &mut Notes::new(Verbosity::Quiet))?;
    loaded.warnings.iter().for_each(|warning| verbosity.warn(&warning.message));
    let lost = collapsed(&loaded.scene, Settings::of(&loaded.scene).precision);
    if !lost.is_empty() {
        return Err(loaded.source.error(lost).into());
    }
    let warnings = match loaded.warnings.len() {
        0 => String::new(),
        1 => ", 1 warning".to_owned(),
        n => format!(", {n} warnings"),
    };
    console::print(format!("{}: ok{warnings}\n", loaded.source.name))
}
