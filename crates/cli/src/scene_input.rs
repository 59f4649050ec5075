//! Reading the scene that a command names, for every command that reads one.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use raywright_core::prepare::{has_light, neutral_sky};
use raywright_io::{Error, ErrorKind, Input, Limits, LoadOptions, Loaded, Overrides, load, presets};

use crate::args::SceneArgs;
use crate::console::Verbosity;
use crate::failure::Failure;

/// Reads and checks a scene and passes on its warnings.
pub fn read(name: &OsStr, changes: &SceneArgs, limits: Limits, verbosity: Verbosity) -> Result<Loaded, Failure> {
    let overrides = Overrides { at: changes.at, set: changes.set.clone() };
    let input = named(name);
    let loaded = load(&input, &LoadOptions { overrides, limits }).map_err(|error| explained(error, &input))?;
    for warning in &loaded.warnings {
        verbosity.warn(&warning.message);
    }
    Ok(loaded)
}

/// Puts what a picture needs into a scene that lacks it, and says so: a neutral sky where nothing gives light.
pub fn complete(loaded: &mut Loaded, verbosity: Verbosity) {
    let name = &loaded.source.name;
    if !has_light(&loaded.scene) {
        loaded.scene.sky = Some(neutral_sky());
        verbosity.say(format_args!("note: {name} has no light; a neutral grey sky is added"));
    }
    if loaded.scene.cameras.is_empty() {
        verbosity.say(format_args!("note: {name} has no camera; the whole scene is shown, from slightly above and to the side"));
    }
}

/// A path, or `preset:NAME`.
fn named(name: &OsStr) -> Input {
    match name.to_str().and_then(|name| name.strip_prefix("preset:")) {
        Some(preset) => Input::Preset(preset.to_owned()),
        None => Input::Path(PathBuf::from(name)),
    }
}

/// A file that does not exist is sometimes a preset without its prefix.
fn explained(error: Error, input: &Input) -> Error {
    match input {
        Input::Path(path) if error.kind() == ErrorKind::File && !path.exists() && is_preset(path) => {
            error.with_hint(format!("the built-in scene of that name is `preset:{}`", path.display()))
        }
        _ => error,
    }
}

fn is_preset(path: &Path) -> bool {
    path.to_str().is_some_and(|name| presets::get(name).is_ok())
}
