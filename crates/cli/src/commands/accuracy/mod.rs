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
    let files = resolve_report_files(args, &mut outputs)?;
    let name = args
        .scene
        .clone()
        .map_or_else(scene_input::default_scene_name, Ok)?;
    if let Some(path) = &args.reference {
        outputs.add_output(path, "--reference")?;
    }
    let mut notes = Notes::new(verbosity);
    let options = plan::build_load_options(&args.changes, args.max_memory);
    let threads = Threads::within_machine(args.threads, verbosity)?;
    let mut loaded = threads.run(|| scene_input::load_with_notes(&name, &options, &mut notes))?;
    outputs.check_against_inputs(&loaded.inputs)?;
    scene_input::note_added_parts(&loaded, &mut notes);
    notes.print_kept_messages();
    let settings = resolve_settings(args, &mut loaded, &options)?;
    let given_reference = args
        .reference
        .as_deref()
        .map(|path| reference::read_reference(path, &options.limits))
        .transpose()?
        .flatten();
    let identity =
        origin::format_scene_identity(&loaded, &options, &RungChoices::from(&args.choices));
    let start = MeasurementStart {
        scene: &identity,
        reference: given_reference,
    };
    let watch = RunObserver::with_stop_flag(interrupt::install_stop_flag()?);
    let mut steps = StepProgress::start(verbosity);
    let (report, used_reference) =
        threads.run(|| measure_scene(args, (&loaded, &settings), start, &watch, &mut steps))?;
    drop(steps);
    let is_free = |path: &Path| outputs.is_free_path(path, &loaded.inputs);
    // The measurement is worth reporting even if the reference cannot be written.
    let reference_result = args
        .reference
        .as_deref()
        .filter(|_| !report.reference.kept && !watch.was_stopped())
        .map_or(Ok(()), |path| {
            reference::write_reference(path, used_reference, &loaded, is_free)?;
            verbosity.print_result_message(path.display());
            Ok(())
        });
    let document = AccuracyDocument::new(
        &loaded,
        &format_measurement_flags(args),
        &settings,
        threads.run(rayon::current_num_threads),
        &report,
    );
    write_reports(&document, &files, (watch.was_stopped(), is_free), verbosity)?;
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

/// Resolves the files of `-o` and their kinds, and adds them to the outputs.
fn resolve_report_files<'a>(
    args: &'a AccuracyArgs,
    outputs: &mut OutputFiles,
) -> Result<Vec<(&'a Path, AccuracyFileKind)>, Failure> {
    let mut files = Vec::new();
    for path in &args.output {
        files.push((path.as_path(), AccuracyFileKind::from_path(path)?));
        outputs.add_output(path, "-o")?;
    }
    Ok(files)
}

/// Writes the report to files, and prints their names. The report of a stopped measurement goes to
/// partial files, which overwrite no file that is not free.
fn write_reports(
    document: &AccuracyDocument<'_>,
    files: &[(&Path, AccuracyFileKind)],
    (was_stopped, is_free): (bool, impl Fn(&Path) -> bool),
    verbosity: Verbosity,
) -> Result<(), Failure> {
    for &(path, kind) in files {
        let text = document.format_as(kind);
        if was_stopped {
            let name = output::write_file_without_overwriting(
                &output::partial_picture_path(path),
                text.as_bytes(),
                &is_free,
            )?;
            verbosity.print_result_message(name.display());
        } else {
            output::write_atomically(path, text.as_bytes())?;
            verbosity.print_result_message(path.display());
        }
    }
    Ok(())
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
            "{}: this call returns the report and writes no file; leave out -o and --reference",
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

impl ProgressListener for StepProgress {
    fn report_step(&mut self, label: &str, share: f64) {
        self.show_step(label, share);
    }
}
