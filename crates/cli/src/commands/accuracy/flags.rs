//! Flags of `render` that define a measurement of `accuracy`.

use raywright_io::{EnvironmentSource, GroundRule};

use crate::args::values::{MaterialChoice, UpDirection};
use crate::args::{AccuracyArgs, SceneArgs};
use crate::origin::{self, quote_for_shell};
use crate::plan::RungChoices;

/// Formats the flags that define the measurement, as `render` accepts them.
pub fn format_measurement_flags(args: &AccuracyArgs) -> Vec<String> {
    let integrator = args
        .integrator
        .map(|integrator| format!("--integrator {}", origin::variant_name(&integrator)));
    let size = args
        .size
        .map(|[width, height]| format!("--size {width}x{height}"));
    integrator
        .into_iter()
        .chain(format_scene_flags(&args.changes))
        .chain(size)
        .chain(RungChoices::from(&args.choices).format_choices("--rung ", "--without "))
        .collect()
}

/// Formats the flags that change a scene.
fn format_scene_flags(changes: &SceneArgs) -> Vec<String> {
    let SceneArgs {
        at,
        set,
        model_scene,
        variant,
        animation,
        up,
        material,
        section,
        env,
        studio,
        ground,
        backdrop,
        env_rotation,
        env_strength,
        allow_outside,
    } = changes;
    let name_flag = |flag: &str, name: &Option<String>| {
        name.as_ref()
            .map(|name| format!("--{flag} {}", quote_for_shell(name)))
    };
    let parameters = set
        .iter()
        .map(|(name, value)| format!("--set {name}={value}"));
    let flags = [
        name_flag("scene", model_scene),
        name_flag("variant", variant),
        name_flag("animation", animation),
        up.map(format_up_flag),
        material.map(|MaterialChoice::Clay| "--material clay".to_owned()),
        section.map(|section| format!("--section {section}")),
        env.as_ref().map(format_environment_flag),
        studio.then(|| "--studio".to_owned()),
        (*ground == GroundRule::None).then(|| "--ground none".to_owned()),
        backdrop.map(|backdrop| format!("--backdrop {}", backdrop.name())),
        env_rotation.map(|degrees| format!("--env-rotation {degrees}")),
        env_strength.map(|factor| format!("--env-strength {factor}")),
        allow_outside.then(|| "--allow-outside".to_owned()),
    ];
    at.map(|seconds| format!("--at {seconds}"))
        .into_iter()
        .chain(parameters)
        .chain(flags.into_iter().flatten())
        .collect()
}

/// Formats the flag of an up direction.
fn format_up_flag(up: UpDirection) -> String {
    match up {
        UpDirection::Axis(axis) => format!("--up {}", axis.name()),
        UpDirection::Direction([x, y, z]) => format!("--up {x},{y},{z}"),
    }
}

/// Formats the flag of an environment: `--studio` for the studio, otherwise `--env`.
fn format_environment_flag(source: &EnvironmentSource) -> String {
    match source {
        EnvironmentSource::None => "--env none".to_owned(),
        EnvironmentSource::Default => "--env default".to_owned(),
        EnvironmentSource::Studio => "--studio".to_owned(),
        EnvironmentSource::File(path) => {
            format!("--env {}", quote_for_shell(&path.to_string_lossy()))
        }
    }
}
