//! `accuracy`: time and error of each rung (quality level) of each ladder (all levels of a setting)
//! on a scene, and the combinations of rungs that are worth their time.

mod csv;
mod file;
mod recommendation;
mod reference;
mod text;

use std::ffi::OsString;
use std::path::Path;

use raywright_core::accuracy::{
    AccuracyEffort, AccuracyReport, MeasureError, MeasurementStart, ProgressListener,
    ReusableReference, measure_accuracy,
};
use raywright_core::{Observer, Settings};
use raywright_io::{Error, LoadedScene};

use crate::args::{self, AccuracyArgs};
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::origin::quote_for_shell;
use crate::plan::{self, RungChoices};
use crate::preparation::prepare_failure;
use crate::progress::StepProgress;
use crate::session::Session;
use crate::targets::{OutputFiles, select_by_extension};
use crate::{command_words, origin, scene_input};
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
    let measure = || measure(args, &mut loaded, reference, (&watch, &mut steps));
    let (settings, report, used_reference) = session.run(measure)?;
    drop(steps);
    let is_stopped = watch.was_stopped();
    let words = command_words::insert_command(origin::run_arguments().to_vec());
    let flags = format_measurement_flags(words);
    let threads = session.run(rayon::current_num_threads);
    let document = AccuracyDocument::new(&loaded, &flags, &settings, threads, &report);
    // The measurement is worth reporting even if the reference cannot be written.
    let reference_result = kept
        .filter(|_| !report.reference.reused && !is_stopped)
        .map_or(Ok(()), |path| {
            let free = session.outputs.beside(&loaded.inputs);
            reference::write_reference(path, used_reference, &loaded, free)?;
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
    let free = session.outputs.beside(&loaded.inputs);
    let name = free.write_partial_file(path, text.as_bytes())?;
    session.verbosity.print_result_message(name);
    Ok(())
}

/// Returns the JSON of `accuracy` for a loaded scene. The work runs on the caller's thread pool;
/// nothing is printed or written.
pub fn run_embedded(
    args: &AccuracyArgs,
    mut loaded: LoadedScene,
    (command, flags): (String, &[String]),
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
    let (settings, report, _) = measure(args, &mut loaded, None, (observer, &mut steps))?;
    let threads = rayon::current_num_threads();
    let mut document = AccuracyDocument::new(&loaded, flags, &settings, threads, &report);
    document.command = command;
    Ok(console::format_json(&document))
}

/// Measures a scene with its own settings as changed by the flags, which are returned first.
/// `reference` is the reference picture of an earlier measurement; the one in use is returned last.
fn measure(
    args: &AccuracyArgs,
    loaded: &mut LoadedScene,
    reference: Option<ReusableReference>,
    (observer, steps): (&dyn Observer, &mut StepProgress),
) -> Result<(Settings, AccuracyReport, ReusableReference), Failure> {
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
    Ok((settings, report, reference))
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

/// Formats the flags of a command line that `render` has too, without those of the run itself; a
/// rung and an effect each with a flag of its own.
pub fn format_measurement_flags(words: Vec<OsString>) -> Vec<String> {
    const OF_RUN: [&str; 4] = ["budget", "threads", "max-memory", "output"];
    let mut flags = Vec::new();
    for (name, value) in args::list_render_flags(words) {
        match (name.as_str(), value) {
            (name, _) if OF_RUN.contains(&name) => {}
            (name @ ("rung" | "without"), Some(list)) => {
                flags.extend(list.split(',').map(|value| format!("--{name} {value}")));
            }
            (name, Some(value)) => flags.push(format!("--{name} {}", quote_for_shell(&value))),
            (name, None) => flags.push(format!("--{name}")),
        }
    }
    flags
}

impl ProgressListener for StepProgress {
    fn report_step(&mut self, label: &str, share: f64) {
        self.show_step(label, share);
    }
}
