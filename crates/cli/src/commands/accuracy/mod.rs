//! `accuracy`: time and error of each rung (quality level) of each ladder (all levels of a setting)
//! on a scene, and the combinations of rungs that are worth their time.

mod csv;
mod file;
mod recommendation;
mod reference;
mod text;

use std::path::Path;

use raywright_core::accuracy::{
    AccuracyEffort, AccuracyReport, MeasureError, MeasurementStart, ProgressListener,
    ReusableReference, measure_accuracy,
};
use raywright_core::{Observer, Settings};
use raywright_io::{EnvironmentSource, Error, GroundRule, LoadOptions, LoadedScene, output};

use crate::args::values::{MaterialChoice, UpDirection};
use crate::args::{AccuracyArgs, SceneArgs};
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::observer::RunObserver;
use crate::origin::quote_for_shell;
use crate::plan::{self, RungChoices};
use crate::preparation::prepare_failure;
use crate::progress::StepProgress;
use crate::targets::OutputFiles;
use crate::threads::Threads;
use crate::{interrupt, origin, scene_input};
use file::{AccuracyDocument, AccuracyFileKind};

/// Runs `accuracy`: measures, writes the requested files, and prints a table or JSON.
pub fn run(args: &AccuracyArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let mut outputs = OutputFiles::default();
    let mut files = Vec::new();
    for path in &args.output {
        files.push((path, AccuracyFileKind::from_path(path)?));
        outputs.add_output(path, "-o")?;
    }
    let name = args
        .scene
        .clone()
        .map_or_else(scene_input::default_scene_name, Ok)?;
    if let Some(path) = &args.reference {
        outputs.add_output(path, "--reference")?;
    }
    let mut notes = Notes::new(verbosity);
    let options = plan::build_load_options(&args.changes, args.max_memory);
    let (limits, choices) = (options.limits, RungChoices::from(&args.choices));
    let threads = Threads::new(args.threads)?;
    let mut loaded = threads.run(|| scene_input::load_with_notes(&name, &options, &mut notes))?;
    outputs.check_against_inputs(&loaded.inputs)?;
    scene_input::note_added_parts(&loaded, &mut notes);
    notes.print_kept_messages();
    let settings = resolve_settings(args, &mut loaded, &options)?;
    let reference = args
        .reference
        .as_deref()
        .map(|path| reference::read_reference(path, &limits))
        .transpose()?
        .flatten();
    let identity = origin::format_scene_identity(&loaded, &options, &choices);
    let start = MeasurementStart {
        scene: &identity,
        reference,
    };
    let watch = RunObserver::with_stop_flag(interrupt::install_stop_flag()?);
    let mut steps = StepProgress::start(verbosity);
    let (report, reference) =
        threads.run(|| measure_scene(args, (&loaded, &settings), start, &watch, &mut steps))?;
    drop(steps);
    // The measurement is worth reporting even if the reference cannot be written.
    let requested = args
        .reference
        .as_deref()
        .filter(|_| !report.reference.kept && !watch.was_stopped());
    let reference_result = requested.map_or(Ok(()), |path| {
        reference::write_reference(path, reference, &loaded)
    });
    if let Some(path) = requested.filter(|_| reference_result.is_ok()) {
        verbosity.print_result_message(path.display());
    }
    let document = AccuracyDocument::new(
        &loaded,
        &format_measurement_flags(args),
        &settings,
        threads.run(rayon::current_num_threads),
        &report,
    );
    let is_free = |path: &Path| outputs.is_free_path(path, &loaded.inputs);
    for (path, kind) in files {
        let text = document.format_as(kind);
        if watch.was_stopped() {
            let name = output::write_file_without_overwriting(
                &output::partial_picture_path(path),
                text.as_bytes(),
                is_free,
            )?;
            verbosity.print_result_message(name.display());
        } else {
            output::write_atomically(path, text.as_bytes())?;
            verbosity.print_result_message(path.display());
        }
    }
    console::print(if args.json {
        console::format_json(&document)
    } else {
        text::format_report(&document)
    })?;
    if watch.was_stopped() {
        return Err(Failure::new(
            Exit::Interrupted,
            "interrupted; the report contains the measurements that were finished",
        ));
    }
    reference_result
}

