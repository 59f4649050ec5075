//! Loading of the scenes of a run: each at the times of its pictures, and never overwritten by an
//! output of the run.

use raywright_core::estimate_scene_memory;
use raywright_core::scene::{Scene, Sky};
use raywright_core::settings::Settings;
use raywright_io::{Input, InputFiles, LoadOptions, LoadedScene};

use super::super::ALLOW_EMPTY;
use super::scene_at_time::SceneAtTime;
use super::{PictureJob, PictureSeries};
use crate::failure::Failure;
use crate::plan::Shot;
use crate::progress::Progress;
use crate::scene_input;

/// Largest estimated memory in bytes of all scenes kept in memory for their turn; further scenes
/// are loaded again.
const MOST_KEPT_BYTES: u64 = 1 << 30;

/// Message of a run that a request to stop ends while it loads the scene of a further picture.
const BETWEEN_PICTURES: &str = "interrupted; the finished pictures are kept";

/// Estimates the memory of a scene in bytes.
fn estimate_scene_bytes(scene: &Scene) -> u64 {
    estimate_scene_memory(scene, &Settings::from_scene(scene)).total()
}

impl PictureSeries<'_> {
    /// Checks that no output overwrites a file of any scene. The files that a later scene names are
    /// known only after it is loaded, which is too late if an earlier picture has overwritten a
    /// file. Therefore, if any output exists already, all scenes are loaded first. Small scenes are
    /// kept in memory for their turn; load errors are reported then.
    pub(super) fn check_outputs_against_scenes(&mut self) -> Result<(), Failure> {
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
            let loaded = self.load_scene(scene, &self.task.shots[0]);
            if let Ok(loaded) = &loaded {
                self.session.outputs.check_against_inputs(&loaded.inputs)?;
                bytes += estimate_scene_bytes(&loaded.scene);
            }
            if bytes <= MOST_KEPT_BYTES {
                self.preloaded.insert(scene, loaded);
            }
        }
        Ok(())
    }

    /// Returns the load options of a picture: at the picture's own time, or at the time of `--at`.
    pub(super) fn shot_load_options(&self, shot: &Shot) -> LoadOptions {
        let mut options = self.task.options.clone();
        options.overrides.time = shot.at.or(options.overrides.time);
        options
    }

    /// Loads a scene at the time of a picture, with its own progress display in a run of a single
    /// picture.
    fn load_scene(&mut self, scene: usize, shot: &Shot) -> Result<LoadedScene, Failure> {
        // In a run of several pictures, the progress display counts pictures and shows no loads.
        let loading = if self.task.is_single {
            Progress::start("loading", self.task.progress, self.session.verbosity)
        } else {
            Progress::hidden()
        };
        // A request to stop ends the program during a load, except where a sheet or an animation
        // with finished pictures is to be kept.
        let is_between = !self.session.is_early_stage();
        if is_between && !self.combined_files.is_requested() {
            self.session.start_early_stage(BETWEEN_PICTURES);
        }
        let (input, options) = (&self.inputs[scene], self.shot_load_options(shot));
        let loaded = self
            .session
            .run(|| scene_input::load_with_progress(input, &options, &loading));
        if is_between {
            self.session.end_early_stage();
        }
        loaded
    }

    /// Loads the scene of a picture at its time, and checks that no output overwrites a file of the
    /// scene. `number` is the index of the picture, which may be the first of its scene.
    pub(super) fn load_scene_at_time(
        &mut self,
        number: usize,
        is_first: bool,
    ) -> Result<SceneAtTime, Failure> {
        let PictureJob {
            scene, ref shot, ..
        } = self.jobs[number];
        let shot = shot.clone();
        let early = is_first.then(|| self.preloaded.remove(&scene)).flatten();
        let loaded = early.unwrap_or_else(|| self.load_scene(scene, &shot))?;
        if self.inputs.len() > 1 && is_first {
            self.session.notes.set_current_file(&loaded.source.name);
        }
        self.session.notes.add_scene_warnings(&loaded);
        if self.task.is_single {
            self.choose_file_names(&loaded.inputs)?;
        }
        // Outputs are checked again only for new input files: an animation loads the same files
        // thousands of times.
        if loaded.inputs != self.checked_inputs {
            self.session.outputs.check_against_inputs(&loaded.inputs)?;
            self.checked_inputs = loaded.inputs.clone();
        }
        if let Some(failure) =
            scene_input::empty_scene_failure(&loaded).filter(|_| self.task.refuses_empty_pictures())
        {
            return Err(failure.with_hint(ALLOW_EMPTY));
        }
        scene_input::note_added_parts(&loaded, &mut self.session.notes);
        let mut loaded = loaded;
        if let Some(Sky::Studio(studio)) = &mut loaded.scene.sky {
            studio.backdrop = studio.backdrop.or(self.backdrop);
        }
        Ok(SceneAtTime::new(loaded))
    }
}
