//! Loading of scenes by the names on the command line, for every command.

use std::ffi::{OsStr, OsString};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use raywright_core::fault::FaultKind;
use raywright_core::suggest::most_similar_word;
use raywright_core::{Observer, RenderOutput, Settings, measure_scene_extent};
use raywright_io::{
    Error, ErrorKind, Input, LightShortage, Limits, LoadOptions, LoadedScene, SceneFormat,
    list_scenes_and_models, load_observed, presets,
};

use crate::args::DEFAULT_PRESET;
use crate::early_stage::EarlyStageGuard;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::progress::{Progress, RunObserver};

/// Loads and validates a scene by its name on the command line, and records its warnings.
pub fn load_with_notes(
    name: &OsStr,
    options: &LoadOptions,
    notes: &mut Notes,
) -> Result<LoadedScene, Failure> {
    let _beginning = EarlyStageGuard::start(name, options.limits.memory_bytes, None)?;
    let loaded = load_with_progress(
        &resolve_input(name, &options.limits)?,
        options,
        &Progress::hidden(),
    )?;
    notes.add_faults(&loaded.warnings);
    Ok(loaded)
}

/// Loads and validates a scene, with a progress display for slow loads.
pub fn load_with_progress(
    input: &Input,
    options: &LoadOptions,
    progress: &Progress,
) -> Result<LoadedScene, Failure> {
    let loaded = load_with_observer(
        input,
        options,
        &RunObserver {
            progress: Some(progress),
            ..RunObserver::with_stop_flag(&AtomicBool::new(false))
        },
    );
    progress.finish();
    loaded
}

/// Loads and validates a scene, with an observer for progress and cancellation.
pub fn load_with_observer(
    input: &Input,
    options: &LoadOptions,
    observer: &dyn Observer,
) -> Result<LoadedScene, Failure> {
    load_observed(input, options, observer).map_err(|error| with_file_hint(error, input).into())
}

/// Returns the name of the default preset, for a command line without a scene.
pub fn default_scene_name() -> Result<OsString, Failure> {
    Ok(select_default_preset(&presets::names().collect::<Vec<_>>())?.into())
}

/// Returns the name of the default preset if it is among `carried`, the presets of this build;
/// otherwise an error that lists these presets. A build may lack the default preset, because
/// presets are files that can be deleted.
fn select_default_preset(carried: &[&str]) -> Result<String, Error> {
    if carried.contains(&DEFAULT_PRESET) {
        return Ok(format!("preset:{DEFAULT_PRESET}"));
    }
    let message = format!(
        "no scene is named, and the program was built without its default preset `{DEFAULT_PRESET}`"
    );
    Err(Error::invalid_usage(message).with_hint(match carried {
        [] => "name a file: raywright render FILE; there are no presets".to_owned(),
        [first, ..] => format!(
            "name a file or a preset, such as preset:{first}; the presets: {}",
            carried.join(", ")
        ),
    }))
}

/// Records the parts that a scene lacks and the program added: light, camera, up direction. That the
/// default studio lights a model without lights is no news.
pub fn note_added_parts(loaded: &LoadedScene, notes: &mut Notes) {
    let light = match (&loaded.source.format, loaded.added_sky) {
        (_, None) => None,
        (SceneFormat::Native(_), _) => Some("the scene has no light: a neutral grey sky is added"),
        (_, Some(LightShortage::NoLight)) => None,
        (_, Some(LightShortage::TooDim)) => {
            Some("the model's own lights are too dim: the default studio lights it")
        }
    };
    let camera = "the file has no camera: the whole scene is shown";
    let camera = loaded.scene.cameras.is_empty().then_some(camera);
    let up = loaded.assumed_up.map(|up| {
        format!(
            "STL files state no up axis: {} is assumed; --up y makes y the up axis",
            up.name()
        )
    });
    let parts: Vec<&str> = light
        .into_iter()
        .chain(camera)
        .chain(up.as_deref())
        .collect();
    if !parts.is_empty() {
        notes.add_note(parts.join("; "));
    }
}

