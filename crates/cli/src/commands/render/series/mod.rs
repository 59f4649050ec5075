//! The pictures of a `render` run: a single picture, or several from scenes, views, a turntable, or
//! times of an animation. A scene is loaded once for each time, and prepared once where only the
//! camera moves. Each picture has the same bits as in a run for this picture alone; only the
//! studio's backdrop and a chosen exposure are the same for all pictures.

mod combined;
mod frame;

use std::cell::OnceCell;
use std::collections::HashMap;
use std::path::PathBuf;

use raywright_core::framing::Silhouette;
use raywright_core::scene::Sky;
use raywright_core::settings::Settings;
use raywright_core::{ReadyScene, estimate_scene_memory};
use raywright_io::output::{AnimationFormat, PictureFormat};
use raywright_io::report::{format_duration, format_significant_digits};
use raywright_io::{Error, Input, InputFiles, LoadOptions, LoadedScene};

use crate::commands::render::film;
use crate::commands::render::series::combined::CombinedFiles;
use crate::commands::render::write::join_label;
use crate::failure::{Exit, Failure};
use crate::plan::{ChosenExposure, PictureJob, PicturePlan, RenderTask};
use crate::preparation::prepare_loaded;
use crate::progress::Progress;
use crate::session::Session;
use crate::targets::{OutputFiles, OutputTarget};
use crate::{console, scene_input, targets};

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
    /// Outputs of each picture, in the order of the task.
    targets: Vec<Vec<OutputTarget>>,
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

