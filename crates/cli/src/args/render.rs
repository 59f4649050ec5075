//! Arguments of `render`: the picture, the machine, long renders and reports.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgAction, Args, ValueEnum};
use raywright_core::bvh::{AcceleratorKind, BuildQuality};
use raywright_core::framing::ViewAngles;
use raywright_core::scene::{AspectFit, Integrator, ToneMap, TransferCurve};
use raywright_core::settings::{Aov, Crop, PrecisionChoice};

use super::values::{
    BackgroundChoice, ExposureChoice, FrameTimes, NamedViews, PictureShare, TevAddress,
};
use super::{ChoiceArgs, DEFAULT_PRESET, SceneArgs, values};

fn format_examples() -> String {
    format!(
        "Examples:
  raywright render                             The preset {DEFAULT_PRESET}
  raywright render preset:{DEFAULT_PRESET} --at 2.5     The same, 2.5 seconds later
  raywright render duck.glb -o d.png -o d.exr  A model, to two files
  raywright render duck.glb --views front,left,top   Three views of a model
  raywright render duck.glb --turntable 72 -o spin.gif   Once around the model
  raywright render *.glb --sheet all.png       Many models side by side
  raywright render a.scene.toml --crop 100,50,320,200
  raywright render a.scene.toml -o - | display
  raywright render a.scene.toml --quick        A first look: 8 samples, denoised
  raywright render a.scene.toml --budget 30s   As many samples as fit in half a minute
  raywright render cornell.glb --max-error 0.05 -o c.exr   Samples until the error is below 0.05

Exit code: 0 done, 1 failed, 2 wrong flags, 3 bad scene or empty picture, 4 a file cannot be read or written, 5 over a limit, 6 written, \
         but the error of --max-error is not reached, 130 interrupted \
         (the unfinished picture is in NAME.partial.EXT)."
    )
}

/// Arguments of `render`.
#[derive(Clone, Debug, Default, Args)]
#[command(after_help = format_examples())]
pub struct RenderArgs {
    /// Scenes to render.
    #[arg(value_name = "SCENE", help = format!(
        "Scene files (.scene.toml, .scene.json), glTF/GLB, OBJ, STL or PLY models, preset:NAME, or - for standard input [default: preset:{DEFAULT_PRESET}]"
    ))]
    pub scenes: Vec<OsString>,

    /// Picture to write, .png, .jpg or .webp (display) or .exr (linear); may be repeated; - for PNG
    /// on standard output. Several pictures are numbered at %04d in the name; .gif or .apng holds
    /// all pictures as an animation [default: the scene's name .png in the current directory]
    #[arg(short, long = "output", value_name = "OUT", action = ArgAction::Append)]
    pub outputs: Vec<PathBuf>,

    /// Write all pictures side by side into one .png, each with its name below. Without -o no other
    /// picture is written
    #[arg(long, value_name = "FILE")]
    pub sheet: Option<PathBuf>,

    /// Also write pictures that show no object, instead of ending with exit code 3
    #[arg(long)]
    pub allow_empty: bool,

    /// Leave the picture's origin out of its metadata: equal pixels then give equal files. A later
    /// run without -o does not replace such a file
    #[arg(long)]
    pub no_metadata: bool,

    /// Layers to add to an .exr output, separated by commas: albedo, normal, position, emission (of
    /// lamps and sky), depth, object, material, edges (lines of --edges), samples (their number), stderr (standard
    /// error)
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::aov_parser(), hide_possible_values = true)]
    pub aov: Vec<Aov>,

    /// Changes to the scene.
    #[command(flatten)]
    pub changes: SceneArgs,

    /// View of the picture: size, camera, crop and background.
    #[command(flatten)]
    pub view: ViewArgs,

    /// Settings of light transport, sampling and accuracy.
    #[command(flatten)]
    pub light: LightArgs,

    /// Chosen rungs (quality levels of settings) and switched-off effects.
    #[command(flatten)]
    pub choices: ChoiceArgs,

    /// Conversion of the picture to display values, for every format but EXR.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Threads, memory and accelerator.
    #[command(flatten)]
    pub machine: MachineArgs,

    /// Time limit, checkpoints, and shares of a picture.
    #[command(flatten)]
    pub film: FilmRequest,

    /// Reports, previews and progress.
    #[command(flatten)]
    pub report: ReportRequest,
}

