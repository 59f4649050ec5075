//! `render`: renders scenes to pictures.

pub mod film;
mod live;
pub mod messages;
pub mod picture;
mod series;
pub mod write;

use std::borrow::Cow;
use std::io::{self, IsTerminal};

use raywright_core::denoise::FEWEST_SAMPLES;
use raywright_core::display::Display;
use raywright_core::film::{Film, Uncertainty};
use raywright_core::{ReadyScene, RenderOutput};
use raywright_io::LoadedScene;
use raywright_io::output::{PictureMetadata, pixel_hash};

use crate::failure::Failure;
use crate::notes::Notes;
use crate::plan::{PicturePlan, RenderTask};
use crate::targets::OutputTarget;
use crate::{console, origin, scene_input};
pub use series::run;

/// Advice in the message about a scene with nothing visible.
const ALLOW_EMPTY: &str = "--allow-empty writes the picture nevertheless";

/// A rendered picture with all that its messages and its files need.
struct RenderedPicture<'a> {
    task: &'a RenderTask,
    loaded: &'a LoadedScene,
    ready: &'a ReadyScene,
    plan: &'a PicturePlan,
    film: &'a Film,
    rendered: &'a RenderOutput,
    /// Estimated error of the picture before denoising.
    noisy: Option<Uncertainty>,
}

impl RenderedPicture<'_> {
    /// Returns the estimated error that the final message and the picture's file report. Path
    /// tracing, denoising and a target error each require an estimate. `None` for a Whitted render
    /// without denoising and target error, whose samples have no random error.
    fn reported_error(&self) -> Option<&Uncertainty> {
        let is_random = self.ready.is_path_traced() || self.rendered.denoise_output().is_some();
        let is_reported = is_random || self.task.max_error.is_some();
        self.noisy.as_ref().filter(|_| is_reported)
    }

    /// Returns the estimated error of the displayed picture, denoised or not.
    fn shown_error(&self) -> Option<Uncertainty> {
        let denoised = self.rendered.denoise_output().map(|output| output.error);
        denoised.or(self.reported_error().copied())
    }

    /// Returns the metadata for a picture's file: its origin with the estimated error; empty with
    /// `--no-metadata`.
    fn metadata(&self, origin: PictureMetadata) -> PictureMetadata {
        let error = origin::format_error_metadata(self.reported_error(), self.rendered, self.film);
        match self.task.files.has_metadata {
            true => PictureMetadata { error, ..origin },
            false => PictureMetadata::default(),
        }
    }

    /// Records the notes and warnings about a rendered picture: no visible object, a bad exposure,
    /// lights without effect, and its error. Returns the error for the final message, if known.
    fn add_notes(&self, targets: &[OutputTarget], notes: &mut Notes) -> Option<String> {
        let settings = &self.plan.settings;
        if let Some(reason) =
            scene_input::describe_empty_picture(self.loaded, self.rendered, settings)
        {
            notes.add_picture_warning(reason);
        }
        messages::note_exposure(self, targets, notes);
        messages::note_unreached_lights(self, notes);
        let (noisy, requested) = (self.reported_error(), self.task.max_error);
        messages::report_error(noisy, self.film, self.rendered, requested, notes)
    }

    /// Describes how the picture misses the target error of `--max-error`; `None` if it does not.
    fn describe_shortfall(&self) -> Option<String> {
        let requested = self.task.max_error?;
        messages::describe_shortfall(requested, self.reported_error(), self.film, self.rendered)
    }
}

/// Prints the hash of a picture's pixels if `--hash` is set. A line is printed for each file that
/// holds the pixels, with the name of the file. If no file holds them, a single line with `name` is
/// printed.
fn print_pixel_hash(
    task: &RenderTask,
    (rendered, display): (&RenderOutput, Display),
    files: &[String],
    name: &str,
) -> Result<(), Failure> {
    if !task.report.hash {
        return Ok(());
    }
    let shown = match display.linear_background() {
        None => Cow::Borrowed(rendered.final_picture()),
        Some(colour) => Cow::Owned(rendered.final_picture().composite_over(colour)),
    };
    let (hash, name) = (pixel_hash(&shown), [name.to_owned()]);
    let names = if files.is_empty() { &name } else { files };
    console::print(
        names
            .iter()
            .map(|name| format!("{hash}  {}\n", console::mask_to_one_line(name)))
            .collect::<String>(),
    )
}

