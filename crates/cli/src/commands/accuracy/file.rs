//! Files of `accuracy`: JSON or a page, with everything needed to judge and to repeat
//! the measurement.

use raywright_core::Settings;
use raywright_core::accuracy::AccuracyReport;
use raywright_core::bench::clock::CLOCK_NAME;
use raywright_core::display::Display;
use raywright_io::LoadedScene;
use raywright_io::report::{
    AccuracyPage, format_count, format_duration, format_significant_digits,
};
use serde::Serialize;

use super::recommendation::{RenderCommand, format_recommendation};
use crate::console;
use crate::machine::processor_name;
use crate::origin::command_line;

/// Version of the layout of [`AccuracyDocument`]. Since version 8, ladders without effect on the scene
/// are left to `explain`. Since version 7, `settings` holds each measured
/// setting once, and `frontier` and `recommendations` are rows of it; ladders that change no picture,
/// output formats and effects are left to `bench`, the documentation and `explain --measure`. Since
/// version 6, keys are nouns (`recommendations`, `sufficient_budget`).
const FORMAT: u32 = 8;

/// Function that formats the report as the content of a file.
pub type FileFormat = fn(&AccuracyDocument<'_>) -> String;

/// Formats of files, each with the extension that selects it.
pub const FORMATS: [(&str, FileFormat); 2] = [
    ("html", |document| document.page.to_html()),
    ("json", |document| console::format_json(document)),
];

/// Report of a measurement, with its scene, its machine and its commands.
#[derive(Debug, Serialize)]
pub struct AccuracyDocument<'a> {
    /// Version of the layout of this structure.
    format: u32,
    /// Version of the program.
    version: &'static str,
    /// Name of the scene's file or preset.
    scene: &'a str,
    /// Hash of the scene's content.
    scene_hash: String,
    /// Command line of the measurement.
    pub command: String,
    /// Name of the processor; `None` where the system does not report it.
    processor: Option<String>,
    /// Number of render threads.
    threads: usize,
    /// Name of the clock that measured the times.
    clock: &'static str,
    /// Content of the page, whose sections the terminal shows too.
    #[serde(skip)]
    pub page: AccuracyPage<'a>,
    /// The measured errors and times.
    #[serde(flatten)]
    report: &'a AccuracyReport,
}

impl<'a> AccuracyDocument<'a> {
    /// Combines a report with the scene, the flags of the measurement and the machine.
    pub fn new(
        loaded: &'a LoadedScene,
        requested: &[String],
        settings: &Settings,
        threads: usize,
        report: &'a AccuracyReport,
    ) -> Self {
        let processor = processor_name();
        let clock = match CLOCK_NAME {
            "thread CPU time" => "CPU time of all threads",
            other => other,
        };
        let is_model = loaded.source.format.is_model();
        let command = RenderCommand::new(&loaded.source.name, is_model, requested, settings);
        let rows = report.settings.iter();
        let flags = rows.map(|row| match command.format_flags(&row.setting) {
            flags if flags.is_empty() => "as it is".to_owned(),
            flags => flags,
        });
        let scene = &loaded.source.name;
        Self {
            page: AccuracyPage {
                scene,
                circumstances: describe_conditions(processor.as_deref(), threads, clock, report),
                command: command_line(),
                report,
                recommendation: format_recommendation(report, &command),
                flags: flags.collect(),
                own_command: command.base,
                display: Display::from_render(&loaded.scene.render),
            },
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            scene,
            scene_hash: loaded.hash.to_string(),
            command: command_line(),
            processor,
            threads,
            clock,
            report,
        }
    }
}

/// Describes the conditions of the measurement in sentences: the size, the machine and the
/// reference, and whether the time was too short for some measurements.
fn describe_conditions(
    processor: Option<&str>,
    threads: usize,
    clock: &str,
    report: &AccuracyReport,
) -> Vec<String> {
    let ([width, height], tiles) = (report.size, &report.tiles);
    let machine = processor
        .map(|name| format!("{name}, "))
        .unwrap_or_default();
    let reference = &report.reference;
    let measured = match tiles.measured {
        total if total >= tiles.all => "the whole picture".to_owned(),
        total => format!(
            "noise by the errors that whole pictures state, and rungs on {total} of the picture's {} tiles of {edge}x{edge} pixels",
            tiles.all,
            edge = tiles.edge
        ),
    };
    let threads = format_count(threads, "thread");
    let cut = if report.cut_short {
        "; the time ended before all settings were measured: give a larger --budget"
    } else {
        ""
    };
    vec![
        format!("measured at the size of the render, {width}x{height} pixels: {measured}"),
        format!(
            "{machine}{threads}; times are {clock} without preparation; intervals have 95 % confidence"
        ),
        format!(
            "reference picture, for bias and light: double precision (f64), the most exact rung of every ladder that is fast enough, {} samples a pixel; its own error {} is noise, which is subtracted",
            reference.samples,
            format_significant_digits(reference.error, 2),
        ),
        format!("measured in {}{cut}", format_duration(report.seconds)),
    ]
}