impl<'a> PictureSeries<'a> {
    /// Creates the series after all checks that need no loaded scene, and starts the run's early
    /// stage, loading and preparation.
    fn start(task: &'a RenderTask, mut session: Session) -> Result<Self, Failure> {
        let count = task.jobs.len();
        let (targets, combined_files) = resolve_outputs(task, count, &mut session.outputs)?;
        refuse_repeated_stdin(task)?;
        // In a run of several scenes the memory limit does not end the program, because a single
        // large scene must not prevent the render of the others.
        let memory = match task.scenes.len() {
            1 => task.options.limits.memory_bytes,
            _ => u64::MAX,
        };
        session.start_limited_stage(&task.scenes[0], memory, task.film.budget)?;
        let inputs = task
            .scenes
            .iter()
            .map(|name| scene_input::resolve_input(name, &task.options.limits))
            .collect::<Result<Vec<_>, _>>()?;
        let progress = Progress::start("rendering", task.report.progress, session.verbosity)
            .with_work_pieces(count);
        let mut series = Self {
            task,
            session,
            progress,
            inputs,
            preloaded: HashMap::new(),
            checked_inputs: InputFiles::default(),
            targets,
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
        let has_own = self.targets.iter().any(|targets| !targets.is_empty());
        if !has_own && !self.combined_files.is_requested() && self.task.film.part.is_none() {
            let (all, jobs) = ((&mut self.session.outputs, inputs), &self.task.jobs);
            let format = match self.task.wants_linear_output() {
                true => PictureFormat::Exr,
                false => PictureFormat::Png,
            };
            self.targets = resolve_default_files(format, &self.inputs, jobs, all)?;
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
            let missing = 0..self.task.pictures_per_scene();
            missing.for_each(|_| self.progress.finish_work_piece());
        }
        let free = self.session.outputs.beside(&self.checked_inputs);
        let together = self.combined_files.write_all(free)?;
        let seconds = self.session.clock.total_seconds();
        Ok(self.summary.format_message(together, seconds))
    }

    /// Keeps the unfinished sheet and animations in files, and adds their names to the failure.
    fn with_partial_files(&mut self, failure: Failure) -> Failure {
        let free = self.session.outputs.beside(&self.checked_inputs);
        match self.combined_files.write_partial_files(free) {
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
        let task = self.task;
        let jobs = task.jobs.iter().enumerate();
        let mut is_first = true;
        for (number, job) in jobs.filter(|(_, job)| job.scene == scene) {
            // Only the first picture of a scene has notes, because they usually apply to all its
            // pictures.
            self.session.notes.set_silent(!is_first);
            let now = match moment.take() {
                Some(moment) if job.at.is_none() => moment,
                _ => self.load_scene_at_time(job, is_first)?,
            };
            self.render_job(number, moment.insert(now))?;
            is_first = false;
        }
        let reason = "no picture of the scene shows an object";
        let reason = Some(reason).filter(|_| !self.shows_object);
        moment.map_or(Ok(()), |moment| {
            super::refuse_empty_picture(self.task, &moment.loaded, reason)
        })
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
    let targets = resolve_named_files(
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
    if let Some(path) = &task.report.stats {
        let kind = ("json", "the statistics are a JSON file");
        outputs.add_output_of_type(path, "--stats", kind)?;
    }
    if let Some(path) = &task.report.preview {
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

/// Largest estimated memory in bytes of all scenes kept in memory for their turn; further scenes
/// are loaded again.
const MOST_KEPT_BYTES: u64 = 1 << 30;

/// Message of a run that a request to stop ends while it loads the scene of a further picture.
const BETWEEN_PICTURES: &str = "interrupted; the finished pictures are kept";

impl PictureSeries<'_> {
    /// Checks that no output overwrites a file of any scene. The files that a later scene names are
    /// known only after it is loaded, which is too late if an earlier picture has overwritten a
    /// file. Therefore, if any output exists already, all scenes are loaded first. Small scenes are
    /// kept in memory for their turn; load errors are reported then.
    fn check_outputs_against_scenes(&mut self) -> Result<(), Failure> {
        let mut input_paths = InputFiles::default();
        self.inputs.iter().for_each(|input| {
            if let Input::Path(path) = input {
                input_paths.record_read(path)
            }
        });
        self.session.outputs.check_against_inputs(&input_paths)?;
        if !self.session.outputs.has_existing_file() {
            return Ok(());
        }
        let mut bytes = 0;
        for scene in 1..self.inputs.len() {
            let loaded = self.load_scene(scene, &self.task.jobs[0]);
            if let Ok(loaded) = &loaded {
                self.session.outputs.check_against_inputs(&loaded.inputs)?;
                let settings = Settings::from_scene(&loaded.scene);
                bytes += estimate_scene_memory(&loaded.scene, &settings).total();
            }
            if bytes <= MOST_KEPT_BYTES {
                self.preloaded.insert(scene, loaded);
            }
        }
        Ok(())
    }

    /// Returns the load options of a picture: at the picture's own time, or at the time of `--at`.
    fn job_load_options(&self, job: &PictureJob) -> LoadOptions {
        let mut options = self.task.options.clone();
        options.overrides.time = job.at.or(options.overrides.time);
        options
    }

    /// Loads a scene at the time of a picture, with its own progress display in a run of a single
    /// picture.
    fn load_scene(&mut self, scene: usize, job: &PictureJob) -> Result<LoadedScene, Failure> {
        // In a run of several pictures, the progress display counts pictures and shows no loads.
        let loading = if self.task.is_single {
            Progress::start("loading", self.task.report.progress, self.session.verbosity)
        } else {
            Progress::hidden()
        };
        // A request to stop ends the program during a load, except where a sheet or an animation
        // with finished pictures is to be kept.
        let is_between = !self.session.is_early_stage();
        if is_between && !self.combined_files.is_requested() {
            self.session.start_early_stage(BETWEEN_PICTURES);
        }
        let (input, options) = (&self.inputs[scene], self.job_load_options(job));
        let loaded = self
            .session
            .run(|| scene_input::load_with_progress(input, &options, &loading));
        if is_between {
            self.session.end_early_stage();
        }
        loaded
    }

    /// Loads the scene of a picture at its time, and checks that no output overwrites a file of the
    /// scene. The picture may be the first of its scene.
    fn load_scene_at_time(
        &mut self,
        job: &PictureJob,
        is_first: bool,
    ) -> Result<SceneAtTime, Failure> {
        let early = is_first
            .then(|| self.preloaded.remove(&job.scene))
            .flatten();
        let loaded = early.unwrap_or_else(|| self.load_scene(job.scene, job))?;
        if self.inputs.len() > 1 && is_first {
            self.session.notes.set_current_file(&loaded.source.name);
        }
        self.session.notes.add_faults(&loaded.warnings);
        if self.task.is_single {
            self.choose_file_names(&loaded.inputs)?;
        }
        // Outputs are checked again only for new input files: an animation loads the same files
        // thousands of times.
        if loaded.inputs != self.checked_inputs {
            self.session.outputs.check_against_inputs(&loaded.inputs)?;
            self.checked_inputs = loaded.inputs.clone();
        }
        super::refuse_empty_scene(self.task, &loaded)?;
        scene_input::note_added_parts(&loaded, &mut self.session.notes);
        let mut loaded = loaded;
        if let Some(Sky::Studio(studio)) = &mut loaded.scene.sky {
            studio.backdrop = studio.backdrop.or(self.backdrop);
        }
        Ok(SceneAtTime::new(loaded))
    }
}

/// A scene at a fixed time of its animation.
pub struct SceneAtTime {
    /// The loaded scene, changed by the rungs (quality levels) that were chosen for the last
    /// picture.
    pub loaded: LoadedScene,
    /// Silhouette of the scene, computed only if a camera frames the whole scene.
    pub silhouette: OnceCell<Silhouette>,
    /// The prepared scene of the last picture; `None` before the first.
    pub ready: Option<ReadyScene>,
}

impl SceneAtTime {
    /// Wraps a loaded scene that is not prepared yet.
    pub fn new(loaded: LoadedScene) -> Self {
        Self {
            loaded,
            silhouette: OnceCell::new(),
            ready: None,
        }
    }

    /// Prepares the scene for a picture. If only the camera differs from the last picture, the
    /// preparation is kept and the camera is moved.
    pub fn prepare_picture(
        &mut self,
        plan: &PicturePlan,
        session: &Session,
    ) -> Result<(), Failure> {
        let turned = match (&mut self.ready, &plan.settings.camera) {
            (Some(ready), Some(camera)) => ready.replace_camera(&self.loaded.scene, camera),
            _ => false,
        };
        if !turned {
            let prepare = || prepare_loaded(&self.loaded, &plan.settings, &session.observer());
            self.ready = Some(session.run(prepare)?);
        }
        Ok(())
    }
}

/// Resolves the outputs of each picture from names with a placeholder for the picture's number,
/// such as `%04d`. Sheets and animations hold all pictures, and their names are skipped. If `count`
/// is absent, the run has a single picture and the names are used unchanged.
pub fn resolve_named_files(
    outputs: &[PathBuf],
    count: Option<usize>,
    all: &mut OutputFiles,
) -> Result<Vec<Vec<OutputTarget>>, Failure> {
    let Some(count) = count else {
        return Ok(vec![targets::resolve_picture_targets(outputs, all)?]);
    };
    let own: Vec<&PathBuf> = outputs
        .iter()
        .filter(|path| AnimationFormat::from_path(path).is_none())
        .collect();
    let numbered =
        |path: &&PathBuf, number: usize| match insert_number(&path.to_string_lossy(), number) {
            Some(name) => Ok(PathBuf::from(name)),
            None if count == 1 => Ok(path.to_path_buf()),
            None => {
                let error = Error::invalid_usage(format_args!(
                    "{count} pictures cannot all be written to the single file {}",
                    path.display()
                ));
                let stem = path.file_stem().unwrap_or_default().to_string_lossy();
                let numbered = path
                    .with_file_name(format!("{stem}-%04d"))
                    .with_extension(path.extension().unwrap_or_default());
                Err(error.with_hint(format!(
                    "number the files: -o {}; or put all pictures on one sheet: --sheet {}",
                    numbered.display(),
                    path.with_extension("png").display()
                )))
            }
        };
    let numbered_paths = |number: usize| {
        own.iter()
            .map(|path| numbered(path, number))
            .collect::<Result<Vec<_>, _>>()
    };
    (0..count)
        .map(|number| targets::resolve_picture_targets(&numbered_paths(number)?, all))
        .collect()
}

/// Resolves the output of each picture if the user named none: files are named after scenes and
/// views. The second and each later scene of the same name gets a number. `read` lists the input
/// files known so far.
fn resolve_default_files(
    format: PictureFormat,
    inputs: &[Input],
    jobs: &[PictureJob],
    (all, read): (&mut OutputFiles, &InputFiles),
) -> Result<Vec<Vec<OutputTarget>>, Failure> {
    let mut counts: HashMap<String, usize> = HashMap::new();
    let stem = |input: &Input| {
        let own = input.file_stem();
        let count = counts.entry(own.clone()).or_default();
        *count += 1;
        match *count {
            1 => own,
            count => format!("{own}-{count}"),
        }
    };
    let stems: Vec<String> = inputs.iter().map(stem).collect();
    let target = |job: &PictureJob| {
        let name = join_label(&stems[job.scene], &job.label);
        Ok(vec![targets::resolve_default_target(
            &name, format, all, read,
        )?])
    };
    jobs.iter().map(target).collect()
}

/// Replaces `%d`, `%4d`, `%04d` or `####` in a name by a number, padded with zeros; `None` without
/// such a placeholder.
fn insert_number(name: &str, number: usize) -> Option<String> {
    const MOST_DIGITS: usize = 20;
    if let Some(start) = name.find("##") {
        let width = name[start..]
            .bytes()
            .take_while(|&byte| byte == b'#')
            .count();
        return (width <= MOST_DIGITS).then(|| {
            format!(
                "{}{number:0width$}{}",
                &name[..start],
                &name[start + width..]
            )
        });
    }
    let (before, rest) = name.split_once('%')?;
    let (digits, after) = rest.split_once('d')?;
    let is_width = digits.bytes().all(|byte| byte.is_ascii_digit());
    let width = if digits.is_empty() {
        Some(0)
    } else {
        digits.parse().ok().filter(|_| is_width)
    };
    width
        .filter(|&width| width <= MOST_DIGITS)
        .map(|width| format!("{before}{number:0width$}{after}"))
}

/// Outcome of the pictures so far.
#[derive(Default)]
pub struct RunSummary {
    /// Names of the written files of each finished picture.
    pub written_files: Vec<Vec<String>>,
    /// Number of finished pictures.
    pub finished: usize,
    /// Two texts for the final message: the description of the last picture, and its size and
    /// samples, which stand for all pictures of a run.
    pub description: [String; 2],
    /// Largest root relMSE of all pictures of path tracing.
    pub error: Option<f64>,
    /// Exit codes of the failed scenes, in the order of the run.
    pub failed_exits: Vec<Exit>,
    /// Descriptions of the pictures that do not reach the target error.
    pub shortfalls: Vec<String>,
    /// Failure of a film file that could not be written.
    pub checkpoint_failure: Option<Failure>,
}

impl RunSummary {
    /// Formats the final message; `None` for a picture that went to standard output alone.
    /// `together` names the files that hold all pictures.
    pub fn format_message(&self, together: Vec<String>, seconds: f64) -> Option<String> {
        let files = [format_file_ranges(&self.written_files), together]
            .concat()
            .join(", ");
        let error = self
            .error
            .map(|error| format!(", errors up to {}", format_significant_digits(error, 2)))
            .unwrap_or_default();
        let [one, all] = &self.description;
        let described = match self.finished {
            1 => one.clone(),
            finished => format!("{finished} pictures, {all}{error}"),
        };
        match files.as_str() {
            "" if self.finished > 0 => None,
            "" => Some("nothing was written".to_owned()),
            files => Some(format!(
                "wrote {files} ({described}, {})",
                format_duration(seconds)
            )),
        }
    }

    /// Returns the result of a run of `scenes`: a failure if a scene failed, a film file could not be
    /// written, or a target error is not reached.
    pub fn into_result(self, is_single: bool, scenes: usize) -> Result<(), Failure> {
        if let Some(failure) = self.checkpoint_failure {
            return Err(failure);
        }
        if let Some(&exit) = self.failed_exits.first() {
            let message = format!(
                "{} of {scenes} scenes were not rendered (see the errors above)",
                self.failed_exits.len()
            );
            return Err(Failure::new(exit, message));
        }
        match self.shortfalls.as_slice() {
            [] => Ok(()),
            [message] if is_single => Err(Failure::new(Exit::Unreached, message)),
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

/// Formats the written files for the final message: for each output, the range from the first
/// picture's file to the last picture's file.
pub fn format_file_ranges(names: &[Vec<String>]) -> Vec<String> {
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

#[cfg(test)]
mod names_tests {
    use super::*;

    /// Protects: a number replaces only the placeholder in a name, padded to the placeholder's
    /// digits.
    #[test]
    fn names_are_numbered() {
        assert_eq!(
            insert_number("a-%04d.png", 7).as_deref(),
            Some("a-0007.png")
        );
        assert_eq!(insert_number("%d/%d.png", 12).as_deref(), Some("12/%d.png"));
        assert_eq!(
            insert_number("a%03dx.exr", 12345).as_deref(),
            Some("a12345x.exr")
        );
        assert_eq!(insert_number("a%5d.png", 12).as_deref(), Some("a00012.png"));
        assert_eq!(
            insert_number("a-####.png", 12).as_deref(),
            Some("a-0012.png")
        );
        for name in [
            "a.png",
            "a#.png",
            "100%.png",
            "a%+4d.png",
            "a%0xd.png",
            "a%099d.png",
            &"#".repeat(30),
        ] {
            assert_eq!(insert_number(name, 1), None, "{name}");
        }
    }

    /// Protects: pictures of scenes with the same name have distinct names, in the order of the
    /// scenes.
    #[test]
    fn equal_names_are_told_apart() {
        let inputs = [
            "a/no-such-x.glb",
            "b/no-such-x.glb",
            "b/no-such-y.glb",
            "c/no-such-x.glb",
        ]
        .map(|name| Input::Path(name.into()));
        let found = resolve_default_files(
            PictureFormat::Png,
            &inputs,
            &[0, 1, 2, 3].map(|scene| PictureJob {
                scene,
                ..PictureJob::default()
            }),
            (&mut OutputFiles::default(), &InputFiles::default()),
        )
        .expect("names that are free");
        let names = found
            .iter()
            .flatten()
            .filter_map(OutputTarget::path)
            .map(|path| path.display().to_string());
        assert_eq!(
            names.collect::<Vec<_>>(),
            [
                "no-such-x.png",
                "no-such-x-2.png",
                "no-such-y.png",
                "no-such-x-3.png"
            ]
        );
    }
}
