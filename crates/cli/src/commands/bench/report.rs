//! Figures, subject and conditions of a measurement: the single source of table, JSON and plot.

use std::thread::available_parallelism;

use raywright_core::bench::clock::CLOCK;
use raywright_core::bench::{BenchOptions, FILL, SceneComparison, Series};
use raywright_core::ladder::build_rung;
use serde::Serialize;

use crate::machine::processor;

/// Number of threads in every measurement.
pub const THREADS: u32 = 1;

/// Everything needed to judge the figures.
#[derive(Debug, Serialize)]
pub struct BenchReport {
    /// Version of this structure.
    format: u32,
    /// Program version.
    version: &'static str,
    /// Name of the processor; `None` where the system does not report it.
    pub processor: Option<String>,
    /// Processors of the machine, of which a single one was used.
    processors: usize,
    threads: u32,
    /// Clock of the times.
    pub clock: &'static str,
    precision: &'static str,
    /// Builder preset of the tree.
    builder: &'static str,
    /// Interleaved repeats.
    pub repeats: usize,
    /// Target length of a sample in seconds.
    pub sample_seconds: f64,
    /// The measured figures.
    #[serde(flatten)]
    pub measured: BenchFigures,
}

/// The measured figures.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BenchFigures {
    /// Time against the number of primitives.
    Generated(Vec<Series>),
    /// Time on a given scene.
    Given {
        /// Name of the file or preset.
        scene: String,
        /// Hash of the scene.
        hash: String,
        /// Rows of the table.
        #[serde(flatten)]
        rows: Box<SceneComparison>,
    },
}

impl BenchReport {
    /// Adds the description of the machine.
    pub fn new(options: BenchOptions, measured: BenchFigures) -> Self {
        Self {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            processor: processor(),
            processors: available_parallelism().map_or(1, usize::from),
            threads: THREADS,
            clock: CLOCK,
            precision: "robust",
            builder: build_rung(options.build),
            repeats: options.repeats,
            sample_seconds: options.sample_seconds,
            measured,
        }
    }

    /// Describes the measurement in sentences.
    pub fn preamble(&self) -> Vec<String> {
        let label = match &self.measured {
            BenchFigures::Generated(_) => {
                format!(
                    "Random rays through N primitives of constant fill ({} % of a unit cube, size ∝ N^(−1/3)).",
                    FILL * 100.0
                )
            }
            BenchFigures::Given { scene, .. } => {
                format!("{scene}: rays of its camera, and one cosine-weighted bounce of each.")
            }
        };
        let machine = self
            .processor
            .as_deref()
            .map(|name| format!("{name}, "))
            .unwrap_or_default();
        vec![
            label,
            "Closest hit: every primitive tested (scan), or a bounding-volume hierarchy (tree); the same hits, checked."
                .to_owned(),
            format!(
                "{machine}one thread, {}; median of {} interleaved repeats ± half the distance of the quartiles.",
                self.clock, self.repeats
            ),
        ]
    }
}
