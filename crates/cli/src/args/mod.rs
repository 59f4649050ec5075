//! The command line as parsed by clap: names, help texts and parsers of all flags.

mod commands;
mod render;
mod scene;
pub mod values;

pub use commands::{
    AccuracyArgs, BenchArgs, CompareArgs, DenoiseArgs, MergeArgs, StabilityArgs, StressArgs,
    ThresholdArgs, ThumbsArgs, ViewerArgs,
};
pub use render::{
    DisplayArgs, FilmRequest, LightArgs, LimitArgs, ProgressStyle, RenderArgs, ReportRequest,
    ViewArgs,
};
pub use scene::{CheckArgs, ChoiceArgs, ExplainArgs, InfoArgs, SceneArgs};
pub use values::{
    BackgroundChoice, ExposureChoice, FrameTimes, MOST_SAMPLES, NamedViews, PictureShare,
    TevAddress,
};

use std::ffi::{OsStr, OsString};

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::Shell;

use crate::console::{ColorChoice, Verbosity};

/// Name of the default preset, the only preset name that the program's code contains.
pub const DEFAULT_PRESET: &str = "whitted";

fn format_examples() -> String {
    format!(
        "Examples:
  raywright                                 Render the preset {DEFAULT_PRESET}
  raywright render preset:{DEFAULT_PRESET} --at 2.5  The same, 2.5 seconds later
  raywright duck.glb                        Render a model to duck.png
  raywright *.glb --sheet models.png        Many models, on one sheet

`raywright COMMAND --help` explains a command and its flags."
    )
}

const SCHEMA_HELP: &str = "\
With the schema, an editor completes and checks scene files while you write:

  raywright schema > scene.schema.json

In a TOML file, the first line may name the schema:

  #:schema ./scene.schema.json";

/// Render a scene - a text file, a glTF, OBJ, STL or PLY model - to a picture.
#[derive(Debug, Parser)]
#[command(name = "raywright", version, propagate_version = false, after_help = format_examples(), max_term_width = 100)]
#[command(subcommand_value_name = "COMMAND", args_override_self = true)]
#[command(override_usage = "raywright [OPTIONS] [COMMAND]\n       raywright [OPTIONS] FILE...")]
pub struct Arguments {
    /// Command to run; without a command, the default preset is rendered.
    #[command(subcommand)]
    pub command: Option<Command>,

    /// Amount and colours of messages.
    #[command(flatten)]
    pub messages: MessageArgs,
}

/// Flags of every command, before or after its name.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct MessageArgs {
    /// Print no messages but errors
    #[arg(short, long, global = true, overrides_with = "verbose")]
    pub quiet: bool,

    /// Print more: every warning and note, and the effects, times, rays and memory of a render
    #[arg(short, long, global = true, overrides_with = "quiet")]
    pub verbose: bool,

    /// Colours of messages: auto (on a terminal, unless NO_COLOR is set or CLICOLOR is 0), always
    /// or never
    #[arg(
        long,
        value_name = "WHEN",
        global = true,
        value_enum,
        default_value_t,
        hide_default_value = true,
        hide_possible_values = true
    )]
    pub color: ColorChoice,
}

impl Arguments {
    /// Parses a command line. A flag that the help of its command hides is refused: commands share
    /// groups of flags, and not every command takes every flag of a group.
    pub fn parse_line(words: Vec<OsString>) -> Result<Self, clap::Error> {
        let mut program = Self::command();
        let matches = program.try_get_matches_from_mut(words)?;
        if let Some((name, typed)) = matches.subcommand()
            && let Some(command) = program.find_subcommand_mut(name)
        {
            let is_refused = |arg: &&Arg| {
                let source = typed.value_source(arg.get_id().as_str());
                arg.is_hide_set() && source == Some(ValueSource::CommandLine)
            };
            let refused = command.get_arguments().find(is_refused);
            if let Some(flag) = refused.and_then(Arg::get_long) {
                let message = format!("`{name}` takes no --{flag}");
                return Err(command.error(ErrorKind::UnknownArgument, message));
            }
        }
        Self::from_arg_matches(&matches)
    }
}

/// A flag: its long name, and its value if the flag takes one.
pub type Flag = (String, Option<String>);

