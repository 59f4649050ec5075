//! The viewer's scene, loaded and prepared. A request of the page updates it by no more work than
//! necessary.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::PathBuf;
use std::time::SystemTime;

use raywright_core::framing::Silhouette;
use raywright_core::ladder::RungChoice;
use raywright_core::settings::Settings;
use raywright_core::{Observer, ReadyScene, measure_scene_extent, prepare_for_previews};
use raywright_io::{LoadOptions, LoadedScene};

use crate::commands::render::picture::refuse_file_flags;
use crate::commands::view::progress::LoadObserver;
use crate::early_stage::EarlyStageGuard;
use crate::failure::Failure;
use crate::plan::{ChosenExposure, PicturePlan, RenderTask, choose_exposure};
use crate::preparation::prepare_failure;
use crate::scene_input;

/// Work that a request of the page required.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneChange {
    /// No work on the scene: only the display of the same picture changed.
    Display,
    /// Only a move of the camera in the prepared scene, or another size of the picture.
    Camera,
    /// A new preparation, because a setting changed.
    Preparation,
    /// A new load, because a load option changed.
    Reading,
}

/// The viewer's scene, loaded and prepared, with its current settings.
pub struct ViewedScene {
    pub loaded: LoadedScene,
    /// The scene, prepared for the current settings.
    pub ready: ReadyScene,
    /// Whether the scene is prepared for more than previews.
    is_complete: bool,
    pub plan: PicturePlan,
    /// Exposure chosen for the scene, which stays while only the camera moves.
    exposure: ChosenExposure,
    /// Work of the page's latest request.
    pub task: RenderTask,
    silhouette: OnceCell<Silhouette>,
    /// Centre and radius of a sphere around the bounded shapes.
    pub bounding_sphere: ([f64; 3], f64),
}

impl ViewedScene {
    /// Loads and prepares a scene.
    pub fn load(name: &OsStr, task: RenderTask, watch: &LoadObserver<'_>) -> Result<Self, Failure> {
        refuse_file_flags(&task)?;
        watch.start_stage("reading the scene");
        let limits = &task.options.limits;
        let _beginning = EarlyStageGuard::start(name, limits.memory_bytes, None)?;
        let mut loaded = scene_input::load_with_observer(
            &scene_input::resolve_input(name, limits)?,
            &task.options,
            watch,
        )?;
        if let Some(failure) =
            scene_input::empty_scene_failure(&loaded).filter(|_| task.refuses_empty_pictures())
        {
            return Err(failure);
        }
        watch.start_stage("building the tree");
        let silhouette = OnceCell::new();
        let mut plan = task.resolve_job(&mut loaded, &task.jobs[0], &silhouette)?;
        let mut ready = prepare_loaded_for_previews(&loaded, &plan, watch)?;
        let requested = (plan.display, plan.requested_exposure);
        let exposure = choose_exposure(&loaded, &ready, requested, watch);
        plan.apply_exposure(exposure, &mut ready);
        let bounds = measure_scene_extent(&loaded.scene, plan.settings.precision).bounds;
        let reach = if bounds.is_empty() {
            ([0.0; 3], 1.0)
        } else {
            (bounds.centre().into(), 0.5 * bounds.extent().length())
        };
        Ok(Self {
            loaded,
            ready,
            is_complete: false,
            plan,
            exposure,
            task,
            silhouette,
            bounding_sphere: reach,
        })
    }

    /// Applies a request of the page with the least work, and returns which work this was. A
    /// failure leaves the scene unchanged.
    pub fn apply_task(
        &mut self,
        name: &OsStr,
        task: RenderTask,
        watch: &LoadObserver<'_>,
    ) -> Result<SceneChange, Failure> {
        refuse_file_flags(&task)?;
        if task.options != self.task.options || chosen_rungs(&task) != chosen_rungs(&self.task) {
            *self = Self::load(name, task, watch)?;
            return Ok(SceneChange::Reading);
        }
        let mut plan = task.resolve_job(&mut self.loaded, &task.jobs[0], &self.silhouette)?;
        let of_scene = |settings: &Settings| Settings {
            camera: None,
            size: [1; 2],
            ..settings.clone()
        };
        let change = match &plan.settings.camera {
            _ if plan.settings == self.plan.settings => SceneChange::Display,
            Some(camera)
                if of_scene(&plan.settings) == of_scene(&self.plan.settings)
                    && self
                        .ready
                        .replace_view(&self.loaded.scene, camera, plan.settings.size) =>
            {
                SceneChange::Camera
            }
            _ => {
                watch.start_stage("building the tree");
                let _beginning =
                    EarlyStageGuard::start(name, task.options.limits.memory_bytes, None)?;
                self.ready = prepare_loaded_for_previews(&self.loaded, &plan, watch)?;
                self.is_complete = false;
                SceneChange::Preparation
            }
        };
        let requested = (plan.display, plan.requested_exposure);
        if change != SceneChange::Camera || requested.1 != self.plan.requested_exposure {
            self.exposure = choose_exposure(&self.loaded, &self.ready, requested, watch);
        }
        plan.apply_exposure(self.exposure, &mut self.ready);
        (self.plan, self.task) = (plan, task);
        Ok(change)
    }

    /// Completes the preparation for the samples of the picture, once previews are shown. Returns
    /// false if a newer request ended it.
    pub fn complete_preparation(&mut self, watch: &dyn Observer) -> bool {
        if !self.is_complete {
            self.is_complete = self.ready.complete(&self.loaded.scene, watch).is_ok();
        }
        self.is_complete
    }

    /// Returns the load options of the scene.
    pub fn load_options(&self) -> &LoadOptions {
        &self.task.options
    }

    /// Returns all files of the scene, with their current modification times and lengths.
    pub fn file_stamps(&self) -> FileStamps {
        let stamp_of = |path: PathBuf| {
            let stamp = path
                .metadata()
                .ok()
                .and_then(|metadata| Some((metadata.modified().ok()?, metadata.len())));
            (path, stamp)
        };
        self.loaded
            .inputs
            .files()
            .map(|path| stamp_of(path.to_owned()))
            .collect()
    }
}

fn prepare_loaded_for_previews(
    loaded: &LoadedScene,
    plan: &PicturePlan,
    watch: &dyn Observer,
) -> Result<ReadyScene, Failure> {
    prepare_for_previews(&loaded.scene, &plan.settings, watch)
        .map_err(|error| prepare_failure(&loaded.source, error))
}

/// Modification time and length of each file; `None` for a missing file.
pub type FileStamps = BTreeMap<PathBuf, Option<(SystemTime, u64)>>;

fn chosen_rungs(task: &RenderTask) -> &[RungChoice] {
    &task.choices.rungs
}
