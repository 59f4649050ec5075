//! Arguments of commands that are no render and change no scene: `view`, `merge`, `denoise`,
//! `compare`, `bench`, `stability` and `thumbs`.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Arg, ArgAction, Args};
use raywright_core::bench::GeneratedPrimitive;
use raywright_core::bvh::BuildQuality;
use raywright_core::fault::Severity;
use raywright_core::ladder::{Ladder, build_quality_of_rung};
use raywright_core::scene::{Integrator, ToneMap, TransferCurve};
use raywright_core::settings::PrecisionChoice;
use raywright_core::stability::RayCount;

use super::{ChoiceArgs, DisplayArgs, LimitArgs, RenderArgs, SceneArgs, hide_flags, values};

/// Hides the flags that change light and materials alone, which no ray of `bench` meets.
pub fn hide_light_flags(arg: Arg) -> Arg {
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
    #[arg(long, value_name = "KIND", default_value = "both", conflicts_with = "scene", value_parser = values::named(&[
        ("spheres", "Spheres only", &[GeneratedPrimitive::Spheres] as &[_]),
        ("triangles", "Triangles only", &[GeneratedPrimitive::Triangles]),
        (
            "both",
            "A table for spheres and a table for triangles",
            &[GeneratedPrimitive::Spheres, GeneratedPrimitive::Triangles],
        ),
    ]))]
    pub shape: &'static [GeneratedPrimitive],

    /// Primitives in the largest generated scene, at most 10000000
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 1_000_000, value_parser = values::whole_number::<u32>(1..=10_000_000), conflicts_with = "scene")]
    pub max_n: u32,

    /// Quality of the tree's build: fast, medium or high, the rungs of the ladder `build`
    #[arg(long, value_name = "RUNG", default_value = "fast", value_parser = parse_build_quality)]
    pub build: BuildQuality,

    /// Number of measurements of each case, in turns with all other cases; more measurements make
    /// median and spread more certain
    #[arg(long, value_name = "K", allow_hyphen_values = true, default_value_t = 7, value_parser = values::whole_number::<u32>(1..=1000))]
    pub repeats: u32,

    /// CPU seconds for the rays, approximately; builds take further time. Less time means shorter
    /// measurements, which are less certain, and leaves out the slowest scans
    #[arg(long, value_name = "S", allow_hyphen_values = true, default_value_t = 40.0, value_parser = values::limited(0.001..=86_400.0, "a number of seconds from 0.001 to 86400, such as 40"))]
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

/// Arguments of `compare`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "\
Two .exr pictures are compared as linear radiance, all other pairs as display values. FLIP always compares display values.

Thresholds apply to colours and, if a picture has coverage, to coverage too.

Exit code: 0 no given threshold is exceeded, 1 a threshold or the noise is exceeded, 3 the pictures cannot be compared.

Examples:
  raywright compare got.png expected.png
  raywright compare got.exr expected.exr --max-rmse 0.001 --diff d.png
  raywright compare got.exr expected.film --noise")]
pub struct CompareArgs {
    /// Picture to judge, .png, .exr or .film
    #[arg(value_name = "A")]
    pub picture: PathBuf,

    /// Picture to compare with, of the same size
    #[arg(value_name = "B")]
    pub reference: PathBuf,

    /// Limits of the measures of difference.
    #[command(flatten)]
    pub thresholds: ThresholdArgs,

    /// Fail if the pictures differ by more than their noise. The noise is read from the layer
    /// stderr of an .exr or from a .film; a picture without either counts as noiseless. Blocks of
    /// all sizes are tested, from 16 pixels wide to the whole picture
    #[arg(long, help_heading = "Thresholds")]
    pub noise: bool,

    /// Probability of a false alarm of --noise, over all tested blocks together
    #[arg(long, value_name = "P", allow_hyphen_values = true, value_parser = values::limited(1e-9..=0.5, "a probability from 1e-9 to 0.5, such as 0.01"), default_value = "0.01", requires = "noise", help_heading = "Thresholds")]
    pub level: f64,

    /// Write a picture of the differences, .png: black where the pictures are alike, lighter where
    /// an observer would notice more difference
    #[arg(long, value_name = "FILE")]
    pub diff: Option<PathBuf>,

    /// Brighten .exr pictures by this many stops before the perceptual comparison [default: as
    /// their files say, or 0]
    #[arg(long, value_name = "STOPS", value_parser = values::parse_number, allow_hyphen_values = true, help_heading = "Display of .exr")]
    pub exposure: Option<f64>,

    /// Tone map of .exr pictures in the perceptual comparison [default: as their files say, or
    /// khronos-neutral]
    #[arg(long, value_name = "NAME", value_parser = values::variant_parser::<ToneMap>(), help_heading = "Display of .exr")]
    pub tonemap: Option<ToneMap>,

