//! Several pictures a run: of several scenes, from several views, once around, or of several moments. A scene is loaded once for each
//! moment and prepared once where only the camera moves; each picture has the bits of a run of its own.

mod shots;
mod together;

use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use raywright_core::Ready;
use raywright_core::denoise::DenoiseError;
use raywright_core::framing::Silhouette;
use raywright_core::settings::Settings;
use raywright_core::{Scene, estimate};
use raywright_io::{Error, Input, Inputs, Loaded};

use super::{
    described, limits, metadata, name_of, note_prepared, note_rendered, print_hash, refuse_to_denoise, settle, size_and_samples,
    start, tell, write,
};
use crate::args::{RenderArgs, ReportArgs};
use crate::beginning::Beginning;
use crate::clock::{Clock, spoken};
use crate::commands::denoise;
use crate::console;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::plan::Plan;
use crate::progress::Progress;
use crate::ready::prepared;
use crate::table::significant;
use crate::targets::{Outputs, Target};
use crate::threads::Threads;
use crate::watch::Watch;
use crate::{interrupt, scene_input};
use shots::Shot;
pub(super) use shots::{is_asked_for, shots};
use together::Together;

/// Renders several pictures.
pub(super) fn run(args: &RenderArgs, shots: Vec<Shot>) -> Result<(), Failure> {
    shots::refuse_what_is_of_one_picture(args)?;
    let shots = if shots.is_empty() { vec![Shot::default()] } else { shots };
    let mut notes = Notes::new(args.report.verbosity);
    let mut series = Series::start(args, &shots)?;
    let done = series.render(&shots, &mut notes);
    series.progress.finish();
    notes.finish();
    args.report.verbosity.say(done?);
    series.verdict()
}

/// A run of several pictures.
struct Series<'a> {
    args: &'a RenderArgs,
    clock: Clock,
    /// Until the first picture is begun.
    beginning: Option<Beginning>,
    stop: &'static AtomicBool,
    threads: Threads,
    progress: Progress,
    outputs: Outputs,
    inputs: Vec<Input>,
    /// Scenes that were read before their turn, by number, at the moment of their first picture.
    loaded: HashMap<usize, Result<Loaded, Failure>>,
    /// What the scene read that the outputs were last held against.
    clear_of: Inputs,
    /// The files of each picture, scene after scene.
    targets: Vec<Vec<Target>>,
    together: Together,
    /// Files that were written, picture by picture.
    names: Vec<Vec<String>>,
    finished: usize,
    /// The last picture in a few words, and what holds for all of them.
    description: [String; 2],
    /// The greatest error of all.
    error: Option<f64>,
    /// How the first of the scenes that failed did.
    failed: Vec<Exit>,
}

impl<'a> Series<'a> {
    /// Everything that can be known before a scene is read.
    fn start(args: &'a RenderArgs, shots: &[Shot]) -> Result<Self, Failure> {
        let clock = Clock::start();
        let mut outputs = Outputs::default();
        let scenes = args.scenes.len().max(1);
        let count = scenes * shots.len();
        let mut targets = shots::named(&args.outputs, count, &mut outputs)?;
        let together = Together::start(args, count, shots::rate(&args.view), &mut outputs)?;
        let has_own = targets.iter().any(|targets| !targets.is_empty());
        if has_own {
            targets.iter().try_for_each(|targets| super::check_floats_and_layers(args, targets))?;
        }
        let (stop, threads) = (interrupt::flag()?, Threads::new(args.machine.threads)?);
        let names = if args.scenes.is_empty() { vec![name_of(None)?] } else { args.scenes.clone() };
        if names.iter().filter(|name| *name == "-").count() > 1 {
            return Err(Error::usage("standard input is one scene, and `-` is named twice").into());
        }
        let beginning = Some(super::begin(&names[0], args, None)?);
        let inputs = names.iter().map(|name| scene_input::input(name, &limits(args))).collect::<Result<Vec<_>, _>>()?;
        if !has_own && !together.is_some() {
            targets = shots::unnamed(args, &inputs, shots, &mut outputs)?;
        }
        let progress = Progress::start("rendering", args.report.progress, args.report.verbosity).of_pieces(count);
        let (names, failed, description) = (Vec::new(), Vec::new(), Default::default());
        let mut series = Self {
            args,
            clock,
            beginning,
            stop,
            threads,
            progress,
            outputs,
            inputs,
            loaded: HashMap::new(),
            clear_of: Inputs::default(),
            targets,
            together,
            names,
            finished: 0,
            description,
            error: None,
            failed,
        };
        series.keep_clear_of_all(shots)?;
        Ok(series)
    }

