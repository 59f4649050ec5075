//! Film files of `render`: renders that are checkpointed, resumed, divided among machines, or
//! limited by a time budget.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use raywright_core::ReadyScene;
use raywright_core::film::{Film, FilmMergeError, FilmPart, Uncertainty};
use raywright_io::output::{PictureMetadata, StoredFilm, read_film, write_film};
use raywright_io::report::format_duration;
use raywright_io::{Error, InputFiles, Limits, LoadOptions, LoadedScene};
use serde::Serialize;

use crate::args::{PictureShare, ProgressStyle};
use crate::commands::render::live::LivePreviews;
use crate::commands::render::write::{join_label, with_fallback_hint, write_film_to_fallback};
use crate::console::Verbosity;
use crate::failure::Failure;
use crate::plan::{PicturePlan, RenderTask};
use crate::progress::{Deadlines, Progress, RunObserver};
use crate::session::Session;
use crate::targets::{FreePaths, OutputFiles, OutputTarget, printable_path};
use crate::{console, origin};

/// Least interval between checkpoints. The interval is raised to twenty times the duration of
/// writing the last checkpoint, if that is longer.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(60);

/// Interval between the lines of `--progress json`.
const PROGRESS_INTERVAL: Duration = Duration::from_secs(1);

/// Render of a picture, or of a share of a picture, with its film (the samples so far), its
/// checkpoints and its previews.
pub struct FilmRender<'a> {
    /// Film with the samples so far, and the metadata of its file.
    kept_film: StoredFilm,
    /// Tiles and replicates of the picture that this run renders.
    part: FilmPart,
    task: &'a RenderTask,
    /// Whether all requested samples were rendered, or all that the budget allowed.
    is_done: bool,
    /// Error of the last checkpoint if its file could not be written.
    checkpoint_error: Option<Error>,
    /// File that holds the film in place of the file of the last checkpoint.
    film_copy: Option<PathBuf>,
    /// Previews that are updated during the render.
    previews: LivePreviews,
}

impl<'a> FilmRender<'a> {
    /// Creates the render of a picture with an empty film, or with the film of `--resume`. `label`
    /// is the suffix of the picture's name.
    pub fn start(
        task: &'a RenderTask,
        options: &LoadOptions,
        (loaded, ready): (&LoadedScene, &ReadyScene),
        (plan, label): (&PicturePlan, &str),
    ) -> Result<Self, Failure> {
        let limits = task.options.limits;
        let identity = origin::format_scene_identity(loaded, options, &task.choices);
        let mut film = ready.new_film(&identity);
        if let Some(path) = &task.film.resume {
            let earlier = read_own_film(path, &limits)?;
            film.continue_from(earlier.film)
                .map_err(|error| wrong_film_failure(path, error))?;
        }
        if let Some(path) = &task.film.replay {
            let map = read_own_film(path, &limits)?;
            film.repeat_sample_counts(&map.film)
                .map_err(|error| wrong_film_failure(path, error))?;
        }
        let whole = film.full_part();
        let part = match task.film.part {
            Some(PictureShare { of: total, .. }) if total > whole.tiles.end => {
                return Err(Failure::usage(
                    format_args!(
                        "--part divides the picture into {total} shares, and the picture has only {} tiles",
                        whole.tiles.end
                    ),
                    "choose fewer shares: a smaller N in --part K/N",
                ));
            }
            Some(PictureShare { number, of: total }) => {
                whole.split_into_nth_subset(number - 1, total)
            }
            None => whole,
        };
        Ok(Self {
            kept_film: StoredFilm {
                film,
                metadata: origin::picture_metadata(loaded, plan, &task.choices),
                display: plan.display,
            },
            part,
            task,
            is_done: false,
            checkpoint_error: None,
            film_copy: None,
            previews: LivePreviews::from_task(task, &join_label(&loaded.source.stem, label))?,
        })
    }

