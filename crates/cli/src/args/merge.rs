//! Arguments of `merge`.

use std::path::PathBuf;

use clap::{ArgAction, Args};

use super::{DisplayArgs, values};

/// Arguments of `merge`.
#[derive(Debug, Args)]
#[command(after_help = "\
Parts come from `raywright render ... --part K/N --checkpoint FILE`. The merged picture has the same bits as the picture of a single run, in whatever order \
the parts are named; a part may itself be merged from other parts. docs/farm.md shows job arrays.

Exit code: 0 done, 2 wrong flags, 3 the files are not parts of one picture or parts are missing, 4 a file cannot be read or written, \
5 over a limit.

Examples:
  raywright merge part*.film -o picture.png -o picture.exr
  raywright merge part1.film part2.film --checkpoint both.film")]
pub struct MergeArgs {
    /// Film files of the parts of a picture, in any order
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,

    /// Picture to write, .png, .jpg or .webp (display) or .exr (linear, with the layers of the
    /// parts); may be repeated; - for PNG on standard output
    #[arg(short, long = "output", value_name = "OUT", action = ArgAction::Append, required_unless_present = "checkpoint")]
    pub outputs: Vec<PathBuf>,

    /// Write the merged parts to this film file, for another merge or for --resume
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Write the picture even if samples are missing, as in parts that a --budget ended
    #[arg(long)]
    pub unfinished: bool,

    /// Conversion of the picture to display values, for every format but EXR.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Limit on memory, in bytes or with K, M or G, such as 2G; work that needs more is refused
    /// [default: 8G]
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true, value_parser = values::parse_bytes)]
    pub max_memory: Option<u64>,
}
