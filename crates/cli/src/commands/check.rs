//! `check`: whether files can be rendered, and everything that stands in the way if not. Who names no precision renders in the
//! default one, so that what its numbers lose is a problem here too.

use raywright_core::{Settings, collapsed, extent};
use raywright_io::Loaded;
use serde::Serialize;

use crate::args::CheckArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::{plan, scene_input};

/// Version of the layout of [`Checked`].
const FORMAT: u32 = 1;

/// What is found in all files.
#[derive(Serialize)]
struct CheckReport {
    format: u32,
    files: Vec<Checked>,
}

/// What is found in a file.
#[derive(Serialize)]
struct Checked {
    file: String,
    /// Whether it can be rendered, and has no warnings where these count.
    ok: bool,
    /// The exit code that a check of this file alone has.
    code: u8,
    /// What stands in the way of a picture.
    error: Option<String>,
    warnings: Vec<String>,
}

/// Reads and validates each file; the exit code is that of the first one that is not right.
pub fn run(args: &CheckArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let mut report = CheckReport { format: FORMAT, files: Vec::new() };
    let mut first = None;
    for name in &args.scenes {
        let options = plan::options(&args.changes, None);
        let loaded = scene_input::read(name, &options, &mut Notes::new(Verbosity::Quiet)).and_then(right);
        let (checked, failure) = judged(name.to_string_lossy().into_owned(), loaded, args.deny_warnings);
        if !args.json {
            tell(&checked, failure.as_ref().filter(|_| args.scenes.len() > 1), verbosity)?;
        }
        first = first.or(failure);
        report.files.push(checked);
    }
    if args.json {
        console::print(console::json(&report))?;
    }
    match first {
        None => Ok(()),
        Some(failure) if args.scenes.len() == 1 => Err(failure),
        Some(failure) => {
            let wrong = report.files.iter().filter(|checked| !checked.ok).count();
            Err(Failure::new(failure.exit, format_args!("{wrong} of {} files are not right", report.files.len())))
        }
    }
}

/// The scene, unless the default precision loses a part of it.
fn right(loaded: Loaded) -> Result<Loaded, Failure> {
    let lost = collapsed(&loaded.scene, Settings::of(&loaded.scene).precision);
    if lost.is_empty() { Ok(loaded) } else { Err(loaded.source.error(lost).into()) }
}

/// What is said of a file, and how a check of it alone ends.
fn judged(file: String, loaded: Result<Loaded, Failure>, deny_warnings: bool) -> (Checked, Option<Failure>) {
    let loaded = match loaded {
        Ok(loaded) => loaded,
        Err(failure) => {
            let message = failure.message.trim_end();
            let error = Some(message.strip_prefix("error: ").unwrap_or(message).to_owned());
            return (Checked { file, ok: false, code: failure.exit as u8, error, warnings: Vec::new() }, Some(failure));
        }
    };
    let mut warnings: Vec<String> = loaded.warnings.iter().map(|warning| warning.message.clone()).collect();
    if shows_nothing(&loaded) {
        warnings.push(format!("{}: there is nothing to see: it has no object", loaded.source.name));
    }
    let denied = deny_warnings && !warnings.is_empty();
    let failure = denied.then(|| {
        let found = counted(warnings.len());
        Failure::new(Exit::Input, format_args!("{}: {found}, and --deny-warnings allows none", loaded.source.name))
    });
    let code = failure.as_ref().map_or(Exit::Done, |failure| failure.exit) as u8;
    (Checked { file: loaded.source.name, ok: !denied, code, error: None, warnings }, failure)
}

/// Whether no ray could meet anything: neither what has an end nor an infinite plane.
fn shows_nothing(loaded: &Loaded) -> bool {
    let scene = &loaded.scene;
    let listed = scene.objects.is_empty() && scene.generators.is_empty();
    let extent = extent(scene, Settings::of(scene).precision);
    listed || extent.bounds.is_empty() && extent.unbounded == 0
}

fn counted(warnings: usize) -> String {
    if warnings == 1 { "1 warning".to_owned() } else { format!("{warnings} warnings") }
}

/// A line on standard output for a file that is right; the rest goes to standard error, errors of several files one by one.
fn tell(checked: &Checked, failure: Option<&Failure>, verbosity: Verbosity) -> Result<(), Failure> {
    checked.warnings.iter().for_each(|warning| verbosity.warn(warning));
    if let Some(failure) = failure {
        console::tell(failure.message.trim_end());
    }
    if !checked.ok {
        return Ok(());
    }
    let warnings = match checked.warnings.len() {
        0 => String::new(),
        n => format!(", {}", counted(n)),
    };
    console::print(format!("{}: ok{warnings}\n", checked.file))
}