    /// Renders the samples that the film lacks, with checkpoints, progress lines and previews
    /// during the render and at its end. A failed checkpoint does not end the render.
    pub fn render(
        &mut self,
        ready: &ReadyScene,
        progress: &Progress,
        session: &Session,
    ) -> Result<(), Failure> {
        let (start, verbosity) = (session.start_time(), session.verbosity);
        let deadline = self.task.film.budget.map(|budget| start + budget);
        let prints_progress =
            self.task.report.progress == ProgressStyle::Json && verbosity > Verbosity::Quiet;
        let (mut checkpoint_interval, mut last_checkpoint, mut last_progress) =
            (CHECKPOINT_INTERVAL, Instant::now(), Instant::now());
        let mut error = ErrorTracker::default();
        loop {
            let checkpoint_at = self
                .task
                .film
                .checkpoint
                .is_some()
                .then(|| last_checkpoint + checkpoint_interval);
            let progress_at = prints_progress.then(|| last_progress + PROGRESS_INTERVAL);
            let pause_at = checkpoint_at.into_iter().chain(progress_at).min();
            let pause_with = self.previews.next_update_sample_count(&self.kept_film.film);
            let deadlines = Deadlines {
                deadline,
                pause_at,
                pause_at_samples: pause_with,
            };
            let watch = RunObserver {
                progress: Some(progress),
                deadlines,
                start,
                ..session.observer()
            };
            let rendered = ready.render_part(&mut self.kept_film.film, &self.part, &watch);
            rendered.map_err(Error::invalid_usage)?;
            self.is_done = !watch.was_stopped()
                && (self.count_unfinished_tiles() == 0 || watch.is_past_deadline());
            let ends = self.is_done || watch.was_stopped();
            if prints_progress {
                let error = error.update_estimate(&self.kept_film.film, ends);
                console::print_message(self.format_progress_line(progress, error));
                last_progress = Instant::now();
            }
            self.update_previews(&watch, ends, verbosity);
            if ends || checkpoint_at.is_some_and(|checkpoint_at| Instant::now() >= checkpoint_at) {
                let began = Instant::now();
                self.write_checkpoint(verbosity);
                checkpoint_interval = CHECKPOINT_INTERVAL.max(20 * began.elapsed());
                last_checkpoint = Instant::now();
            }
            if ends {
                return Ok(());
            }
        }
    }

    /// Updates the live previews if their next update is due or the render ends. A failed preview
    /// gives a warning and does not end the render.
    fn update_previews(&mut self, watch: &RunObserver<'_>, ends: bool, verbosity: Verbosity) {
        let StoredFilm {
            film,
            metadata,
            display,
        } = &self.kept_film;
        let done = watch.finished_samples.load(Ordering::Relaxed);
        if !self
            .previews
            .next_update_sample_count(film)
            .is_some_and(|next| ends || done >= next)
        {
            return;
        }
        let nothing = PictureMetadata::default();
        let metadata = match self.task.files.has_metadata {
            true => metadata,
            false => &nothing,
        };
        if let Some(failed) =
            self.previews
                .update_previews(film, (done, watch), (*display, metadata))
        {
            verbosity.print_warning(format_args!("{failed}; the render continues"));
        }
    }

    /// Writes the film to the file of `--checkpoint`. Of successive failures during the render, the
    /// first gives a warning. The next checkpoint is written even after a failure, because the disk
    /// may have room by then.
    fn write_checkpoint(&mut self, verbosity: Verbosity) {
        let Some(path) = &self.task.film.checkpoint else {
            return;
        };
        self.kept_film.metadata.settings =
            origin::replace_sample_count(&self.kept_film.metadata.settings, &self.format_samples());
        let failed = write_film(path, &mut self.kept_film).err();
        if let Some(error) = failed
            .as_ref()
            .filter(|_| !self.is_done && self.checkpoint_error.is_none())
        {
            verbosity.print_warning(format_args!(
                "the render continues, but the checkpoint could not be written: {}",
                error.message()
            ));
        }
        self.checkpoint_error = failed;
    }

