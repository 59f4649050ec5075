//! `bench`: time per ray with a linear scan of primitives or of their boxes, and time per ray with
//! a tree. In generated scenes, the growth of these times with the number N of primitives is
//! measured too.

use std::ffi::OsStr;
use std::thread::available_parallelism;

use raywright_core::bench::clock::CLOCK_NAME;
use raywright_core::bench::{
    BenchError, BenchOptions, Crossover, FIT_FROM, GeneratedPrimitive, GeneratedSceneTimings,
    PowerLaw, QueryCost, ScanTreeTiming, SceneComparison, TOTAL_SPHERE_VOLUME, compare_scene,
    generated_sizes, measure_generated,
};
use raywright_core::ladder::rung_name_of_build_quality;
use raywright_core::settings::Settings;
use raywright_io::Error;
use raywright_io::report::{
    Plot, PlotAxis, PlotLine, PlotPoint, ReportSection, ThemeColour, format_median, format_power,
    format_seconds, format_three_digits,
};
use serde::Serialize;

use crate::args::BenchArgs;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::machine::processor_name;
use crate::plan;
use crate::progress::StepProgress;
use crate::session::Session;
use crate::table::{ColumnAlignment, Table, TableRow, wrap_paragraph};

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
        session.write_report(path, &draw_bench_plot(series, &report))?;
    }
    console::print_report(args.json, &report, || format_report(&report, args.markdown))
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

// Tables of `bench`, as plain text and as Markdown.

/// Formats the report for a terminal, or as Markdown.
pub fn format_report(report: &BenchReport, is_markdown: bool) -> String {
    let room = console::line_width();
    let line = |line: String| match is_markdown {
        true => line + "\n",
        false => wrap_paragraph(&line) + "\n",
    };
    let section = |section: &ReportSection| match is_markdown {
        true => section.to_markdown(),
        false => section.to_text(room),
    };
    let preamble = report.format_preamble().into_iter().map(line);
    let sections = build_sections(report);
    preamble.chain(sections.iter().map(section)).collect()
}

fn build_sections(report: &BenchReport) -> Vec<ReportSection> {
    match &report.measured {
        BenchMeasurements::Generated(series) => series
            .iter()
            .flat_map(|series| series_sections(series, report))
            .collect(),
        BenchMeasurements::Given { rows, .. } => scene_sections(rows, report),
    }
}

/// Builds the sections of a kind of generated primitives: times, and build times with memory.
fn series_sections(series: &GeneratedSceneTimings, report: &BenchReport) -> Vec<ReportSection> {
    let rows = series.rows.iter();
    let rows: Vec<_> = rows
        .map(|row| (vec![row.primitives.to_string()], row))
        .collect();
    let growth = |label, law: Option<PowerLaw>| law.map(|law| describe_growth(label, &law));
    let mut notes = vec![describe_crossover(series.crossover)];
    notes.extend(growth("tree", series.tree_growth));
    notes.extend(growth("scan", series.scan_growth));
    let all: Vec<_> = series.rows.iter().collect();
    let name = series.kind.name();
    let title = name[..1].to_uppercase() + &name[1..];
    build_pair(title, (&["N"], rows), &all, notes, report)
}

/// Builds the sections of a given scene, with a row for each kind of rays.
fn scene_sections(comparison: &SceneComparison, report: &BenchReport) -> Vec<ReportSection> {
    let camera = &comparison.camera;
    let bounce = comparison.bounce.iter().map(|row| ("bounce", row));
    let named = [("camera", camera)].into_iter().chain(bounce);
    let rows: Vec<_> = named
        .map(|(name, row)| (vec![name.to_owned(), row.tree.rays.to_string()], row))
        .collect();
    let note = "No camera ray hits an object, so that no bounce was measured.".to_owned();
    let notes = comparison.bounce.map_or(vec![note], |_| Vec::new());
    let title = format!("Scan against tree, {} primitives", camera.primitives);
    build_pair(title, (&["rays", "number"], rows), &[camera], notes, report)
}

/// Builds the section of the times of rows, and that of the builds and the memory of `built`.
fn build_pair(
    title: String,
    (first, rows): (&[&str], Vec<(Vec<String>, &ScanTreeTiming)>),
    built: &[&ScanTreeTiming],
    mut notes: Vec<String>,
    report: &BenchReport,
) -> Vec<ReportSection> {
    if rows.iter().any(|(_, row)| row.scan.is_none()) {
        notes.push(format!(
            "Scans not run: a single timing sample would take much longer than {} ms.",
            format_three_digits(report.sample_seconds * 1e3)
        ));
    }
    let costs = built.iter().map(|row| {
        let cells = |cost: Option<QueryCost>| {
            cost.map_or_else(
                || ["not run".to_owned(), "-".to_owned()],
                |cost| {
                    let bytes = cost.bytes as f64 / row.primitives as f64;
                    let build = format_median(&cost.build_milliseconds);
                    [build, format_three_digits(bytes)]
                },
            )
        };
        let cells = [cells(row.scan), cells(Some(row.tree))].concat();
        let size = row.primitives.to_string();
        [size].into_iter().chain(cells).collect()
    });
    let names = [
        "N",
        "scan: build, ms",
        "bytes/N",
        "tree: build, ms",
        "bytes/N",
    ];
    let section = |title, table, notes| ReportSection {
        explanation: String::new(),
        title,
        table,
        notes,
    };
    vec![
        section(title.clone(), time_table(first, rows), notes),
        section(
            format!("{title}: build and memory"),
            Table::new([ColumnAlignment::Right; 5], names, costs),
            Vec::new(),
        ),
    ]
}

