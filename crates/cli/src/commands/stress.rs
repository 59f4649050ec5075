//! The command `stress`: finds faults of a scene that make its picture wrong, slow or noisy, with
//! place, reason and remedy.

use std::path::Path;
use std::time::Instant;

use raywright_core::display::Display;
use raywright_core::fault::{Fault, Severity, Subject, count_with_unit, format_decimal};
use raywright_core::settings::{Sampling, Settings};
use raywright_core::stress::{CheckRun, StressEffort, StressSummary, stress};
use raywright_io::output::{self, PictureMark, PictureMetadata};
use raywright_io::{Error, LoadedScene};
use serde_json::json;

use crate::args::{ProgressStyle, StressArgs};
use crate::console::{self, Verbosity, mask_to_one_line};
use crate::failure::{Exit, Failure};
use crate::plan::{self, RungChoices};
use crate::preparation::{prepare_failure, prepare_loaded};
use crate::progress::{Deadlines, Progress, RunObserver};
use crate::session::Session;
use crate::table::{wrap_paragraph, wrap_text};

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
    let options = plan::build_load_options(&args.changes, args.limits.max_memory);
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
    fail_on_denied(&report, args.deny, &loaded.source.name)
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
    settings.precision = args.precision.unwrap_or(settings.precision);
    settings.seed = args.seed.unwrap_or(settings.seed);
    settings.max_memory = Some(plan::build_limits(args.limits.max_memory).memory_bytes);
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

// Text output of `stress`.

/// Formatter of the text report.
struct StressText<'a> {
    pub loaded: &'a LoadedScene,
    pub report: &'a StressSummary,
    /// Path of the picture with marks, if it was written.
    pub picture: Option<&'a Path>,
    pub verbosity: Verbosity,
}