    /// Keeps the film in the folder of the input or in the temporary folder, if the file of the
    /// last checkpoint could not be written.
    pub fn keep_unwritten_film(&mut self, free: FreePaths<'_>) {
        if let (Some(path), Some(_)) = (&self.task.film.checkpoint, &self.checkpoint_error) {
            self.film_copy = write_film_to_fallback(path, &mut self.kept_film, free);
        }
    }

    /// Returns the failure of the last checkpoint, if its file could not be written. The failure
    /// names the file that holds the film.
    pub fn into_checkpoint_failure(self) -> Option<Failure> {
        let error = self.checkpoint_error?;
        Some(with_fallback_hint(error.into(), "film", self.film_copy))
    }

    /// Adds a note if the run took more than 1.1 times its budget: the budget was too small for the
    /// first pass over the picture.
    pub fn note_exceeded_budget(&self, session: &mut Session) {
        let taken = session.clock.total_seconds();
        if let Some(budget) = self.task.film.budget.map(|budget| budget.as_secs_f64())
            && taken > 1.1 * budget
        {
            session.notes.add_hint(format!(
                "the budget of {} is too short for the first pass over the picture, which ended after {}; give a larger --budget or a smaller --size",
                format_duration(budget),
                format_duration(taken)
            ));
        }
    }

    /// Returns the number of tiles, among those that this run renders, that lack samples.
    fn count_unfinished_tiles(&self) -> usize {
        self.kept_film.film.unfinished_tiles(&self.part)
    }

    /// Returns the film with the samples so far.
    pub fn film(&self) -> &Film {
        &self.kept_film.film
    }

    /// Returns the metadata of the picture's file.
    pub fn metadata(&self) -> &PictureMetadata {
        &self.kept_film.metadata
    }

    /// Whether all requested samples were rendered, or all that the budget allowed.
    pub fn is_done(&self) -> bool {
        self.is_done
    }

    /// Formats the number of samples per pixel so far: `12 to 16 of 64 samples`.
    pub fn format_samples(&self) -> String {
        format_samples(&self.kept_film.film, &self.part)
    }

    /// Adds the checkpoint file, if it was written, to the list of written files.
    pub fn with_checkpoint_path(&self, mut written: Vec<String>) -> Vec<String> {
        let last_checkpoint = self
            .task
            .film
            .checkpoint
            .as_ref()
            .filter(|_| self.checkpoint_error.is_none());
        written.extend(last_checkpoint.map(|path| printable_path(path)));
        written
    }

    /// Adds a hint to the failure of an interrupted run: the flag that resumes its checkpoint, or
    /// the reason why no checkpoint exists.
    pub fn with_resume_hint(&self, failure: Failure) -> Failure {
        let Some(checkpoint) = &self.task.film.checkpoint else {
            return failure;
        };
        let (failure, film) = match (&self.checkpoint_error, &self.film_copy) {
            (Some(error), None) => {
                return failure.with_hint(format_args!(
                    "the run cannot be resumed: {}",
                    error.message()
                ));
            }
            (Some(error), Some(copy)) => (failure.with_hint(error.message()), copy),
            (None, _) => (failure, checkpoint),
        };
        failure.with_hint(format_args!(
            "continue with --resume {}",
            origin::quote_for_shell(&film.to_string_lossy())
        ))
    }
}

/// Formats the number of samples per pixel in a share of a picture: `16 samples`, `12 to 16 of 64
/// samples`.
pub fn format_samples(film: &Film, part: &FilmPart) -> String {
    let (rendered, all) = (film.sample_range(part), film.requested_samples());
    let (minimum, maximum) = (*rendered.start(), *rendered.end());
    let Some(all) = all else {
        return if minimum == maximum {
            format!("{maximum} samples")
        } else {
            format!("{minimum} to {maximum} samples")
        };
    };
    match (minimum == maximum, maximum == all) {
        (true, true) if all == 1 => "1 sample".to_owned(),
        (true, true) => format!("{all} samples"),
        (true, false) => format!("{minimum} of {all} samples"),
        (false, _) => format!("{minimum} to {maximum} of {all} samples"),
    }
}

