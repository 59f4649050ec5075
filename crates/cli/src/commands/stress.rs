//! The command `stress`: finds faults of a scene that make its picture wrong, slow or noisy, with
//! place, reason and remedy.

mod text;

use std::path::Path;
use std::time::Instant;

use raywright_core::display::Display;
use raywright_core::fault::{Fault, Severity, Subject, count_with_unit};
use raywright_core::settings::{Sampling, Settings};
use raywright_core::stress::{StressEffort, StressSummary, stress};
use raywright_io::output::{self, PictureMark, PictureMetadata};
use raywright_io::{Error, LoadedScene};
use serde_json::json;

use crate::args::{ProgressStyle, StressArgs};
use crate::console;
use crate::failure::{Exit, Failure};
use crate::observer::{Deadlines, RunObserver};
use crate::plan::{self, RungChoices};
use crate::preparation::{prepare_failure, prepare_loaded};
use crate::progress::Progress;
use crate::session::Session;
use text::StressText;

/// Version of the layout of the JSON.
const FORMAT: u32 = 2;

/// Greatest number of samples per pixel of the marked picture.
const MARKED_PICTURE_SAMPLES: u32 = 16;

/// Greatest number of paths of other subjects in an entry.
const MOST_PATHS: usize = 100;

/// Checks a scene and prints the findings. Fails if a finding is as severe as `--deny` or worse.
pub fn run(mut session: Session, args: &StressArgs) -> Result<(), Failure> {
    if let Some(path) = &args.output {
        if output::PictureFormat::from_path(path)? != output::PictureFormat::Png {
            return Err(
                Error::invalid_usage("-o writes the picture with marks only as PNG")
                    .with_hint("name a file that ends in .png")
                    .into(),
            );
        }
        session.outputs.add_output(path, "-o")?;
    }
    let options = plan::build_load_options(&args.changes, args.max_memory);
    let mut loaded = session.load_to_render(&args.scene, &options)?;
    let settings = resolve_settings(args, &mut loaded)?;
    let progress = Progress::start("checking", ProgressStyle::Auto, session.verbosity);
    let watch = RunObserver {
        progress: Some(&progress),
        ..session.start_work()
    };
    let effort = StressEffort {
        budget: args.budget,
    };
    let report = session.run(|| stress(&loaded.scene, &settings, &effort, &watch));
    progress.finish();
    let report = report.map_err(|error| prepare_failure(&loaded.source, error))?;
    if let Some(path) = &args.output {
        let watch = session.observer();
        let write = || write_marked_picture(path, (args, watch), &settings, &loaded, &report);
        session.run(write)?;
        session.verbosity.print_result_message(path.display());
    }
    let seconds = session.clock.total_seconds();
    console::print(if args.json {
        format_json(&loaded, &settings, &report, seconds)
    } else {
        let words = StressText {
            loaded: &loaded,
            report: &report,
            picture: args.output.as_deref(),
            verbosity: session.verbosity,
        };
        words.format_report(seconds)
    })?;
    fail_on_denied(&report, args.deny.into(), &loaded.source.name)
}

/// Returns an error if a finding has the denied severity or a worse one.
fn fail_on_denied(report: &StressSummary, denied: Severity, name: &str) -> Result<(), Failure> {
    let all = count_with_unit(report.findings.len() as u64, "findings");
    let findings = report.findings.iter();
    let count = findings.filter(|found| found.severity <= denied);
    let message = match (count.count(), denied) {
        (0, _) => return Ok(()),
        (count, Severity::PictureWrong) => {
            let findings = count_with_unit(count as u64, "findings");
            format!("{name}: the picture is wrong, see {findings} above")
        }
        (count, _) => format!("{name}: --deny rejects {count} of {all}"),
    };
    Err(Failure::new(Exit::Failed, message))
}

fn resolve_settings(args: &StressArgs, loaded: &mut LoadedScene) -> Result<Settings, Failure> {
    let mut settings = Settings::from_scene(&loaded.scene);
    settings.integrator = args.integrator.unwrap_or(settings.integrator);
    settings.precision = args.precision.map_or(settings.precision, Into::into);
    settings.seed = args.seed.unwrap_or(settings.seed);
    settings.max_memory = Some(plan::build_limits(args.max_memory).memory_bytes);
    RungChoices::from(&args.choices).apply(&mut loaded.scene, &mut settings)?;
    Ok(settings)
}

