//! The pictures of a `render` run: a single picture, or several from scenes, views, a turntable, or
//! times of an animation. A scene is loaded once for each time, and prepared once where only the
//! camera moves. Each picture has the same bits as in a run for this picture alone; only the
//! studio's backdrop and a chosen exposure are the same for all pictures.

mod combined;
mod frame;
mod loading;
mod names;
mod scene_at_time;
mod summary;

use std::collections::HashMap;
use std::path::Path;

use raywright_io::{Error, Input, InputFiles, LoadedScene};

use super::{ALLOW_EMPTY, film};
use crate::console;
use crate::failure::{Exit, Failure};
use crate::plan::{ChosenExposure, RenderTask, Shot};
use crate::progress::Progress;
use crate::scene_input;
use crate::session::Session;
use crate::targets::{OutputFiles, OutputTarget};
use combined::CombinedFiles;
use scene_at_time::SceneAtTime;
use summary::RunSummary;

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
    let scenes = task.scenes.len();
    series.summary.into_result(task.is_single, scenes)
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
    /// Pictures of the run, ordered by scene, and within a scene by shot.
    jobs: Vec<PictureJob>,
    combined_files: CombinedFiles,
    summary: RunSummary,
    /// Exposure chosen for the current scene's first picture, which all its pictures have.
    exposure: Option<ChosenExposure>,
    /// Radiance of the studio's backdrop, chosen by the first picture with a studio for all
    /// pictures.
    backdrop: Option<f64>,
    /// Whether any picture of the current scene shows an object.
    shows_object: bool,
}

/// A picture of a run.
struct PictureJob {
    /// Index of its scene in the run.
    scene: usize,
    /// Its view, its time and its labels.
    shot: Shot,
    /// Its outputs.
    targets: Vec<OutputTarget>,
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
        let shots_of = |scene| task.shots.iter().map(move |shot| (scene, shot));
        let shots = (0..task.scenes.len()).flat_map(shots_of);
        let job = |((scene, shot), targets): ((usize, &Shot), _)| PictureJob {
            scene,
            shot: shot.clone(),
            targets,
        };
        let mut series = Self {
            task,
            session,
            progress,
            inputs,
            preloaded: HashMap::new(),
            checked_inputs: InputFiles::default(),
            jobs: shots.zip(targets).map(job).collect(),
            combined_files,
            summary: RunSummary::default(),
            exposure: None,
            backdrop: None,
            shows_object: false,
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
        let has_own = self.jobs.iter().any(|job| !job.targets.is_empty());
        if !has_own && !self.combined_files.is_requested() && self.task.film.part.is_none() {
            let format = super::default_picture_format(self.task);
            let all = (&mut self.session.outputs, inputs);
            let shots = &self.task.shots;
            let targets = names::resolve_default_files(format, &self.inputs, shots, all)?;
            let named = self.jobs.iter_mut().zip(targets);
            named.for_each(|(job, targets)| job.targets = targets);
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
            self.summary.failed_exits.push(failure.exit);
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
        let seconds = self.session.clock.total_seconds();
        Ok(self.summary.format_message(together, seconds))
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
        let shots = self.task.shots.len();
        for number in scene * shots..(scene + 1) * shots {
            // Only the first picture of a scene has notes, because they usually apply to all its
            // pictures.
            let is_first = number == scene * shots;
            self.session.notes.set_silent(!is_first);
            let now = match moment.take() {
                Some(moment) if self.jobs[number].shot.at.is_none() => moment,
                _ => self.load_scene_at_time(number, is_first)?,
            };
            self.render_shot(number, moment.insert(now))?;
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
}

/// Resolves the output files of a run of `count` pictures: the outputs of each picture, and the files
/// that combine pictures. Refuses outputs that cannot hold the requested data.
fn resolve_outputs(
    task: &RenderTask,
    count: usize,
    outputs: &mut OutputFiles,
) -> Result<(Vec<Vec<OutputTarget>>, CombinedFiles), Failure> {
    *outputs = OutputFiles::with_quality(task.files.quality);
    let targets = names::resolve_named_files(
        &task.files.pictures,
        (!task.is_single).then_some(count),
        outputs,
    )?;
    let combined_files = CombinedFiles::start(task, count, outputs)?;
    if task.is_single || targets.iter().any(|targets| !targets.is_empty()) {
        targets
            .iter()
            .try_for_each(|targets| super::check_targets(task, targets))?;
    }
    if let Some(path) = &task.files.stats {
        let kind = ("json", "the statistics are a JSON file");
        outputs.add_output_of_type(path, "--stats", kind)?;
    }
    if let Some(path) = &task.files.preview {
        outputs.add_output_of_type(path, "--preview", ("png", "the preview is a PNG file"))?;
    }
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

#[cfg(test)]
mod tests;