/// Returns the JSON of `accuracy` for a loaded scene. The work runs on the caller's thread pool;
/// nothing is printed or written.
pub fn run_embedded(
    args: &AccuracyArgs,
    mut loaded: LoadedScene,
    command: String,
    observer: &dyn Observer,
) -> Result<String, Failure> {
    if let Some(path) = args.output.iter().chain(&args.reference).next() {
        return Err(Error::invalid_usage(format_args!(
            "{}: this call returns the report and writes no file; leave out the flag",
            path.display()
        ))
        .into());
    }
    let options = plan::build_load_options(&args.changes, args.max_memory);
    let settings = resolve_settings(args, &mut loaded, &options)?;
    let identity =
        origin::format_scene_identity(&loaded, &options, &RungChoices::from(&args.choices));
    let start = MeasurementStart {
        scene: &identity,
        reference: None,
    };
    let (report, _) = measure_scene(
        args,
        (&loaded, &settings),
        start,
        observer,
        &mut StepProgress::start(Verbosity::Quiet),
    )?;
    let mut document = AccuracyDocument::new(
        &loaded,
        &format_measurement_flags(args),
        &settings,
        rayon::current_num_threads(),
        &report,
    );
    document.command = command;
    Ok(console::format_json(&document))
}

/// Resolves the scene's own settings as changed by the flags. All other settings are compared with
/// these.
fn resolve_settings(
    args: &AccuracyArgs,
    loaded: &mut LoadedScene,
    options: &LoadOptions,
) -> Result<Settings, Failure> {
    let mut settings = Settings::from_scene(&loaded.scene);
    settings.integrator = args.integrator.unwrap_or(settings.integrator);
    RungChoices::from(&args.choices).apply(&mut loaded.scene, &mut settings)?;
    settings.max_memory = Some(options.limits.memory_bytes);
    Ok(settings)
}

fn measure_scene(
    args: &AccuracyArgs,
    (loaded, settings): (&LoadedScene, &Settings),
    start: MeasurementStart<'_>,
    observer: &dyn Observer,
    steps: &mut StepProgress,
) -> Result<(AccuracyReport, ReusableReference), Failure> {
    let effort = AccuracyEffort {
        budget: args.budget,
        size: args.size,
        rounds: args.rounds,
    };
    measure_accuracy(&loaded.scene, settings, &effort, start, observer, steps).map_err(|error| {
        match (error, &args.reference) {
            (MeasureError::Reference(error), Some(path)) => {
                reference::wrong_reference_failure(path, &error)
            }
            (MeasureError::Reference(error), None) => Error::invalid_usage(error).into(),
            (MeasureError::Prepare(error), _) => prepare_failure(&loaded.source, error),
            (error @ MeasureError::InsufficientTime, _) => Failure::new(
                Exit::Failed,
                format_args!("{}: {error}", loaded.source.name),
            )
            .with_hint("give a larger --budget or a smaller --size"),
        }
    })
}

/// Formats the flags that define the measurement, as `render` accepts them.
fn format_measurement_flags(args: &AccuracyArgs) -> Vec<String> {
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
    } = &args.changes;
    let integrator = args
        .integrator
        .map(|integrator| format!("--integrator {}", origin::variant_name(&integrator)));
    let mut flags: Vec<String> = integrator
        .into_iter()
        .chain(at.map(|t| format!("--at {t}")))
        .collect();
    flags.extend(
        set.iter()
            .map(|(name, value)| format!("--set {name}={value}")),
    );
    flags.extend(
        model_scene
            .iter()
            .map(|name| format!("--scene {}", quote_for_shell(name))),
    );
    flags.extend(
        variant
            .iter()
            .map(|name| format!("--variant {}", quote_for_shell(name))),
    );
    flags.extend(
        animation
            .iter()
            .map(|name| format!("--animation {}", quote_for_shell(name))),
    );
    flags.extend(up.map(|up| match up {
        UpDirection::Axis(axis) => format!("--up {}", axis.name()),
        UpDirection::Direction([x, y, z]) => format!("--up {x},{y},{z}"),
    }));
    flags.extend(material.map(|MaterialChoice::Clay| "--material clay".to_owned()));
    flags.extend(section.map(|section| format!("--section {section}")));
    flags.extend(env.iter().map(|source| match source {
        EnvironmentSource::None => "--env none".to_owned(),
        EnvironmentSource::Default => "--env default".to_owned(),
        EnvironmentSource::Studio => "--studio".to_owned(),
        EnvironmentSource::File(path) => {
            format!("--env {}", quote_for_shell(&path.to_string_lossy()))
        }
    }));
    flags.extend(studio.then(|| "--studio".to_owned()));
    flags.extend((*ground == GroundRule::None).then(|| "--ground none".to_owned()));
    flags.extend(backdrop.map(|backdrop| format!("--backdrop {}", backdrop.name())));
    flags.extend(env_rotation.map(|degrees| format!("--env-rotation {degrees}")));
    flags.extend(env_strength.map(|factor| format!("--env-strength {factor}")));
    flags.extend(allow_outside.then(|| "--allow-outside".to_owned()));
    flags.extend(
        args.size
            .map(|[width, height]| format!("--size {width}x{height}")),
    );
    flags.extend(RungChoices::from(&args.choices).format_choices("--rung ", "--without "));
    flags
}

impl ProgressListener for StepProgress {
    fn report_step(&mut self, label: &str, share: f64) {
        self.show_step(label, share);
    }
}
