//! The pictures of a `render` run: a single picture, or several from scenes, views, a turntable, or
//! times of an animation. A scene is loaded once for each time, and prepared once where only the
//! camera moves. Each picture has the same bits as in a run for this picture alone; only the
//! studio's backdrop and a chosen exposure are the same for all pictures.

mod combined;
mod frame;
mod loading;
mod names;
mod scene_at_time;

use std::collections::HashMap;
use std::path::Path;

use raywright_io::{Error, Input, InputFiles, LoadedScene};

use super::{ALLOW_EMPTY, film};
use crate::console;
use crate::failure::{Exit, Failure};
use crate::numbers::{format_duration, format_significant_digits};
use crate::plan::{ChosenExposure, RenderTask};
use crate::progress::Progress;
use crate::scene_input;
use crate::session::Session;
use crate::targets::{OutputFiles, OutputTarget};
use combined::CombinedFiles;
use scene_at_time::SceneAtTime;

/// Runs `render`: renders the scenes of a task and writes their pictures.
pub fn run(session: Session, task: &RenderTask) -> Result<(), Failure> {
    let mut series = PictureSeries::start(task, session)?;
    let done = series.render_all_scenes();
    series.progress.finish();
    series.session.notes.print_kept_messages();
    let verbosity = series.session.verbosity;
    done?
        .iter()
        .for_each(|line| verbosity.print_result_message(line));
    series.into_result()
}

/// State of a run while its pictures are rendered. A single picture is a series of length one; only
/// such a series may have a film file or write to standard output.
struct PictureSeries<'a> {
    task: &'a RenderTask,
    session: Session,
    progress: Progress,
    inputs: Vec<Input>,
    /// Scenes loaded before their turn, each at the time of its first picture; the key is the
    /// scene's index in the run.
    preloaded: HashMap<usize, Result<LoadedScene, Failure>>,
    /// Input files that the outputs were last checked against.
    checked_inputs: InputFiles,
    /// Outputs of each picture. Pictures are ordered by scene, and within a scene by shot.
    targets: Vec<Vec<OutputTarget>>,
    combined_files: CombinedFiles,
    /// Names of the written files of each finished picture.
    written_files: Vec<Vec<String>>,
    /// Number of finished pictures.
    finished: usize,
    /// Two texts for the final message: the description of the last picture, and its size and
    /// samples, which stand for all pictures of a run.
    description: [String; 2],
    /// Largest root relMSE of all pictures of path tracing so far.
    error: Option<f64>,
    /// Exposure chosen for the current scene's first picture, which all its pictures have.
    exposure: Option<ChosenExposure>,
    /// Radiance of the studio's backdrop, chosen by the first picture with a studio for all
    /// pictures.
    backdrop: Option<f64>,
    /// Whether any picture of the current scene shows an object.
    shows_object: bool,
    /// Exit codes of the failed scenes, in the order of the run.
    failed_exits: Vec<Exit>,
    /// Descriptions of the pictures that do not reach the target error.
    shortfalls: Vec<String>,
    /// Failure of a film file that could not be written.
    checkpoint_failure: Option<Failure>,
}

impl<'a> PictureSeries<'a> {
    /// Creates the series after all checks that need no loaded scene, and starts the run's early
    /// stage, loading and preparation.
    fn start(task: &'a RenderTask, mut session: Session) -> Result<Self, Failure> {
        let count = task.scenes.len() * task.shots.len();
        let (targets, combined_files) = resolve_outputs(task, count, &mut session.outputs)?;
        refuse_repeated_stdin(task)?;
        super::start_early_stage(task, &mut session)?;
        let inputs = task
            .scenes
            .iter()
            .map(|name| scene_input::resolve_input(name, &task.options.limits))
            .collect::<Result<Vec<_>, _>>()?;
        let progress =
            Progress::start("rendering", task.progress, session.verbosity).with_work_pieces(count);
        let mut series = Self {
            task,
            session,
            progress,
            inputs,
            preloaded: HashMap::new(),
            checked_inputs: InputFiles::default(),
            targets,
            combined_files,
            written_files: Vec::new(),
            finished: 0,
            description: Default::default(),
            error: None,
            exposure: None,
            backdrop: None,
            shows_object: false,
            failed_exits: Vec::new(),
            shortfalls: Vec::new(),
            checkpoint_failure: None,
        };
        if !task.is_single {
            // Scene files are never overwritten by pictures. Other files that a scene names are
            // known only after it is loaded.
            series.choose_file_names(&InputFiles::default())?;
            series.check_outputs_against_scenes()?;
        }
        Ok(series)
    }

    /// Chooses file names after the scenes, if the user named no output.
    fn choose_file_names(&mut self, inputs: &InputFiles) -> Result<(), Failure> {
        let has_own = self.targets.iter().any(|targets| !targets.is_empty());
        if !has_own && !self.combined_files.is_requested() && self.task.part.is_none() {
            let format = super::default_picture_format(self.task);
            self.targets = names::resolve_default_files(
                format,
                &self.inputs,
                &self.task.shots,
                (&mut self.session.outputs, inputs),
            )?;
        }
        Ok(())
    }

