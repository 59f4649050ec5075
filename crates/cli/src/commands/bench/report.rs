//! Report of `bench`: the measured figures, and the scene and conditions of the measurement. Table,
//! JSON and plot are all made from this report.

use std::thread::available_parallelism;

use raywright_core::bench::clock::CLOCK_NAME;
use raywright_core::bench::{
    BenchOptions, GeneratedSceneTimings, SceneComparison, TOTAL_SPHERE_VOLUME,
};
use raywright_core::ladder::rung_name_of_build_quality;
use serde::Serialize;

use crate::machine::processor_name;

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
            format: 1,
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
