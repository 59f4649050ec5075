//! `bench`: time per ray with a linear scan of primitives or of their boxes, and time per ray with
//! a tree. In generated scenes, the growth of these times with the number N of primitives is
//! measured too.

mod text;

use std::ffi::OsStr;
use std::thread::available_parallelism;

use raywright_core::bench::clock::CLOCK_NAME;
use raywright_core::bench::{
    BenchError, BenchOptions, GeneratedSceneTimings, ScanTreeTiming, SceneComparison,
    TOTAL_SPHERE_VOLUME, compare_scene, generated_sizes, measure_generated,
};
use raywright_core::ladder::rung_name_of_build_quality;
use raywright_core::settings::Settings;
use raywright_io::Error;
use serde::Serialize;

use crate::args::BenchArgs;
use crate::console::Verbosity;
use crate::failure::{Exit, Failure};
use crate::machine::processor_name;
use crate::progress::StepProgress;
use crate::session::Session;
use crate::{console, plan};

/// Longest useful timing sample in seconds. The spread of longer samples has other causes than the
/// length of the samples.
const LONGEST_SAMPLE: f64 = 0.05;
/// Number of rows in the table of a given scene: camera rays and bounces.
const SCENE_ROWS: usize = 2;

/// Runs `bench`: measures, and prints a table or JSON.
pub fn run(mut session: Session, args: &BenchArgs) -> Result<(), Failure> {
    if let Some(path) = &args.plot {
        let kind = ("svg", "the plot is an SVG file");
        session.outputs.add_output_of_type(path, "-o", kind)?;
    }
    let report = match &args.scene {
        Some(name) => measure_scene(args, name, &mut session)?,
        None => session.run(|| measure_generated_scenes(args, session.verbosity))?,
    };
    if let (Some(path), BenchMeasurements::Generated(series)) = (&args.plot, &report.measured) {
        session.write_report(path, &text::draw_bench_plot(series, &report))?;
    }
    console::print_report(args.json, &report, || {
        text::format_report(&report, args.markdown)
    })
}

/// Returns the options of the measurement. The length of a timing sample is chosen such that `rows`
/// table rows together take the requested time. A row has samples of two scans and of the tree.
fn choose_bench_options(args: &BenchArgs, rows: usize) -> BenchOptions {
    let samples = f64::from(args.repeats) * 3.0 * rows as f64;
    BenchOptions {
        repeats: args.repeats as usize,
        sample_seconds: (args.seconds / samples).min(LONGEST_SAMPLE),
        build: args.build,
    }
}

fn measure_generated_scenes(
    args: &BenchArgs,
    verbosity: Verbosity,
) -> Result<BenchReport, Failure> {
    let (kinds, sizes) = (args.shape, generated_sizes(args.max_n));
    let bench_options = choose_bench_options(args, kinds.len() * sizes.len());
    let (mut steps, mut rows) = (StepProgress::start(verbosity), 0.0);
    let all = (kinds.len() * sizes.len()) as f64;
    let mut series = Vec::with_capacity(kinds.len());
    for &kind in kinds {
        let mut done = |row: &ScanTreeTiming| {
            rows += 1.0;
            steps.show_step(&format!("{} {}", row.primitives, kind.name()), rows / all);
        };
        series.push(
            measure_generated(kind, &sizes, &bench_options, &mut done)
                .map_err(|error| bench_failure(error, "generated scene"))?,
        );
    }
    Ok(BenchReport::new(
        bench_options,
        BenchMeasurements::Generated(series),
    ))
}

fn measure_scene(
    args: &BenchArgs,
    name: &OsStr,
    session: &mut Session,
) -> Result<BenchReport, Failure> {
    let options = plan::build_load_options(&args.changes, None);
    let loaded = session.load(name, &options)?;
    session.notes.print_kept_messages();
    let bench_options = choose_bench_options(args, SCENE_ROWS);
    let settings = Settings::from_scene(&loaded.scene);
    let (mut steps, mut rows) = (StepProgress::start(session.verbosity), 0.0);
    let mut done = |_: &ScanTreeTiming| {
        rows += 1.0;
        steps.show_step("rays measured", rows / SCENE_ROWS as f64);
    };
    let rows = session
        .run(|| compare_scene(&loaded.scene, &settings, &bench_options, &mut done))
        .map_err(|error| bench_failure(error, &loaded.source.name))?;
    Ok(BenchReport::new(
        bench_options,
        BenchMeasurements::Given {
            scene: loaded.source.name,
            hash: loaded.hash.to_string(),
            rows: Box::new(rows),
        },
    ))
}

fn bench_failure(error: BenchError, name: &str) -> Failure {
    match error {
        BenchError::Disagreement(_) => Failure::new(Exit::Failed, error),
        BenchError::Geometry(_) | BenchError::Prepare(_) | BenchError::Empty => {
            Error::invalid_input(name, error).into()
        }
    }
}

