//! Files of `accuracy`: JSON or a page, with everything needed to judge and to repeat
//! the measurement.

use raywright_core::Settings;
use raywright_core::accuracy::{AccuracyReport, RungSetting};
use raywright_core::bench::clock::CLOCK_NAME;
use raywright_core::display::Display;
use raywright_core::ladder::{Ladder, RungChoice};
use raywright_io::LoadedScene;
use raywright_io::report::{
    AccuracyPage, format_count, format_duration, format_significant_digits,
};
use serde::Serialize;

use super::recommendation::format_recommendation;
use crate::console;
use crate::machine::processor_name;
use crate::origin::{command_line, quote_for_shell};

/// Version of the layout of [`AccuracyDocument`]. Since version 8, ladders without effect on the scene
/// are left to `explain`, and flags are the shortest of `render`. Since version 7, `settings` holds each measured
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
        report: &'a mut AccuracyReport,
    ) -> Self {
        let processor = processor_name();
        let clock = match CLOCK_NAME {
            "thread CPU time" => "CPU time of all threads",
            other => other,
        };
        let scene = &loaded.source.name;
        let own_command = split_command(scene, requested, settings, report);
        Self {
            page: AccuracyPage {
                scene,
                circumstances: describe_conditions(processor.as_deref(), threads, clock, report),
                command: command_line(),
                report,
                recommendation: format_recommendation(report),
                own_command,
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

/// Splits the `render` commands of all settings: returns what they have in common, and gives each setting
/// of the report its flags, with the rungs of the measurement. A model has other samples without denoising,
/// so that flags of denoising state the samples.
fn split_command(
    scene: &str,
    requested: &[String],
    settings: &Settings,
    report: &mut AccuracyReport,
) -> String {
    let mut common = vec!["raywright render".to_owned(), quote_for_shell(scene)];
    let mut chosen = RungSetting::default();
    for flag in requested {
        match flag.strip_prefix("--rung ").map(RungChoice::parse) {
            Some(Ok(choice)) => chosen = chosen.with_rung(choice),
            _ => common.push(flag.clone()),
        }
    }
    let samples = RungChoice::parse(&format!("samples={}", settings.samples()));
    for row in &mut report.settings {
        let mut all = chosen.with_rungs(row.setting.choices());
        if let (Some(_), None, Ok(samples)) = (
            all.rung(Ladder::Reconstruction),
            all.rung(Ladder::Samples),
            &samples,
        ) {
            all = all.with_rung(*samples);
        }
        row.flags = all.flags();
    }
    common.join(" ")
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
        "; the time ended before all planned renders: give a larger --budget"
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

#[cfg(test)]
mod tests {
    use clap::Parser;
    use raywright_core::accuracy::MeasuredSetting;
    use raywright_core::scene::Scene;
    use raywright_core::settings::Sampling;

    use super::super::text::tests::report;
    use super::*;
    use crate::args::{Arguments, Command};
    use crate::plan::RenderTask;

    /// Returns the common command of a measurement with some flags, and the flags of a setting.
    fn split(requested: &[&str], rungs: &[&str]) -> (String, String) {
        let choice = |rung: &&str| RungChoice::parse(rung).expect("a rung");
        let choices: Vec<RungChoice> = rungs.iter().map(choice).collect();
        let settings = Settings {
            sampling: Sampling::General(64),
            ..Settings::from_scene(&Scene::default())
        };
        let mut report = AccuracyReport {
            settings: vec![MeasuredSetting {
                setting: RungSetting::from_rungs(&choices),
                ..MeasuredSetting::default()
            }],
            ..report()
        };
        let requested: Vec<String> = requested.iter().map(|&flag| flag.to_owned()).collect();
        let common = split_command("a b.glb", &requested, &settings, &mut report);
        (common, report.settings[0].flags.join(" "))
    }

    /// Protects: a command repeats the flags of the measurement, except for ladders whose rung the
    /// setting changes. No ladder is named twice, and denoising comes with the number of samples.
    #[test]
    fn commands_ask_for_everything() {
        let requested = ["--integrator path", "--rung samples=16"];
        let (common, flags) = split(&requested, &["samples=64", "precision=reference"]);
        assert_eq!(common, "raywright render 'a b.glb' --integrator path");
        assert_eq!(flags, "--spp 64 --precision reference");
        for (requested, rungs, flags) in [
            (
                &requested[..],
                &["clamp=10", "reconstruction=denoised"][..],
                "--spp 16 --denoise --rung clamp=10",
            ),
            (
                &requested,
                &["clamp=10", "roulette=off"],
                "--spp 16 --rung roulette=off --rung clamp=10",
            ),
            (&requested, &[], "--spp 16"),
            (&[], &[], ""),
            (&[], &["reconstruction=unbiased"], "--spp 64 --no-denoise"),
            (
                &["--rung clamp=10"],
                &["samples=4"],
                "--spp 4 --rung clamp=10",
            ),
            (&["--rung clamp=10"], &["clamp=1"], "--rung clamp=1"),
        ] {
            assert_eq!(split(requested, rungs).1, flags);
        }
    }

    /// Protects: the flags of a setting select exactly the rungs (quality levels) that were measured, for
    /// every rung that changes a picture.
    #[test]
    fn what_is_advised_is_what_was_measured() {
        let settings = |flags: &str| {
            let words = ["raywright", "render", "preset:cornell"]
                .into_iter()
                .chain(flags.split_whitespace());
            let Ok(Arguments {
                command: Some(Command::Render(args)),
                ..
            }) = Arguments::try_parse_from(words)
            else {
                panic!("{flags}")
            };
            let (mut scene, task) = (
                Scene::default(),
                RenderTask::new(*args).expect("right words"),
            );
            let plan =
                task.resolve_plan(&mut scene, None, |_, _, _, _| panic!("nothing is framed"));
            (plan.expect("a plan").settings, scene)
        };
        let ladders = Ladder::ALL.into_iter().filter(|of| of.changes_pictures());
        for choice in ladders.flat_map(Ladder::choices) {
            let flags = RungSetting::from_rung(choice).flags().join(" ");
            let rung = format!("--rung {choice}");
            assert_eq!(settings(&flags), settings(&rung), "{flags}");
            assert!(flags.len() <= rung.len());
        }
    }
}