    /// Transfer curve of .exr pictures in the perceptual comparison [default: as their files say,
    /// or srgb]
    #[arg(long, value_name = "CURVE", value_parser = values::variant_parser::<TransferCurve>(), help_heading = "Display of .exr")]
    pub gamma: Option<TransferCurve>,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Limits of the measures of difference; `--noise` is none of them.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Thresholds")]
pub struct ThresholdArgs {
    /// Fail if the root mean square error is above X
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::parse_non_negative)]
    pub max_rmse: Option<f64>,

    /// Fail if relMSE, the mean of (A - B)² / (B² + 0.01), is above X
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::parse_non_negative)]
    pub max_relmse: Option<f64>,

    /// Fail if relMSE without the worst 0.1 % of the pixels is above X
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::parse_non_negative)]
    pub max_relmse_trimmed: Option<f64>,

    /// Fail if the mean FLIP difference, from 0 (alike) to 1, is above X
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::parse_non_negative)]
    pub max_flip: Option<f64>,

    /// Fail if the peak signal-to-noise ratio, in decibels, is below DB
    #[arg(long, value_name = "DB", allow_hyphen_values = true, value_parser = values::parse_number)]
    pub min_psnr: Option<f64>,
}

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

    /// Threads and memory.
    #[command(flatten)]
    pub limits: LimitArgs,
}

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

/// Arguments of `stability`.
#[derive(Debug, Args)]
#[command(after_help = "\
The results of each case are compared with results of higher precision, in both precisions of the program (robust, reference) and for every kernel (instruction set) of this processor. \
The margin is the bound divided by the worst error; results that are only right or wrong have none. The textbook's share is the share of results that its formulas get wrong on \
the same rays. The last column is the CPU time of the textbook's formula on ordinary rays, and the additional time in either precision. The cases are sorted, the least margin first. \
Exit code 1 if more results exceed their bound than are known to; with `--strict` also if known ones do.

Examples:
  raywright stability                         All cases that are measured, with a quarter of their rays
  raywright stability --cases T01,P21         Two of the cases
  raywright stability --rays all -o page.html All rays; also write a page with a plot of the margins")]
pub struct StabilityArgs {
    /// Numbers of the cases to measure, separated by commas [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub cases: Vec<String>,

    /// Share of each case's rays to trace
    #[arg(long, value_name = "SHARE", default_value = "quarter", value_parser = values::named(&[
        ("quarter", "A quarter of the rays; all rays of small cases", RayCount::Quarter),
        ("all", "All rays, which takes minutes", RayCount::All),
    ]))]
    pub rays: RayCount,

    /// Exit with code 1 also for results that are known to exceed their bound
    #[arg(long)]
    pub strict: bool,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,

    /// Also write the report to this file; the extension selects the content: .html (page with plot
    /// and table), .svg (plot of the margins), .md (table) or .json
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

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
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 256, value_parser = values::whole_number::<u32>(16..=4096))]
    pub size: u32,
}

/// Hides the flags of `render` for files, for several pictures and for the run, none of which the
/// viewer takes.
pub fn hide_render_flags(arg: Arg) -> Arg {
    const REFUSED: [&str; 17] = [
        "outputs",
        "sheet",
        "views",
        "turntable",
        "frames",
        "fps",
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
    #[arg(long, value_name = "N", help_heading = "Viewer", allow_hyphen_values = true, default_value = "0", hide_default_value = true, value_parser = values::whole_number::<u16>(0..=65_535))]
    pub port: u16,

    /// Print the page's address without opening it
    #[arg(long, help_heading = "Viewer")]
    pub no_open: bool,
}

// Arguments of `accuracy`.

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
    #[arg(long, value_name = "NAME", value_parser = values::variant_parser::<Integrator>())]
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

    /// Also write the report: .html (a page with plot and table) or .json; may be repeated
    #[arg(short = 'o', long, value_name = "FILE", action = clap::ArgAction::Append)]
    pub output: Vec<PathBuf>,
}

// Arguments of `stress`.

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
    #[arg(long, value_name = "NAME", value_parser = values::variant_parser::<Integrator>())]
    pub integrator: Option<Integrator>,

    /// Arithmetic of rays and surfaces [default: robust]
    #[arg(long, value_name = "NAME", value_parser = values::named(values::PRECISIONS))]
    pub precision: Option<PrecisionChoice>,

    /// Seed of the rays: the same seed gives the same rays [default: the scene's; for models 0]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_seed)]
    pub seed: Option<u64>,

    /// Time after which no more rays are traced, such as 90s or 5min; meshes and images are always
    /// examined in full
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, default_value = "30s", value_parser = values::parse_duration)]
    pub budget: Duration,

    /// Threads and memory.
    #[command(flatten)]
    pub limits: LimitArgs,

    /// Mildest kind of finding for which the exit code is 1
    #[arg(long, value_name = "KIND", default_value = "picture-wrong", value_parser = values::named(&[
        ("picture-wrong", "Findings that make the picture wrong", Severity::PictureWrong),
        (
            "slow-or-noisy",
            "Also findings that make the picture slow or noisy",
            Severity::SlowOrNoisy,
        ),
        ("harmless", "All findings", Severity::Harmless),
    ]))]
    pub deny: Severity,

    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,

    /// Write a quick picture with the findings marked, as PNG
    #[arg(short, long, value_name = "FILE.png")]
    pub output: Option<PathBuf>,
}
