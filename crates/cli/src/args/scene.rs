//! Arguments of the commands that read a scene and say something about it.

use std::ffi::OsString;

use clap::Args;

use super::values;

/// Which scene, and what is changed in it before anything else happens.
#[derive(Clone, Debug, Default, Args)]
pub struct SceneArgs {
    /// Time in seconds at which the scene's expressions are evaluated [default: the file's `t`]
    #[arg(long, value_name = "T", value_parser = values::number, allow_hyphen_values = true)]
    pub at: Option<f64>,

    /// Give a parameter of the scene another value; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = values::assignment, action = clap::ArgAction::Append)]
    pub set: Vec<(String, f64)>,
}

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// Scene file (.scene.toml, .scene.json), glTF/GLB or OBJ model, or preset:NAME
    #[arg(value_name = "SCENE")]
    pub scene: OsString,

    /// What is changed in the scene.
    #[command(flatten)]
    pub changes: SceneArgs,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Scene file (.scene.toml, .scene.json), glTF/GLB or OBJ model, or preset:NAME
    #[arg(value_name = "FILE")]
    pub scene: OsString,

    /// What is changed in the scene.
    #[command(flatten)]
    pub changes: SceneArgs,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
#[command(after_help = "Exit code: 0 the file can be rendered, 3 it cannot, 4 it cannot be read, 5 it is over a limit.")]
pub struct CheckArgs {
    /// Scene file (.scene.toml, .scene.json), glTF/GLB or OBJ model, or preset:NAME
    #[arg(value_name = "FILE")]
    pub scene: OsString,

    /// What is changed in the scene.
    #[command(flatten)]
    pub changes: SceneArgs,
}