/// View of the picture: size, camera, crop and background.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "View")]
pub struct ViewArgs {
    /// Width and height in pixels; the vertical field of view is kept [default: the scene's; models
    /// 1280x720]
    #[arg(short, long, value_name = "WxH", allow_hyphen_values = true, value_parser = values::parse_size)]
    pub size: Option<[u32; 2]>,

    /// Camera by name, or by index from 0 [default: the scene's first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,

    /// Show the whole scene from a direction: front, back, left, right, top, bottom, iso, or
    /// azimuth and elevation in degrees (0,0 is the front, on the +z side, 90,0 the right)
    /// [default: the scene's camera; without a camera from slightly above and to the side, flat
    /// things and open rooms from their front]
    #[arg(long, value_name = "VIEW|AZ,EL", value_parser = values::parse_view, allow_hyphen_values = true,
        conflicts_with_all = ["camera", "eye", "target"])]
    pub view: Option<ViewAngles>,

    /// One picture from each of these views, separated by commas. The files are named
    /// SCENE-VIEW.png, or numbered where the name of -o contains %04d
    #[arg(long, value_name = "LIST", value_parser = values::parse_views, allow_hyphen_values = true,
        conflicts_with_all = ["view", "camera", "eye", "target", "turntable", "frames"])]
    pub views: Option<NamedViews>,

    /// N pictures from a full circle around the whole scene, at the elevation of the current view
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::whole_number::<u32>(1..=3600),
        conflicts_with_all = ["camera", "eye", "target", "frames"])]
    pub turntable: Option<u32>,

    /// Pictures per second of a .gif or .apng file [default: those of --frames; a turn of --turntable
    /// takes 4 seconds; otherwise 1]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::limited(0.01..=100.0, "a number of pictures per second from 0.01 to 100, such as 25"))]
    pub fps: Option<f64>,

    /// One picture for each time from A up to, but not at, B seconds, at FPS pictures per second,
    /// such as 0..2:25 for 50 pictures; all:25 is a model's whole animation. Each picture equals the
    /// picture of --at with the same time
    #[arg(long, value_name = "A..B:FPS|all:FPS", value_parser = values::parse_frame_times, allow_hyphen_values = true, conflicts_with = "at")]
    pub frames: Option<FrameTimes>,

    /// Enlarge the middle of the picture by this factor
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::limited(1e-3..=1e3, "a factor from 0.001 to 1000, such as 2"))]
    pub zoom: Option<f64>,

    /// Move the camera to this point
    #[arg(long, value_name = "X,Y,Z", value_parser = values::parse_triple, allow_hyphen_values = true)]
    pub eye: Option<[f64; 3]>,

    /// Turn the camera to this point
    #[arg(long, value_name = "X,Y,Z", value_parser = values::parse_triple, allow_hyphen_values = true)]
    pub target: Option<[f64; 3]>,

    /// Up vector of the camera, from `--up X,Y,Z`.
    #[arg(skip)]
    pub up: Option<[f64; 3]>,

    /// Show the whole scene without perspective, by parallel rays: lengths across the view are to
    /// scale. Combines with --view, --views, --turntable, --zoom, --eye and --target; a camera of
    /// the scene is not used
    #[arg(long, conflicts_with_all = ["camera", "fov", "fit"])]
    pub ortho: bool,

    /// Vertical field of view in degrees; --view still shows the whole scene
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, value_parser = values::parse_field_of_view)]
    pub fov: Option<f64>,

    /// Fit of a picture whose aspect ratio differs from the camera's: contain shows the camera's
    /// whole view and more at two sides, cover shows a part of the view [default: contain for glTF
    /// cameras; for others the scene's `fit`, or the vertical field of view is kept]
    #[arg(long, value_name = "contain|cover", value_parser = values::one_of(&[("contain", AspectFit::Contain), ("cover", AspectFit::Cover)]), conflicts_with_all = ["view", "views", "turntable", "fov"])]
    pub fit: Option<AspectFit>,

    /// Render only this rectangle of pixels, counted from the top left; the pixels have the same
    /// values as in the whole picture
    #[arg(long, value_name = "X,Y,W,H", allow_hyphen_values = true, value_parser = values::parse_crop)]
    pub crop: Option<Crop>,

    /// Draw the edges of a mesh's triangles, a pixel wide, on the first surface that the camera
    /// sees; thinner on triangles of a few pixels. Spheres and other shapes have no such edges.
    /// Useful with --material clay to judge shapes
    #[arg(long)]
    pub wireframe: bool,

    /// Draw outlines, borders, steps and creases of at least 30°, a pixel wide and without noise, on
    /// any shape. Lines are dark, and bright on dark surfaces; .exr files also have them as layer
    /// edges. Combines with --ortho, --material clay and --section
    #[arg(long)]
    pub edges: bool,

    /// Background where rays hit nothing: env (the sky), transparent, or a colour such as white,
    /// #e6b219 or rgb(230,178,25). .png, .jpg and .webp show the colour with exactly these codes,
    /// whatever exposure and tone map are; .exr has its linear value. R,G,B are linear, from 0 to
    /// 1. The shadow on a studio's ground stays: under transparent as alpha [default: env]
    #[arg(long, value_name = "env|transparent|COLOUR", allow_hyphen_values = true, value_parser = values::parse_background)]
    pub background: Option<BackgroundChoice>,
}

