//! `accuracy`: time and error of each rung (quality level) of each ladder (all levels of a setting)
//! on a scene, and the combinations of rungs that are worth their time.

mod file;
mod recommendation;
mod text;

use std::ffi::OsString;
use std::path::Path;

use raywright_core::accuracy::{AccuracyEffort, AccuracyReport, MeasureError, measure_accuracy};
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
use file::{AccuracyDocument, FORMATS, FileFormat};

/// Runs `accuracy`: measures, writes the requested files, and prints a table or JSON.
pub fn run(mut session: Session, args: &AccuracyArgs) -> Result<(), Failure> {
    let files = resolve_report_files(args, &mut session.outputs)?;
    let default = scene_input::default_scene_name;
    let name = args.scene.clone().map_or_else(default, Ok)?;
    let options = plan::build_load_options(&args.changes, args.max_memory);
    let mut loaded = session.load_to_render(&name, &options)?;
    let (watch, mut steps) = (session.start_work(), StepProgress::start(session.verbosity));
    let (settings, mut report) =
        session.run(|| measure(args, &mut loaded, (&watch, &mut steps)))?;
    drop(steps);
    let is_stopped = watch.was_stopped();
    let words = command_words::insert_command(origin::run_arguments().to_vec());
    let flags = format_measurement_flags(words);
    let threads = session.run(rayon::current_num_threads);
    let document = AccuracyDocument::new(&loaded, &flags, &settings, threads, &mut report);
    for (path, format) in files {
        let text = format(&document);
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
    Ok(())
}

/// Resolves the files of `-o` and their formats, and adds them to the outputs.
fn resolve_report_files<'a>(
    args: &'a AccuracyArgs,
    outputs: &mut OutputFiles,
) -> Result<Vec<(&'a Path, FileFormat)>, Failure> {
    let mut files = Vec::new();
    for path in &args.output {
        files.push((path.as_path(), select_by_extension(path, &FORMATS)?));
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
    if let Some(path) = args.output.first() {
        return Err(Error::invalid_usage(format_args!(
            "{}: this call returns the report and writes no file; leave out -o",
            path.display()
        ))
        .into());
    }
    let mut steps = StepProgress::start(Verbosity::Quiet);
    let (settings, mut report) = measure(args, &mut loaded, (observer, &mut steps))?;
    let threads = rayon::current_num_threads();
    let mut document = AccuracyDocument::new(&loaded, flags, &settings, threads, &mut report);
    document.command = command;
    Ok(console::format_json(&document))
}

/// Measures a scene as `render` would render it with these flags. Returns its settings, too.
fn measure(
    args: &AccuracyArgs,
    loaded: &mut LoadedScene,
    (observer, steps): (&dyn Observer, &mut StepProgress),
) -> Result<(Settings, AccuracyReport), Failure> {
    let options = plan::build_load_options(&args.changes, args.max_memory);
    let choices = RungChoices::from(&args.choices);
    let mut settings = Settings::from_scene(&loaded.scene);
    settings.integrator = args.integrator.unwrap_or(settings.integrator);
    settings.size = args.size.unwrap_or(settings.size);
    choices.apply(&mut loaded.scene, &mut settings)?;
    choices.denoise_by_default(loaded, false, &mut settings);
    settings.max_memory = Some(options.limits.memory_bytes);
    let effort = AccuracyEffort {
        budget: args.budget,
        rounds: args.rounds,
    };
    let mut tell = |label: &str, share: f64| steps.show_step(label, share);
    let measured = measure_accuracy(&loaded.scene, &settings, &effort, observer, &mut tell);
    let report = measured.map_err(|error| match error {
        MeasureError::Prepare(error) => prepare_failure(&loaded.source, error),
        error => Failure::new(
            Exit::Failed,
            format_args!("{}: {error}", loaded.source.name),
        )
        .with_hint("give a larger --budget or a smaller --size"),
    })?;
    Ok((settings, report))
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