/// Renders the first camera's picture with few samples, and marks the positions of findings with
/// their numbers in the text.
fn write_marked_picture(
    path: &Path,
    (args, watch): (&StressArgs, RunObserver<'_>),
    settings: &Settings,
    loaded: &LoadedScene,
    report: &StressSummary,
) -> Result<(), Failure> {
    let sampling = match settings.sampling {
        Sampling::General(samples) => Sampling::General(samples.min(MARKED_PICTURE_SAMPLES)),
        pattern => pattern,
    };
    let settings = Settings {
        sampling,
        ..settings.clone()
    };
    let deadline = Instant::now().checked_add(args.budget);
    let watch = RunObserver {
        deadlines: Deadlines {
            deadline,
            ..Deadlines::default()
        },
        ..watch
    };
    let rendered = prepare_loaded(loaded, &settings, &watch)?.render(&watch);
    let findings = report.findings.iter().enumerate();
    let marks: Vec<PictureMark> = findings.filter_map(finding_mark).collect();
    let note = describe_marks(report);
    output::write_marked_picture(
        path,
        &rendered.picture,
        Display::from_render(&loaded.scene.render),
        &marks,
        &note,
        &PictureMetadata::default(),
    )?;
    Ok(())
}

fn finding_mark((index, found): (usize, &Fault)) -> Option<PictureMark> {
    let (pixel, _) = found.pixel.filter(|(_, camera)| *camera == 0)?;
    let colour = match found.severity {
        Severity::NoPicture | Severity::PictureWrong => [255, 70, 70],
        Severity::SlowOrNoisy => [255, 200, 40],
        Severity::Harmless => [120, 200, 255],
    };
    Some(PictureMark {
        pixel,
        label: (index + 1).to_string(),
        colour,
    })
}

/// Returns the report as JSON.
fn format_json(
    loaded: &LoadedScene,
    settings: &Settings,
    report: &StressSummary,
    seconds: f64,
) -> String {
    let path = |subject: Subject| subject.scene_path(&loaded.scene);
    let finding = |found: &Fault| {
        let own = path(found.subject);
        let others = found.others.iter().take(MOST_PATHS);
        json!({
            "code": found.kind,
            "severity": found.severity,
            "about": found.subject.display_name(&loaded.scene),
            "path": own,
            "position": loaded.source.format_value_position(&own),
            "others": others.map(|&subject| path(subject)).collect::<Vec<_>>(),
            "more": found.others.len(),
            "primitive": found.primitive,
            "place": found.place,
            "pixel": found.pixel.map(|(pixel, _)| pixel),
            "camera": found.pixel.map(|(_, camera)| camera),
            "count": found.count,
            "of": found.of,
            "unit": found.unit,
            "predicate": found.predicate,
            "message": found.message,
            "remedy": found.remedy,
        })
    };
    console::format_json(&json!({
        "format": FORMAT,
        "version": env!("CARGO_PKG_VERSION"),
        "scene": loaded.source.name,
        "scene_hash": loaded.hash.to_string(),
        "seed": settings.seed,
        "size": report.size,
        "solid": report.solid,
        "cameras": report.cameras,
        "findings": report.findings.iter().map(finding).collect::<Vec<_>>(),
        "left_out": report.left_out,
        "checks": report.checks,
        "warnings": loaded.warnings,
        "cut_short": report.is_cut_short(),
        "seconds": seconds,
    }))
}

/// Returns a sentence about the marks of a picture: findings without a mark, and overlapping marks.
fn describe_marks(report: &StressSummary) -> String {
    let radius = output::mark_radius(report.size);
    let (mut unmarked, mut places) = (Vec::new(), Vec::<([f64; 2], Vec<String>)>::new());
    for (index, found) in report.findings.iter().enumerate() {
        let Some(PictureMark { pixel, label, .. }) = finding_mark((index, found)) else {
            unmarked.push((index + 1).to_string());
            continue;
        };
        let is_near = |(place, _): &&mut ([f64; 2], Vec<String>)| {
            (place[0] - pixel[0]).hypot(place[1] - pixel[1]) < radius
        };
        match places.iter_mut().find(is_near) {
            Some((_, labels)) => labels.push(label),
            None => places.push((pixel, vec![label])),
        }
    }
    let mut text = match (report.findings.is_empty(), unmarked.is_empty()) {
        (true, _) => "nothing to mark".to_owned(),
        (_, true) => "a mark at each finding".to_owned(),
        (_, false) => format!(
            "no mark for {}, whose positions the first camera does not see",
            unmarked.join(", ")
        ),
    };
    for (_, labels) in places.iter().filter(|(_, labels)| labels.len() > 1) {
        text += &format!("; {} lie over each other", labels.join(", "));
    }
    text
}