/// Settings of light transport, sampling and accuracy.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Light")]
pub struct LightArgs {
    /// Integrator; auto takes the integrator that suits the scene [default: the scene's; models
    /// auto]
    #[arg(long, value_name = "NAME", value_parser = values::variant_parser::<Integrator>())]
    pub integrator: Option<Integrator>,

    /// Samples a pixel: time grows with the number, noise falls with its square root. A scene's
    /// fixed sample pattern is kept only if N is the pattern's number of samples. With N = 1, the
    /// sample is at the pixel centre [default: the scene's; models 64, or 16 if
    /// they are denoised by default]
    #[arg(long, value_name = "N", value_parser = values::parse_samples, allow_hyphen_values = true)]
    pub spp: Option<u32>,

    /// Filter the noise out of the picture, from 8 samples on, and report the remaining error. The
    /// filter is biased: it blurs fine and faint detail. PNG shows the result; EXR keeps the noisy
    /// picture and gains layers denoised and denoised.stderr [default: path-traced models, and scenes
    /// with `denoise = true`, unless an .exr picture, layers or a film file are written]
    #[arg(long, overrides_with = "no_denoise")]
    pub denoise: bool,

    /// Keep the noise of the samples, also in pictures of models and of scenes with `denoise = true`
    #[arg(long, overrides_with = "denoise", conflicts_with = "quick")]
    pub no_denoise: bool,

    /// A quick preview: at most 8 samples a pixel, denoised, half as wide and as high, at most
    /// 640x360, unless --size says otherwise. The fixed sample pattern of a scene stays as it is
    #[arg(long, conflicts_with_all = ["spp", "max_error", "budget", "replay", "resume"])]
    pub quick: bool,

    /// Add samples where the error is largest, until the upper end of the 95 % interval of the root
    /// relMSE is below E: 0.1 is grainy, 0.02 clean. A pixel takes at most --spp samples, or the
    /// number that --budget allows. With --denoise, E limits the error of the denoised picture
    /// [default: every pixel takes --spp]
    #[arg(long, value_name = "E", allow_hyphen_values = true, value_parser = values::parse_max_error)]
    pub max_error: Option<f64>,

