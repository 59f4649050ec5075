//! A measurement as files: JSON and CSV, with what a reader needs to judge and to repeat it.

use std::path::Path;

use raywright_core::accuracy::{Measured, Report};
use raywright_core::bench::clock::CLOCK;
use raywright_io::{Error, Loaded, output};
use serde::Serialize;

use crate::console;
use crate::failure::Failure;
use crate::machine::processor;
use crate::origin::command_line;

/// What a file is to hold, by its ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Everything.
    Json,
    /// A line for each rung and each combination.
    Csv,
}

impl Kind {
    /// By the ending of a name.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("json") => Ok(Self::Json),
            Some("csv") => Ok(Self::Csv),
            _ => Err(Error::usage(format_args!("cannot tell from {} what to write", path.display()))
                .with_hint("let it end in .json or .csv")
                .into()),
        }
    }
}

/// The figures with scene and machine.
#[derive(Debug, Serialize)]
pub struct Document<'a> {
    /// Version of this structure.
    format: u32,
    /// Program version.
    version: &'static str,
    /// Name of the file or preset.
    pub scene: &'a str,
    scene_hash: &'a str,
    /// The command line that asked for it.
    pub command: String,
    /// Name of the processor; none where the system does not tell.
    pub processor: Option<String>,
    /// Threads that rendered.
    pub threads: usize,
    /// What the times count.
    pub clock: &'static str,
    /// The figures.
    #[serde(flatten)]
    pub report: &'a Report,
}

impl<'a> Document<'a> {
    /// Adds scene and machine to a report.
    pub fn new(loaded: &'a Loaded, threads: usize, report: &'a Report) -> Self {
        Self {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            scene: &loaded.source.name,
            scene_hash: &loaded.hash,
            command: command_line(),
            processor: processor(),
            threads,
            clock: if CLOCK == "thread CPU time" { "CPU time of all threads" } else { CLOCK },
            report,
        }
    }

    /// Writes it to a file.
    pub fn write(&self, path: &Path, kind: Kind) -> Result<(), Failure> {
        let text = match kind {
            Kind::Json => console::json(self),
            Kind::Csv => self.csv(),
        };
        Ok(output::write_atomically(path, text.as_bytes())?)
    }

    /// A line for each: ladder and rung, or the flags of a combination on the frontier.
    fn csv(&self) -> String {
        let mut csv =
            "ladder,rung,in_use,flags,renders,seconds,seconds_lower_quartile,seconds_upper_quartile,ratio,rays,rmse,rmse_low,\
             rmse_high,bias,noise,relmse,relmse_low,relmse_high,flip,percentile_99_9,own_error\n"
                .to_owned();
        for ladder in &self.report.ladders {
            for rung in &ladder.rungs {
                let flag = rung.flag.clone().unwrap_or_default();
                csv += &format!("{},{},{},{flag},", ladder.ladder, rung.rung, rung.in_use);
                csv += &rung.measured.as_ref().map_or_else(|| ",".repeat(FIGURES), figures);
                csv += &rung.own_error.map(|own| own.to_string()).unwrap_or_default();
                csv.push('\n');
            }
        }
        for candidate in &self.report.frontier {
            let (flags, own) = (candidate.flags.join(" "), candidate.flags.is_empty());
            csv += &format!("frontier,,{own},{flags},{}\n", figures(&candidate.measured));
        }
        csv
    }
}

/// Columns that a measurement fills.
const FIGURES: usize = 16;

/// Each followed by a comma.
fn figures(of: &Measured) -> String {
    let (time, e) = (&of.seconds, &of.errors);
    let noise = e.noise.map(|noise| noise.to_string()).unwrap_or_default();
    let numbers = [time.median, time.lower_quartile, time.upper_quartile, of.ratio.median];
    let errors = [e.rmse.value, e.rmse.low, e.rmse.high, e.bias];
    let more = [e.relmse.value, e.relmse.low, e.relmse.high, of.flip, e.percentile_99_9];
    let list = |numbers: &[f64]| numbers.iter().map(|x| format!("{x},")).collect::<String>();
    format!("{},{}{},{}{noise},{}", of.renders, list(&numbers), of.rays, list(&errors), list(&more))
}
