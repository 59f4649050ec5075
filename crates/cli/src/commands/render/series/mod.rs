//! The pictures of a `render` run: a single picture, or several from scenes, views, a turntable, or
//! times. A scene is loaded once for each time, and prepared once where only the camera moves. Each
//! picture has the bits of a run of its own, except for the studio's backdrop, which is the same
//! for all pictures.

mod moment;
mod names;
mod together;

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use raywright_core::denoise::DenoiseError;
use raywright_core::display::Display;
use raywright_core::film::Uncertainty;
use raywright_core::scene::Sky;
use raywright_core::settings::Settings;
use raywright_core::{ReadyScene, RenderOutput, Scene, estimate};
use raywright_io::output::write_atomically;
use raywright_io::{Error, Input, InputFiles, LoadOptions, Loaded};

use super::film::FilmSession;
use super::{ALLOW_EMPTY, film, messages, write};
use crate::beginning::Beginning;
use crate::clock::{Clock, Seconds, format_duration};
use crate::commands::denoise;
use crate::console;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::plan::{PicturePlan, RenderTask, Shot};
use crate::progress::Progress;
use crate::stats::Stats;
use crate::table::format_significant;
use crate::targets::{OutputFiles, OutputTarget};
use crate::threads::Threads;
use crate::{interrupt, origin, scene_input};
use moment::SceneMoment;
use together::CombinedFiles;

/// Runs `render`: renders the scenes of a task and writes their pictures.
pub fn run(task: &RenderTask) -> Result<(), Failure> {
    let mut notes = Notes::new(task.verbosity);
    let mut series = Series::start(task)?;
    let done = series.render(&mut notes);
    series.progress.finish();
    notes.finish();
    done?.iter().for_each(|line| task.verbosity.say(line));
    series.verdict()
}

/// State of a run while its pictures are rendered. A single picture is a series of length one; only
/// such a series may have a film file or write to standard output.
struct Series<'a> {
    task: &'a RenderTask,
    clock: Clock,
    /// Guard of the early stage; `None` from the start of the first render on.
    beginning: Option<Beginning>,
    stop: &'static AtomicBool,
    threads: Threads,
    progress: Progress,
    outputs: OutputFiles,
    inputs: Vec<Input>,
    /// Scenes loaded before their turn, by index, at the time of their first picture.
    loaded: HashMap<usize, Result<Loaded, Failure>>,
    /// Input files that the outputs were last checked against.
    clear_of: InputFiles,
    /// Outputs of each picture, ordered by scene and then by shot.
    targets: Vec<Vec<OutputTarget>>,
    together: CombinedFiles,
    /// Names of the written files of each finished picture.
    names: Vec<Vec<String>>,
    finished: usize,
    /// Texts for the final message: of the last picture alone, and of the size and samples that all
    /// pictures share.
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
    shows: bool,
    /// Exit codes of the failed scenes, in the order of the run.
    failed: Vec<Exit>,
    /// Descriptions of the pictures that do not reach the target error.
    shortfalls: Vec<String>,
    /// Error of a film file that could not be written.
    unkept: Option<Error>,
}

/// A rendered picture of a series, before it is written.
struct RenderedFrame<'a> {
    plan: PicturePlan,
    session: FilmSession<'a>,
    rendered: RenderOutput,
    /// Estimated error of the picture before denoising.
    noisy: Option<Uncertainty>,
    seconds: Seconds,
}

impl<'a> Series<'a> {
    /// Creates the series after all checks that need no loaded scene, and starts the early stage.
    fn start(task: &'a RenderTask) -> Result<Self, Failure> {
        let clock = Clock::start();
        let mut outputs = OutputFiles::with_quality(task.quality());
        let count = task.scenes.len() * task.shots.len();
        let targets = names::named(
            &task.outputs,
            (!task.is_single).then_some(count),
            &mut outputs,
        )?;
        let together = CombinedFiles::start(task, count, &mut outputs)?;
        if task.is_single || targets.iter().any(|targets| !targets.is_empty()) {
            targets
                .iter()
                .try_for_each(|targets| super::check(task, targets))?;
        }
        super::check_stats_target(task, &mut outputs)?;
        super::check_preview_target(task, &mut outputs)?;
        film::check(task, &targets[0], &mut outputs)?;
        let (stop, threads) = (interrupt::flag()?, Threads::new(task.threads)?);
        if task.scenes.iter().filter(|name| *name == "-").count() > 1 {
            return Err(Error::usage("standard input is one scene, and `-` is named twice").into());
        }
        let beginning = Some(super::begin(task, &clock)?);
        let input = |name: &OsString| scene_input::input(name, &task.options.limits);
        let inputs = task
            .scenes
            .iter()
            .map(input)
            .collect::<Result<Vec<_>, _>>()?;
        let progress = Progress::start("rendering", task.progress, task.verbosity).of_pieces(count);
        let (names, failed, shortfalls, description) =
            (Vec::new(), Vec::new(), Vec::new(), Default::default());
        let (loaded, clear_of, finished, error, unkept) =
            (HashMap::new(), InputFiles::default(), 0, None, None);
        let (exposure, backdrop, shows) = (None, None, false);
        let mut series = Self {
            task,
            clock,
            beginning,
            stop,
            threads,
            progress,
            outputs,
            inputs,
            loaded,
            clear_of,
            targets,
            together,
            names,
            finished,
            description,
            error,
            exposure,
            backdrop,
            shows,
            failed,
            shortfalls,
            unkept,
        };
        if !task.is_single {
            // Scene files are never overwritten by pictures. Other files that a scene names are
            // known only after it is loaded.
            series.name_pictures(&InputFiles::default())?;
            series.keep_clear_of_all()?;
        }
        Ok(series)
    }

