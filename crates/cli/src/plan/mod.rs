//! Resolves the arguments of `render` to a task, the work of a run. Code that renders reads the
//! task and no arguments. Errors that depend on the scene, such as an unknown camera or a crop
//! outside the picture, are found here too, before anything is rendered.

mod display;
mod settings;
mod view;

use std::ffi::OsString;
use std::path::PathBuf;

use raywright_core::bvh::AcceleratorKind;
use raywright_core::display::OutputFormat;
use raywright_core::framing::ViewAngles;
use raywright_core::ladder::RungValue;
use raywright_core::settings::Aov;
use raywright_io::output::{AnimationFormat, PictureFormat};
use raywright_io::{
    EnvironmentOptions, EnvironmentSource, Error, Limits, LoadOptions, ModelOptions,
    ParameterOverrides,
};

use crate::args::values::{BackdropChoice, MaterialChoice, UpDirection};
use crate::args::{
    BackgroundChoice, DisplayArgs, ExposureChoice, FilmRequest, FrameTimes, LightArgs, RenderArgs,
    ReportRequest, SceneArgs, ViewArgs,
};
use crate::failure::Failure;
use crate::progress::Progress;
use crate::scene_input;
pub use display::{ChosenExposure, apply_display_and_exposure, choose_exposure};
pub use settings::{PicturePlan, RungChoices};
pub use view::PictureJob;

/// Work of a `render` run, resolved from its arguments.
#[derive(Debug)]
pub struct RenderTask {
    /// Names of the scenes, at least one.
    pub scenes: Vec<OsString>,
    /// Options for loading the scenes: changes, and limits on their size.
    pub options: LoadOptions,
    /// Chosen rungs (quality levels of settings) and switched-off effects.
    pub choices: RungChoices,
    /// Pictures of the run, ordered by scene, and within a scene by view, angle or time.
    pub jobs: Vec<PictureJob>,
    /// Whether the run renders a single picture, without a sheet or an animation.
    pub is_single: bool,
    /// Whether a picture that shows no object is allowed.
    pub allows_empty: bool,
    /// Layers of `--aov`, in addition to colour.
    pub layers: Vec<Aov>,
    /// Target for the root relMSE; `None`: a fixed number of samples.
    pub max_error: Option<f64>,
    /// Whether the run is a quick preview.
    pub is_quick: bool,
    /// Requested output files.
    pub files: OutputRequest,
    /// Time limit, film files and share of the picture.
    pub film: FilmRequest,
    /// Reports, previews and progress.
    pub report: ReportRequest,
    overrides: DisplayOverrides,
}

/// Output files of a `render` run.
#[derive(Debug)]
pub struct OutputRequest {
    /// Files of `-o`. A name may hold a placeholder for the picture's number, such as `%04d`.
    pub pictures: Vec<PathBuf>,
    /// Contact sheet, which shows all pictures.
    pub sheet: Option<PathBuf>,
    /// Pictures per second of an animation.
    pub frame_rate: f64,
    /// Requested quality of JPEG files, 1 to 100.
    pub quality: Option<u8>,
    /// Whether the files record their origin.
    pub has_metadata: bool,
}

/// Flags that change settings and display of the scene. A flag that the user did not give changes
/// nothing.
#[derive(Debug)]
struct DisplayOverrides {
    view: ViewArgs,
    light: LightArgs,
    display: DisplayArgs,
    accel: Option<AcceleratorKind>,
}

impl RenderTask {
    /// Resolves the arguments of `render`.
    ///
    /// A usage failure if a flag for a single picture is combined with several pictures.
    pub fn new(args: RenderArgs) -> Result<Self, Failure> {
        let RenderArgs {
            scenes,
            outputs,
            sheet,
            allow_empty,
            no_metadata,
            aov,
            changes,
            view,
            light,
            choices,
            display,
            machine,
            film,
            report,
        } = args;
        let mut view = with_up_direction(view, changes.up)?;
        let scenes = with_default_scene(scenes)?;
        let options = build_load_options(&changes, machine.limits.max_memory);
        view.frames = view
            .frames
            .map(|frames| with_animation_length(frames, &scenes, &options))
            .transpose()?;
        let jobs = view::list_jobs(&view);
        let is_usual = jobs.iter().all(|job| job.label.is_empty());
        let jobs_of = |scene| {
            let jobs = jobs.iter().cloned();
            jobs.map(move |job| PictureJob { scene, ..job })
        };
        let is_animation = |path: &PathBuf| AnimationFormat::from_path(path).is_some();
        let task = Self {
            is_single: is_usual
                && scenes.len() <= 1
                && sheet.is_none()
                && !outputs.iter().any(is_animation),
            jobs: (0..scenes.len()).flat_map(jobs_of).collect(),
            scenes,
            options,
            choices: RungChoices::from(&choices),
            allows_empty: allow_empty,
            layers: aov,
            max_error: light.max_error,
            is_quick: light.quick,
            files: OutputRequest {
                pictures: outputs,
                sheet,
                frame_rate: view::frame_rate(&view),
                quality: display.quality,
                has_metadata: !no_metadata,
            },
            film,
            report,
            overrides: DisplayOverrides {
                view,
                light,
                display,
                accel: machine.accel,
            },
        };
        if !task.is_single {
            task.refuse_single_picture_flags()?;
        }
        Ok(task)
    }

