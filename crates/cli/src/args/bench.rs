//! Arguments of `bench`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Arg, Args, ValueEnum};
use raywright_core::bench::GeneratedPrimitive;
use raywright_core::bvh::BuildQuality;
use raywright_core::ladder::{Ladder, build_quality_of_rung};

use super::{SceneArgs, hide_flags, values};

/// Hides the flags that change light and materials alone, which no ray of `bench` meets.
pub fn hide_refused(arg: Arg) -> Arg {
    const REFUSED: [&str; 7] = [
        "material",
        "env",
        "studio",
        "ground",
        "backdrop",
        "env_rotation",
        "env_strength",
    ];
    hide_flags(arg, &REFUSED)
}

/// Arguments of `bench`.
#[derive(Debug, Args)]
#[command(after_help = "\
Two methods find the closest hit of a ray: the scan tests every primitive, and the tree is a bounding-volume hierarchy. \
Both must give the same hits before they are timed; otherwise the exit code is 1. Times are CPU time of one thread, so that other programs disturb them less.

Examples:
  raywright bench                             Spheres and triangles
  raywright bench --max-n 10000 --plot n.svg  A shorter table, with a plot
  raywright bench duck.glb                    Camera rays and bounces of a model
  raywright bench duck.glb --build high       The same with a tree of higher quality")]
pub struct BenchArgs {
    /// Scene or model to measure instead of generated scenes: .scene.toml, .scene.json, glTF/GLB,
    /// OBJ, STL, PLY, preset:NAME, or - for standard input
    #[arg(value_name = "SCENE")]
    pub scene: Option<OsString>,

    /// Changes to the scene.
    #[command(flatten)]
    pub changes: SceneArgs,

    /// Primitives of generated scenes
    #[arg(
        long,
        value_name = "KIND",
        value_enum,
        default_value_t,
        conflicts_with = "scene"
    )]
    pub shape: GeneratedShapes,

    /// Primitives in the largest generated scene, at most 10000000
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000), conflicts_with = "scene")]
    pub max_n: u32,

    /// Quality of the tree's build: fast, medium or high, the rungs of the ladder `build`
    #[arg(long, value_name = "RUNG", default_value = "fast", value_parser = parse_build_quality)]
    pub build: BuildQuality,

    /// Number of measurements of each case, in turns with all other cases; more measurements make
    /// median and spread more certain
    #[arg(long, value_name = "K", allow_hyphen_values = true, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeats: u32,

    /// CPU seconds for the rays, approximately; builds take further time. Less time means shorter
    /// measurements, which are less certain, and leaves out the slowest scans
    #[arg(long, value_name = "S", allow_hyphen_values = true, default_value_t = 40.0, value_parser = parse_seconds)]
    pub seconds: f64,

    /// Print JSON instead of a table
    #[arg(long, conflicts_with = "markdown")]
    pub json: bool,

    /// Print the table as Markdown
    #[arg(long)]
    pub markdown: bool,

    /// Also draw the time per ray against the number of primitives, as .svg
    #[arg(short = 'o', long, value_name = "FILE", conflicts_with = "scene")]
    pub plot: Option<PathBuf>,
}

/// Parses a build quality of the tree, a rung of the ladder `build`, such as `high`.
fn parse_build_quality(text: &str) -> Result<BuildQuality, String> {
    let names = || {
        Ladder::Build
            .rungs()
            .iter()
            .map(|rung| rung.name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    build_quality_of_rung(text).ok_or_else(|| format!("expected one of {}", names()))
}

/// Parses a measuring time in seconds, from 0.001 to 86400.
fn parse_seconds(text: &str) -> Result<f64, String> {
    match values::parse_number(text)? {
        seconds if (0.001..=86_400.0).contains(&seconds) => Ok(seconds),
        _ => Err("expected a number of seconds from 0.001 to 86400, such as 40".to_owned()),
    }
}

/// Primitives of generated scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum GeneratedShapes {
    /// Spheres only
    Spheres,
    /// Triangles only
    Triangles,
    /// A table for spheres and a table for triangles
    #[default]
    Both,
}

impl GeneratedShapes {
    /// Returns the kinds of generated primitives to measure: spheres, triangles, or both.
    pub fn generated_kinds(self) -> Vec<GeneratedPrimitive> {
        match self {
            Self::Spheres => vec![GeneratedPrimitive::Spheres],
            Self::Triangles => vec![GeneratedPrimitive::Triangles],
            Self::Both => GeneratedPrimitive::ALL.map(|(_, kind)| kind).to_vec(),
        }
    }
}