/// Returns the seconds after which a scene looks as at its start: the period that a scene file
/// states, or the length of a model's animations.
pub fn loop_seconds(loaded: &LoadedScene, animation: Option<&str>) -> Option<f64> {
    match loaded.source.format {
        SceneFormat::Native(_) => loaded.scene.period,
        _ => loaded.contents.animation_seconds(animation),
    }
    .filter(|seconds| *seconds > 0.0)
}

/// Whether an expression of a scene file contains the time.
pub fn depends_on_time(loaded: &LoadedScene) -> bool {
    let text = loaded.source.text.as_deref();
    text.is_some_and(contains_time_variable)
}

/// Whether an expression in the text of a scene file contains the variable `t`.
fn contains_time_variable(text: &str) -> bool {
    let formulas = text
        .lines()
        .filter(|line| !line.trim_start().starts_with('#'))
        .flat_map(|line| line.split('"').skip(1).step_by(2));
    formulas.filter(|formula| formula.len() > 1).any(|formula| {
        let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        formula.split(|c| !is_part(c)).any(|word| word == "t")
    })
}

/// Whether every ray misses a scene: it has no bounded shape, no infinite plane, and no sky in its
/// file.
pub fn is_empty_scene(loaded: &LoadedScene) -> bool {
    let scene = &loaded.scene;
    if !loaded.source.format.is_model() && scene.sky.is_some() && loaded.added_sky.is_none() {
        return false;
    }
    let has_no_objects = scene.objects.is_empty() && scene.generators.is_empty();
    let extent = measure_scene_extent(scene, Settings::from_scene(scene).precision);
    has_no_objects || extent.bounds.is_empty() && extent.unbounded == 0
}

/// Creates the failure for a scene that every ray misses; `None` for any other scene.
pub fn empty_scene_failure(loaded: &LoadedScene) -> Option<Failure> {
    if !is_empty_scene(loaded) {
        return None;
    }
    let is_thin = loaded
        .warnings
        .iter()
        .any(|warning| warning.kind == FaultKind::PointsAndLines);
    let is_cut = loaded
        .warnings
        .iter()
        .any(|warning| warning.kind == FaultKind::Section);
    let reason = match (is_cut, is_thin) {
        (true, _) => "--section cuts away the whole model; choose another position",
        (_, true) => "the file has only points and lines, which are not rendered",
        _ => "the scene has no object",
    };
    Some(empty_picture_failure(&loaded.source.name, reason))
}

/// Describes why a rendered picture shows the background alone, which is rarely intended; `None`
/// for any other picture.
pub fn describe_empty_picture(
    loaded: &LoadedScene,
    rendered: &RenderOutput,
    settings: &Settings,
) -> Option<String> {
    let bounds = measure_scene_extent(&loaded.scene, settings.precision).bounds;
    // A ray that ended after the largest number of crossed surfaces has hit something, too.
    if rendered.counters.hits > 0 || rendered.counters.cut_short > 0 || bounds.is_empty() {
        return None;
    }
    let show = |[x, y, z]: [f64; 3]| format!("({x:.6}, {y:.6}, {z:.6})");
    Some(format!(
        "no camera ray hits an object: the scene lies between {} and {}; turn the camera to it with --eye and --target",
        show(bounds.min.to_array()),
        show(bounds.max.to_array())
    ))
}

/// Creates the failure for a picture that shows nothing.
pub fn empty_picture_failure(name: &str, why: impl std::fmt::Display) -> Failure {
    let message = format!("{name}: there is nothing to see: {why}");
    Failure::new(Exit::Input, message)
}

/// Resolves the name of a scene on the command line: a path, `preset:NAME`, or `-` for standard
/// input.
pub fn resolve_input(name: &OsStr, limits: &Limits) -> Result<Input, Error> {
    if name == "-" {
        return read_stdin(limits);
    }
    Ok(
        match name.to_str().and_then(|name| name.strip_prefix("preset:")) {
            Some(preset) => Input::Preset(preset.to_owned()),
            None => Input::Path(PathBuf::from(name)),
        },
    )
}

