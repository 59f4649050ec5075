//! Text output of `stress`.

use std::path::Path;

use raywright_core::fault::{Fault, Severity, count_with_unit, format_decimal};
use raywright_core::stress::{CheckRun, StressSummary};
use raywright_io::LoadedScene;

use super::describe_marks;
use crate::console::{self, Verbosity, mask_to_one_line};
use crate::table::{wrap_paragraph, wrap_text};

/// Formatter of the text report.
pub(super) struct StressText<'a> {
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
