//! `stress`: what of a scene makes its picture wrong or noisy, with place, reason and remedy.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use raywright_core::display::Display;
use raywright_core::settings::{Sampling, Settings};
use raywright_core::stress::{Effort, Finding, Report, Severity, stress};
use raywright_io::output::{self, Mark, Metadata};
use raywright_io::{Error, Loaded, Warning};
use serde::Serialize;

use crate::args::StressArgs;
use crate::console::{self, Verbosity, on_one_line};
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::plan::{self, Choices};
use crate::progress::Progress;
use crate::ready::{failed, prepared};
use crate::table::{paragraph, wrapped};
use crate::targets::Outputs;
use crate::threads::Threads;
use crate::watch::{Patience, Watch};
use crate::{args, interrupt, scene_input};

/// Version of the layout of [`StressReport`].
const FORMAT: u32 = 1;

/// Samples of a pixel of the picture in which places are marked.
const SAMPLES: u32 = 16;

/// What is found, for other programs.
#[derive(Serialize)]
struct StressReport<'a> {
    format: u32,
    version: &'static str,
    scene: &'a str,
    scene_hash: String,
    seed: u64,
    size: [u32; 2],
    cameras: [usize; 2],
    findings: Vec<Entry>,
    left_out: usize,
    checks: Vec<CheckEntry>,
    warnings: &'a [Warning],
    cut_short: bool,
    seconds: f64,
}

/// A finding in words.
#[derive(Serialize)]
struct Entry {
    code: &'static str,
    severity: Severity,
    /// What it is about.
    about: String,
    /// Path in the scene, and where that is in its file.
    path: String,
    #[serde(rename = "in")]
    at: String,
    primitive: Option<u32>,
    place: Option<[f64; 3]>,
    pixel: Option<[f64; 2]>,
    camera: Option<usize>,
    count: u64,
    of: u64,
    unit: &'static str,
    why: String,
    remedy: String,
}

#[derive(Serialize)]
struct CheckEntry {
    name: &'static str,
    unit: &'static str,
    looked_at: u64,
    planned: u64,
}

/// Checks a scene and prints what was found; fails where that is as bad as what is denied.
pub fn run(args: &StressArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let start = Instant::now();
    let mut outputs = Outputs::default();
    if let Some(path) = &args.output {
        if output::Format::of(path)? != output::Format::Png {
            return Err(Error::usage("marks are drawn into a PNG")
                .with_hint("name a file that ends in .png")
                .into());
        }
        outputs.add(path, "-o")?;
    }
    let threads = Threads::new(args.threads)?;
    let (mut notes, options) = (
        Notes::new(verbosity),
        plan::options(&args.changes, args.max_memory),
    );
    let mut loaded = threads.run(|| scene_input::read(&args.scene, &options, &mut notes))?;
    outputs.keep_clear_of(&loaded.inputs)?;
    scene_input::note_completed(&loaded, &mut notes);
    notes.finish();
    let settings = settings(args, &mut loaded)?;
    let stop = interrupt::flag()?;
    let progress = Progress::start("checking", args::ProgressStyle::Auto, verbosity);
    let watch = Watch {
        progress: Some(&progress),
        ..Watch::until(stop)
    };
    let report = threads.run(|| {
        stress(
            &loaded.scene,
            &settings,
            &Effort {
                budget: args.budget,
            },
            &watch,
        )
    });
    progress.finish();
    let report = report.map_err(|error| failed(&loaded.source, error))?;
    if let Some(path) = &args.output {
        threads.run(|| mark(path, (args, stop), &settings, &loaded, &report))?;
        verbosity.say(path.display());
    }
    let seconds = start.elapsed().as_secs_f64();
    console::print(if args.json {
        json(&loaded, &settings, &report, seconds)
    } else {
        text(&loaded, &report, seconds)
    })?;
    ending(&report, args.deny.into(), &loaded.source.name)
}

