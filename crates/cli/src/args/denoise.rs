//! Arguments of `denoise`.

use std::path::PathBuf;

use clap::{ArgAction, Args};

use super::render::DisplayArgs;
use super::values;

const EXAMPLES: &str = "\
Examples:
  raywright render a.scene.toml --denoise --checkpoint a.film -o noisy.exr
  raywright denoise a.film -o b.png

The film file needs the layers albedo, normal, emission and depth, and four replicates (independent shares of the samples). A render with --denoise keeps them; so does --aov albedo,normal,emission,depth with at least 64
samples a pixel.";

/// Arguments of `denoise`.
#[derive(Clone, Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DenoiseArgs {
    /// Film file of a render, written by --checkpoint or by `raywright merge`
    #[arg(value_name = "FILM")]
    pub film: PathBuf,

    /// Picture to write, .png, .jpg or .webp (denoised) or .exr (noisy, with layers denoised and
    /// denoised.stderr); may be repeated; - for PNG on standard output
    #[arg(short, long = "output", value_name = "OUT", action = ArgAction::Append, required = true)]
    pub outputs: Vec<PathBuf>,

    /// Conversion of the picture to display values, for every format but EXR.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Number of threads, at most one for each processor; the picture does not depend on the number
    /// [default: one for each processor]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,

    /// Limit on memory, in bytes or with K, M or G, such as 2G; work that needs more is refused
    /// [default: 8G]
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true, value_parser = values::parse_bytes)]
    pub max_memory: Option<u64>,
}
