//! Options for loading a scene, and the length of its animation.

use std::ffi::OsString;

use raywright_io::{
    EnvironmentOptions, EnvironmentSource, Error, Limits, LoadOptions, ModelOptions,
    ParameterOverrides,
};

use crate::args::values::{BackdropChoice, MaterialChoice, UpDirection};
use crate::args::{FrameTimes, SceneArgs};
use crate::failure::Failure;
use crate::progress::Progress;
use crate::scene_input;

/// Returns the load limits with a memory limit in bytes; `None`: the default limit.
pub fn build_limits(memory: Option<u64>) -> Limits {
    let own = Limits::default();
    Limits {
        memory_bytes: memory.unwrap_or(own.memory_bytes),
        ..own
    }
}

/// Resolves the arguments that change a scene to load options.
pub fn build_load_options(changes: &SceneArgs, memory: Option<u64>) -> LoadOptions {
    LoadOptions {
        overrides: ParameterOverrides {
            time: changes.at,
            set: changes.set.clone(),
        },
        model: ModelOptions {
            scene: changes.model_scene.clone(),
            variant: changes.variant.clone(),
            animation: changes.animation.clone().filter(|name| name != "all"),
            up: match changes.up {
                Some(UpDirection::Axis(axis)) => Some(axis),
                Some(UpDirection::Direction(_)) | None => None,
            },
        },
        environment: EnvironmentOptions {
            source: if changes.studio {
                Some(EnvironmentSource::Studio)
            } else {
                changes.env.clone()
            },
            ground: changes.ground,
            backdrop: changes.backdrop.and_then(BackdropChoice::radiance),
            rotation: changes.env_rotation,
            strength: changes.env_strength,
        },
        clay: changes.material == Some(MaterialChoice::Clay),
        section: changes.section,
        allow_outside: changes.allow_outside,
        limits: build_limits(memory),
    }
}

/// Replaces the end of `--frames all` by the length in seconds of the animation.
pub fn with_animation_length(
    frames: FrameTimes,
    scenes: &[OsString],
    options: &LoadOptions,
) -> Result<FrameTimes, Failure> {
    if frames.to < f64::INFINITY {
        return Ok(frames);
    }
    Ok(FrameTimes {
        to: read_animation_length(scenes, options, frames.rate)?,
        ..frames
    })
}

/// Returns the length in seconds of the single scene's animation, for `--frames all`.
fn read_animation_length(
    scenes: &[OsString],
    options: &LoadOptions,
    rate: f64,
) -> Result<f64, Failure> {
    let [name] = scenes else {
        return Err(Error::invalid_usage(
            "--frames all needs a single model, and several are named; give each model a run of its own",
        )
        .into());
    };
    let refusal = |reason: String| {
        Error::invalid_usage(format_args!("{}: {reason}", name.display()))
            .with_hint("give start and end in seconds, and the pictures per second: --frames 0..2:25 is the time from 0 s to 2 s at 25 pictures per second")
    };
    if name == "-" {
        return Err(refusal(
            "standard input can be read only once, and --frames all reads the length of the animation first".to_owned(),
        )
        .into());
    }
    let loaded = scene_input::load_with_progress(
        &scene_input::resolve_input(name, &options.limits)?,
        options,
        &Progress::hidden(),
    )?;
    match loaded
        .contents
        .animation_seconds(options.model.animation.as_deref())
        .filter(|seconds| *seconds > 0.0)
    {
        None => Err(refusal(
            "--frames all needs an animation longer than 0 s, and the model has none".to_owned(),
        )
        .into()),
        Some(seconds) if seconds * rate > FrameTimes::MOST_TIMES => Err(refusal(format!(
            "{} pictures are too many; the largest number is 100000",
            seconds * rate
        ))
        .into()),
        Some(seconds) => Ok(seconds),
    }
}
