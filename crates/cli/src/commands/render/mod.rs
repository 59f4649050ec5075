//! `render`: renders scenes to pictures.

pub mod film;
mod live;
pub mod messages;
pub mod picture;
mod series;
mod tev;
pub mod write;

use std::borrow::Cow;
use std::io::{self, IsTerminal};

use raywright_core::denoise::FEWEST_SAMPLES;
use raywright_core::display::{Display, OutputFormat};
use raywright_core::film::Uncertainty;
use raywright_core::ladder::RungValue;
use raywright_core::settings::Settings;
use raywright_core::{ReadyScene, RenderOutput};
use raywright_io::output::{PictureFormat, PictureMetadata, pixel_hash};
use raywright_io::{LoadOptions, LoadedScene};

use crate::console;
use crate::failure::Failure;
use crate::notes::Notes;
use crate::plan::{PicturePlan, RenderTask};
use crate::session::Session;
use crate::targets::OutputTarget;
use crate::{origin, scene_input};
use film::FilmRender;
use live::LivePreviews;
pub use series::run;

/// Advice in the message about a scene with nothing visible.
const ALLOW_EMPTY: &str = "--allow-empty writes the picture nevertheless";

/// Selects the estimated error that the final message and the picture's file report. Path tracing,
/// denoising and a target error each require an estimate. `None` for a Whitted render without
/// denoising and target error, whose samples have no random error.
fn select_reported_error<'a>(
    task: &RenderTask,
    (ready, rendered): (&ReadyScene, &RenderOutput),
    noisy: Option<&'a Uncertainty>,
) -> Option<&'a Uncertainty> {
    noisy.filter(|_| {
        ready.is_path_traced() || task.max_error.is_some() || rendered.denoise_output().is_some()
    })
}

/// Returns the metadata for a picture's file: origin and estimated error; empty with
/// `--no-metadata`.
fn picture_metadata(
    task: &RenderTask,
    film_render: &FilmRender,
    rendered: &RenderOutput,
    noisy: Option<&Uncertainty>,
) -> PictureMetadata {
    match task.files.has_metadata {
        true => PictureMetadata {
            error: origin::format_error_metadata(noisy, rendered, film_render.film()),
            ..film_render.metadata().clone()
        },
        false => PictureMetadata::default(),
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
    if !task.files.hash {
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

/// Returns the file format of a picture whose file name the user did not give.
fn default_picture_format(task: &RenderTask) -> PictureFormat {
    if wants_linear_output(task) {
        PictureFormat::Exr
    } else {
        PictureFormat::Png
    }
}

/// Starts the render of a picture, with its film and its live previews. `label` is the
/// suffix of the picture's name.
fn start_film_render<'a>(
    task: &'a RenderTask,
    options: &LoadOptions,
    (loaded, ready): (&LoadedScene, &ReadyScene),
    (plan, label): (&PicturePlan, &str),
) -> Result<FilmRender<'a>, Failure> {
    let stem = &loaded.source.stem;
    let name = if label.is_empty() {
        stem.clone()
    } else {
        format!("{stem}-{label}")
    };
    let identity = origin::format_scene_identity(loaded, options, &task.choices);
    let metadata = origin::picture_metadata(loaded, plan, &task.choices);
    let onlookers = LivePreviews::from_task(task, &name)?;
    Ok(FilmRender::start(task, ready, identity, metadata, plan.display)?.with_previews(onlookers))
}

/// Records the notes and warnings about a prepared scene, before its render.
fn note_preparation(
    loaded: &mut LoadedScene,
    ready: &ReadyScene,
    settings: &Settings,
    notes: &mut Notes,
) {
    messages::note_effects(loaded, ready.effects(), notes);
    messages::note_lost_objects(loaded, ready, notes);
    messages::note_unresolved_objects(loaded, ready, notes);
    messages::note_missing_edges(loaded, settings, notes);
    messages::note_closed_gaps(loaded, ready, settings, notes);
    messages::note_light_leaks(loaded, ready, settings, notes);
    messages::note_clamp_bias(loaded, ready, settings, notes);
    messages::note_headlight(ready, notes);
}

/// Records the notes and warnings about a rendered picture: no visible object, or a bad exposure.
fn note_picture(
    loaded: &LoadedScene,
    rendered: &RenderOutput,
    plan: &PicturePlan,
    targets: &[OutputTarget],
    notes: &mut Notes,
) {
    if let Some(reason) = scene_input::describe_empty_picture(loaded, rendered, &plan.settings) {
        notes.add_warning(reason);
    }
    messages::note_exposure(rendered, plan, targets, notes);
}

/// Refuses outputs that cannot hold the requested data, before the scene is loaded: text and a
/// picture on standard output, a picture on a terminal, layers without a file that holds them,
/// coverage in JPEG files, and linear values in any format but OpenEXR.
fn check_targets(task: &RenderTask, targets: &[OutputTarget]) -> Result<(), Failure> {
    let is_stdout = targets.contains(&OutputTarget::Stdout);
    let has_layers = targets.iter().any(OutputTarget::has_layers);
    let all = |holds: fn(&OutputTarget) -> bool| targets.iter().all(holds);
    Failure::refuse_if(
        is_stdout && task.files.hash,
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
        wants_linear_output(task) && !all(OutputTarget::has_layers),
        "--rung output=float writes linear values, which .exr files alone can hold",
        "name pictures that end in .exr, or leave out --rung output=float",
    )
}

/// Whether `--rung output=float` requests linear values in all output files.
fn wants_linear_output(task: &RenderTask) -> bool {
    task.choices
        .rungs
        .iter()
        .any(|choice| choice.value() == RungValue::Output(OutputFormat::Float))
}

/// Refuses `--denoise` for a fixed sample pattern and for too few samples, and adds a hint if no
/// sample is random. A quick preview, which requests denoising by itself, is not refused: where
/// denoising is impossible, the preview is rendered without it.
fn refuse_impossible_denoising(
    task: &RenderTask,
    settings: &Settings,
    ready: &ReadyScene,
    notes: &mut Notes,
) -> Result<(), Failure> {
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
        settings.sampling.samples_per_pixel() < FEWEST_SAMPLES,
        format_args!(
            "--denoise needs at least {FEWEST_SAMPLES} samples a pixel to estimate the noise"
        ),
        format_args!("give --spp {FEWEST_SAMPLES} or a larger number"),
    )
}

/// Starts the early stage of a run (loading and preparation). The time budget and the memory limit
/// may end the program in this stage. In a run of several scenes the memory limit does not end the
/// program, because a single large scene must not prevent the render of the others.
fn start_early_stage(task: &RenderTask, session: &mut Session) -> Result<(), Failure> {
    let memory = if task.scenes.len() > 1 {
        u64::MAX
    } else {
        task.options.limits.memory_bytes
    };
    session.start_limited_stage(&task.scenes[0], memory, task.film.budget)
}

/// Formats size, samples and estimated error of a picture for the final message.
fn describe_picture(
    task: &RenderTask,
    settings: &Settings,
    film_render: &FilmRender,
    rendered: &RenderOutput,
    noisy: Option<&Uncertainty>,
    notes: &mut Notes,
) -> String {
    let error = messages::report_error(noisy, film_render.film(), rendered, task.max_error, notes);
    let error = error.map(|error| format!(", {error}")).unwrap_or_default();
    format_size_and_samples(settings, film_render) + &error
}

fn format_size_and_samples(settings: &Settings, film_render: &FilmRender) -> String {
    let [width, height] = settings
        .crop
        .map_or(settings.size, |crop| [crop.width, crop.height]);
    format!("{width}x{height}, {}", film_render.format_samples())
}