/// Lists the flags of `render` that a command line of any command gives, by their long names.
pub fn list_render_flags(words: Vec<OsString>) -> Vec<Flag> {
    let matches = Arguments::command().try_get_matches_from(words).ok();
    let typed = matches.as_ref().and_then(ArgMatches::subcommand);
    // A command that has parsed nothing lacks the flags of every command.
    let program = Arguments::command();
    let (Some((_, typed)), Some(render)) = (typed, program.find_subcommand("render")) else {
        return Vec::new();
    };
    let mut flags = Vec::new();
    for arg in render.get_arguments() {
        let (id, Some(name)) = (arg.get_id().as_str(), arg.get_long()) else {
            continue;
        };
        if typed.try_contains_id(id).is_err()
            || typed.value_source(id) != Some(ValueSource::CommandLine)
        {
            continue;
        }
        if matches!(arg.get_action(), ArgAction::SetTrue) {
            flags.push((name.to_owned(), None));
            continue;
        }
        for values in typed.get_raw_occurrences(id).into_iter().flatten() {
            let values: Vec<_> = values.map(OsStr::to_string_lossy).collect();
            flags.push((name.to_owned(), Some(values.join(","))));
        }
    }
    flags
}

/// Hides the flags with these ids, which the command does not take.
fn hide_flags(arg: Arg, refused: &[&str]) -> Arg {
    let is_refused = refused.contains(&arg.get_id().as_str());
    arg.hide(is_refused)
}

impl MessageArgs {
    /// Returns the amount of messages that `--quiet` and `--verbose` select.
    pub fn verbosity(self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (false, false) => Verbosity::Normal,
            (false, true) => Verbosity::Verbose,
        }
    }
}

/// A command of the program.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render scenes to pictures; files without a command are rendered too
    Render(Box<RenderArgs>),
    /// Show a scene in the browser while it renders, and move the camera there
    #[command(mut_args = commands::hide_render_flags)]
    View(Box<ViewerArgs>),
    /// Make a picture of parts that were rendered separately
    Merge(MergeArgs),
    /// Filter the noise out of a kept render, and report the error of the result
    Denoise(DenoiseArgs),
    /// List the effects of a scene: simulated, absent, and left out
    Explain(ExplainArgs),
    /// Measure the difference of two pictures
    Compare(CompareArgs),
    /// Show the contents of a scene, model, picture or film file
    Info(InfoArgs),
    /// Check a scene or model file and report every problem
    Check(CheckArgs),
    /// Measure error and time of each rung (quality level), and list those worth their time
    Accuracy(AccuracyArgs),
    /// Measure the time per ray of a linear scan and of a tree, and the growth of both times with
    /// the size of the scene
    #[command(mut_args = commands::hide_light_flags)]
    Bench(BenchArgs),
    /// Measure errors of hard numerical cases on this machine, and compare with the bounds
    Stability(StabilityArgs),
    /// Find causes of a wrong or noisy picture of a scene: place, reason and remedy
    Stress(Box<StressArgs>),
    /// Make a small picture of every model below a folder
    Thumbs(ThumbsArgs),
    /// List the built-in scenes, or print one of them
    Presets(PresetsArgs),
    /// Print the JSON Schema of the scene format
    #[command(after_help = SCHEMA_HELP)]
    Schema,
    /// Print a completion script for a shell
    Completions(CompletionsArgs),
    /// Print the manual page
    Man(ManArgs),
}

/// Arguments of `presets`.
#[derive(Debug, Args)]
#[command(after_help = format!(
    "Examples:
  raywright presets                          A table of names and titles
  raywright presets {DEFAULT_PRESET} > my.scene.toml  A scene to start from"
))]
pub struct PresetsArgs {
    /// Preset whose scene file is printed instead of the table
    pub name: Option<String>,
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  raywright completions bash > ~/.local/share/bash-completion/completions/raywright"
)]
pub struct CompletionsArgs {
    /// Shell of the script
    pub shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  raywright man | man -l -                   Read the manual page
  raywright man render > raywright-render.1  The page of one command")]
pub struct ManArgs {
    /// Command of the manual page [default: the program itself]
    pub command: Option<String>,
}