/// How a run ends with these findings where some are denied.
fn ending(report: &Report, denied: Severity, name: &str) -> Result<(), Failure> {
    let all = report.findings.len();
    let count = report
        .findings
        .iter()
        .filter(|found| found.severity <= denied)
        .count();
    match (count, denied) {
        (0, _) => Ok(()),
        (_, Severity::PictureWrong) => Err(Failure::new(
            Exit::Failed,
            format_args!("{name}: the picture is wrong, see {}", findings(count)),
        )),
        _ => Err(Failure::new(
            Exit::Failed,
            format_args!("{name}: {count} of {} are denied", findings(all)),
        )),
    }
}

fn settings(args: &StressArgs, loaded: &mut Loaded) -> Result<Settings, Failure> {
    let mut settings = Settings::of(&loaded.scene);
    settings.integrator = args.integrator.unwrap_or(settings.integrator);
    settings.precision = args.precision.map_or(settings.precision, Into::into);
    settings.seed = args.seed.unwrap_or(settings.seed);
    settings.max_memory = Some(plan::limits(args.max_memory).memory_bytes);
    Choices::from(&args.choices).apply(&mut loaded.scene, &mut settings)?;
    Ok(settings)
}

fn findings(count: usize) -> String {
    if count == 1 {
        "1 finding".to_owned()
    } else {
        format!("{count} findings")
    }
}

/// Renders the first camera's picture with few samples and marks the places that are in it by their
/// numbers in the text.
fn mark(
    path: &Path,
    (args, stop): (&StressArgs, &AtomicBool),
    settings: &Settings,
    loaded: &Loaded,
    report: &Report,
) -> Result<(), Failure> {
    let sampling = match settings.sampling {
        Sampling::General(samples) => Sampling::General(samples.min(SAMPLES)),
        pattern => pattern,
    };
    let settings = Settings {
        sampling,
        ..settings.clone()
    };
    let deadline = Instant::now().checked_add(args.budget);
    let watch = Watch {
        patience: Patience {
            deadline,
            ..Patience::default()
        },
        ..Watch::until(stop)
    };
    let rendered = prepared(loaded, &settings, &watch)?.render(&watch);
    let marks: Vec<Mark> = report
        .findings
        .iter()
        .enumerate()
        .filter_map(|(index, found)| mark_of(index, found))
        .collect();
    output::write_marked(
        path,
        &rendered.picture,
        Display::of(&loaded.scene.render),
        &marks,
        &Metadata::default(),
    )?;
    Ok(())
}

fn mark_of(index: usize, found: &Finding) -> Option<Mark> {
    let (pixel, _) = found.pixel.filter(|(_, camera)| *camera == 0)?;
    let colour = match found.severity {
        Severity::PictureWrong => [255, 70, 70],
        Severity::SlowOrNoisy => [255, 200, 40],
        Severity::Harmless => [120, 200, 255],
    };
    Some(Mark {
        pixel,
        label: (index + 1).to_string(),
        colour,
    })
}

fn json(loaded: &Loaded, settings: &Settings, report: &Report, seconds: f64) -> String {
    let entry = |found: &Finding| {
        let path = found.subject.path(&loaded.scene);
        Entry {
            code: found.code.name(),
            severity: found.severity,
            about: found.subject.words(&loaded.scene),
            at: loaded.source.locate(&path),
            path,
            primitive: found.primitive,
            place: found.place,
            pixel: found.pixel.map(|(pixel, _)| pixel),
            camera: found.pixel.map(|(_, camera)| camera),
            count: found.count,
            of: found.of,
            unit: found.unit,
            why: found.why.clone(),
            remedy: found.remedy.clone(),
        }
    };
    let check = |run: &raywright_core::stress::CheckRun| CheckEntry {
        name: run.name,
        unit: run.unit,
        looked_at: run.looked_at,
        planned: run.planned,
    };
    console::json(&StressReport {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION"),
        scene: &loaded.source.name,
        scene_hash: loaded.hash.to_string(),
        seed: settings.seed,
        size: report.size,
        cameras: report.cameras,
        findings: report.findings.iter().map(entry).collect(),
        left_out: report.left_out,
        checks: report.checks.iter().map(check).collect(),
        warnings: &loaded.warnings,
        cut_short: report.is_cut(),
        seconds,
    })
}

