//! Resolves the arguments of `render` to a task, the work of a run. Code that renders reads the
//! task and no arguments. Errors that depend on the scene, such as an unknown camera or a crop
//! outside the picture, are found here too, before anything is rendered.

mod rungs;
mod shots;
mod view;

use std::cell::OnceCell;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use raywright_core::Settings;
use raywright_core::display::Display;
use raywright_core::framing::{Silhouette, ViewAngles};
use raywright_core::ladder::Ladder;
use raywright_core::picture::Picture;
use raywright_core::scene::{Camera, Scene};
use raywright_core::settings::{Aov, Background, Crop, Sampling};
use raywright_io::output::AnimationFormat;
use raywright_io::{
    EnvironmentOptions, EnvironmentSource, Error, Limits, LoadOptions, ModelOptions,
    ParameterOverrides,
};

use crate::args::values::{BackdropChoice, MaterialChoice, UpDirection};
use crate::args::{
    Accelerator, BackgroundChoice, DisplayArgs, ExposureChoice, FrameTimes, LightArgs,
    MOST_SAMPLES, PictureShare, ProgressStyle, RenderArgs, SceneArgs, TevAddress, ViewArgs,
};
use crate::console::Verbosity;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::scene_input;
pub use rungs::RungChoices;
pub use shots::Shot;

/// Samples per pixel of a quick preview.
const QUICK_SAMPLES: u32 = 16;
/// Largest width and height of a quick preview, in pixels.
const QUICK_SIZE: [u32; 2] = [640, 360];

/// Settings of a picture, and its conversion to display values.
#[derive(Clone, Debug)]
pub struct PicturePlan {
    /// Settings that determine the pixel values, together with the scene.
    pub settings: Settings,
    /// Conversion of pixel values to display values, for all formats but EXR.
    pub display: Display,
    /// Whether the exposure is chosen automatically from the rendered picture.
    pub has_auto_exposure: bool,
}

/// Work of a `render` run, resolved from its arguments.
#[derive(Debug)]
pub struct RenderTask {
    /// Names of the scenes, at least one.
    pub scenes: Vec<OsString>,
    /// Options for loading the scenes: changes, and limits on their size.
    pub options: LoadOptions,
    /// Chosen rungs (quality levels of settings) and switched-off effects.
    pub choices: RungChoices,
    /// Pictures to render of each scene, at least one.
    pub shots: Vec<Shot>,
    /// Whether the run renders a single picture, without a sheet or an animation.
    pub is_single: bool,
    /// Pictures per second of an animation.
    pub frame_rate: f64,
    /// Output files of `-o`. A name may hold a placeholder for the picture's number, such as
    /// `%04d`.
    pub outputs: Vec<PathBuf>,
    /// Output file of the contact sheet, which shows all pictures.
    pub sheet: Option<PathBuf>,
    /// Whether a picture that shows no object is allowed.
    pub allows_empty: bool,
    /// Whether output files record their origin.
    pub has_metadata: bool,
    /// Layers of `--aov`, in addition to colour.
    pub layers: Vec<Aov>,
    /// Target for the root relMSE; `None`: a fixed number of samples.
    pub max_error: Option<f64>,
    /// Whether the run is a quick preview.
    pub is_quick: bool,
    /// Number of threads; `None`: one for each processor.
    pub threads: Option<u32>,
    /// Time limit for the whole run, counted from the program's start.
    pub budget: Option<Duration>,
    /// Film file of `--checkpoint`, which keeps the samples so far.
    pub checkpoint: Option<PathBuf>,
    /// Film file of `--resume`, whose render is continued.
    pub resume: Option<PathBuf>,
    /// Film file of `--replay`, whose sample count in each tile is rendered again.
    pub replay: Option<PathBuf>,
    /// Share of the picture to render, from `--part`; `None`: the whole picture.
    pub part: Option<PictureShare>,
    /// Output file of `--stats`, with times and counts.
    pub stats: Option<PathBuf>,
    /// Whether the hashes of pictures are printed.
    pub hash: bool,
    /// PNG file of `--preview`, updated during the render.
    pub preview: Option<PathBuf>,
    /// Address of the image viewer tev, from `--display`.
    pub display: Option<TevAddress>,
    /// Style of the progress display.
    pub progress: ProgressStyle,
    /// Amount of messages.
    pub verbosity: Verbosity,
    overrides: DisplayOverrides,
}

