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
use raywright_io::{EnvironmentSource, Error, GroundRule, LoadedScene, output};

use crate::args::values::{MaterialChoice, UpDirection};
use crate::args::{AccuracyArgs, SceneArgs};
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::origin::quote_for_shell;
use crate::plan::{self, RungChoices};
use crate::preparation::prepare_failure;
use crate::progress::StepProgress;
use crate::session::Session;
use crate::targets::{OutputFiles, select_by_extension};
use crate::{origin, scene_input};
use file::{AccuracyDocument, AccuracyFileKind};

/// Runs `accuracy`: measures, writes the requested files, and prints a table or JSON.
pub fn run(mut session: Session, args: &AccuracyArgs) -> Result<(), Failure> {
    let files = resolve_report_files(args, &mut session.outputs)?;
    let default = scene_input::default_scene_name;
    let name = args.scene.clone().map_or_else(default, Ok)?;
    let kept = args.reference.as_deref();
    kept.map_or(Ok(()), |path| {
        session.outputs.add_output(path, "--reference")
    })?;
    let options = plan::build_load_options(&args.changes, args.max_memory);
    let mut loaded = session.load_to_render(&name, &options)?;
    let reference = kept
        .map(|path| reference::read_reference(path, &options.limits))
        .transpose()?
        .flatten();
    let (watch, mut steps) = (session.start_work(), StepProgress::start(session.verbosity));
    let measure = || Measurement::measure(args, &mut loaded, reference, (&watch, &mut steps));
    let (measured, used_reference) = session.run(measure)?;
    drop(steps);
    let is_stopped = watch.was_stopped();
    let document = measured.document(args, &loaded, session.run(rayon::current_num_threads));
    // The measurement is worth reporting even if the reference cannot be written.
    let reference_result = kept
        .filter(|_| !measured.report.reference.kept && !is_stopped)
        .map_or(Ok(()), |path| {
            let is_free = |path: &Path| session.outputs.is_free_path(path, &loaded.inputs);
            reference::write_reference(path, used_reference, &loaded, is_free)?;
            session.verbosity.print_result_message(path.display());
            Ok(())
        });
    for (path, kind) in files {
        let text = document.format_as(kind);
        if is_stopped {
            write_partial_report(&session, path, &text, &loaded)?;
        } else {
            session.write_report(path, &text)?;
        }
    }
    console::print_report(args.json, &document, || text::format_report(&document))?;
    if is_stopped {
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
        let kind = select_by_extension(path, &AccuracyFileKind::ALL)?;
        files.push((path.as_path(), kind));
        outputs.add_output(path, "-o")?;
    }
    Ok(files)
}

/// Writes the report of a stopped measurement to a partial file, which replaces no file, and prints
/// its name.
fn write_partial_report(
    session: &Session,
    path: &Path,
    text: &str,
    loaded: &LoadedScene,
) -> Result<(), Failure> {
    let name = output::write_file_without_overwriting(
        &output::partial_picture_path(path),
        text.as_bytes(),
        |path: &Path| session.outputs.is_free_path(path, &loaded.inputs),
    )?;
    session.verbosity.print_result_message(name.display());
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
    let mut steps = StepProgress::start(Verbosity::Quiet);
    let (measured, _) = Measurement::measure(args, &mut loaded, None, (observer, &mut steps))?;
    let mut document = measured.document(args, &loaded, rayon::current_num_threads());
    document.command = command;
    Ok(console::format_json(&document))
}

/// A measurement of a scene, with the settings that all others are compared with.
struct Measurement {
    settings: Settings,
    report: AccuracyReport,
}

impl Measurement {
    /// Measures a scene with its own settings as changed by the flags. `reference` is the reference
    /// picture of an earlier measurement. Returns the used reference picture too.
    fn measure(
        args: &AccuracyArgs,
        loaded: &mut LoadedScene,
        reference: Option<ReusableReference>,
        (observer, steps): (&dyn Observer, &mut StepProgress),
    ) -> Result<(Self, ReusableReference), Failure> {
        let options = plan::build_load_options(&args.changes, args.max_memory);
        let choices = RungChoices::from(&args.choices);
        let mut settings = Settings::from_scene(&loaded.scene);
        settings.integrator = args.integrator.unwrap_or(settings.integrator);
        choices.apply(&mut loaded.scene, &mut settings)?;
        settings.max_memory = Some(options.limits.memory_bytes);
        let start = MeasurementStart {
            scene: &origin::format_scene_identity(loaded, &options, &choices),
            reference,
        };
        let effort = AccuracyEffort {
            budget: args.budget,
            size: args.size,
            rounds: args.rounds,
        };
        let measured = measure_accuracy(&loaded.scene, &settings, &effort, start, observer, steps);
        let (report, reference) = measured.map_err(|error| measure_failure(args, loaded, error))?;
        Ok((Self { settings, report }, reference))
    }

    /// Combines the measurement with its scene, its flags and its number of threads.
    fn document<'a>(
        &'a self,
        args: &AccuracyArgs,
        loaded: &'a LoadedScene,
        threads: usize,
    ) -> AccuracyDocument<'a> {
        let flags = format_measurement_flags(args);
        AccuracyDocument::new(loaded, &flags, &self.settings, threads, &self.report)
    }
}

fn measure_failure(args: &AccuracyArgs, loaded: &LoadedScene, error: MeasureError) -> Failure {
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