/// The worst first, each with its number.
fn text(loaded: &Loaded, report: &Report, seconds: f64) -> String {
    let worst = report.worst().map_or_else(
        || "nothing found".to_owned(),
        |worst| {
            format!(
                "{}, the worst: {}",
                findings(report.findings.len()),
                worst.words()
            )
        },
    );
    let mut text = format!(
        "{}\n",
        paragraph(&format!("{}: {worst}", on_one_line(&loaded.source.name)))
    );
    for severity in Severity::ALL {
        let of = report
            .findings
            .iter()
            .enumerate()
            .filter(|(_, found)| found.severity == severity);
        for (position, (index, found)) in of.enumerate() {
            if position == 0 {
                text += &format!("\n{}\n", severity.words());
            }
            text += &lines(index + 1, found, loaded);
        }
    }
    if report.left_out > 0 {
        text += &format!(
            "\n{}\n",
            paragraph(&format!(
                "and {} more of the same kinds",
                findings(report.left_out)
            ))
        );
    }
    text + &format!("\n{}\n", paragraph(&looked_at(report, seconds)))
}

/// A finding: what and where, then why and what to do.
fn lines(number: usize, found: &Finding, loaded: &Loaded) -> String {
    const INDENT: usize = 6;
    let room = console::width().unwrap_or(usize::MAX);
    let path = found.subject.path(&loaded.scene);
    let mut places = Vec::new();
    if !path.is_empty() {
        places.push(loaded.source.locate(&path));
    }
    places.extend(
        found
            .primitive
            .map(|primitive| format!("triangle {primitive}")),
    );
    places.extend(
        found
            .place
            .map(|[x, y, z]| format!("at ({x:.4}, {y:.4}, {z:.4})")),
    );
    places.extend(
        found
            .pixel
            .map(|([x, y], _)| format!("pixel {x:.0},{y:.0}")),
    );
    let count = match (found.unit, found.of) {
        ("", _) => String::new(),
        (unit, 0) => format!(": {} {unit}", found.count),
        (unit, of) => format!(": {} of {of} {unit}", found.count),
    };
    let head = format!(
        "{} - {}{count}",
        found.subject.words(&loaded.scene),
        found.code.name()
    );
    let mut text = format!(
        "{number:>4}  {}\n",
        wrapped(&on_one_line(&head), INDENT, room)
    );
    let lines = [
        places.join(", "),
        found.why.clone(),
        format!("do: {}", found.remedy),
    ];
    for line in lines.iter().filter(|line| !line.is_empty()) {
        text += &format!(
            "{:INDENT$}{}\n",
            "",
            wrapped(&on_one_line(line), INDENT, room)
        );
    }
    text
}

/// What was looked at, and what not.
fn looked_at(report: &Report, seconds: f64) -> String {
    let run = |run: &raywright_core::stress::CheckRun| match run.is_cut() {
        true => format!(
            "{} ({} of {} {})",
            run.name, run.looked_at, run.planned, run.unit
        ),
        false => format!("{} ({} {})", run.name, run.looked_at, run.unit),
    };
    let checks: Vec<String> = report.checks.iter().map(run).collect();
    let mut said = format!(
        "looked at in {}: meshes, images, materials, lights",
        crate::clock::spoken(seconds)
    );
    checks
        .iter()
        .for_each(|check| said += &format!(", {check}"));
    let [through, of] = report.cameras;
    if through < of {
        said += &format!("; through {through} of {of} cameras");
    }
    if report.is_cut() {
        said += "; the time was over before all rays were sent: a larger --budget finds more";
    }
    said
}
