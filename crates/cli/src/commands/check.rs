//! `check`: whether a file can be rendered, and everything that stands in the way if not.

use raywright_io::Limits;

use crate::args::CheckArgs;
use crate::console::{self, Verbosity};
use crate::failure::Failure;
use crate::scene_input;

/// Reads and validates the file; problems are the error.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let loaded = scene_input::read(&args.scene, &args.changes, Limits::default(), Verbosity::Normal)?;
    let warnings = match loaded.warnings.len() {
        0 => String::new(),
        1 => ", 1 warning".to_owned(),
        n => format!(", {n} warnings"),
    };
    console::print(format!("{}: ok{warnings}\n", loaded.source.name))
}
