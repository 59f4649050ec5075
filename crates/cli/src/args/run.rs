//! Arguments of `render` about the run: the machine, long renders, and reports besides the picture.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use raywright_core::bvh::{AcceleratorKind, BuildQuality};

use super::pictures::{PictureShare, TevAddress};
use super::values;

/// Threads, memory and accelerator.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Machine")]
pub struct MachineArgs {
    /// Number of threads, at most one for each processor; the picture does not depend on the number
    /// [default: one for each processor]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,

    /// Limit on memory, in bytes or with K, M or G, such as 2G; work that needs more is refused
    /// [default: 8G]
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true, value_parser = values::parse_bytes)]
    pub max_memory: Option<u64>,

    /// Acceleration structure; the picture does not depend on the structure [default: bvh]
    #[arg(long, value_name = "NAME", value_enum)]
    pub accel: Option<Accelerator>,
}

/// Time limit of a render, checkpoints, and shares of a picture.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Long renders")]
pub struct FilmArgs {
    /// Render as many samples as the time allows, counted from the program's start, such as 10s or
    /// 5min: at least one pass over the picture, at most --spp. Exit code 5 if the time is over
    /// before the render can begin [default: no limit; with it, up to 65536 samples]
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = values::parse_duration)]
    pub budget: Option<Duration>,

    /// Keep the unfinished picture in this file, every minute and at the end, for --resume
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Continue from this film file with the same scene and flags; --spp may be larger. The picture
    /// has the same bits as a single run
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,

    /// Render as many samples in each tile as this film file has, with the same scene and flags
    /// except --budget. The picture has the same bits as the render that --budget ended and
    /// --checkpoint kept in the file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["budget", "resume", "part"])]
    pub replay: Option<PathBuf>,

    /// Render only the Kth of N shares of the picture into the file of --checkpoint; `raywright
    /// merge` makes one picture of all shares
    #[arg(long, value_name = "K/N", allow_hyphen_values = true, value_parser = values::parse_share)]
    pub part: Option<PictureShare>,
}

/// Acceleration structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Accelerator {
    /// Bounding volume hierarchy
    Bvh,
    /// Linear scan of all objects, for comparison
    Linear,
}

impl From<Accelerator> for AcceleratorKind {
    fn from(accelerator: Accelerator) -> Self {
        match accelerator {
            Accelerator::Bvh => Self::Tree(BuildQuality::default()),
            Accelerator::Linear => Self::Linear,
        }
    }
}

/// Reports besides the picture.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Report")]
pub struct ReportArgs {
    /// Write times, ray counts, effects and memory to this JSON file
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,

    /// Print the SHA-256 hash of each picture's linear pixels, and its file name, on standard
    /// output
    #[arg(long, conflicts_with = "part")]
    pub hash: bool,

    /// Write the unfinished picture to this file at each doubling of the samples, for an image
    /// viewer. The file is complete at any time, and at the end holds the finished picture
    #[arg(long, value_name = "FILE.png")]
    pub preview: Option<PathBuf>,

    /// Show the picture in tev, an image viewer, at each doubling of the samples, with its layers,
    /// the denoised picture where requested, and standard errors [default host and port:
    /// 127.0.0.1:14158]
    #[arg(long, value_name = "tev[:HOST:PORT]", value_parser = values::parse_tev_address)]
    pub display: Option<TevAddress>,

    /// Progress on standard error: a bar on a terminal and lines elsewhere (auto), lines (plain),
    /// JSON with samples, error and seconds left in each line (json), or none
    #[arg(long, value_name = "STYLE", value_enum, default_value_t)]
    pub progress: ProgressStyle,
}

/// Style of progress on standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ProgressStyle {
    /// A bar where standard error is a terminal, lines elsewhere
    #[default]
    Auto,
    /// Occasional lines
    Plain,
    /// JSON, one object a line
    Json,
    /// Nothing
    None,
}