/// Returns the table of times and tests. Each row has its own cells, below the headings `first`.
fn time_table(first: &[&str], rows: Vec<(Vec<String>, &ScanTreeTiming)>) -> Table {
    let names = [
        "rays that hit",
        "scan, ns/ray",
        "tree, ns/ray",
        "scan : tree",
        "nodes/ray",
        "tests/ray",
    ];
    let cells = |(own, row): (Vec<String>, &ScanTreeTiming)| -> TableRow {
        let scan = row.scan.map(|cost| format_median(&cost.nanoseconds));
        let ratio = row.ratio.as_ref().map(format_median);
        let cells = [
            format!("{:.1} %", row.hit_share * 100.0),
            scan.unwrap_or_else(|| "not run".to_owned()),
            format_median(&row.tree.nanoseconds),
            ratio.unwrap_or_else(|| "-".to_owned()),
            format!("{:.1}", row.tree.nodes_per_ray),
            format!("{:.1}", row.tree.tests_per_ray),
        ];
        own.into_iter().chain(cells).collect()
    };
    let names = first.iter().chain(&names).map(|&name| name.to_owned());
    let mut columns = vec![ColumnAlignment::Right; first.len() + 6];
    if first.len() > 1 {
        columns[0] = ColumnAlignment::Left;
    }
    Table {
        columns,
        rows: [names.collect()]
            .into_iter()
            .chain(rows.into_iter().map(cells))
            .collect(),
    }
}

fn describe_crossover(crossover: Option<Crossover>) -> String {
    match crossover {
        Some(Crossover::Always) => {
            "The tree is faster than the scan at every measured N.".to_owned()
        }
        Some(Crossover::At(n)) => format!(
            "The tree is faster than the scan from N = {} on (interpolated); below, the scan is as fast or faster.",
            format_three_digits(n)
        ),
        Some(Crossover::Never) => {
            "The tree is not faster than the scan at the largest measured N.".to_owned()
        }
        None => "The scan, which tests every primitive, was not timed: from which N on the tree is faster is not known.".to_owned(),
    }
}

fn describe_growth(label: &str, law: &PowerLaw) -> String {
    format!(
        "The {label}'s time grows as N to the power {:.3} ± {:.3} (standard error), from N = {FIT_FROM} on.",
        law.exponent, law.standard_error
    )
}

// Plot of `bench`: time per ray against the number N of primitives, for linear scan and tree. A
// mark shows the least N at which the tree is faster.

/// Draws the lines of all series in a plot and returns its SVG text.
pub fn draw_bench_plot(series: &[GeneratedSceneTimings], report: &BenchReport) -> String {
    let scans = series
        .iter()
        .map(|s| build_series_line(s, "scan", ThemeColour::First, s.scan_growth, |row| row.scan));
    let trees = series.iter().map(|s| {
        build_series_line(s, "tree", ThemeColour::Second, s.tree_growth, |row| {
            Some(row.tree)
        })
    });
    let machine = report
        .processor
        .as_deref()
        .map(|name| format!(" · {name}"))
        .unwrap_or_default();
    Plot {
        title: "Time to find the closest hit of a ray".to_owned(),
        subtitle: "scan: every primitive tested · tree: a hierarchy of boxes".to_owned(),
        circumstances: format!("one thread, {}{machine}", report.clock),
        x: PlotAxis {
            label: "N, number of primitives, which fill the same share of space for every N"
                .to_owned(),
            tick: Some(format_power),
        },
        y: PlotAxis {
            label: "time per ray: median, and range of the repeats".to_owned(),
            tick: Some(format_seconds),
        },
        lines: scans.chain(trees).collect(),
        is_falling: false,
    }
    .to_svg()
}

fn build_series_line(
    series: &GeneratedSceneTimings,
    name: &str,
    colour: ThemeColour,
    growth: Option<PowerLaw>,
    cost: fn(&ScanTreeTiming) -> Option<QueryCost>,
) -> PlotLine {
    let exponent = growth
        .map(|law| format!(": grows as N^{:.2}", law.exponent))
        .unwrap_or_default();
    let point = |row: &ScanTreeTiming| {
        let time = cost(row)?.nanoseconds.scale(1e-9);
        Some(PlotPoint {
            x: row.primitives as f64,
            y: time.median,
            spread: [time.min, time.max],
            ..PlotPoint::default()
        })
    };
    PlotLine {
        name: format!("{name}, {}{exponent}", series.kind.name()),
        colour,
        is_dashed: series.kind == GeneratedPrimitive::Triangles,
        is_unjoined: false,
        points: series.rows.iter().filter_map(point).collect(),
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

#[cfg(test)]
mod text_tests;