/// Refuses contradicting flags of film files before the scene is loaded, and adds the checkpoint to
/// the output files.
pub fn check_film_flags(
    task: &RenderTask,
    targets: &[OutputTarget],
    outputs: &mut OutputFiles,
) -> Result<(), Failure> {
    refuse_flags_with_part(task, targets)?;
    let Some(path) = &task.film.checkpoint else {
        return Ok(());
    };
    outputs.add_checkpoint(path)?;
    // The resumed file may be the checkpoint file itself, because the new checkpoint contains all
    // of its samples.
    let mut inputs = InputFiles::default();
    task.film
        .resume
        .iter()
        .filter(|earlier| *earlier != path)
        .for_each(|earlier| inputs.record_read(earlier));
    task.film
        .replay
        .iter()
        .for_each(|map| inputs.record_read(map));
    outputs.check_against_inputs(&inputs)
}

/// Refuses flags that contradict `--part`, whose share of a picture is kept in the film file of
/// `--checkpoint` alone.
fn refuse_flags_with_part(task: &RenderTask, targets: &[OutputTarget]) -> Result<(), Failure> {
    if task.film.part.is_none() {
        return Ok(());
    }
    Failure::refuse_if(
        task.max_error.is_some(),
        "--max-error cannot be used with --part: it needs the errors of the whole picture, and a part has only a share of the samples",
        "use --spp in place of --max-error, or leave out --part",
    )?;
    Failure::refuse_if(
        task.film.checkpoint.is_none(),
        "--part needs --checkpoint, whose file receives the share of the picture",
        "add --checkpoint part.film; raywright merge makes the picture of all parts",
    )?;
    Failure::refuse_if(
        !targets.is_empty(),
        "-o and --part cannot both be given, because a share of a picture is kept in a film file",
        "leave out -o; raywright merge makes the picture of all parts",
    )
}

/// Reads a film file. Refuses the film of another program version, which may use other random
/// numbers.
pub fn read_own_film(path: &Path, limits: &Limits) -> Result<StoredFilm, Failure> {
    let stored = read_film(path, limits)?;
    let software = &stored.metadata.software;
    if software == origin::SOFTWARE {
        return Ok(stored);
    }
    let error = Error::invalid_input(
        path.display(),
        format_args!(
            "the file was made by {software}, and this program is {}",
            origin::SOFTWARE
        ),
    );
    Err(error
        .with_hint("use the program that made the file, or render the picture again")
        .into())
}

/// Creates the failure for a film file that cannot be resumed or replayed with these flags.
pub fn wrong_film_failure(path: &Path, error: FilmMergeError) -> Failure {
    match error {
        FilmMergeError::Foreign { label, .. } => {
            let error = Error::invalid_input(
                path.display(),
                format_args!("the film belongs to another picture: the {label} differs"),
            );
            error
                .with_hint("give the scene and flags that the film was made with; only --spp may be larger")
                .into()
        }
        FilmMergeError::Samples {
            has,
            requested,
            least: minimum,
        } => {
            let message = format!(
                "{}: the film has {has} samples a pixel and cannot be continued to {requested}",
                path.display()
            );
            Failure::usage(
                message,
                format_args!("give --spp {minimum} or a larger number"),
            )
        }
        other => Error::invalid_input(path.display(), other).into(),
    }
}

/// Shortest interval between error estimates, as a multiple of the duration of the last estimate.
/// It keeps estimates of large pictures from taking a large part of the render time.
const ESTIMATE_INTERVAL_FACTOR: u32 = 50;

/// Latest estimate of a picture's error during its render, for progress lines.
#[derive(Default)]
pub struct ErrorTracker {
    /// The latest estimate; `None` before the first.
    error: Option<Uncertainty>,
    /// Time and duration of the latest estimate; `None` before the first.
    last_estimate: Option<(Instant, Duration)>,
}

impl ErrorTracker {
    /// Makes a new error estimate if an estimate is due or `is_last`, and returns the latest
    /// estimate.
    pub fn update_estimate(&mut self, film: &Film, is_last: bool) -> Option<Uncertainty> {
        if is_last
            || self
                .last_estimate
                .is_none_or(|(at, took)| is_estimate_due(at.elapsed(), took))
        {
            let began = Instant::now();
            self.error = film.estimate_uncertainty();
            self.last_estimate = Some((Instant::now(), began.elapsed()));
        }
        self.error
    }
}

