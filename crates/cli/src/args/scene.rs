//! Arguments that change a scene or choose rungs (quality levels of settings), and arguments of
//! `explain`, `info` and `check`, which render no picture.

use std::ffi::OsString;
use std::time::Duration;

use clap::Args;
use raywright_core::effects::Effect;
use raywright_core::fault::FaultKind;
use raywright_core::ladder::RungChoice;
use raywright_io::{EnvironmentSource, GroundRule, SectionPlane};

use super::values;

/// Changes to the scene or model.
#[derive(Clone, Debug, Default, Args)]
pub struct SceneArgs {
    /// Time in seconds at which the scene's expressions are evaluated, or a glTF file's animations
    /// are shown [default: the file's `t`; models at rest]
    #[arg(long, value_name = "T", value_parser = values::parse_number, allow_hyphen_values = true)]
    pub at: Option<f64>,

    /// Set a parameter of the scene to another value; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = values::parse_assignment, action = clap::ArgAction::Append)]
    pub set: Vec<(String, f64)>,

    /// Scene of a glTF file, by name or by index from 0 [default: the file's own choice]
    #[arg(long = "scene", value_name = "NAME|INDEX")]
    pub model_scene: Option<String>,

    /// Variant of a glTF file's materials, by name; `raywright info FILE` lists scenes, variants
    /// and animations
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,

    /// Animation of a glTF file to show, by name, by index from 0, or all of them together
    /// [default: all]
    #[arg(long, value_name = "NAME|INDEX|all")]
    pub animation: Option<String>,

    /// Up direction: an axis of a model (y, z, x, -y, -z, -x), which turns the model before studio,
    /// views and films are set up; or a direction X,Y,Z, which turns only the camera [default: y;
    /// of STL z]
    #[arg(long, value_name = "AXIS|X,Y,Z", value_parser = values::parse_up_direction, allow_hyphen_values = true)]
    pub up: Option<values::UpDirection>,

    /// Material of every surface, to judge shapes: clay, a matte neutral grey. Alpha cut-outs stay
    /// cut out, glass becomes opaque, lamps still emit light
    #[arg(long, value_name = "clay", value_parser = values::one_of(&[("clay", values::MaterialChoice::Clay)]))]
    pub material: Option<values::MaterialChoice>,

    /// Cut models: x=0.3 keeps the side below 0.3 along x, -x=0.3 the side above, in axes and units
    /// of the file, as `raywright info` states them. x=30% is measured in percent of the box around
    /// the model. Closed meshes get a hatched cap; shapes that are no meshes stay whole
    #[arg(long, value_name = "AXIS=VALUE", value_parser = <SectionPlane as std::str::FromStr>::from_str, allow_hyphen_values = true)]
    pub section: Option<SectionPlane>,

    /// Environment in place of the scene's own: none, default (the neutral grey sky of scenes
    /// without light), studio (a room with soft boxes) or outdoor (a blue sky with a sun), which
    /// are also seen behind the scene, or an equirectangular picture (.hdr, .exr, .png, .jpg)
    #[arg(long, value_name = "none|default|studio|outdoor|FILE", value_parser = values::environment_parser())]
    pub env: Option<EnvironmentSource>,

    /// Light the scene by the default studio in place of its own lights and sky. A model without
    /// lights gets the studio anyway. The studio has soft key, fill and rim lights that turn with
    /// the camera, a backdrop that is dark behind bright models and light behind dark models, and a
    /// ground that shows only shadows; --env none leaves out all of these
    #[arg(long, conflicts_with = "env")]
    pub studio: bool,

    /// Ground of the studio: auto (it shows shadows and is otherwise invisible) or none
    #[arg(long, value_name = "auto|none", value_parser = values::one_of(&[("auto", GroundRule::Auto), ("none", GroundRule::None)]), default_value = "auto", hide_default_value = true)]
    pub ground: GroundRule,