/// Records the notes and warnings about a prepared scene, before its render.
fn note_preparation(loaded: &mut LoadedScene, ready: &ReadyScene, notes: &mut Notes) {
    messages::note_effects(loaded, ready.effects(), notes);
    messages::note_missing_edges(loaded, ready, notes);
    messages::note_headlight(ready, notes);
    let faults = ready.faults(&loaded.scene).into_iter();
    let faults = faults.chain(messages::clamp_fault(ready));
    let faults = messages::note_faults(faults, &loaded.scene, notes);
    loaded.warnings.extend(faults);
}

/// Refuses a scene without any object, unless the task allows empty pictures.
pub fn refuse_empty_scene(task: &RenderTask, loaded: &LoadedScene) -> Result<(), Failure> {
    let failure = scene_input::empty_scene_failure(loaded);
    let refused = failure.filter(|_| task.refuses_empty_pictures());
    refused.map_or(Ok(()), |failure| Err(failure.with_hint(ALLOW_EMPTY)))
}

/// Refuses a picture for which a reason is given that it shows no object, unless the task allows
/// empty pictures.
fn refuse_empty_picture(
    task: &RenderTask,
    loaded: &LoadedScene,
    reason: Option<impl std::fmt::Display>,
) -> Result<(), Failure> {
    let failure = |reason| scene_input::empty_picture_failure(&loaded.source.name, reason);
    let refused = reason.filter(|_| task.refuses_empty_pictures());
    refused.map_or(Ok(()), |reason| Err(failure(reason).with_hint(ALLOW_EMPTY)))
}

/// Refuses outputs that cannot hold the requested data, before the scene is loaded: text and a
/// picture on standard output, a picture on a terminal, layers without a file that holds them,
/// coverage in JPEG files, and linear values in any format but OpenEXR.
fn check_targets(task: &RenderTask, targets: &[OutputTarget]) -> Result<(), Failure> {
    let is_stdout = targets.contains(&OutputTarget::Stdout);
    let has_layers = targets.iter().any(OutputTarget::has_layers);
    let all = |holds: fn(&OutputTarget) -> bool| targets.iter().all(holds);
    Failure::refuse_if(
        is_stdout && task.report.hash,
        "-o - and --hash both write to standard output",
        "name a file with -o",
    )?;
    Failure::refuse_if(
        is_stdout && io::stdout().is_terminal(),
        "standard output is a terminal, which cannot show a PNG",
        "send the PNG to a file or a program: raywright render -o - > picture.png",
    )?;
    Failure::refuse_if(
        !task.layers.is_empty() && task.film.checkpoint.is_none() && !has_layers,
        "--aov adds layers to .exr pictures, and no .exr picture is written",
        "add an .exr picture: -o picture.exr",
    )?;
    Failure::refuse_if(
        task.is_transparent() && !all(OutputTarget::has_coverage),
        "--background transparent: a JPEG has no transparency",
        "name a picture that ends in .png or .webp, or choose a colour, such as --background white",
    )?;
    Failure::refuse_if(
        task.wants_linear_output() && !all(OutputTarget::has_layers),
        "--rung output=float writes linear values, which .exr files alone can hold",
        "name pictures that end in .exr, or leave out --rung output=float",
    )
}

/// Refuses `--denoise` for a fixed sample pattern and for too few samples, and adds a hint if no
/// sample is random. A quick preview, which requests denoising by itself, is not refused: where
/// denoising is impossible, the preview is rendered without it.
fn refuse_impossible_denoising(
    task: &RenderTask,
    ready: &ReadyScene,
    notes: &mut Notes,
) -> Result<(), Failure> {
    let settings = ready.settings();
    if !settings.denoise || task.is_quick {
        return Ok(());
    }
    if !ready.depends_on_seed() {
        notes.add_hint(
            "--denoise has no effect: no sample of this picture is random, so that the picture has no noise",
        );
        return Ok(());
    }
    Failure::refuse_if(
        settings.sampling.is_fixed(),
        "--denoise cannot estimate the noise, because the scene has a fixed pattern of samples",
        "add --spp with another number of samples than the fixed pattern has, such as --spp 16: random samples then replace the pattern",
    )?;
    Failure::refuse_if(
        settings.samples() < FEWEST_SAMPLES,
        format_args!(
            "--denoise needs at least {FEWEST_SAMPLES} samples a pixel to estimate the noise"
        ),
        format_args!("give --spp {FEWEST_SAMPLES} or a larger number"),
    )
}
