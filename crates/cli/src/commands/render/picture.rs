//! `render` for an embedding program: the picture is returned in memory instead of written to a
//! file.

use std::cell::OnceCell;
use std::path::Path;
use std::time::Instant;

use raywright_core::display::Display;
use raywright_core::film::Uncertainty;
use raywright_core::picture::Picture;
use raywright_core::{Observer, RenderOutput};
use raywright_io::output::{self, PictureFormat, PictureMetadata};
use raywright_io::{Error, LoadedScene};

use super::{RenderedPicture, film, messages, refuse_empty_scene, write};
use crate::console::Verbosity;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::plan::RenderTask;
use crate::preparation::NOTHING_KEPT;
use crate::{origin, scene_input};

/// A rendered picture in memory, with the metadata that its file would have.
#[derive(Debug)]
pub struct FinishedPicture {
    /// The rendered picture; if a background colour is set, composited over the linear value of
    /// that colour.
    pub rendered: RenderOutput,
    /// The picture with its coverage before compositing, if it has a background colour.
    with_coverage: Option<RenderOutput>,
    /// Conversion of radiance to display values.
    pub display: Display,
    /// Origin and error of the picture, as its file records them.
    pub metadata: PictureMetadata,
    /// Estimated error of the displayed picture; `None` for a picture without random samples.
    pub error: Option<Uncertainty>,
    /// Whether the target error of `--max-error` is reached; `None` without a target.
    pub converged: Option<bool>,
    /// Number of samples per pixel as text, such as `64 samples`.
    pub samples: String,
    /// Notes and warnings that the program would print about the scene and the picture.
    pub notes: Vec<String>,
}

/// Renders the single picture of a task on the caller's thread pool. `command` is the equivalent
/// command line, for the picture's metadata.
pub fn render_to_memory(
    loaded: &mut LoadedScene,
    task: &RenderTask,
    command: String,
    observer: &dyn Observer,
) -> Result<FinishedPicture, Failure> {
    refuse_file_flags(task)?;
    let mut notes = Notes::new(Verbosity::Quiet);
    notes.add_faults(&loaded.warnings);
    scene_input::note_added_parts(loaded, &mut notes);
    refuse_empty_scene(task, loaded)?;
    let watch = BudgetObserver {
        observer,
        deadline: task.film.budget.map(|budget| Instant::now() + budget),
    };
    let (plan, ready, chosen) = task.prepare_first_job(loaded, &OnceCell::new(), &watch)?;
    messages::note_chosen_exposure(chosen, &mut notes);
    messages::note_stray_parts(&plan, &mut notes);
    super::note_preparation(loaded, &ready, &mut notes);
    super::refuse_impossible_denoising(task, &ready, &mut notes)?;
    let mut film = ready.new_film("");
    let whole = film.full_part();
    ready
        .render_part(&mut film, &whole, &watch)
        .map_err(Error::invalid_usage)?;
    let rendered = RenderOutput::from_film(&film, observer);
    if observer.is_cancelled() {
        return Err(Failure::new(Exit::Interrupted, NOTHING_KEPT));
    }
    let reason = scene_input::describe_empty_picture(loaded, &rendered, &plan.settings);
    super::refuse_empty_picture(task, loaded, reason)?;
    messages::note_faults(rendered.counters.faults(), &loaded.scene, &mut notes);
    let picture = RenderedPicture {
        task,
        loaded,
        ready: &ready,
        plan: &plan,
        film: &film,
        rendered: &rendered,
        noisy: rendered.error_before_denoising(&film),
    };
    picture.add_notes(&[], &mut notes);
    let requested = task.max_error;
    let (error, converged) = (
        picture.shown_error(),
        requested.map(|_| picture.describe_shortfall().is_none()),
    );
    let metadata = picture.metadata(PictureMetadata {
        command,
        ..origin::picture_metadata(loaded, &plan, &task.choices)
    });
    let background = plan.display.linear_background();
    let composited = background.map(|colour| rendered.composite_over(colour));
    Ok(FinishedPicture {
        error,
        converged,
        samples: film::format_samples(&film, &whole),
        metadata,
        with_coverage: background.map(|_| rendered.clone()),
        rendered: composited.unwrap_or(rendered),
        display: plan.display,
        notes: notes.into_texts(),
    })
}

impl FinishedPicture {
    /// Encodes the picture as a PNG file in memory.
    pub fn encode_png(&self) -> Result<Vec<u8>, Failure> {
        let bytes = output::encode_png(
            self.output_with_coverage().final_picture(),
            self.display,
            &self.metadata,
        );
        bytes.map_err(|cause| Error::unwritable(Path::new("PNG"), &cause).into())
    }

    /// Writes the picture to a file in the format of its name, as `render -o` does.
    pub fn save(&self, path: &Path) -> Result<(), Failure> {
        let picture = write::select_picture_for_format(
            self.output_with_coverage(),
            PictureFormat::from_path(path)?,
            self.display,
        );
        Ok(output::write_picture(
            path,
            &picture,
            self.display,
            &self.metadata,
        )?)
    }

    /// Returns why the confidence interval of the error may be wrong, or `None` if there is no
    /// reason to doubt it.
    pub fn describe_doubt(&self) -> Option<String> {
        self.error?.doubt.as_ref().map(origin::variant_name)
    }

    /// Returns the picture before compositing over a background colour.
    fn output_with_coverage(&self) -> &RenderOutput {
        self.with_coverage.as_ref().unwrap_or(&self.rendered)
    }

    /// Returns the displayed picture, denoised where requested, with all layers.
    pub fn shown_picture(&self) -> &Picture {
        self.rendered.final_picture()
    }
}

/// Refuses flags that name files or request several pictures, because an embedding program gets a
/// single picture in memory.
pub fn refuse_file_flags(task: &RenderTask) -> Result<(), Failure> {
    let others = [
        ("--output", !task.files.pictures.is_empty()),
        ("--sheet", task.files.sheet.is_some()),
        ("--stats", task.report.stats.is_some()),
        ("--preview", task.report.preview.is_some()),
        ("--display", task.report.display.is_some()),
        ("--hash", task.report.hash),
        ("--views, --turntable or --frames", !task.is_single),
    ];
    let mut flags = others.into_iter().chain(task.film.flags());
    flags.find(|(_, given)| *given).map_or(Ok(()), |(flag, _)| {
        Err(Failure::usage(
            format_args!(
                "{flag} cannot be used here, because the call renders a single picture and returns it"
            ),
            "render each picture with its own call, and save the returned picture",
        ))
    })
}

/// Observer that ends a render at the deadline of its time budget, and otherwise forwards to the
/// caller's observer.
struct BudgetObserver<'a> {
    observer: &'a dyn Observer,
    deadline: Option<Instant>,
}

impl Observer for BudgetObserver<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.observer.progress(done, total);
    }

    fn is_cancelled(&self) -> bool {
        self.observer.is_cancelled()
    }

    fn has_enough_samples(&self, everywhere: bool) -> bool {
        self.observer.has_enough_samples(everywhere)
            || everywhere && self.deadline.is_some_and(|end| Instant::now() >= end)
    }
}
