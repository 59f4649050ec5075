//! Arguments of `accuracy`.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use raywright_core::scene::Integrator;

use super::{ChoiceArgs, SceneArgs};
use super::{names, values};

/// Arguments of `accuracy`.
#[derive(Debug, Args)]
#[command(after_help = "\
A setting that trades accuracy for time is a ladder, and each of its quality levels is a rung. Each rung that applies to the scene is rendered in turn, at the \
full size, and compared with a reference picture: double precision (f64), every ladder on its most exact rung. Errors of noise are those that whole pictures state, \
as by `render`. Times are CPU seconds of all threads, without preparation.

Examples:
  raywright accuracy                                    The default preset, a table
  raywright accuracy duck.glb --budget 5min -o duck.html  More time, and a page with plot and pictures
  raywright accuracy scene.scene.toml --rung samples=16   Starting from 16 samples a pixel
  raywright accuracy duck.glb --json > duck.json          JSON for other programs")]
pub struct AccuracyArgs {
    /// Scene or model to measure: .scene.toml, .scene.json, glTF/GLB, OBJ, STL, PLY, preset:NAME,
    /// or - for standard input [default: the default preset]
    #[arg(value_name = "SCENE")]
    pub scene: Option<OsString>,

    /// Changes to the scene.
    #[command(flatten)]
    pub changes: SceneArgs,

    /// Rungs (quality levels of settings) and switched-off effects of the setting in use. All other
    /// settings are compared with this setting.
    #[command(flatten)]
    pub choices: ChoiceArgs,

    /// Integrator, the method that computes light [default: the scene's]
    #[arg(long, value_name = "NAME", value_parser = names::variant_parser::<Integrator>())]
    pub integrator: Option<Integrator>,

    /// Total time, such as 90s or 5min; renders end when the time is over
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, default_value = "60s", value_parser = values::parse_duration)]
    pub budget: Duration,

    /// Size of the picture in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", allow_hyphen_values = true, value_parser = values::parse_size)]
    pub size: Option<[u32; 2]>,

    /// Largest number of rounds, each with other random numbers; reached only if time is left
    #[arg(long, value_name = "K", allow_hyphen_values = true, default_value_t = 5, value_parser = values::whole_number::<u32>(2..=1000))]
    pub rounds: u32,

    /// Keep the reference picture in this file or, if the file exists, compare with its picture
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,

    /// Number of threads, at most one for each processor [default: one for each processor]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::whole_number::<u32>(1..=1024))]
    pub threads: Option<u32>,

    /// Limit on memory, in bytes or with K, M or G, such as 2G; a render that needs more is refused
    /// [default: 8G]
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true, value_parser = values::parse_bytes)]
    pub max_memory: Option<u64>,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,

    /// Also write the report: .html (a page with plot and table), .csv, .json or .svg (the plot);
    /// may be repeated
    #[arg(short = 'o', long, value_name = "FILE", action = clap::ArgAction::Append)]
    pub output: Vec<PathBuf>,
}