/// Number of threads in every measurement, so that build times do not depend on the machine's number
/// of processors.
pub const THREADS: u32 = 1;

/// Results of a measurement, with everything needed to judge them.
#[derive(Debug, Serialize)]
pub struct BenchReport {
    /// Version of this structure.
    format: u32,
    /// Version of the program.
    version: &'static str,
    /// Name of the processor; `None` where the system does not report it.
    pub processor: Option<String>,
    /// Number of processors in the machine. The measurement uses a single processor.
    processors: usize,
    /// Number of threads of the measurement.
    threads: u32,
    /// Name of the clock that measured the times.
    pub clock: &'static str,
    /// Precision of the rays, by its name on the command line.
    precision: &'static str,
    /// Build quality of the tree: `fast`, `medium` or `high`, the rungs of the ladder `build`.
    builder: &'static str,
    /// Number of interleaved repeats of each measurement.
    pub repeats: usize,
    /// Target length of a timing sample in seconds.
    pub sample_seconds: f64,
    /// Measured times, visits and memory.
    #[serde(flatten)]
    pub measured: BenchMeasurements,
}

/// Measured times, visits and memory.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BenchMeasurements {
    /// Time against the number of primitives, in generated scenes.
    Generated(Vec<GeneratedSceneTimings>),
    /// Time on a given scene, for camera rays and for bounces.
    Given {
        /// Name of the scene's file or preset.
        scene: String,
        /// Hash of the scene.
        hash: String,
        /// Comparison of scan and tree for each kind of ray.
        #[serde(flatten)]
        rows: Box<SceneComparison>,
    },
}

impl BenchReport {
    /// Combines measured times, node visits and memory with the options of the measurement and the
    /// machine.
    pub fn new(options: BenchOptions, measured: BenchMeasurements) -> Self {
        Self {
            format: 2,
            version: env!("CARGO_PKG_VERSION"),
            processor: processor_name(),
            processors: available_parallelism().map_or(1, usize::from),
            threads: THREADS,
            clock: CLOCK_NAME,
            precision: "robust",
            builder: rung_name_of_build_quality(options.build),
            repeats: options.repeats,
            sample_seconds: options.sample_seconds,
            measured,
        }
    }

    /// Describes the rays, the two compared methods and the machine in sentences, for the lines
    /// above the table.
    pub fn format_preamble(&self) -> Vec<String> {
        let label = match &self.measured {
            BenchMeasurements::Generated(_) => {
                format!(
                    "Random rays through N primitives that together fill {} % of a unit cube for every N (size ∝ N^(−1/3)).",
                    TOTAL_SPHERE_VOLUME * 100.0
                )
            }
            BenchMeasurements::Given { scene, .. } => {
                format!("{scene}: camera rays, and a cosine-weighted bounce of each.")
            }
        };
        let machine = self
            .processor
            .as_deref()
            .map(|name| format!("{name}, "))
            .unwrap_or_default();
        vec![
            label,
            "Closest hit by tests of every primitive (scan) or by a bounding-volume hierarchy (tree); both were checked to give the same hits."
                .to_owned(),
            format!(
                "{machine}one thread, {}; median of {} interleaved repeats ± half the interquartile range.",
                self.clock, self.repeats
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use raywright_core::bvh::BuildQuality;

    use super::*;
    use crate::args::{Arguments, Command};

    /// Protects: a table row has timing samples of two scans and the tree, each repeated. All
    /// samples together last the requested time, and no sample is longer than useful.
    #[test]
    fn the_samples_share_the_time() {
        let bench_options = |seconds: &str, rows| {
            let words = ["raywright", "bench", "--seconds", seconds, "--repeats", "4"];
            let Ok(Arguments {
                command: Some(Command::Bench(args)),
                ..
            }) = Arguments::try_parse_from(words)
            else {
                panic!("a right command line")
            };
            choose_bench_options(&args, rows)
        };
        // 0.75 s / (4 repeats · 3 samples · 2 rows)
        assert_eq!(
            bench_options("0.75", 2),
            BenchOptions {
                repeats: 4,
                sample_seconds: 0.03125,
                build: BuildQuality::Fast
            }
        );
        assert_eq!(
            bench_options("0.75", 5),
            BenchOptions {
                repeats: 4,
                sample_seconds: 0.0125,
                build: BuildQuality::Fast
            }
        );
        assert_eq!(bench_options("1000", 2).sample_seconds, 0.05);
    }

    /// Protects: a disagreement of scan and tree has the exit code of failed work, and any other
    /// failure the exit code of a bad input file.
    #[test]
    fn a_disagreement_is_not_the_files_fault() {
        let disagreement = raywright_core::bench::HitMismatch {
            ray: 1,
            primitives: 2,
            scan: String::new(),
            tree: String::new(),
        };
        assert_eq!(
            bench_failure(BenchError::Disagreement(disagreement), "a").exit,
            Exit::Failed
        );
        assert_eq!(bench_failure(BenchError::Empty, "a").exit, Exit::Input);
    }
}
