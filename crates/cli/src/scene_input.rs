//! Reading the scene that a command names, for every command that reads one.

use std::ffi::{OsStr, OsString};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use raywright_io::{
    Environment, EnvironmentSource, Error, ErrorKind, Format, Input, LightShortage, Limits, LoadOptions, Loaded, ModelOptions,
    Overrides, load_observed, presets,
};

use crate::args::{DEFAULT_PRESET, ProgressStyle, SceneArgs};
use crate::console::Verbosity;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::watch::Watch;

/// Reads and checks a scene and passes on its warnings.
pub fn read(name: &OsStr, changes: &SceneArgs, limits: Limits, verbosity: Verbosity) -> Result<Loaded, Failure> {
    watched(name, changes, limits, verbosity, ProgressStyle::None)
}

/// As [`read`], and shows how far it has come where that takes a while.
pub fn watched(
    name: &OsStr,
    changes: &SceneArgs,
    limits: Limits,
    verbosity: Verbosity,
    style: ProgressStyle,
) -> Result<Loaded, Failure> {
    let overrides = Overrides { at: changes.at, set: changes.set.clone() };
    let model = ModelOptions { scene: changes.model_scene.clone(), variant: changes.variant.clone() };
    let input = named(name, &limits)?;
    let environment = Environment {
        source: if changes.studio { Some(EnvironmentSource::Studio) } else { changes.env.clone() },
        ground: changes.ground,
        rotation: changes.env_rotation,
        strength: changes.env_strength,
    };
    let options = LoadOptions { overrides, model, environment, allow_outside: changes.allow_outside, limits };
    let progress = Progress::start("loading", style, verbosity);
    let loaded = load_observed(&input, &options, &Watch { progress: Some(&progress), ..Watch::until(&AtomicBool::new(false)) });
    progress.finish();
    let loaded = loaded.map_err(|error| explained(error, &input))?;
    for warning in &loaded.warnings {
        verbosity.warn(&warning.message);
    }
    Ok(loaded)
}

/// The scene that is meant where none is named.
pub fn unnamed() -> Result<OsString, Failure> {
    Ok(default_of(&presets::names().collect::<Vec<_>>())?.into())
}

/// The default among the presets that there are: a build may come without it, because presets are files that can be deleted.
fn default_of(carried: &[&str]) -> Result<String, Error> {
    if carried.contains(&DEFAULT_PRESET) {
        return Ok(format!("preset:{DEFAULT_PRESET}"));
    }
    let message = format!("no scene is named, and the program was built without its default preset `{DEFAULT_PRESET}`");
    Err(Error::usage(message).with_hint(match carried {
        [] => "name a file: raywright render FILE; there are no presets".to_owned(),
        [first, ..] => format!("name a file or a preset, such as preset:{first}; the presets: {}", carried.join(", ")),
    }))
}

/// Says what a scene lacked that its picture needs, and what is there in its place.
pub fn tell_completed(loaded: &Loaded, verbosity: Verbosity) {
    let name = &loaded.source.name;
    if let Some(shortage) = loaded.added_sky {
        let said = match (loaded.source.format, shortage) {
            (Format::Native(_), _) => "has no light; a neutral grey sky is added",
            (_, LightShortage::NoLight) => "brings no lights; it stands in the default studio",
            (_, LightShortage::TooDim) => "brings too little light to be seen by; it stands in the default studio",
        };
        verbosity.say(format_args!("note: {name} {said}"));
    }
    if loaded.scene.cameras.is_empty() {
        verbosity.say(format_args!("note: {name} has no camera; the whole scene is shown"));
    }
}

/// A path, `preset:NAME`, or `-` for what comes through standard input.
fn named(name: &OsStr, limits: &Limits) -> Result<Input, Error> {
    if name == "-" {
        return piped(limits);
    }
    Ok(match name.to_str().and_then(|name| name.strip_prefix("preset:")) {
        Some(preset) => Input::Preset(preset.to_owned()),
        None => Input::Path(PathBuf::from(name)),
    })
}

/// What comes through standard input. A terminal would be waited for without a word.
fn piped(limits: &Limits) -> Result<Input, Error> {
    let source = std::io::stdin();
    if source.is_terminal() {
        let hint = "pipe one into it: raywright render - < model.stl";
        return Err(Error::usage("`-` reads a scene or model from standard input, which is a terminal here").with_hint(hint));
    }
    Input::from_reader("standard input", source.lock(), limits)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: whoever deletes the default preset's file is told what there is to render instead, and how.
    #[test]
    fn without_the_default_preset_the_others_are_listed() {
        assert_eq!(default_of(&["noise", DEFAULT_PRESET]).expect("it is there"), format!("preset:{DEFAULT_PRESET}"));
        let error = default_of(&["noise", "shapes"]).expect_err("it is not there");
        assert_eq!(error.kind(), ErrorKind::Usage);
        let message = format!(
            "error: no scene is named, and the program was built without its default preset `{DEFAULT_PRESET}`\n\
            help: name a file or a preset, such as preset:noise; the presets: noise, shapes"
        );
        assert_eq!(error.to_string(), message);
        assert!(default_of(&[]).expect_err("nothing is there").to_string().ends_with("there are no presets"));
    }
}
