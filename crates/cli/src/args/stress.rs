//! Arguments of `stress`.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use raywright_core::fault::Severity;
use raywright_core::scene::Integrator;

use super::{ChoiceArgs, SceneArgs};
use super::{Precision, names, values};

/// Arguments of `stress`.
#[derive(Debug, Args)]
#[command(after_help = "\
Findings are of three kinds: picture wrong, slow or noisy, harmless; docs/stress.md lists all of them. Exit code 1 if the picture is wrong, or \
if anything is found that --deny names.

Examples:
  raywright stress model.glb                        What is wrong with a model
  raywright stress room.scene.toml -o places.png    The places too, marked in the picture
  raywright stress room.scene.toml --deny harmless  Exit code 1 for anything at all")]
pub struct StressArgs {
    /// Scene file (.scene.toml, .scene.json), glTF/GLB, OBJ, STL or PLY model, preset:NAME, or -
    /// for standard input
    #[arg(value_name = "SCENE")]
    pub scene: OsString,

    /// Changes to the scene.
    #[command(flatten)]
    pub changes: SceneArgs,

    /// Chosen rungs and switched-off effects.
    #[command(flatten)]
    pub choices: ChoiceArgs,

    /// Integrator, the method that computes light [default: the scene's]
    #[arg(long, value_name = "NAME", value_parser = names::variant_parser::<Integrator>())]
    pub integrator: Option<Integrator>,

    /// Arithmetic of rays and surfaces [default: robust]
    #[arg(long, value_name = "NAME", value_enum)]
    pub precision: Option<Precision>,

    /// Seed of the rays: the same seed gives the same rays [default: the scene's; for models 0]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_seed)]
    pub seed: Option<u64>,

    /// Time after which no more rays are traced, such as 90s or 5min; meshes and images are always
    /// examined in full
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, default_value = "30s", value_parser = values::parse_duration)]
    pub budget: Duration,

    /// Number of threads, at most one for each processor [default: one for each processor]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::whole_number::<u32>(1..=1024))]
    pub threads: Option<u32>,

    /// Refuse work that needs more memory: bytes, or with K, M, G [default: 8G]
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true, value_parser = values::parse_bytes)]
    pub max_memory: Option<u64>,

    /// Mildest kind of finding for which the exit code is 1
    #[arg(long, value_name = "KIND", value_enum, default_value_t)]
    pub deny: DeniedSeverity,

    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,

    /// Write a quick picture with the findings marked, as PNG
    #[arg(short, long, value_name = "FILE.png")]
    pub output: Option<PathBuf>,
}

/// Mildest severity that `--deny` turns into exit code 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum DeniedSeverity {
    /// Findings that make the picture wrong
    #[default]
    PictureWrong,
    /// Also findings that make the picture slow or noisy
    SlowOrNoisy,
    /// All findings
    Harmless,
}

impl From<DeniedSeverity> for Severity {
    fn from(denied: DeniedSeverity) -> Self {
        match denied {
            DeniedSeverity::PictureWrong => Self::PictureWrong,
            DeniedSeverity::SlowOrNoisy => Self::SlowOrNoisy,
            DeniedSeverity::Harmless => Self::Harmless,
        }
    }
}