/// Reads a scene from standard input. A terminal is refused, because the program would wait without
/// a sign.
fn read_stdin(limits: &Limits) -> Result<Input, Error> {
    let source = std::io::stdin();
    if source.is_terminal() {
        let hint = "redirect a file to standard input: raywright render - < model.stl";
        return Err(Error::invalid_usage(
            "`-` reads a scene or model from standard input, which is a terminal here",
        )
        .with_hint(hint));
    }
    Input::from_reader("standard input", source.lock(), limits)
}

/// Adds a hint to the error of a file that cannot be read: a preset written without its prefix, a
/// file with a similar name, or the models in a folder.
fn with_file_hint(error: Error, input: &Input) -> Error {
    let Input::Path(path) = input else {
        return error;
    };
    if error.kind() != ErrorKind::File {
        return error;
    }
    if path.is_dir() {
        let inside = |name: &String| path.join(name).display().to_string();
        let models: Vec<String> = list_scenes_and_models(path).iter().map(inside).collect();
        return match models.as_slice() {
            [] => error
                .with_hint("the folder contains no scene or model; name another folder or a file"),
            models => error.with_hint(format!("the folder contains {}", list_first_names(models))),
        };
    }
    if path.exists() {
        return error;
    }
    let text = path.to_string_lossy();
    if text.contains("://") {
        return error.with_hint(
            "addresses are not fetched: download the file first, for example with `curl -LO ADDRESS`",
        );
    }
    if text.contains(['*', '?']) {
        return error.with_hint("no file matches this pattern of names; check the pattern");
    }
    if is_preset(path) {
        return error.with_hint(format!(
            "the built-in scene of that name is `preset:{}`",
            path.display()
        ));
    }
    let neighbours = list_scenes_and_models(path.parent().unwrap_or(Path::new("")));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    match most_similar_word(&name, neighbours.iter().map(String::as_str)) {
        Some(near) => error.with_hint(format!(
            "did you mean `{}`?",
            path.with_file_name(near).display()
        )),
        None => error,
    }
}

/// Formats the first eight names of a list and the number of all others.
fn list_first_names(names: &[String]) -> String {
    const SHOWN: usize = 8;
    let more = if names.len() > SHOWN {
        format!(" and {} more", names.len() - SHOWN)
    } else {
        String::new()
    };
    names[..names.len().min(SHOWN)].join(", ") + &more
}

fn is_preset(path: &Path) -> bool {
    path.to_str().is_some_and(|name| presets::get(name).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a build without the default preset lists the other presets and how to render one.
    #[test]
    fn without_the_default_preset_the_others_are_listed() {
        assert_eq!(
            select_default_preset(&["noise", DEFAULT_PRESET]).expect("it is there"),
            format!("preset:{DEFAULT_PRESET}")
        );
        let error = select_default_preset(&["noise", "shapes"]).expect_err("it is not there");
        assert_eq!(error.kind(), ErrorKind::Usage);
        let message = format!(
            "error: no scene is named, and the program was built without its default preset `{DEFAULT_PRESET}`\n\
            help: name a file or a preset, such as preset:noise; the presets: noise, shapes"
        );
        assert_eq!(error.to_string(), message);
        assert!(
            select_default_preset(&[])
                .expect_err("nothing is there")
                .to_string()
                .ends_with("there are no presets")
        );
    }

    /// Protects: a scene is animated where an expression contains the time `t`, and not where a
    /// name or a comment contains that letter.
    #[test]
    fn scenes_that_move_are_told() {
        for text in ["a = \"0.15*sin(0.8*t)\"", "a = [0, \"t+1\", 0]"] {
            assert!(contains_time_variable(text), "{text}");
        }
        for text in ["# \"2*t\"", "name = \"t\"", "a = \"sin(tilt)\"", "t = 5"] {
            assert!(!contains_time_variable(text), "{text}");
        }
    }
}