    /// Renders the pictures of all scenes. Returns the final message, or `None` for a picture that
    /// went to standard output alone. After the failure of a scene the next scene is rendered,
    /// except after an interruption.
    fn render_all_scenes(&mut self) -> Result<Option<String>, Failure> {
        for scene in 0..self.inputs.len() {
            let Err(failure) = self.render_scene(scene) else {
                continue;
            };
            if failure.exit == Exit::Interrupted {
                return Err(failure);
            }
            if self.inputs.len() == 1 {
                return Err(self.with_partial_files(failure));
            }
            console::print_message(failure.message.trim_end());
            self.failed_exits.push(failure.exit);
            self.task
                .shots
                .iter()
                .for_each(|_| self.progress.finish_work_piece());
        }
        let is_free = |path: &Path| {
            self.session
                .outputs
                .is_free_path(path, &self.checked_inputs)
        };
        let together = self
            .combined_files
            .write_all((&self.checked_inputs, is_free))?;
        let files = [format_file_ranges(&self.written_files), together]
            .concat()
            .join(", ");
        let error = self
            .error
            .map(|error| format!(", errors up to {}", format_significant_digits(error, 2)))
            .unwrap_or_default();
        let [one, all] = &self.description;
        let described = if self.finished == 1 {
            one.clone()
        } else {
            format!("{} pictures, {all}{error}", self.finished)
        };
        Ok(match files.as_str() {
            "" if self.finished > 0 => None,
            "" => Some("nothing was written".to_owned()),
            files => Some(format!(
                "wrote {files} ({described}, {})",
                format_duration(self.session.clock.total_seconds())
            )),
        })
    }

    /// Keeps the unfinished sheet and animations in files, and adds their names to the failure.
    fn with_partial_files(&mut self, failure: Failure) -> Failure {
        let is_free = |path: &Path| {
            self.session
                .outputs
                .is_free_path(path, &self.checked_inputs)
        };
        match self.combined_files.write_partial_files(is_free) {
            Ok(kept) if !kept.is_empty() => failure.with_hint(format_args!(
                "the finished pictures are in {}",
                kept.join(", ")
            )),
            _ => failure,
        }
    }

    /// Renders all pictures of the scene with index `scene`.
    fn render_scene(&mut self, scene: usize) -> Result<(), Failure> {
        let mut moment: Option<SceneAtTime> = None;
        (self.exposure, self.shows_object) = (None, false);
        for (i, shot) in self.task.shots.iter().enumerate() {
            // Only the first picture of a scene has notes, because they usually apply to all its
            // pictures.
            self.session.notes.set_silent(i > 0);
            let now = match moment.take() {
                Some(moment) if shot.at.is_none() => moment,
                _ => self.load_scene_at_time(scene, i)?,
            };
            self.render_shot(scene * self.task.shots.len() + i, shot, moment.insert(now))?;
        }
        match moment {
            Some(moment) if !self.shows_object && self.task.refuses_empty_pictures() => {
                Err(scene_input::empty_picture_failure(
                    &moment.loaded.source.name,
                    "no picture of the scene shows an object",
                )
                .with_hint(ALLOW_EMPTY))
            }
            _ => Ok(()),
        }
    }

    /// Returns the result of the run: a failure if a scene failed, a film file could not be
    /// written, or a target error is not reached.
    fn into_result(self) -> Result<(), Failure> {
        if let Some(failure) = self.checkpoint_failure {
            return Err(failure);
        }
        if let Some(&exit) = self.failed_exits.first() {
            let message = format!(
                "{} of {} scenes were not rendered (see the errors above)",
                self.failed_exits.len(),
                self.inputs.len()
            );
            return Err(Failure::new(exit, message));
        }
        match self.shortfalls.as_slice() {
            [] => Ok(()),
            [message] if self.task.is_single => Err(Failure::new(Exit::Unreached, message)),
            [first, ..] => {
                let message = format!(
                    "{} of {} pictures do not reach their requested error; the first of them: {first}",
                    self.shortfalls.len(),
                    self.finished
                );
                Err(Failure::new(Exit::Unreached, message))
            }
        }
    }
}

/// Resolves the output files of a run of `count` pictures: the outputs of each picture, and the files that combine pictures. Refuses outputs that cannot hold the requested data.
fn resolve_outputs(
    task: &RenderTask,
    count: usize,
    outputs: &mut OutputFiles,
) -> Result<(Vec<Vec<OutputTarget>>, CombinedFiles), Failure> {
    *outputs = OutputFiles::with_quality(task.jpeg_quality());
    let targets =
        names::resolve_named_files(&task.outputs, (!task.is_single).then_some(count), outputs)?;
    let combined_files = CombinedFiles::start(task, count, outputs)?;
    if task.is_single || targets.iter().any(|targets| !targets.is_empty()) {
        targets
            .iter()
            .try_for_each(|targets| super::check_targets(task, targets))?;
    }
    super::check_stats_target(task, outputs)?;
    super::check_preview_target(task, outputs)?;
    film::check_film_flags(task, &targets[0], outputs)?;
    Ok((targets, combined_files))
}

/// Refuses `-` as the name of several scenes, because standard input holds a single scene.
fn refuse_repeated_stdin(task: &RenderTask) -> Result<(), Failure> {
    if task.scenes.iter().filter(|name| *name == "-").count() > 1 {
        return Err(Error::invalid_usage(
            "`-` is named twice, but standard input holds a single scene; name `-` once",
        )
        .into());
    }
    Ok(())
}

/// Formats the written files for the final message: for each output, the range from the first
/// picture's file to the last picture's file.
fn format_file_ranges(names: &[Vec<String>]) -> Vec<String> {
    let (Some(first), Some(last)) = (names.first(), names.last()) else {
        return Vec::new();
    };
    let range = |(first, last): (&String, &String)| {
        if names.len() == 1 {
            first.clone()
        } else {
            format!("{first} to {last}")
        }
    };
    first.iter().zip(last).map(range).collect()
}

#[cfg(test)]
mod tests;
