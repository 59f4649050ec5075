//! The pictures of a `render` run: a single picture, or several from scenes, views, a turntable, or
//! times of an animation. A scene is loaded once for each time, and prepared once where only the
//! camera moves. Each picture has the same bits as in a run for this picture alone; only the
//! studio's backdrop is the same for all pictures.

mod combined;
mod moment;
mod names;

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use raywright_core::denoise::DenoiseError;
use raywright_core::display::Display;
use raywright_core::film::Uncertainty;
use raywright_core::scene::Sky;
use raywright_core::settings::Settings;
use raywright_core::{ReadyScene, RenderOutput, Scene, estimate_scene_memory};
use raywright_io::output::write_atomically;
use raywright_io::{Error, Input, InputFiles, LoadOptions, LoadedScene};

use super::film::FilmSession;
use super::{ALLOW_EMPTY, film, messages, write};
use crate::clock::{StageClock, StageSeconds, format_duration};
use crate::commands::denoise;
use crate::console;
use crate::early_stage::EarlyStageGuard;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::plan::{PicturePlan, RenderTask, Shot};
use crate::progress::Progress;
use crate::stats::RenderStats;
use crate::table::format_significant_digits;
use crate::targets::{OutputFiles, OutputTarget};
use crate::threads::Threads;
use crate::{interrupt, origin, scene_input};
use combined::CombinedFiles;
use moment::SceneAtTime;

/// Runs `render`: renders the scenes of a task and writes their pictures.
pub fn run(task: &RenderTask) -> Result<(), Failure> {
    let mut notes = Notes::new(task.verbosity);
    let mut series = PictureSeries::start(task)?;
    let done = series.render_all_scenes(&mut notes);
    series.progress.finish();
    notes.print_kept_messages();
    done?
        .iter()
        .for_each(|line| task.verbosity.print_result_message(line));
    series.into_result()
}

/// State of a run while its pictures are rendered. A single picture is a series of length one; only
/// such a series may have a film file or write to standard output.
struct PictureSeries<'a> {
    task: &'a RenderTask,
    clock: StageClock,
    /// Guard of the run's early stage, loading and preparation; `None` from the start of the first
    /// render on.
    early_stage: Option<EarlyStageGuard>,
    stop: &'static AtomicBool,
    threads: Threads,
    progress: Progress,
    outputs: OutputFiles,
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
    /// Automatic exposure in stops, chosen from the current scene's first picture for all its
    /// pictures.
    exposure: Option<f64>,
    /// Radiance of the studio's backdrop, chosen by the first picture with a studio for all
    /// pictures.
    backdrop: Option<f64>,
    /// Whether any picture of the current scene shows an object.
    shows_object: bool,
    /// Exit codes of the failed scenes, in the order of the run.
    failed_exits: Vec<Exit>,
    /// Descriptions of the pictures that do not reach the target error.
    shortfalls: Vec<String>,
    /// Error of a film file that could not be written.
    checkpoint_error: Option<Error>,
}

/// A rendered picture of a series, before it is written.
struct RenderedFrame<'a> {
    plan: PicturePlan,
    session: FilmSession<'a>,
    rendered: RenderOutput,
    /// Estimated error of the picture before denoising.
    noisy: Option<Uncertainty>,
    /// Wall-clock seconds of the stages of the run so far.
    seconds: StageSeconds,
}