impl StressText<'_> {
    /// Returns the whole report: the findings with their numbers, worst first, and the work of the
    /// checks.
    pub fn format_report(&self, seconds: f64) -> String {
        let (name, report) = (mask_to_one_line(&self.loaded.source.name), self.report);
        let mut text = wrap_paragraph(&format!("{name}: {}", self.summarise())) + "\n";
        let mut severity = None;
        for (index, found) in report.findings.iter().enumerate() {
            if severity.replace(found.severity) != Some(found.severity) {
                text += &format!("\n{}\n", found.severity.description());
            }
            text += &self.format_finding(index + 1, found);
        }
        let more = count_with_unit(report.left_out as u64, "findings");
        let more = format!("and {more} more of the same kinds");
        let picture = self.picture.map(Path::display);
        let marks = picture.map(|picture| format!("{picture}: {}", describe_marks(report)));
        let solid = report.solid.as_ref();
        let paragraphs = [
            solid.map(|solid| format!("closed: {solid}")),
            (report.left_out > 0).then_some(more),
            marks,
            Some(describe_checks(report, seconds)),
        ];
        for paragraph in paragraphs.iter().flatten() {
            text += &format!("\n{}\n", wrap_paragraph(paragraph));
        }
        text
    }

    /// Returns the number of findings, the worst severity and the number of reading warnings.
    fn summarise(&self) -> String {
        let findings = match self.report.worst_severity() {
            None => "no faults found".to_owned(),
            Some(worst) => format!(
                "{}, the worst: {}",
                count_with_unit(self.report.findings.len() as u64, "findings"),
                worst.description()
            ),
        };
        let is_warning = |warning: &&Fault| warning.severity < Severity::Harmless;
        let count = self.loaded.warnings.iter().filter(is_warning).count();
        if count == 0 {
            return findings;
        }
        let warnings = count_with_unit(count as u64, "warnings");
        let place = match self.verbosity {
            Verbosity::Quiet => " left out by -q",
            Verbosity::Normal if count > 1 => ", the worst of them above (all: -v)",
            Verbosity::Normal | Verbosity::Verbose => " above",
        };
        format!("{findings}; {warnings} of reading the file{place}")
    }

    /// Returns the text of a finding: subject and code, place, reason, count and remedy. One that is
    /// harmless takes a line with its count, unless `-v` asks for more.
    fn format_finding(&self, number: usize, found: &Fault) -> String {
        const INDENT: usize = 6;
        let room = console::line_width().unwrap_or(usize::MAX);
        let mut lines = vec![format!(
            "{} - {}",
            found.subject_names(&self.loaded.scene),
            found.kind.name()
        )];
        let count = found.count_text().unwrap_or_default();
        if found.severity < Severity::Harmless || self.verbosity == Verbosity::Verbose {
            let (place, reason) = (self.format_location(found), found.message.clone());
            lines.extend([place, reason, count, format!("do: {}", found.remedy)]);
        } else if !count.is_empty() {
            lines[0] += &format!(": {count}");
        }
        let lines = lines.iter().filter(|line| !line.is_empty());
        let wrapped = lines.map(|line| wrap_text(&mask_to_one_line(line), INDENT, room));
        let text = wrapped
            .collect::<Vec<_>>()
            .join(&format!("\n{:INDENT$}", ""));
        format!("{number:>4}  {text}\n")
    }

    /// Returns the place of a finding: in the file, in the mesh, in the world and in the picture.
    fn format_location(&self, found: &Fault) -> String {
        let path = found.subject.scene_path(&self.loaded.scene);
        let in_file = || self.loaded.source.format_value_position(&path);
        let pixel = match (found.place, found.pixel) {
            (_, Some(([x, y], 0))) => Some(format!("pixel {x:.0},{y:.0}")),
            (_, Some(([x, y], camera))) => {
                Some(format!("pixel {x:.0},{y:.0} of cameras[{camera}]"))
            }
            (Some(_), None) => Some("seen by no camera".to_owned()),
            (None, None) => None,
        };
        let places = [
            (!path.is_empty()).then(in_file),
            found.primitive.map(|index| format!("triangle {index}")),
            found.place.map(format_position),
            pixel,
        ];
        places.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

/// Returns a position as text. Coordinates within the rounding error of zero are written as 0.
fn format_position(place: [f64; 3]) -> String {
    let greatest = place
        .iter()
        .fold(0.0_f64, |maximum, x| maximum.max(x.abs()));
    let rounded = |x: f64| if x.abs() < 1e-12 * greatest { 0.0 } else { x };
    let [x, y, z] = place.map(|x| format_decimal(rounded(x)));
    format!("at ({x}, {y}, {z}) metres")
}

/// Returns a sentence about the work of the checks, complete or not.
fn describe_checks(report: &StressSummary, seconds: f64) -> String {
    let run = |run: &CheckRun| {
        let what = match run.name {
            "furnaces" => "energy of materials",
            "samples" => "samples of small pictures",
            name => name,
        };
        match run.is_cut_short() {
            true => format!("{what} ({} of {})", run.looked_at, run.planned),
            false => format!("{what} ({})", run.looked_at),
        }
    };
    let mut message = format!(
        "checked in {}: meshes, images, materials, lights",
        raywright_io::report::format_duration(seconds)
    );
    // Where there is nothing to measure, nothing is said.
    for check in report.checks.iter().filter(|run| run.planned > 0) {
        message += &format!(", {}", run(check));
    }
    let [through, total] = report.cameras;
    if through == 0 {
        message += "; no rays were traced";
    } else if through < total {
        message += &format!(
            "; rays were traced only from the first {through} of {}",
            count_with_unit(total as u64, "cameras")
        );
    }
    let has_pixel = |found: &Fault| found.pixel.is_some();
    if report.findings.iter().any(has_pixel) {
        let [width, height] = report.size;
        message += &format!("; pixels are those of a picture of {width} x {height}");
    }
    if report.is_cut_short() {
        message += "; the time ran out before all rays were traced: a larger --budget finds more";
    }
    message
}