    /// Chooses file names after the scenes, if the user named no output.
    fn name_pictures(&mut self, inputs: &InputFiles) -> Result<(), Failure> {
        let has_own = self.targets.iter().any(|targets| !targets.is_empty());
        if !has_own && !self.together.is_some() && self.task.part.is_none() {
            let format = super::default_format(self.task);
            self.targets = names::unnamed(
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
    fn keep_clear_of_all(&mut self) -> Result<(), Failure> {
        let mut named = InputFiles::default();
        self.inputs.iter().for_each(|input| {
            if let Input::Path(path) = input {
                named.read(path)
            }
        });
        self.outputs.keep_clear_of(&named)?;
        if !self.outputs.replace_any() {
            return Ok(());
        }
        let mut bytes = 0;
        for scene in 1..self.inputs.len() {
            let loaded = self.load(scene, &self.task.shots[0]);
            if let Ok(loaded) = &loaded {
                self.outputs.keep_clear_of(&loaded.inputs)?;
                bytes += bytes_of(&loaded.scene);
            }
            if bytes <= MOST_KEPT {
                self.loaded.insert(scene, loaded);
            }
        }
        Ok(())
    }

    /// Returns the load options of a picture: at the picture's own time, or at the time of `--at`.
    fn options(&self, shot: &Shot) -> LoadOptions {
        let mut options = self.task.options.clone();
        options.overrides.time = shot.at.or(options.overrides.time);
        options
    }

    fn load(&self, scene: usize, shot: &Shot) -> Result<Loaded, Failure> {
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
        self.threads
            .run(|| scene_input::load(&self.inputs[scene], &self.options(shot), &loading))
    }

    /// Renders the pictures of all scenes. Returns the final message, or `None` for a picture that
    /// went to standard output alone. After the failure of a scene the next scene is rendered,
    /// except after an interruption.
    fn render(&mut self, notes: &mut Notes) -> Result<Option<String>, Failure> {
        for scene in 0..self.inputs.len() {
            let Err(failure) = self.render_scene(scene, notes) else {
                continue;
            };
            if failure.exit == Exit::Interrupted {
                return Err(failure);
            }
            if self.inputs.len() == 1 {
                return Err(self.with_kept(failure));
            }
            console::print_message(failure.message.trim_end());
            self.failed.push(failure.exit);
            self.task
                .shots
                .iter()
                .for_each(|_| self.progress.finish_piece());
        }
        let is_free = |path: &Path| self.outputs.leave_free(path, &self.clear_of);
        let together = self.together.write((&self.clear_of, is_free))?;
        let files = [ranges(&self.names), together].concat().join(", ");
        let error = self
            .error
            .map(|error| format!(", errors up to {}", format_significant(error, 2)))
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
                format_duration(self.clock.total())
            )),
        })
    }

    /// Keeps the unfinished sheet and animations in files, and adds their names to the failure.
    fn with_kept(&mut self, failure: Failure) -> Failure {
        let is_free = |path: &Path| self.outputs.leave_free(path, &self.clear_of);
        match self.together.keep(is_free) {
            Ok(kept) if !kept.is_empty() => failure.with_hint(format_args!(
                "the pictures before it are in {}",
                kept.join(", ")
            )),
            _ => failure,
        }
    }

    /// Renders all pictures of the scene with index `scene`.
    fn render_scene(&mut self, scene: usize, notes: &mut Notes) -> Result<(), Failure> {
        let mut moment: Option<SceneMoment> = None;
        (self.exposure, self.shows) = (None, false);
        for (i, shot) in self.task.shots.iter().enumerate() {
            // Only the first picture of a scene has notes, because they usually apply to all its
            // pictures.
            let mut silent = Notes::new(console::Verbosity::Quiet);
            let notes = if i == 0 { &mut *notes } else { &mut silent };
            let now = match moment.take() {
                Some(moment) if shot.at.is_none() => moment,
                _ => self.moment(scene, i, notes)?,
            };
            self.render_shot(
                scene * self.task.shots.len() + i,
                shot,
                moment.insert(now),
                notes,
            )?;
        }
        match moment {
            Some(moment) if !self.shows && self.task.refuses_empty() => Err(scene_input::empty(
                &moment.loaded.source.name,
                "no picture shows any of it",
            )
            .with_hint(ALLOW_EMPTY)),
            _ => Ok(()),
        }
    }

    /// Loads a scene at the time of its picture `i`, and checks the outputs against its files.
    fn moment(
        &mut self,
        scene: usize,
        i: usize,
        notes: &mut Notes,
    ) -> Result<SceneMoment, Failure> {
        let early = if i == 0 {
            self.loaded.remove(&scene)
        } else {
            None
        };
        let loaded = early.unwrap_or_else(|| self.load(scene, &self.task.shots[i]))?;
        if self.inputs.len() > 1 && i == 0 {
            notes.turn_to(&loaded.source.name);
        }
        notes.warn_of(&loaded);
        if self.task.is_single {
            self.name_pictures(&loaded.inputs)?;
        }
        // Outputs are checked again only for new input files: an animation loads the same files
        // thousands of times.
        if loaded.inputs != self.clear_of {
            self.outputs.keep_clear_of(&loaded.inputs)?;
            self.clear_of = loaded.inputs.clone();
        }
        if let Some(failure) =
            scene_input::nothing_to_see(&loaded).filter(|_| self.task.refuses_empty())
        {
            return Err(failure.with_hint(ALLOW_EMPTY));
        }
        scene_input::note_completed(&loaded, notes);
        let mut loaded = loaded;
        if let Some(Sky::Studio(studio)) = &mut loaded.scene.sky {
            studio.backdrop = studio.backdrop.or(self.backdrop);
        }
        Ok(SceneMoment::new(loaded))
    }

    /// Renders a picture and writes it. `number` is the index of the picture in the run.
    fn render_shot(
        &mut self,
        number: usize,
        shot: &Shot,
        moment: &mut SceneMoment,
        notes: &mut Notes,
    ) -> Result<(), Failure> {
        let plan = moment.settle(self.task, shot)?;
        let load = self.clock.lap();
        match moment.prepare(&plan, &self.threads, self.stop) {
            Err(failure) if failure.exit == Exit::Interrupted && !self.task.is_single => {
                let is_free = |path: &Path| self.outputs.leave_free(path, &moment.loaded.inputs);
                return Err(write::interrupted(
                    self.together.keep(is_free),
                    Some([self.finished, self.targets.len()]),
                ));
            }
            prepared => prepared?,
        }
        let prepare = self.clock.lap();
        let SceneMoment {
            loaded,
            ready: Some(ready),
            ..
        } = moment
        else {
            return Ok(());
        };
        self.backdrop = self.backdrop.or(ready.backdrop());
        super::note_prepared(loaded, ready, &plan.settings, notes);
        super::refuse_to_denoise(self.task, &plan.settings, ready, notes)?;
        let mut session = super::start(
            self.task,
            &self.options(shot),
            (loaded, ready),
            (&plan, &shot.label),
        )?;
        if self.beginning.take().is_some() {
            self.progress.begin();
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
        session.note_slow(&self.clock, notes);
        let rendered = self
            .threads
            .run(|| denoise::rendered(session.film(), (self.task.progress, verbosity), self.stop));
        let noisy = self.threads.run(|| rendered.noisy_error(session.film()));
        let [render, render_cpu] = self.clock.lap_with_cpu();
        let seconds = Seconds {
            load,
            prepare,
            render,
            render_cpu,
            ..Seconds::default()
        };
        let caption = match (self.inputs.len(), shot.caption.as_str()) {
            (_, "") => loaded.source.stem.clone(),
            (1, caption) => caption.to_owned(),
            (_, caption) => format!("{} {caption}", loaded.source.stem),
        };
        self.finish(
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
    fn finish(
        &mut self,
        number: usize,
        caption: &str,
        (loaded, ready): (&mut Loaded, &ReadyScene),
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
            self.refuse_empty(loaded, &rendered, &plan)?;
        }
        if plan.is_exposed {
            plan.display.exposure_stops = self.exposure_of(&rendered, plan.display);
            session.show(
                plan.display,
                origin::metadata(loaded, &plan, &self.task.choices),
            );
        }
        let (task, targets) = (self.task, &self.targets[number]);
        let claimed = super::claimed(task, (ready, &rendered), noisy.as_ref());
        let metadata = super::metadata(task, &session, &rendered, claimed);
        let is_free = |path: &Path| self.outputs.leave_free(path, &loaded.inputs);
        if !session.is_done() || matches!(rendered.denoised, Some(Err(DenoiseError::Cancelled))) {
            let own = write::keep(&rendered, targets, plan.display, &metadata, is_free);
            let kept = own
                .and_then(|own| Ok(session.with_own([own, self.together.keep(is_free)?].concat())));
            let of = (!task.is_single).then_some([self.finished, self.targets.len()]);
            return Err(session.explained(write::interrupted(kept, of)));
        }
        let names = write::write(
            &rendered,
            targets,
            plan.display,
            &metadata,
            (&loaded.inputs, is_free),
        )?;
        super::print_hash(task, (&rendered, plan.display), &names, caption)?;
        self.names.push(session.with_own(names));
        self.together
            .add(rendered.shown_picture(), plan.display, caption)?;
        (seconds.write, seconds.total) = (self.clock.lap(), self.clock.total());
        loaded
            .warnings
            .extend(messages::note_losses(&rendered.counters, notes));
        if let Some(path) = &task.stats {
            let stats = Stats::new(loaded, ready, &rendered, noisy, seconds);
            write_atomically(path, console::json(&stats).as_bytes())?;
        }
        super::note_rendered(loaded, &rendered, &plan, targets, notes);
        messages::note_shut_away(loaded, ready, session.film(), notes);
        if let Some(noisy) = claimed {
            messages::note_denoising(noisy, &plan.settings, notes);
        }
        let description =
            super::described(task, &plan.settings, &session, &rendered, claimed, notes);
        let shortfall = task.max_error.and_then(|requested| {
            messages::shortfall(requested, claimed, session.film(), &rendered)
        });
        self.shortfalls.extend(shortfall);
        if task.is_single {
            notes.detail(messages::details(ready, &rendered, &seconds).trim_end());
        }
        self.description = [
            description,
            super::size_and_samples(&plan.settings, &session),
        ];
        let error = rendered.denoised().map(|denoised| denoised.error).or(noisy);
        let error = error
            .filter(|_| ready.follows_paths())
            .map(|error| error.root_relmse.value);
        self.error = self.error.into_iter().chain(error).reduce(f64::max);
        self.finished += 1;
        self.progress.finish_piece();
        self.unkept = session.into_unkept();
        Ok(())
    }

    /// Refuses a picture that shows no object before it is written, if its scene has no other
    /// picture.
    fn refuse_empty(
        &mut self,
        loaded: &Loaded,
        rendered: &RenderOutput,
        plan: &PicturePlan,
    ) -> Result<(), Failure> {
        let reason = scene_input::nothing_met(loaded, rendered, &plan.settings);
        self.shows |= reason.is_none();
        match reason.filter(|_| self.task.shots.len() == 1 && self.task.refuses_empty()) {
            Some(reason) => {
                Err(scene_input::empty(&loaded.source.name, reason).with_hint(ALLOW_EMPTY))
            }
            None => Ok(()),
        }
    }

    /// Returns the automatic exposure in stops, chosen from the scene's first picture.
    fn exposure_of(&mut self, rendered: &RenderOutput, display: Display) -> f64 {
        *self
            .exposure
            .get_or_insert_with(|| display.suited_to(rendered.shown_picture()).exposure_stops)
    }

    /// Returns the result of the run: a failure if a scene failed, a film file could not be
    /// written, or a target error is not reached.
    fn verdict(self) -> Result<(), Failure> {
        if let Some(error) = self.unkept {
            return Err(error.into());
        }
        if let Some(&exit) = self.failed.first() {
            let message = format!(
                "{} of {} scenes were not rendered",
                self.failed.len(),
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

/// Formats the written files for the final message: for each output, the first picture's file to
/// the last picture's file.
fn ranges(names: &[Vec<String>]) -> Vec<String> {
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
const MOST_KEPT: u64 = 1 << 30;

/// Estimates the memory of a scene in bytes.
fn bytes_of(scene: &Scene) -> u64 {
    estimate(scene, &Settings::from_scene(scene)).total()
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
        let mut series = Series::start(&task).expect("nothing in the way");
        std::fs::remove_file(at("b.obj")).expect("a file");
        series
            .render(&mut Notes::new(console::Verbosity::Quiet))
            .expect("pictures");
        assert!(series.failed.is_empty() && std::path::Path::new(&at("1.png")).exists());
    }

    /// Protects: the files of many pictures are listed as first to last for each output, those of a
    /// single picture by name, and an empty list is empty.
    #[test]
    fn files_are_told_by_the_first_and_the_last_of_a_kind() {
        let describe = |names: &[&[&str]]| {
            ranges(
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
