//! A picture that is handed over instead of written.

use std::cell::OnceCell;
use std::path::Path;
use std::time::Instant;

use raywright_core::display::Display;
use raywright_core::film::Uncertainty;
use raywright_core::picture::Picture;
use raywright_core::{Observer, Rendered};
use raywright_io::output::{self, Format, Metadata};
use raywright_io::{Error, Loaded};

use super::{ALLOW_EMPTY, film, tell, write};
use crate::console::Verbosity;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::plan::Task;
use crate::ready::{NOTHING_KEPT, prepared};
use crate::{origin, scene_input};

/// A picture in memory, with all that a file of it says.
#[derive(Debug)]
pub struct FinishedPicture {
    /// What was rendered, before the linear value of a background.
    pub rendered: Rendered,
    /// The same with its coverage, where a background is laid behind it.
    covered: Option<Rendered>,
    /// How it is shown.
    pub display: Display,
    /// Where it comes from.
    pub metadata: Metadata,
    /// How far what is shown probably is from the true picture, where chance decides about it.
    pub error: Option<Uncertainty>,
    /// Whether the error that was asked for is reached; none where none was.
    pub converged: Option<bool>,
    /// Samples of a pixel, in words.
    pub samples: String,
    /// What the program would have said of scene and picture.
    pub notes: Vec<String>,
}

/// Renders the one picture of a task on the thread pool that this is called from. `command` is what
/// the program would have been given.
pub fn render(
    mut loaded: Loaded,
    task: &Task,
    command: String,
    observer: &dyn Observer,
) -> Result<FinishedPicture, Failure> {
    refuse_files(task)?;
    let mut notes = Notes::new(Verbosity::Quiet);
    notes.warn_of(&loaded);
    scene_input::note_completed(&loaded, &mut notes);
    if let Some(failure) = scene_input::nothing_to_see(&loaded).filter(|_| task.refuses_empty()) {
        return Err(failure.with_hint(ALLOW_EMPTY));
    }
    let watch = Budgeted {
        observer,
        deadline: task.budget.map(|budget| Instant::now() + budget),
    };
    let mut plan = task.settle_shot(&mut loaded.scene, &task.shots[0], &OnceCell::new())?;
    let ready = prepared(&loaded, &plan.settings, &watch)?;
    super::note_prepared(&mut loaded, &ready, &plan.settings, &mut notes);
    super::refuse_to_denoise(task, &plan.settings, &ready, &mut notes)?;
    let mut film = ready.film("");
    let whole = film.whole();
    ready
        .render_part(&mut film, &whole, &watch)
        .map_err(Error::usage)?;
    let rendered = Rendered::of(&film, observer);
    if observer.cancelled() {
        return Err(Failure::new(Exit::Interrupted, NOTHING_KEPT));
    }
    if let Some(why) = scene_input::nothing_met(&loaded, &rendered, &plan.settings)
        .filter(|_| task.refuses_empty())
    {
        return Err(scene_input::empty(&loaded.source.name, why).with_hint(ALLOW_EMPTY));
    }
    if plan.is_exposed {
        plan.display = plan.display.suited_to(rendered.shown());
    }
    tell::note_losses(&rendered.counters, &mut notes);
    super::note_rendered(&loaded, &rendered, &plan, &[], &mut notes);
    tell::note_shut_away(&loaded, &ready, &film, &mut notes);
    let noisy = film.uncertainty();
    let noisy = super::claimed(task, (&ready, &rendered), noisy.as_ref());
    tell::error(noisy, &film, &rendered, task.max_error, &mut notes);
    let shortfall = task
        .max_error
        .map(|asked| tell::shortfall(asked, noisy, &film, &rendered));
    let error = origin::error(noisy, &rendered, &film);
    let background = plan.display.linear_background();
    Ok(FinishedPicture {
        error: rendered
            .denoised()
            .map(|denoised| denoised.error)
            .or(noisy.copied()),
        converged: shortfall.map(|shortfall| shortfall.is_none()),
        samples: film::samples(&film, &whole),
        metadata: match task.has_metadata {
            true => Metadata {
                command,
                error,
                ..origin::metadata(&loaded, &plan, &task.choices)
            },
            false => Metadata::default(),
        },
        covered: background.map(|_| rendered.clone()),
        rendered: background
            .map(|colour| rendered.over(colour))
            .unwrap_or(rendered),
        display: plan.display,
        notes: notes.into_texts(),
    })
}

impl FinishedPicture {
    /// The bytes of a PNG that shows it.
    pub fn png(&self) -> Result<Vec<u8>, Failure> {
        let bytes = output::png_bytes(self.covered().shown(), self.display, &self.metadata);
        bytes.map_err(|cause| Error::write(Path::new("PNG"), &cause).into())
    }

    /// Writes it as its name says, as `render -o` does.
    pub fn save(&self, path: &Path) -> Result<(), Failure> {
        let picture = write::picture(self.covered(), Format::of(path)?, self.display);
        Ok(output::write_picture(
            path,
            &picture,
            self.display,
            &self.metadata,
        )?)
    }

    /// Why the interval of its error may not hold, in a word; none where it does.
    pub fn doubt(&self) -> Option<String> {
        self.error?.doubt.as_ref().map(origin::name)
    }

    /// What was rendered, apart from a background.
    fn covered(&self) -> &Rendered {
        self.covered.as_ref().unwrap_or(&self.rendered)
    }

    /// The colours that are to be looked at, with all layers.
    pub fn shown(&self) -> &Picture {
        self.rendered.shown()
    }
}

/// Files are written by whoever has the picture.
pub fn refuse_files(task: &Task) -> Result<(), Failure> {
    let flags = [
        ("--output", !task.outputs.is_empty()),
        ("--sheet", task.sheet.is_some()),
        ("--checkpoint", task.checkpoint.is_some()),
        ("--resume", task.resume.is_some()),
        ("--replay", task.replay.is_some()),
        ("--part", task.part.is_some()),
        ("--stats", task.stats.is_some()),
        ("--preview", task.preview.is_some()),
        ("--display", task.display.is_some()),
        ("--hash", task.hash),
        ("--views, --turntable or --frames", !task.is_single),
    ];
    let Some((flag, _)) = flags.iter().find(|(_, given)| *given) else {
        return Ok(());
    };
    let error = Error::usage(format_args!(
        "{flag} is of the command line: here one picture is made, and handed over"
    ));
    Err(error
        .with_hint("render each picture by a call of its own, and save it")
        .into())
}

/// Looks on, and ends a render when its time is over.
struct Budgeted<'a> {
    observer: &'a dyn Observer,
    deadline: Option<Instant>,
}

impl Observer for Budgeted<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.observer.progress(done, total);
    }

    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }

    fn has_enough(&self, everywhere: bool) -> bool {
        self.observer.has_enough(everywhere)
            || everywhere && self.deadline.is_some_and(|end| Instant::now() >= end)
    }
}
