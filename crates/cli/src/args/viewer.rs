//! Arguments of `view`.

use std::time::Duration;

use clap::{Arg, Args};

use super::{RenderArgs, hide_flags, values};

/// Hides the flags of `render` for files, for several pictures and for the run, none of which the
/// viewer takes.
pub fn hide_refused(arg: Arg) -> Arg {
    const REFUSED: [&str; 16] = [
        "outputs",
        "sheet",
        "views",
        "turntable",
        "frames",
        "quality",
        "budget",
        "checkpoint",
        "resume",
        "replay",
        "part",
        "stats",
        "hash",
        "preview",
        "display",
        "progress",
    ];
    hide_flags(arg, &REFUSED)
}

/// Arguments of `view`.
#[derive(Debug, Args)]
#[command(after_help = "\
Only this machine can open the page, at an address that nobody can guess. The program ends with Ctrl-C, or some time (--linger) after the page was closed.
The finished picture has the same bits as `render` with the command that the page shows. docs/view.md describes the page.

Examples:
  raywright view duck.glb                    Look at a model from all sides
  raywright view preset:cornell --spp 1024   Watch the error shrink
  raywright view my.scene.toml --watch       Render again whenever the file is saved")]
pub struct ViewerArgs {
    /// Arguments of the render.
    #[command(flatten)]
    pub render: RenderArgs,

    /// Render again when the scene, an image or a mesh changes on disk, and keep the camera
    #[arg(long, help_heading = "Viewer")]
    pub watch: bool,

    /// Keep running after the page is closed
    #[arg(long, help_heading = "Viewer", conflicts_with = "linger")]
    pub keep: bool,

    /// Time that the program keeps running after the last page is closed
    #[arg(long, value_name = "TIME", help_heading = "Viewer", allow_hyphen_values = true, default_value = "1min", value_parser = values::parse_duration)]
    pub linger: Duration,

    /// Port of the page [default: a free port]
    #[arg(
        long,
        value_name = "N",
        help_heading = "Viewer",
        default_value_t = 0,
        hide_default_value = true
    )]
    pub port: u16,

    /// Print the page's address without opening it
    #[arg(long, help_heading = "Viewer")]
    pub no_open: bool,
}