    /// Whether a picture that shows no object is refused. A crop, or the part of a picture that
    /// `--part` selects, may show no object.
    pub fn refuses_empty_pictures(&self) -> bool {
        !self.allows_empty && self.overrides.view.crop.is_none() && self.film.part.is_none()
    }

    /// Creates the task of a thumbnail: a square quick preview with automatic exposure, of a view or
    /// of the scene's own camera.
    pub fn thumbnail(
        scene: OsString,
        edge: u32,
        view: Option<ViewAngles>,
    ) -> Result<Self, Failure> {
        Self::new(RenderArgs {
            scenes: vec![scene],
            allow_empty: true,
            view: ViewArgs {
                size: Some([edge; 2]),
                view,
                ..ViewArgs::default()
            },
            light: LightArgs {
                quick: true,
                ..LightArgs::default()
            },
            display: DisplayArgs {
                exposure: Some(ExposureChoice::Auto),
                ..DisplayArgs::default()
            },
            ..RenderArgs::default()
        })
    }

    /// Whether the run keeps samples: in EXR files or a float viewer, as layers, or in films.
    fn keeps_samples(&self) -> bool {
        let is_exr =
            |path: &PathBuf| matches!(PictureFormat::from_path(path), Ok(PictureFormat::Exr));
        let mut films = self.film.flags().into_iter();
        !self.layers.is_empty()
            || self.wants_linear_output()
            || self.files.pictures.iter().any(is_exr)
            || self.report.display.is_some()
            || films.any(|(_, is_given)| is_given)
    }

    /// Whether `--rung output=float` requests linear values in all output files.
    pub fn wants_linear_output(&self) -> bool {
        let mut rungs = self.choices.rungs.iter();
        rungs.any(|choice| choice.value() == RungValue::Output(OutputFormat::Float))
    }

    /// Returns the number of pictures of each scene.
    pub fn pictures_per_scene(&self) -> usize {
        self.jobs.len() / self.scenes.len()
    }

    /// Whether `--background transparent` requests coverage in place of a background.
    pub fn is_transparent(&self) -> bool {
        self.overrides.view.background == Some(BackgroundChoice::Transparent)
    }

    fn refuse_single_picture_flags(&self) -> Result<(), Failure> {
        let stdout = |path: &PathBuf| path.as_os_str() == "-";
        let others = [
            ("--budget", self.film.budget.is_some()),
            ("--stats", self.report.stats.is_some()),
            ("--preview", self.report.preview.is_some()),
            ("-o -", self.files.pictures.iter().any(stdout)),
        ];
        let mut flags = self.film.flags().into_iter().chain(others);
        flags.find(|(_, given)| *given).map_or(Ok(()), |(flag, _)| {
            Err(Failure::usage(
                format_args!("{flag} needs a single picture, and several are requested"),
                "leave out the flag, or render the pictures one by one",
            ))
        })
    }
}

/// Returns the names of the scenes, or the name of the default scene if none is named.
fn with_default_scene(scenes: Vec<OsString>) -> Result<Vec<OsString>, Failure> {
    if scenes.is_empty() {
        Ok(vec![scene_input::default_scene_name()?])
    } else {
        Ok(scenes)
    }
}

/// Adds an up direction of `--up` to the flags of the view. Views of the whole scene are refused,
/// because they are always upright.
fn with_up_direction(view: ViewArgs, up: Option<UpDirection>) -> Result<ViewArgs, Failure> {
    let Some(UpDirection::Direction(direction)) = up else {
        return Ok(view);
    };
    let view_flags = [
        ("--view", view.view.is_some()),
        ("--views", view.views.is_some()),
        ("--turntable", view.turntable.is_some()),
    ];
    if let Some((flag, _)) = view_flags.iter().find(|(_, given)| *given) {
        return Err(Failure::usage(
            format_args!(
                "{flag} cannot be used with --up X,Y,Z: {flag} shows the whole scene upright, and --up turns a single camera"
            ),
            "turn a model instead: --up z, or another axis",
        ));
    }
    Ok(ViewArgs {
        up: Some(direction),
        ..view
    })
}