/// Whether a new error estimate is due: `passed` is the time since the last estimate, `took` is the
/// duration of the last estimate.
fn is_estimate_due(passed: Duration, took: Duration) -> bool {
    passed >= took * ESTIMATE_INTERVAL_FACTOR
}

/// Version of the layout of [`ProgressLine`].
const PROGRESS_FORMAT: u32 = 1;

/// A line of `--progress json`.
#[derive(Serialize)]
struct ProgressLine {
    format: u32,
    /// Number of the picture in the run, counted from one.
    picture: u64,
    /// Number of pictures in the run.
    pictures: u64,
    /// Least and greatest number of samples of a pixel so far.
    samples: [u32; 2],
    /// Requested number of samples per pixel; null with a time budget or a target error.
    of: Option<u32>,
    /// Latest error estimate, in the form of `--stats`; null without an estimate.
    error: Option<Uncertainty>,
    /// Seconds since the start of the first picture.
    seconds: f64,
    /// Estimated seconds until the last picture is finished; null where unknown.
    seconds_left: Option<f64>,
}

impl FilmRender<'_> {
    /// Formats the progress as a line of JSON for `--progress json`.
    fn format_progress_line(&self, progress: &Progress, error: Option<Uncertainty>) -> String {
        let ([picture, pictures], (seconds, left)) =
            (progress.work_piece_counts(), progress.elapsed_and_left());
        let samples = self.kept_film.film.sample_range(&self.part);
        let pass = ProgressLine {
            format: PROGRESS_FORMAT,
            picture: picture + 1,
            pictures,
            samples: [*samples.start(), *samples.end()],
            of: self.kept_film.film.requested_samples(),
            error,
            seconds,
            seconds_left: if self.is_done && picture + 1 == pictures {
                Some(0.0)
            } else {
                left
            },
        };
        serde_json::to_string(&pass).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use raywright_core::scene::SamplePattern;
    use raywright_core::settings::{Crop, Sampling, Settings};
    use raywright_core::{Scene, prepare};

    use super::*;

    /// Protects: a sample count has its singular and plural, and counts that differ between pixels
    /// are a range.
    #[test]
    fn samples_are_told_in_words() {
        let film = |sampling, tiles: u32| {
            let crop = Some(Crop {
                x: 0,
                y: 0,
                width: 64,
                height: 32,
            });
            let ready = prepare(
                &Scene::default(),
                &Settings {
                    crop,
                    sampling,
                    ..Settings::from_scene(&Scene::default())
                },
                &(),
            )
            .expect("empty");
            let mut film = ready.new_film("");
            let whole = film.full_part();
            ready
                .render_part(
                    &mut film,
                    &FilmPart {
                        tiles: 0..tiles,
                        ..whole.clone()
                    },
                    &(),
                )
                .expect("its own");
            format_samples(&film, &whole)
        };
        assert_eq!(
            film(Sampling::Pattern(SamplePattern::Centre), 2),
            "1 sample"
        );
        assert_eq!(
            film(Sampling::Pattern(SamplePattern::Corners), 2),
            "4 samples"
        );
        assert_eq!(film(Sampling::General(9), 1), "0 to 9 of 9 samples");
        assert_eq!(film(Sampling::General(9), 0), "0 of 9 samples");
    }
}

#[cfg(test)]
mod progress_tests {
    use super::*;

    /// Protects: error estimates for progress lines take at most a fiftieth of the render time.
    #[test]
    fn estimates_have_a_bounded_share() {
        let [millisecond, second] = [Duration::from_millis(1), Duration::from_secs(1)];
        assert!(
            is_estimate_due(second, millisecond)
                && is_estimate_due(second, second / 50)
                && is_estimate_due(Duration::ZERO, Duration::ZERO)
        );
        assert!(!is_estimate_due(second, second / 49) && !is_estimate_due(40 * second, second));
    }
}