/// Flags that change settings and display of the scene. A flag that the user did not give changes
/// nothing.
#[derive(Debug)]
struct DisplayOverrides {
    view: ViewArgs,
    light: LightArgs,
    display: DisplayArgs,
    accel: Option<Accelerator>,
}

impl RenderTask {
    /// Resolves the arguments of `render`.
    ///
    /// A usage failure if a flag for a single picture is combined with several pictures.
    pub fn new(args: RenderArgs, verbosity: Verbosity) -> Result<Self, Failure> {
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
        let scenes = if scenes.is_empty() {
            vec![scene_input::default_scene_name()?]
        } else {
            scenes
        };
        let options = build_load_options(&changes, machine.max_memory);
        if let Some(frames) = view.frames.filter(|frames| frames.to == f64::INFINITY) {
            view.frames = Some(FrameTimes {
                to: read_animation_length(&scenes, &options, frames.rate)?,
                ..frames
            });
        }
        let shots = shots::list_shots(&view);
        let is_usual = shots.iter().all(|shot| shot.label.is_empty());
        let is_animation = |path: &PathBuf| AnimationFormat::from_path(path).is_some();
        let task = Self {
            is_single: is_usual
                && scenes.len() <= 1
                && sheet.is_none()
                && !outputs.iter().any(is_animation),
            scenes,
            options,
            choices: RungChoices::from(&choices),
            shots,
            frame_rate: shots::frame_rate(&view),
            outputs,
            sheet,
            allows_empty: allow_empty,
            has_metadata: !no_metadata,
            layers: aov,
            max_error: light.max_error,
            is_quick: light.quick,
            threads: machine.threads,
            budget: film.budget,
            checkpoint: film.checkpoint,
            resume: film.resume,
            replay: film.replay,
            part: film.part,
            stats: report.stats,
            hash: report.hash,
            preview: report.preview,
            display: report.display,
            progress: report.progress,
            verbosity,
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
        !self.allows_empty && self.overrides.view.crop.is_none() && self.part.is_none()
    }

    /// Returns the requested quality of JPEG files, 1 to 100.
    pub fn jpeg_quality(&self) -> Option<u8> {
        self.overrides.display.quality
    }

    /// Whether `--background transparent` requests coverage in place of a background.
    pub fn is_transparent(&self) -> bool {
        self.overrides.view.background == Some(BackgroundChoice::Transparent)
    }

    fn refuse_single_picture_flags(&self) -> Result<(), Failure> {
        let flags = [
            ("--checkpoint", self.checkpoint.is_some()),
            ("--resume", self.resume.is_some()),
            ("--replay", self.replay.is_some()),
            ("--part", self.part.is_some()),
            ("--budget", self.budget.is_some()),
            ("--stats", self.stats.is_some()),
            ("--preview", self.preview.is_some()),
            (
                "-o -",
                self.outputs.iter().any(|path| path.as_os_str() == "-"),
            ),
        ];
        let Some((flag, _)) = flags.iter().find(|(_, given)| *given) else {
            return Ok(());
        };
        let error = Error::invalid_usage(format_args!(
            "{flag} needs a single picture, and several are requested"
        ));
        Err(error
            .with_hint("leave out the flag, or render the pictures one by one")
            .into())
    }

    /// Resolves the settings of a picture of a scene, and applies the chosen rungs (quality levels)
    /// to the scene. The silhouette is computed only if a camera frames the whole scene.
    pub fn resolve_shot(
        &self,
        scene: &mut Scene,
        shot: &Shot,
        silhouette: &OnceCell<Silhouette>,
    ) -> Result<PicturePlan, Failure> {
        let view = shot.resolve_view(|| silhouette.get_or_init(|| Silhouette::from_scene(scene)));
        self.resolve_plan(scene, view, |scene, view, fov, aspect| {
            let silhouette = silhouette.get_or_init(|| Silhouette::from_scene(scene));
            silhouette.frame_camera(
                view.unwrap_or_else(|| silhouette.default_view()),
                fov,
                aspect,
            )
        })
    }

    /// Resolves the settings of a picture of a scene from a view, and applies the chosen rungs
    /// (quality levels of settings) to the scene. `framed` returns the camera that frames the whole
    /// scene, for a view, a vertical field of view in degrees and an aspect ratio. It is called
    /// only if the picture needs that camera and a flag changes the camera.
    pub fn resolve_plan(
        &self,
        scene: &mut Scene,
        view: Option<ViewAngles>,
        framed: impl FnOnce(&Scene, Option<ViewAngles>, f64, f64) -> Camera,
    ) -> Result<PicturePlan, Failure> {
        rungs::refuse_contradicting_flags(&self.choices.rungs, &self.overrides)?;
        let DisplayOverrides {
            view: flags,
            light,
            display,
            accel,
        } = &self.overrides;
        let own_settings = Settings::from_scene(scene);
        let size = flags.size.unwrap_or_else(|| {
            if self.is_quick {
                quick_preview_size(own_settings.size)
            } else {
                own_settings.size
            }
        });
        let mut settings = Settings {
            size,
            crop: flags.crop.map(|crop| check_crop(crop, size)).transpose()?,
            sampling: self.resolve_sampling(scene),
            max_depth: light.max_depth.unwrap_or(own_settings.max_depth),
            clamp: light.clamp,
            integrator: light.integrator.unwrap_or(own_settings.integrator),
            max_error: light.max_error,
            denoise: light.denoise || light.quick,
            seed: light.seed.unwrap_or(own_settings.seed),
            precision: light.precision.map_or(own_settings.precision, Into::into),
            accelerator: accel.map_or(own_settings.accelerator, Into::into),
            background: match flags.background {
                None => own_settings.background,
                Some(BackgroundChoice::Environment) => Background::Environment,
                // A picture over a background colour is rendered with coverage, and composited
                // afterwards.
                Some(BackgroundChoice::Transparent | BackgroundChoice::Colour(_)) => {
                    Background::Transparent
                }
            },
            wireframe: flags.wireframe,
            aovs: self.layers.clone(),
            max_memory: Some(self.options.limits.memory_bytes),
            ..own_settings
        };
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        settings.camera = view::resolve_camera(scene, (flags, view), |view, fov| {
            framed(scene, view, fov, aspect)
        })?;
        let display = Display {
            background: match flags.background {
                Some(BackgroundChoice::Colour(colour)) => Some(colour),
                _ => None,
            },
            ..apply_display_flags(display, Display::from_render(&scene.render))
        };
        self.choices.apply(scene, &mut settings)?;
        let is_exposed = self.overrides.display.exposure == Some(ExposureChoice::Auto);
        Ok(PicturePlan {
            display: Display {
                output: settings.output,
                ..display
            },
            settings,
            has_auto_exposure: is_exposed,
        })
    }

    /// Resolves the samples per pixel. With a time budget or a target error the default is the
    /// largest allowed number. A scene's fixed pattern keeps its own number, because its error does
    /// not fall with more samples.
    fn resolve_sampling(&self, scene: &Scene) -> Sampling {
        let spp = self.overrides.light.spp;
        let named = spp.is_some() || self.choices.has_ladder(Ladder::Samples);
        let open_ended = (self.budget.is_some() || self.replay.is_some()) && !named;
        match Sampling::from_spp(scene, spp) {
            Sampling::General(_) if open_ended => Sampling::General(MOST_SAMPLES),
            own if self.is_quick => quick_preview_sampling(own),
            _ if self.max_error.is_some() => Sampling::General(spp.unwrap_or(MOST_SAMPLES)),
            other => other,
        }
    }
}

/// Returns the length in seconds of the single scene's animation, for `--frames all`.
fn read_animation_length(
    scenes: &[OsString],
    options: &LoadOptions,
    rate: f64,
) -> Result<f64, Failure> {
    let [name] = scenes else {
        return Err(Error::invalid_usage(
            "--frames all needs a single model, and several are named",
        )
        .into());
    };
    let refusal = |reason: String| {
        Error::invalid_usage(format_args!("{}: {reason}", name.display()))
            .with_hint("give the times in seconds: --frames 0..2:25")
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
    match loaded
        .contents
        .animation_seconds(options.model.animation.as_deref())
        .filter(|seconds| *seconds > 0.0)
    {
        None => Err(refusal(
            "--frames all needs an animation longer than 0 s, and the model has none".to_owned(),
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

/// Returns the samples per pixel of a quick preview, at most [`QUICK_SAMPLES`]. A fixed pattern has
/// few samples and is kept.
pub fn quick_preview_sampling(own: Sampling) -> Sampling {
    match own {
        Sampling::General(samples) => Sampling::General(samples.min(QUICK_SAMPLES)),
        fixed => fixed,
    }
}

/// Returns the size of a quick preview: half the width and height, or the largest size of the same
/// shape that fits [`QUICK_SIZE`].
fn quick_preview_size([width, height]: [u32; 2]) -> [u32; 2] {
    let [most_width, most_height] = QUICK_SIZE.map(f64::from);
    let factor = 0.5_f64
        .min(most_width / f64::from(width))
        .min(most_height / f64::from(height));
    [width, height].map(|edge| ((f64::from(edge) * factor).round() as u32).max(1))
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
        let error = Error::invalid_usage(format_args!(
            "{flag} cannot be used with --up X,Y,Z: {flag} shows the whole scene upright, and --up turns a single camera"
        ));
        return Err(error
            .with_hint("turn a model instead: --up z, or another axis")
            .into());
    }
    Ok(ViewArgs {
        up: Some(direction),
        ..view
    })
}

/// Returns the display settings of a scene or a file, as changed by the flags.
pub fn apply_display_flags(requested: &DisplayArgs, display: Display) -> Display {
    Display {
        tone_map: requested.tonemap.unwrap_or(display.tone_map),
        curve: requested.gamma.unwrap_or(display.curve),
        exposure_stops: match requested.exposure {
            Some(ExposureChoice::Stops(stops)) => stops,
            Some(ExposureChoice::Auto) | None => display.exposure_stops,
        },
        ..display
    }
}

/// Returns the display settings as changed by the flags. With `--exposure auto` the exposure is
/// chosen from the picture.
pub fn apply_display_and_exposure(
    requested: &DisplayArgs,
    own_display: Display,
    picture: &Picture,
) -> Display {
    let display = apply_display_flags(requested, own_display);
    match requested.exposure {
        Some(ExposureChoice::Auto) => display.with_suitable_exposure(picture),
        Some(ExposureChoice::Stops(_)) | None => display,
    }
}

/// Returns the crop if it lies inside the picture of this size; otherwise a usage error.
fn check_crop(crop: Crop, [width, height]: [u32; 2]) -> Result<Crop, Failure> {
    let fits = |start: u32, extent: u32, whole: u32| {
        start.checked_add(extent).is_some_and(|end| end <= whole)
    };
    if fits(crop.x, crop.width, width) && fits(crop.y, crop.height, height) {
        return Ok(crop);
    }
    let Crop {
        x,
        y,
        width: w,
        height: h,
    } = crop;
    let message =
        format!("--crop {x},{y},{w},{h} reaches outside the picture of {width}x{height} pixels");
    Err(Error::invalid_usage(message)
        .with_hint(
            "--crop is x,y,width,height in pixels; x and y are distances from the top left corner",
        )
        .into())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    /// Protects: a quick preview has half the width and height, fits its frame without a change of
    /// shape, and has at least one pixel.
    #[test]
    fn first_looks_are_small() {
        let sizes = [
            [64, 48],
            [1280, 720],
            [1920, 1080],
            [1000, 4000],
            [1, 1],
            [16_384, 1],
        ];
        assert_eq!(
            sizes.map(quick_preview_size),
            [
                [32, 24],
                [640, 360],
                [640, 360],
                [90, 360],
                [1, 1],
                [640, 1]
            ]
        );
    }

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

    /// Protects: right and lower edge of a crop are compared with the width and height of the
    /// picture, to the last pixel, and no sum overflows.
    #[test]
    fn crops_lie_inside_the_picture() {
        let fits = |x, y, width, height| {
            check_crop(
                Crop {
                    x,
                    y,
                    width,
                    height,
                },
                [100, 60],
            )
            .is_ok()
        };
        assert!(fits(0, 0, 100, 60) && fits(99, 59, 1, 1));
        assert!(!fits(0, 0, 101, 60) && !fits(1, 0, 100, 60), "right");
        assert!(
            !fits(0, 0, 100, 61) && !fits(0, 50, 10, 11) && !fits(0, 60, 1, 1),
            "below, in a wide picture"
        );
        assert!(!fits(u32::MAX, 0, 1, 1) && !fits(0, u32::MAX, 1, 1));
    }
}
