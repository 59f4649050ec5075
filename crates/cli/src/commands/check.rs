//! `check`: whether files can be rendered, and every problem that prevents a picture. The check
//! uses the default precision, so that coordinates that this precision loses are problems too.

use raywright_core::fault::{Fault, FaultKind, Severity};
use raywright_core::{Settings, find_collapsed_objects};
use raywright_io::LoadedScene;
use raywright_io::report::format_count;
use serde::Serialize;

use crate::args::CheckArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::session::Session;
use crate::{plan, scene_input};

/// Version of the layout of [`CheckedFile`].
const FORMAT: u32 = 3;

/// Report of `check`: the results for all files.
#[derive(Serialize)]
struct CheckReport {
    format: u32,
    files: Vec<CheckedFile>,
}

/// Result of the check of a file.
#[derive(Serialize)]
struct CheckedFile {
    file: String,
    /// Whether the file can be rendered and, with `--deny-warnings`, has no denied warning.
    ok: bool,
    /// Exit code that a check of this file alone has.
    code: u8,
    /// Message of the problem that prevents a picture, if any.
    error: Option<String>,
    warnings: Vec<Fault>,
}

/// Runs `check`: loads and validates each file. The exit code is the code of the first file with a
/// problem.
pub fn run(mut session: Session, args: &CheckArgs) -> Result<(), Failure> {
    // The warnings are a part of the result.
    session.notes = Notes::new(Verbosity::Quiet);
    let options = plan::build_load_options(&args.changes, None);
    let mut report = CheckReport {
        format: FORMAT,
        files: Vec::new(),
    };
    let mut first = None;
    for name in &args.scenes {
        let loaded = session
            .load(name, &options)
            .and_then(refuse_collapsed_shapes);
        let (checked, failure) = check_load_result(&name.to_string_lossy(), loaded, args);
        if !args.json {
            let printed = failure.as_ref().filter(|_| args.scenes.len() > 1);
            print_result(&checked, printed, session.verbosity)?;
        }
        first = first.or(failure);
        report.files.push(checked);
    }
    if args.json {
        console::print(console::format_json(&report))?;
    }
    match first {
        None => Ok(()),
        Some(failure) if args.scenes.len() == 1 => Err(failure),
        Some(failure) => {
            let wrong = report.files.iter().filter(|checked| !checked.ok).count();
            Err(Failure::new(
                failure.exit,
                format_args!(
                    "{wrong} of {} files have problems (see the messages above)",
                    report.files.len()
                ),
            ))
        }
    }
}

/// Refuses a scene of which the default precision loses a part, such as triangles far from the
/// origin.
fn refuse_collapsed_shapes(loaded: LoadedScene) -> Result<LoadedScene, Failure> {
    let lost = find_collapsed_objects(&loaded.scene, Settings::from_scene(&loaded.scene).precision);
    if lost.is_empty() {
        Ok(loaded)
    } else {
        Err(loaded.source.error_at_problems(lost).into())
    }
}

/// Converts the result of loading a file to its entry in the report, and to the failure with which
/// a check of this file alone ends.
fn check_load_result(
    name: &str,
    loaded: Result<LoadedScene, Failure>,
    args: &CheckArgs,
) -> (CheckedFile, Option<Failure>) {
    let (file, warnings, error, failure) = match loaded {
        Ok(loaded) => {
            let (warnings, name) = (list_warnings(&loaded), loaded.source.name);
            let failure = deny_warnings(&name, &warnings, args);
            (name, warnings, None, failure)
        }
        Err(failure) => {
            let message = failure.message.trim_end();
            let error = message
                .strip_prefix("error: ")
                .unwrap_or(message)
                .to_owned();
            (name.to_owned(), Vec::new(), Some(error), Some(failure))
        }
    };
    let checked = CheckedFile {
        file,
        ok: failure.is_none(),
        code: failure.as_ref().map_or(Exit::Done, |failure| failure.exit) as u8,
        error,
        warnings,
    };
    (checked, failure)
}

/// Returns the warnings about a scene, the most severe first, among them the warning about a scene
/// without objects.
fn list_warnings(loaded: &LoadedScene) -> Vec<Fault> {
    let mut warnings = loaded.warnings.clone();
    if scene_input::is_empty_scene(loaded)
        && !warnings
            .iter()
            .any(|warning| warning.kind == FaultKind::NothingSeen)
    {
        let message = "there is nothing to see: the scene has no object";
        warnings.push(FaultKind::NothingSeen.in_file(&loaded.source.name, message));
    }
    warnings.sort_by_key(|warning| (warning.severity, warning.kind));
    warnings
}

/// Returns the failure of `--deny-warnings` for a file; `None` if every warning is allowed.
fn deny_warnings(name: &str, warnings: &[Fault], args: &CheckArgs) -> Option<Failure> {
    // Notes report automatic choices, which `--deny-warnings` does not deny.
    let denied = warnings
        .iter()
        .filter(|warning| {
            warning.severity < Severity::Harmless && !args.allow.contains(&warning.kind)
        })
        .count();
    (args.deny_warnings && denied > 0).then(|| {
        let found = format_count(denied, "warning");
        Failure::new(
            Exit::Input,
            format_args!("{name}: {found}, and --deny-warnings allows none; correct the file, or permit a warning by its code: --allow CODE"),
        )
    })
}

/// Prints the result for a file: a line on standard output for a file without problems, warnings on
/// standard error, and the failure, if given, on standard error too.
fn print_result(
    checked: &CheckedFile,
    failure: Option<&Failure>,
    verbosity: Verbosity,
) -> Result<(), Failure> {
    for warning in &checked.warnings {
        let message = format_args!("{warning} [{}]", warning.kind.name());
        if warning.severity == Severity::Harmless {
            verbosity.print_note(message)
        } else {
            verbosity.print_warning(message)
        }
    }
    if let Some(failure) = failure {
        console::print_message(failure.message.trim_end());
    }
    if !checked.ok {
        return Ok(());
    }
    let notes = checked
        .warnings
        .iter()
        .filter(|warning| warning.severity == Severity::Harmless)
        .count();
    let counts = [(checked.warnings.len() - notes, "warning"), (notes, "note")]
        .into_iter()
        .filter(|(n, _)| *n > 0);
    let counts: String = counts
        .map(|(n, label)| format!(", {}", format_count(n, label)))
        .collect();
    console::print(format!("{}: ok{counts}\n", checked.file))
}