    /// Backdrop of the studio, the same for all pictures of a run: dark, light, or auto, which is
    /// dark behind a bright first model and light behind a dark first model
    #[arg(long, value_name = "auto|dark|light", value_parser = values::one_of(&values::BackdropChoice::NAMED))]
    pub backdrop: Option<values::BackdropChoice>,

    /// Turn the environment by this many degrees about +y: 90 shows along +z the part that was
    /// along +x
    #[arg(long, value_name = "DEG", value_parser = values::parse_number, allow_hyphen_values = true)]
    pub env_rotation: Option<f64>,

    /// Factor on the environment's light, 0 or more
    #[arg(long, value_name = "X", value_parser = values::parse_non_negative, allow_hyphen_values = true)]
    pub env_strength: Option<f64>,

    /// Read files outside the scene's folder, too, if the scene names them by absolute paths, `..`
    /// or links
    #[arg(long)]
    pub allow_outside: bool,
}

/// Chosen rungs (quality levels of settings) and switched-off effects.
#[derive(Clone, Debug, Default, Args)]
pub struct ChoiceArgs {
    /// Use another rung (quality level) of a ladder, such as ray-offset=constant; may be repeated.
    /// `raywright explain SCENE` lists the ladders that affect a scene
    #[arg(long = "rung", value_name = "LADDER=RUNG", value_parser = RungChoice::parse, value_delimiter = ',')]
    pub rungs: Vec<RungChoice>,

    /// Effects to switch off
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        value_parser = values::parse_effect,
        help = format!("Switch effects off, separated by commas: {}", values::list_switchable_effects())
    )]
    pub without: Vec<Effect>,
}

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// Scene file (.scene.toml, .scene.json), glTF/GLB, OBJ, STL or PLY model, preset:NAME, or -
    /// for standard input
    #[arg(value_name = "SCENE")]
    pub scene: OsString,

    /// Changes to the scene.
    #[command(flatten)]
    pub changes: SceneArgs,

    /// Chosen rungs (quality levels of settings) and switched-off effects.
    #[command(flatten)]
    pub choices: ChoiceArgs,

    /// Render the scene with and without each effect, in turns and at a reduced size, and report
    /// the cost in time and the change of the picture
    #[arg(long)]
    pub measure: bool,

    /// Total time for measuring, such as 90s or 5min
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, default_value = "30s", value_parser = values::parse_duration, requires = "measure")]
    pub budget: Duration,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Scene file (.scene.toml, .scene.json), glTF/GLB, OBJ, STL or PLY model, preset:NAME, - for
    /// standard input, or a picture (.png, .exr) or film made by this program, whose estimated error,
    /// scene and settings are shown
    #[arg(value_name = "FILE")]
    pub scene: OsString,

    /// Changes to the scene.
    #[command(flatten)]
    pub changes: SceneArgs,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit code: 0 the files can be rendered; otherwise the code of the first file with a problem: 3 it cannot be \
                        rendered or has warnings that are denied, 4 it cannot be read, 5 it is over a limit."
)]
pub struct CheckArgs {
    /// Scene files (.scene.toml, .scene.json), glTF/GLB, OBJ, STL or PLY models, preset:NAME, or -
    /// for standard input
    #[arg(value_name = "FILE", required = true)]
    pub scenes: Vec<OsString>,

    /// Print JSON instead of lines
    #[arg(long)]
    pub json: bool,

    /// Treat warnings as errors; notes stay notes
    #[arg(long)]
    pub deny_warnings: bool,

    /// Codes of warnings that --deny-warnings allows, separated by commas; each printed warning
    /// ends with its code in brackets
    #[arg(long, value_name = "CODE", value_delimiter = ',', value_parser = values::parse_warning_code, requires = "deny_warnings")]
    pub allow: Vec<FaultKind>,

    /// Changes to the scene.
    #[command(flatten)]
    pub changes: SceneArgs,
}