    /// What a later scene names is known when it is read, which is too late for a file of its that an earlier picture would replace. So where
    /// a picture would replace anything at all, all scenes are read beforehand, and kept for their turn as far as they are small; what is wrong
    /// with one is said then.
    fn keep_clear_of_all(&mut self, shots: &[Shot]) -> Result<(), Failure> {
        let mut named = Inputs::default();
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
            let loaded = self.load(scene, shots.first().and_then(|shot| shot.at));
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

    /// Reads a scene at a moment, or at the one that the flags say.
    fn load(&self, scene: usize, at: Option<f64>) -> Result<Loaded, Failure> {
        let mut changes = self.args.changes.clone();
        changes.at = at.or(changes.at);
        self.threads.run(|| scene_input::load(&self.inputs[scene], &changes, limits(self.args), &Progress::hidden()))
    }

    /// Renders the pictures of all scenes; what is said in the end. A scene that can't be rendered does not keep the others away.
    fn render(&mut self, shots: &[Shot], notes: &mut Notes) -> Result<String, Failure> {
        for scene in 0..self.inputs.len() {
            let Err(failure) = self.render_scene(scene, shots, notes) else { continue };
            if failure.exit == Exit::Interrupted || self.inputs.len() == 1 {
                return Err(failure);
            }
            console::tell(failure.message.trim_end());
            self.failed.push(failure.exit);
            (0..shots.len()).for_each(|_| self.progress.finish_piece());
        }
        let together = self.together.write()?;
        let files = [ranges(&self.names), together].concat().join(", ");
        let error = self.error.map(|error| format!(", errors up to {}", significant(error, 2))).unwrap_or_default();
        let [one, all] = &self.description;
        let described = if self.finished == 1 { one.clone() } else { format!("{} pictures, {all}{error}", self.finished) };
        Ok(match files.as_str() {
            "" => "nothing was written".to_owned(),
            files => format!("wrote {files} ({described}, {})", spoken(self.clock.total())),
        })
    }

    /// Renders all pictures of a scene.
    fn render_scene(&mut self, scene: usize, shots: &[Shot], notes: &mut Notes) -> Result<(), Failure> {
        let mut moment: Option<Moment> = None;
        for (i, shot) in shots.iter().enumerate() {
            let mut own = self.args.clone();
            own.changes.at = shot.at.or(own.changes.at);
            if moment.is_none() || shot.at.is_some() {
                let early = if i == 0 { self.loaded.remove(&scene) } else { None };
                let loaded = early.unwrap_or_else(|| self.load(scene, shot.at))?;
                // Each of thousands of moments reads the same files.
                if loaded.inputs != self.clear_of {
                    self.outputs.keep_clear_of(&loaded.inputs)?;
                    self.clear_of = loaded.inputs.clone();
                }
                if self.inputs.len() > 1 && i == 0 {
                    notes.turn_to(&loaded.source.name);
                }
                moment = Some(Moment { silhouette: Silhouette::of(&loaded.scene), loaded, ready: None });
            }
            let Some(moment) = &mut moment else { continue };
            own.view.view = shot.seen_from(&moment.silhouette);
            let plan = match moment.prepare(&own, &self.threads, self.stop) {
                Err(failure) if failure.exit == Exit::Interrupted => {
                    let is_free = |path: &Path| self.outputs.leave_free(path, &moment.loaded.inputs);
                    return Err(interrupted(self.finished, self.targets.len(), Ok(Vec::new()), self.together.keep(is_free)));
                }
                prepared => prepared?,
            };
            self.beginning.take();
            let caption = match (self.inputs.len(), shot.caption.as_str()) {
                (_, "") => moment.loaded.source.stem.clone(),
                (1, caption) => caption.to_owned(),
                (_, caption) => format!("{} {caption}", moment.loaded.source.stem),
            };
            // What holds for one picture of a scene mostly holds for all.
            let mut silent = Notes::new(console::Verbosity::Quiet);
            let notes = if i == 0 { &mut *notes } else { &mut silent };
            self.render_shot(scene * shots.len() + i, &caption, (&own, moment, &plan), notes)?;
        }
        Ok(())
    }

    /// Renders one picture and writes it.
    fn render_shot(
        &mut self,
        number: usize,
        caption: &str,
        (own, moment, plan): (&RenderArgs, &mut Moment, &Plan),
        notes: &mut Notes,
    ) -> Result<(), Failure> {
        let Moment { loaded, ready: Some(ready), .. } = moment else { return Ok(()) };
        notes.warn_of(loaded);
        scene_input::note_completed(loaded, notes);
        note_prepared(loaded, ready, &plan.settings, notes);
        refuse_to_denoise(own, &plan.settings, ready, notes)?;
        let mut session = start(own, loaded, ready, plan)?;
        let (clock, stop) = (&self.clock, self.stop);
        self.threads.run(|| session.render(ready, &self.progress, &own.report, (clock, stop)))?;
        // Each has progress of its own, and the run has one line.
        let quiet = ReportArgs { verbosity: console::Verbosity::Quiet, ..own.report.clone() };
        let rendered = self.threads.run(|| denoise::rendered(session.film(), &quiet, stop));
        let targets = &self.targets[number];
        let (is_free, metadata) = (|path: &Path| self.outputs.leave_free(path, &loaded.inputs), metadata(own, &session));
        if !session.is_done() || matches!(rendered.denoised, Some(Err(DenoiseError::Cancelled))) {
            let kept = write::keep(&rendered, targets, plan.display, &metadata, is_free);
            return Err(interrupted(self.finished, self.targets.len(), kept, self.together.keep(is_free)));
        }
        let names = write::write(&rendered, targets, plan.display, &metadata, is_free)?;
        print_hash(own, &rendered, &names, caption)?;
        self.names.push(names);
        self.together.add(rendered.shown(), plan.display, caption)?;
        tell::note_losses(&rendered.counters, notes);
        note_rendered(loaded, &rendered, plan, targets, notes);
        tell::note_shut_away(loaded, ready, session.film(), notes);
        let noisy = self.threads.run(|| session.film().uncertainty());
        let description = described(own, &plan.settings, &session, (ready, &rendered), noisy.as_ref(), notes);
        self.description = [description, size_and_samples(&plan.settings, &session)];
        let error = rendered.denoised().map(|denoised| denoised.error).or(noisy);
        let error = error.filter(|_| ready.follows_paths()).map(|error| error.root_relmse.value);
        self.error = self.error.into_iter().chain(error).reduce(f64::max);
        self.finished += 1;
        self.progress.finish_piece();
        Ok(())
    }

    /// Whether all scenes were rendered.
    fn verdict(&self) -> Result<(), Failure> {
        let Some(&exit) = self.failed.first() else { return Ok(()) };
        Err(Failure::new(exit, format_args!("{} of {} scenes were not rendered", self.failed.len(), self.inputs.len())))
    }
}

/// The files of pictures in a few words: of each that a picture has, the first picture's to the last one's.
fn ranges(names: &[Vec<String>]) -> Vec<String> {
    let (Some(first), Some(last)) = (names.first(), names.last()) else { return Vec::new() };
    let range = |(first, last): (&String, &String)| if names.len() == 1 { first.clone() } else { format!("{first} to {last}") };
    first.iter().zip(last).map(range).collect()
}

/// The end of a run that was stopped, with what there is of the picture under way and of what holds all of them.
fn interrupted(finished: usize, of: usize, own: Result<Vec<String>, Error>, together: Result<Vec<String>, Error>) -> Failure {
    let kept = own.and_then(|own| Ok([own, together?].concat()));
    let kept = match kept {
        Err(error) => return Failure { exit: Exit::Interrupted, message: error.to_string() },
        Ok(kept) if kept.is_empty() => String::new(),
        Ok(kept) => format!("; what there is besides is in {}", kept.join(", ")),
    };
    Failure::new(Exit::Interrupted, format_args!("interrupted; {finished} of {of} pictures are finished{kept}"))
}

/// Bytes of scenes that are kept at most until it is their turn; the others are read once more then.
const MOST_KEPT: u64 = 1 << 30;

/// What a scene takes in memory, as far as it can be known.
fn bytes_of(scene: &Scene) -> u64 {
    estimate(scene, &Settings::of(scene)).total()
}

/// A scene at a moment.
struct Moment {
    loaded: Loaded,
    silhouette: Silhouette,
    ready: Option<Ready>,
}

impl Moment {
    /// Makes it ready for a picture, by turning the camera alone where that is all that changed.
    fn prepare(&mut self, own: &RenderArgs, threads: &Threads, stop: &AtomicBool) -> Result<Plan, Failure> {
        let Self { loaded, silhouette, ready } = self;
        let plan = settle(own, loaded, |_, view, fov, aspect| {
            silhouette.frame(view.unwrap_or_else(|| silhouette.front()), fov, aspect)
        })?;
        let turned = match (&mut *ready, &plan.settings.camera) {
            (Some(ready), Some(camera)) => ready.turn_to(&loaded.scene, camera),
            _ => false,
        };
        if !turned {
            *ready = Some(threads.run(|| prepared(loaded, &plan.settings, &Watch::until(stop)))?);
        }
        Ok(plan)
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Arguments, Command};