impl<'a> PictureSeries<'a> {
    /// Creates the series after all checks that need no loaded scene, and starts the run's early
    /// stage, loading and preparation.
    fn start(task: &'a RenderTask) -> Result<Self, Failure> {
        let clock = StageClock::start();
        let mut outputs = OutputFiles::with_quality(task.jpeg_quality());
        let count = task.scenes.len() * task.shots.len();
        let targets = names::resolve_named_files(
            &task.outputs,
            (!task.is_single).then_some(count),
            &mut outputs,
        )?;
        let together = CombinedFiles::start(task, count, &mut outputs)?;
        if task.is_single || targets.iter().any(|targets| !targets.is_empty()) {
            targets
                .iter()
                .try_for_each(|targets| super::check_targets(task, targets))?;
        }
        super::check_stats_target(task, &mut outputs)?;
        super::check_preview_target(task, &mut outputs)?;
        film::check_film_flags(task, &targets[0], &mut outputs)?;
        let (stop, threads) = (interrupt::install_stop_flag()?, Threads::new(task.threads)?);
        if task.scenes.iter().filter(|name| *name == "-").count() > 1 {
            return Err(Error::invalid_usage(
                "`-` is named twice, and standard input holds a single scene",
            )
            .into());
        }
        let beginning = Some(super::start_early_stage(task, &clock)?);
        let input = |name: &OsString| scene_input::resolve_input(name, &task.options.limits);
        let inputs = task
            .scenes
            .iter()
            .map(input)
            .collect::<Result<Vec<_>, _>>()?;
        let progress =
            Progress::start("rendering", task.progress, task.verbosity).with_pieces(count);
        let (names, failed, shortfalls, description) =
            (Vec::new(), Vec::new(), Vec::new(), Default::default());
        let (loaded, clear_of, finished, error, unkept) =
            (HashMap::new(), InputFiles::default(), 0, None, None);
        let (exposure, backdrop, shows) = (None, None, false);
        let mut series = Self {
            task,
            clock,
            early_stage: beginning,
            stop,
            threads,
            progress,
            outputs,
            inputs,
            preloaded: loaded,
            checked_inputs: clear_of,
            targets,
            combined_files: together,
            written_files: names,
            finished,
            description,
            error,
            exposure,
            backdrop,
            shows_object: shows,
            failed_exits: failed,
            shortfalls,
            checkpoint_error: unkept,
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
                (&mut self.outputs, inputs),
            )?;
        }
        Ok(())
    }

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
        self.outputs.check_against_inputs(&input_paths)?;
        if !self.outputs.has_existing_file() {
            return Ok(());
        }
        let mut bytes = 0;
        for scene in 1..self.inputs.len() {
            let loaded = self.load_scene(scene, &self.task.shots[0]);
            if let Ok(loaded) = &loaded {
                self.outputs.check_against_inputs(&loaded.inputs)?;
                bytes += estimate_scene_bytes(&loaded.scene);
            }
            if bytes <= MOST_KEPT_BYTES {
                self.preloaded.insert(scene, loaded);
            }
        }
        Ok(())
    }

    /// Returns the load options of a picture: at the picture's own time, or at the time of `--at`.
    fn shot_load_options(&self, shot: &Shot) -> LoadOptions {
        let mut options = self.task.options.clone();
        options.overrides.time = shot.at.or(options.overrides.time);
        options
    }

    fn load_scene(&self, scene: usize, shot: &Shot) -> Result<LoadedScene, Failure> {
        let RenderTask {
            is_single,
            progress,
            verbosity,
            ..
        } = *self.task;
        // In a run of several pictures, the progress display counts pictures and shows no loads.
        let loading = if is_single {
            Progress::start("loading", progress, verbosity)
        } else {
            Progress::hidden()
        };
        self.threads.run(|| {
            scene_input::load_with_progress(
                &self.inputs[scene],
                &self.shot_load_options(shot),
                &loading,
            )
        })
    }

    /// Renders the pictures of all scenes. Returns the final message, or `None` for a picture that
    /// went to standard output alone. After the failure of a scene the next scene is rendered,
    /// except after an interruption.
    fn render_all_scenes(&mut self, notes: &mut Notes) -> Result<Option<String>, Failure> {
        for scene in 0..self.inputs.len() {
            let Err(failure) = self.render_scene(scene, notes) else {
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
                .for_each(|_| self.progress.finish_piece());
        }
        let is_free = |path: &Path| self.outputs.is_free_path(path, &self.checked_inputs);
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
                format_duration(self.clock.total_seconds())
            )),
        })
    }

    /// Keeps the unfinished sheet and animations in files, and adds their names to the failure.
    fn with_partial_files(&mut self, failure: Failure) -> Failure {
        let is_free = |path: &Path| self.outputs.is_free_path(path, &self.checked_inputs);
        match self.combined_files.write_partial_files(is_free) {
            Ok(kept) if !kept.is_empty() => failure.with_hint(format_args!(
                "the pictures finished before are in {}",
                kept.join(", ")
            )),
            _ => failure,
        }
    }

    /// Renders all pictures of the scene with index `scene`.
    fn render_scene(&mut self, scene: usize, notes: &mut Notes) -> Result<(), Failure> {
        let mut moment: Option<SceneAtTime> = None;
        (self.exposure, self.shows_object) = (None, false);
        for (i, shot) in self.task.shots.iter().enumerate() {
            // Only the first picture of a scene has notes, because they usually apply to all its
            // pictures.
            let mut silent = Notes::new(console::Verbosity::Quiet);
            let notes = if i == 0 { &mut *notes } else { &mut silent };
            let now = match moment.take() {
                Some(moment) if shot.at.is_none() => moment,
                _ => self.load_scene_at_time(scene, i, notes)?,
            };
            self.render_shot(
                scene * self.task.shots.len() + i,
                shot,
                moment.insert(now),
                notes,
            )?;
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

    /// Loads a scene at the time of its picture `i`, and checks that no output overwrites a file of
    /// the scene.
    fn load_scene_at_time(
        &mut self,
        scene: usize,
        i: usize,
        notes: &mut Notes,
    ) -> Result<SceneAtTime, Failure> {
        let early = if i == 0 {
            self.preloaded.remove(&scene)
        } else {
            None
        };
        let loaded = early.unwrap_or_else(|| self.load_scene(scene, &self.task.shots[i]))?;
        if self.inputs.len() > 1 && i == 0 {
            notes.set_current_file(&loaded.source.name);
        }
        notes.add_scene_warnings(&loaded);
        if self.task.is_single {
            self.choose_file_names(&loaded.inputs)?;
        }
        // Outputs are checked again only for new input files: an animation loads the same files
        // thousands of times.
        if loaded.inputs != self.checked_inputs {
            self.outputs.check_against_inputs(&loaded.inputs)?;
            self.checked_inputs = loaded.inputs.clone();
        }
        if let Some(failure) =
            scene_input::empty_scene_failure(&loaded).filter(|_| self.task.refuses_empty_pictures())
        {
            return Err(failure.with_hint(ALLOW_EMPTY));
        }
        scene_input::note_added_parts(&loaded, notes);
        let mut loaded = loaded;
        if let Some(Sky::Studio(studio)) = &mut loaded.scene.sky {
            studio.backdrop = studio.backdrop.or(self.backdrop);
        }
        Ok(SceneAtTime::new(loaded))
    }

    /// Renders a picture and writes it. `number` is the index of the picture in the run.
    fn render_shot(
        &mut self,
        number: usize,
        shot: &Shot,
        moment: &mut SceneAtTime,
        notes: &mut Notes,
    ) -> Result<(), Failure> {
        let plan = moment.resolve_plan(self.task, shot)?;
        let load = self.clock.lap();
        match moment.prepare_picture(&plan, &self.threads, self.stop) {
            Err(failure) if failure.exit == Exit::Interrupted && !self.task.is_single => {
                let is_free = |path: &Path| self.outputs.is_free_path(path, &moment.loaded.inputs);
                return Err(write::interrupted_failure(
                    self.combined_files.write_partial_files(is_free),
                    Some([self.finished, self.targets.len()]),
                ));
            }
            prepared => prepared?,
        }
        let prepare = self.clock.lap();
        let SceneAtTime {
            loaded,
            ready: Some(ready),
            ..
        } = moment
        else {
            return Ok(());
        };
        self.backdrop = self.backdrop.or(ready.backdrop_radiance());
        super::note_preparation(loaded, ready, &plan.settings, notes);
        super::refuse_impossible_denoising(self.task, &plan.settings, ready, notes)?;
        let mut session = super::start_session(
            self.task,
            &self.shot_load_options(shot),
            (loaded, ready),
            (&plan, &shot.label),
        )?;
        if self.early_stage.take().is_some() {
            self.progress.restart_clock();
        }
        self.threads
            .run(|| session.render(ready, &self.progress, (&self.clock, self.stop)))?;
        // A run of several pictures has a single progress display, without a display for each
        // picture.
        let mut verbosity = console::Verbosity::Quiet;
        if self.task.is_single {
            self.progress.finish();
            verbosity = self.task.verbosity;
        }
        session.note_exceeded_budget(&self.clock, notes);
        let rendered = self.threads.run(|| {
            denoise::denoise_with_progress(
                session.film(),
                (self.task.progress, verbosity),
                self.stop,
            )
        });
        let noisy = self
            .threads
            .run(|| rendered.error_before_denoising(session.film()));
        let [render, render_cpu] = self.clock.lap_with_cpu();
        let seconds = StageSeconds {
            load,
            prepare,
            render,
            render_cpu,
            ..StageSeconds::default()
        };
        let caption = match (self.inputs.len(), shot.caption.as_str()) {
            (_, "") => loaded.source.stem.clone(),
            (1, caption) => caption.to_owned(),
            (_, caption) => format!("{} {caption}", loaded.source.stem),
        };
        self.write_rendered_frame(
            number,
            &caption,
            (loaded, ready),
            RenderedFrame {
                plan,
                session,
                rendered,
                noisy,
                seconds,
            },
            notes,
        )
    }

    /// Writes a picture, finished or interrupted, and records its messages.
    fn write_rendered_frame(
        &mut self,
        number: usize,
        caption: &str,
        (loaded, ready): (&mut LoadedScene, &ReadyScene),
        rendered_frame: RenderedFrame<'_>,
        notes: &mut Notes,
    ) -> Result<(), Failure> {
        let RenderedFrame {
            mut plan,
            mut session,
            rendered,
            noisy,
            mut seconds,
        } = rendered_frame;
        if session.is_done() {
            self.refuse_empty_picture(loaded, &rendered, &plan)?;
        }
        if plan.has_auto_exposure {
            plan.display.exposure_stops = self.choose_scene_exposure(&rendered, plan.display);
            session.set_display(
                plan.display,
                origin::picture_metadata(loaded, &plan, &self.task.choices),
            );
        }
        let (task, targets) = (self.task, &self.targets[number]);
        let claimed = super::select_reported_error(task, (ready, &rendered), noisy.as_ref());
        let metadata = super::picture_metadata(task, &session, &rendered, claimed);
        let is_free = |path: &Path| self.outputs.is_free_path(path, &loaded.inputs);
        if !session.is_done() || matches!(rendered.denoised, Some(Err(DenoiseError::Cancelled))) {
            let own =
                write::write_partial_picture(&rendered, targets, plan.display, &metadata, is_free);
            let kept = own.and_then(|own| {
                Ok(session.with_checkpoint_path(
                    [own, self.combined_files.write_partial_files(is_free)?].concat(),
                ))
            });
            let of = (!task.is_single).then_some([self.finished, self.targets.len()]);
            return Err(session.with_resume_hint(write::interrupted_failure(kept, of)));
        }
        let names = write::write_targets(
            &rendered,
            targets,
            plan.display,
            &metadata,
            (&loaded.inputs, is_free),
        )?;
        super::print_pixel_hash(task, (&rendered, plan.display), &names, caption)?;
        self.written_files.push(session.with_checkpoint_path(names));
        self.combined_files
            .add_picture(rendered.final_picture(), plan.display, caption)?;
        (seconds.write, seconds.total) = (self.clock.lap(), self.clock.total_seconds());
        loaded
            .warnings
            .extend(messages::note_lost_samples(&rendered.counters, notes));
        if let Some(path) = &task.stats {
            let stats = RenderStats::new(loaded, ready, &rendered, noisy, seconds);
            write_atomically(path, console::format_json(&stats).as_bytes())?;
        }
        super::note_picture(loaded, &rendered, &plan, targets, notes);
        messages::note_unreached_lights(loaded, ready, session.film(), notes);
        if let Some(noisy) = claimed {
            messages::note_denoising(noisy, &plan.settings, notes);
        }
        let description =
            super::describe_picture(task, &plan.settings, &session, &rendered, claimed, notes);
        let shortfall = task.max_error.and_then(|requested| {
            messages::describe_shortfall(requested, claimed, session.film(), &rendered)
        });
        self.shortfalls.extend(shortfall);
        if task.is_single {
            notes.print_detail(messages::format_details(ready, &rendered, &seconds).trim_end());
        }
        self.description = [
            description,
            super::format_size_and_samples(&plan.settings, &session),
        ];
        let error = rendered
            .denoise_output()
            .map(|denoised| denoised.error)
            .or(noisy);
        let error = error
            .filter(|_| ready.is_path_traced())
            .map(|error| error.root_relmse.value);
        self.error = self.error.into_iter().chain(error).reduce(f64::max);
        self.finished += 1;
        self.progress.finish_piece();
        self.checkpoint_error = session.into_checkpoint_error();
        Ok(())
    }

    /// Refuses a picture that shows no object before it is written, if its scene has no other
    /// picture.
    fn refuse_empty_picture(
        &mut self,
        loaded: &LoadedScene,
        rendered: &RenderOutput,
        plan: &PicturePlan,
    ) -> Result<(), Failure> {
        let reason = scene_input::describe_empty_picture(loaded, rendered, &plan.settings);
        self.shows_object |= reason.is_none();
        match reason.filter(|_| self.task.shots.len() == 1 && self.task.refuses_empty_pictures()) {
            Some(reason) => Err(
                scene_input::empty_picture_failure(&loaded.source.name, reason)
                    .with_hint(ALLOW_EMPTY),
            ),
            None => Ok(()),
        }
    }

    /// Returns the automatic exposure in stops. It is chosen from the scene's first picture, and
    /// used for all its pictures.
    fn choose_scene_exposure(&mut self, rendered: &RenderOutput, display: Display) -> f64 {
        *self.exposure.get_or_insert_with(|| {
            display
                .with_suitable_exposure(rendered.final_picture())
                .exposure_stops
        })
    }

    /// Returns the result of the run: a failure if a scene failed, a film file could not be
    /// written, or a target error is not reached.
    fn into_result(self) -> Result<(), Failure> {
        if let Some(error) = self.checkpoint_error {
            return Err(error.into());
        }
        if let Some(&exit) = self.failed_exits.first() {
            let message = format!(
                "{} of {} scenes were not rendered",
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
                    "{} of {} pictures: {first}",
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

/// Largest estimated memory in bytes of all scenes kept in memory for their turn; further scenes
/// are loaded again.
const MOST_KEPT_BYTES: u64 = 1 << 30;

/// Estimates the memory of a scene in bytes.
fn estimate_scene_bytes(scene: &Scene) -> u64 {
    estimate_scene_memory(scene, &Settings::from_scene(scene)).total()
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Arguments, Command};

    /// Protects: scenes loaded before their turn, because outputs could overwrite their files, are
    /// loaded once: the picture shows the loaded content even if the file is gone.
    #[test]
    fn scenes_are_read_once() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
        for name in ["a.obj", "b.obj"] {
            std::fs::write(at(name), "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n").expect("a file");
        }
        let words = [
            "raywright",
            "render",
            &at("a.obj"),
            &at("b.obj"),
            "-s",
            "4x4",
            "--spp",
            "1",
            "-o",
            &at("%d.png"),
        ];
        let Ok(Arguments {
            command: Some(Command::Render(args)),
            ..
        }) = Arguments::try_parse_from(words)
        else {
            panic!("a right command line")
        };
        std::fs::write(at("0.png"), "old").expect("a file");
        let task =
            RenderTask::new(*args, console::Verbosity::Quiet).expect("nothing is wrong with it");
        let mut series = PictureSeries::start(&task).expect("nothing in the way");
        std::fs::remove_file(at("b.obj")).expect("a file");
        series
            .render_all_scenes(&mut Notes::new(console::Verbosity::Quiet))
            .expect("pictures");
        assert!(series.failed_exits.is_empty() && std::path::Path::new(&at("1.png")).exists());
    }

    /// Protects: the files of many pictures are listed as first to last for each output, those of a
    /// single picture by name, and an empty list is empty.
    #[test]
    fn files_are_told_by_the_first_and_the_last_of_a_kind() {
        let describe = |names: &[&[&str]]| {
            format_file_ranges(
                &names
                    .iter()
                    .map(|names| names.iter().map(|&name| name.to_owned()).collect())
                    .collect::<Vec<_>>(),
            )
            .join(", ")
        };
        assert_eq!(
            describe(&[
                &["a-0.png", "b-0.exr"],
                &["a-1.png", "b-1.exr"],
                &["a-2.png", "b-2.exr"]
            ]),
            "a-0.png to a-2.png, b-0.exr to b-2.exr"
        );
        assert_eq!(describe(&[&["w.png", "t-0000.png"]]), "w.png, t-0000.png");
        assert_eq!(
            (describe(&[]), describe(&[&[], &[]])),
            (String::new(), String::new())
        );
    }
}
