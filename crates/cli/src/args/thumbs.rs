//! Arguments of `thumbs`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `thumbs`.
#[derive(Debug, Args)]
#[command(after_help = "\
Prints a line for each model: its picture, and whether the picture is new. A picture is rendered again if a file that its model reads has changed, if another \
size is requested, or with another version of the program; OUT/thumbs.json records all three. Models that can't be rendered are named, the \
others are rendered nevertheless, and the exit code is the greatest of all models.

Examples:
  raywright thumbs models -o thumbnails
  raywright thumbs . -o .thumbnails --size 512")]
pub struct ThumbsArgs {
    /// Folder of the scenes and models, searched with all folders below, each once; names that begin
    /// with a dot are skipped
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,

    /// Folder for the pictures, with the same subfolders; created if missing
    #[arg(short, long = "output", value_name = "OUT")]
    pub output: PathBuf,

    /// Width and height of each picture in pixels
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub size: u32,
}