    /// Protects: scenes that are read before their turn, since their files could be replaced, are read once: the picture is made of what was
    /// read then, though the file is gone.
    #[test]
    fn scenes_are_read_once() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
        for name in ["a.obj", "b.obj"] {
            std::fs::write(at(name), "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n").expect("a file");
        }
        let words = ["raywright", "render", &at("a.obj"), &at("b.obj"), "-s", "4x4", "--spp", "1", "-o", &at("%d.png")];
        let Ok(Arguments { command: Some(Command::Render(args)), .. }) = Arguments::try_parse_from(words) else {
            panic!("a right command line")
        };
        std::fs::write(at("0.png"), "old").expect("a file");
        let (shots, mut notes) = ([Shot::default()], Notes::new(console::Verbosity::Quiet));
        let mut series = Series::start(&args, &shots).expect("nothing in the way");
        std::fs::remove_file(at("b.obj")).expect("a file");
        series.render(&shots, &mut notes).expect("pictures");
        assert!(series.failed.is_empty() && std::path::Path::new(&at("1.png")).exists());
    }

    /// Protects: files of many pictures are told by the first and the last of each kind, those of one picture by name, and nothing by nothing.
    #[test]
    fn files_are_told_by_the_first_and_the_last_of_a_kind() {
        let told = |names: &[&[&str]]| {
            ranges(&names.iter().map(|names| names.iter().map(|&name| name.to_owned()).collect()).collect::<Vec<_>>()).join(", ")
        };
        assert_eq!(
            told(&[&["a-0.png", "b-0.exr"], &["a-1.png", "b-1.exr"], &["a-2.png", "b-2.exr"]]),
            "a-0.png to a-2.png, b-0.exr to b-2.exr"
        );
        assert_eq!(told(&[&["w.png", "t-0000.png"]]), "w.png, t-0000.png");
        assert_eq!((told(&[]), told(&[&[], &[]])), (String::new(), String::new()));
    }
}
