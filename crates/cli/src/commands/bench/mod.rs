//! `bench`: time per ray with a linear scan of primitives or of their boxes, and time per ray with
//! a tree. In generated scenes, the growth of these times with the number N of primitives is
//! measured too.

mod chart;
mod report;
mod text;

use std::ffi::OsStr;

use raywright_core::bench::{
    BenchError, BenchOptions, ScanTreeTiming, compare_scene, generated_sizes, measure_generated,
};
use raywright_core::settings::Settings;
use raywright_io::Error;

use crate::args::BenchArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::plan;
use crate::progress::StepProgress;
use crate::session::Session;
pub use report::THREADS;
use report::{BenchMeasurements, BenchReport};

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
        session.write_report(path, &chart::draw_bench_plot(series, &report))?;
    }
    console::print_report(args.json, &report, || match args.markdown {
        true => text::format_markdown(&report),
        false => text::format_plain(&report),
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
    let (kinds, sizes) = (args.shape.generated_kinds(), generated_sizes(args.max_n));
    let bench_options = choose_bench_options(args, kinds.len() * sizes.len());
    let (mut steps, mut rows) = (StepProgress::start(verbosity), 0.0);
    let all = (kinds.len() * sizes.len()) as f64;
    let mut series = Vec::with_capacity(kinds.len());
    for kind in kinds {
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