    /// Largest number of ray segments in a light path, 1 to 64, or unlimited, where Russian
    /// roulette alone ends paths; 1 is the camera ray alone [default: the scene's; models 8]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_max_depth)]
    pub max_depth: Option<u32>,

    /// Largest radiance of a sample; brighter samples are dimmed to X. Fireflies become fewer, but
    /// light is lost, and the picture is biased [default: no limit]
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::limited(f64::MIN_POSITIVE.., "a radiance above zero, such as 10"))]
    pub clamp: Option<f64>,

    /// Seed of the random numbers: the same seed gives the same picture, bit for bit [default: the
    /// scene's; for models 0]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_seed)]
    pub seed: Option<u64>,

    /// Arithmetic of rays and surfaces [default: robust]
    #[arg(long, value_name = "NAME", value_parser = values::named(values::PRECISIONS))]
    pub precision: Option<PrecisionChoice>,
}

/// Conversion of radiance to the colours of a PNG. EXR files stay linear.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Display (PNG)")]
pub struct DisplayArgs {
    /// Brighten by stops: 1 doubles, -1 halves. auto chooses whole stops with which at most a tenth
    /// of the lit objects in view is clipped or black; all pictures of a scene take the stops of the
    /// first [default: the scene's; for models 0, or what their own lights call for]
    #[arg(long, value_name = "STOPS|auto", value_parser = values::parse_exposure, allow_hyphen_values = true)]
    pub exposure: Option<ExposureChoice>,

    /// Tone map, the compression of bright light [default: the scene's; for models khronos-neutral]
    #[arg(long, value_name = "NAME", value_parser = values::variant_parser::<ToneMap>())]
    pub tonemap: Option<ToneMap>,

    /// Transfer curve of pixel values [default: the scene's; for models srgb]
    #[arg(long, value_name = "CURVE", value_parser = values::variant_parser::<TransferCurve>())]
    pub gamma: Option<TransferCurve>,

    /// Quality of .jpg pictures, from 1 to 100 [default: 90]
    #[arg(long, value_name = "Q", allow_hyphen_values = true, value_parser = values::whole_number::<u8>(1..=100))]
    pub quality: Option<u8>,
}

/// Threads and memory.
#[derive(Clone, Debug, Default, Args)]
pub struct LimitArgs {
    /// Number of threads, at most one for each processor; the picture does not depend on the number
    /// [default: one for each processor]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::whole_number::<u32>(1..=1024))]
    pub threads: Option<u32>,

    /// Limit on memory, in bytes or with K, M or G, such as 2G; work that needs more is refused
    /// [default: 8G]
    #[arg(long, value_name = "BYTES", allow_hyphen_values = true, value_parser = values::parse_bytes)]
    pub max_memory: Option<u64>,
}

/// Threads, memory and accelerator.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Machine")]
pub struct MachineArgs {
    /// Threads and memory.
    #[command(flatten)]
    pub limits: LimitArgs,

    /// Acceleration structure; the picture does not depend on the structure [default: bvh]
    #[arg(long, value_name = "NAME", value_parser = values::named(&[
        ("bvh", "Bounding volume hierarchy", AcceleratorKind::Tree(BuildQuality::Medium)),
        ("linear", "Linear scan of all objects, for comparison", AcceleratorKind::Linear),
    ]))]
    pub accel: Option<AcceleratorKind>,
}

/// Time limit of a render, checkpoints, and shares of a picture.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Long renders")]
pub struct FilmRequest {
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

impl FilmRequest {
    /// Lists the flags of film files, and whether each is given.
    pub fn flags(&self) -> [(&'static str, bool); 4] {
        [
            ("--checkpoint", self.checkpoint.is_some()),
            ("--resume", self.resume.is_some()),
            ("--replay", self.replay.is_some()),
            ("--part", self.part.is_some()),
        ]
    }
}

/// Reports besides the picture.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Report")]
pub struct ReportRequest {
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