/// Returns the load limits with a memory limit in bytes; `None`: the default limit.
pub fn build_limits(memory: Option<u64>) -> Limits {
    let own = Limits::default();
    Limits {
        memory_bytes: memory.unwrap_or(own.memory_bytes),
        ..own
    }
}

/// Resolves the arguments that change a scene to load options.
pub fn build_load_options(changes: &SceneArgs, memory: Option<u64>) -> LoadOptions {
    LoadOptions {
        overrides: ParameterOverrides {
            time: changes.at,
            set: changes.set.clone(),
        },
        model: ModelOptions {
            scene: changes.model_scene.clone(),
            variant: changes.variant.clone(),
            animation: changes.animation.clone().filter(|name| name != "all"),
            up: match changes.up {
                Some(UpDirection::Axis(axis)) => Some(axis),
                Some(UpDirection::Direction(_)) | None => None,
            },
        },
        environment: EnvironmentOptions {
            source: if changes.studio {
                Some(EnvironmentSource::Studio)
            } else {
                changes.env.clone()
            },
            ground: changes.ground,
            backdrop: changes.backdrop.and_then(BackdropChoice::radiance),
            rotation: changes.env_rotation,
            strength: changes.env_strength,
        },
        clay: changes.material == Some(MaterialChoice::Clay),
        section: changes.section,
        allow_outside: changes.allow_outside,
        limits: build_limits(memory),
    }
}

/// Replaces the end of `--frames all` by the length in seconds of the animation.
pub fn with_animation_length(
    frames: FrameTimes,
    scenes: &[OsString],
    options: &LoadOptions,
) -> Result<FrameTimes, Failure> {
    if frames.to < f64::INFINITY {
        return Ok(frames);
    }
    Ok(FrameTimes {
        to: read_animation_length(scenes, options, frames.rate)?,
        ..frames
    })
}

/// Returns the length in seconds of the single scene's animation, for `--frames all`.
fn read_animation_length(
    scenes: &[OsString],
    options: &LoadOptions,
    rate: f64,
) -> Result<f64, Failure> {
    let [name] = scenes else {
        return Err(Error::invalid_usage(
            "--frames all needs a single model, and several are named; give each model a run of its own",
        )
        .into());
    };
    let refusal = |reason: String| {
        Error::invalid_usage(format_args!("{}: {reason}", name.display()))
            .with_hint("give start and end in seconds, and the pictures per second: --frames 0..2:25 is the time from 0 s to 2 s at 25 pictures per second")
    };
    if name == "-" {
        return Err(refusal(
            "standard input can be read only once, and --frames all reads the length of the animation first".to_owned(),
        )
        .into());
    }
    let loaded = scene_input::load_with_progress(
        &scene_input::resolve_input(name, &options.limits)?,
        options,
        &Progress::hidden(),
    )?;
    match scene_input::loop_seconds(&loaded, options.model.animation.as_deref()) {
        None => Err(refusal(
            "--frames all needs an animation longer than 0 s, or a scene file with a `period`"
                .to_owned(),
        )
        .into()),
        Some(seconds) if seconds * rate > FrameTimes::MOST_TIMES => Err(refusal(format!(
            "{} pictures are too many; the largest number is 100000",
            seconds * rate
        ))
        .into()),
        Some(seconds) => Ok(seconds),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    /// Protects: only this module reads clap's structures of `render`. Code that this module calls
    /// reads none, and other commands read only their own arguments.
    #[test]
    fn what_was_typed_is_not_known_below() {
        let (root, mut folders, mut looked_at) = (
            Path::new(env!("CARGO_MANIFEST_DIR")).join("src"),
            vec![PathBuf::new()],
            0,
        );
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(root.join(&folder)).expect("a folder") {
                let entry = entry.expect("a file or a folder");
                let (path, inside) = (folder.join(entry.file_name()), entry.path());
                let commands = Path::new("commands");
                let is_command = folder == commands
                    || folder.parent() == Some(commands) && path.ends_with("mod.rs");
                if inside.is_dir() && !["args", "plan"].contains(&path.to_string_lossy().as_ref()) {
                    folders.push(path);
                } else if inside.is_file() {
                    let text = fs::read_to_string(&inside).expect("a source");
                    let typed = if is_command && !path.starts_with("commands/render") {
                        "RenderArgs"
                    } else {
                        "Args"
                    };
                    let names_it = text.lines().any(|line| line.contains(typed));
                    assert!(!names_it, "{} names {typed}", path.display());
                    looked_at += 1;
                }
            }
        }
        assert!(looked_at > 30, "{looked_at}");
    }
}
