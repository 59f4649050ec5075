//! Files of `accuracy`: JSON, CSV, a page or a plot, with everything needed to judge and to repeat
//! the measurement.

use raywright_core::Settings;
use raywright_core::accuracy::AccuracyReport;
use raywright_core::bench::clock::CLOCK_NAME;
use raywright_core::display::Display;
use raywright_core::effects::assess_effects;
use raywright_io::LoadedScene;
use raywright_io::report::{
    AccuracyPage, format_count, format_duration, format_significant_digits,
};
use serde::Serialize;

use super::csv::format_csv;
use super::recommendation::{RenderCommand, format_recommendation};
use crate::console;
use crate::machine::processor_name;
use crate::origin::command_line;

/// Version of the layout of [`AccuracyDocument`]. Since version 6, keys are nouns
/// (`recommendations`, `cost`, `sufficient_budget`, `inapplicable`, `reused`), and `ladders` holds
/// those that change no picture, too. Since version 5, intervals state whether they are
/// `known`, and rungs are figures of the setting in use, without `base`, `flip` and `own_error`.
/// Since version 4, all errors are roots of mean squares.
const FORMAT: u32 = 6;

/// Content of an output file of `accuracy`, selected by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccuracyFileKind {
    /// The whole report as JSON.
    Json,
    /// Comma-separated values: a line for each rung (quality level of a setting), effect and
    /// combination of rungs.
    Csv,
    /// An HTML page with plot, tables and pictures.
    Html,
    /// The plot of error against time.
    Svg,
}

impl AccuracyFileKind {
    /// Kinds of files, each with the extension that selects it.
    pub const ALL: [(&'static str, Self); 4] = [
        ("html", Self::Html),
        ("csv", Self::Csv),
        ("json", Self::Json),
        ("svg", Self::Svg),
    ];
}

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
    /// Commands, each of which renders with a setting on the Pareto frontier.
    commands: Vec<String>,
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
        let command = RenderCommand::new(
            &loaded.source.name,
            loaded.source.format.is_model(),
            requested,
        );
        let format_flags = |flags: &[String]| match command.format_flags(flags) {
            flags if flags.is_empty() => "as it is".to_owned(),
            flags => flags,
        };
        let details = report.pictures.details.iter();
        let details = details.map(|detail| match detail.measured {
            Some(_) if detail.flags.is_empty() => "in use".to_owned(),
            Some(_) => format_flags(&detail.flags),
            None => "reference".to_owned(),
        });
        let frontier = report.frontier.iter();
        let scene = &loaded.source.name;
        Self {
            commands: frontier
                .clone()
                .map(|of| format!("{} {}", command.base, command.format_flags(&of.flags)))
                .map(|command| command.trim_end().to_owned())
                .collect(),
            page: AccuracyPage {
                scene,
                circumstances: describe_conditions(processor.as_deref(), threads, clock, report),
                command: command_line(),
                report,
                recommendation: format_recommendation(report, &command),
                flags: frontier.map(|of| format_flags(&of.flags)).collect(),
                details: details.collect(),
                own_command: command.base,
                effects: assess_effects(&loaded.scene, settings),
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

    /// Formats the report as the content of a file of this kind.
    pub fn format_as(&self, kind: AccuracyFileKind) -> String {
        match kind {
            AccuracyFileKind::Json => console::format_json(self),
            AccuracyFileKind::Csv => format_csv(self.report),
            AccuracyFileKind::Html => self.page.to_html(),
            AccuracyFileKind::Svg => self.page.plot().to_svg(),
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
            "reference picture{}: double precision (f64), the most exact rung of every ladder that is fast enough, {} samples a pixel; standard error {}",
            if reference.reused {
                " (of an earlier run)"
            } else {
                ""
            },
            reference.samples,
            format_significant_digits(reference.standard_error, 2),
        ),
        format!("measured in {}{cut}", format_duration(report.seconds)),
    ]
}
