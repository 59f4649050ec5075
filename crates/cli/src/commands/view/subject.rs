//! The viewer's scene, loaded and prepared. A request of the page updates it by no more work than
//! necessary.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::SystemTime;

use raywright_core::framing::{FIELD_OF_VIEW, Silhouette};
use raywright_core::ladder::RungChoice;
use raywright_core::settings::Settings;
use raywright_core::{ReadyScene, extent};
use raywright_io::{LoadOptions, Loaded};

use crate::beginning::Beginning;
use crate::commands::render::picture::refuse_files;
use crate::failure::Failure;
use crate::plan::{PicturePlan, RenderTask};
use crate::preparation::prepare_loaded;
use crate::scene_input;
use crate::watch::Watch;

/// Work that a request of the page required.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubjectChange {
    /// None for the scene: only the display of the same picture changed.
    Display,
    /// A move of the camera in the prepared scene.
    Camera,
    /// A new preparation, because a setting changed.
    Preparation,
    /// A new load, because a load option changed.
    Reading,
}

/// The viewer's scene, loaded and prepared, with its current settings.
pub struct ViewedScene {
    pub loaded: Loaded,
    pub ready: ReadyScene,
    pub plan: PicturePlan,
    pub task: RenderTask,
    silhouette: OnceCell<Silhouette>,
    /// Centre and radius of a sphere around the bounded shapes.
    pub reach: ([f64; 3], f64),
}

impl ViewedScene {
    /// Loads and prepares a scene.
    pub fn read(name: &OsStr, task: RenderTask, stop: &AtomicBool) -> Result<Self, Failure> {
        refuse_files(&task)?;
        let limits = &task.options.limits;
        let _beginning = Beginning::of(name, limits.memory_bytes, None)?;
        let watch = Watch::until(stop);
        let mut loaded =
            scene_input::load_watched(&scene_input::input(name, limits)?, &task.options, &watch)?;
        if let Some(failure) = scene_input::nothing_to_see(&loaded).filter(|_| task.refuses_empty())
        {
            return Err(failure);
        }
        let silhouette = OnceCell::new();
        let plan = settle(&task, &mut loaded, &silhouette)?;
        let ready = prepare_loaded(&loaded, &plan.settings, &watch)?;
        let bounds = extent(&loaded.scene, plan.settings.precision).bounds;
        let reach = if bounds.is_empty() {
            ([0.0; 3], 1.0)
        } else {
            (bounds.centre().into(), 0.5 * bounds.extent().length())
        };
        Ok(Self {
            loaded,
            ready,
            plan,
            task,
            silhouette,
            reach,
        })
    }

    /// Applies a request with the least work. A failure leaves the scene unchanged.
    pub fn change(
        &mut self,
        name: &OsStr,
        task: RenderTask,
        stop: &AtomicBool,
    ) -> Result<SubjectChange, Failure> {
        refuse_files(&task)?;
        if task.options != self.task.options || rungs(&task) != rungs(&self.task) {
            *self = Self::read(name, task, stop)?;
            return Ok(SubjectChange::Reading);
        }
        let plan = settle(&task, &mut self.loaded, &self.silhouette)?;
        let of_scene = |settings: &Settings| Settings {
            camera: None,
            ..settings.clone()
        };
        let change = match &plan.settings.camera {
            _ if plan.settings == self.plan.settings => SubjectChange::Display,
            Some(camera)
                if of_scene(&plan.settings) == of_scene(&self.plan.settings)
                    && self.ready.turn_to(&self.loaded.scene, camera) =>
            {
                SubjectChange::Camera
            }
            _ => {
                let _beginning = Beginning::of(name, task.options.limits.memory_bytes, None)?;
                self.ready = prepare_loaded(&self.loaded, &plan.settings, &Watch::until(stop))?;
                SubjectChange::Preparation
            }
        };
        (self.plan, self.task) = (plan, task);
        Ok(change)
    }

    /// Returns the load options of the scene.
    pub fn options(&self) -> &LoadOptions {
        &self.task.options
    }

    /// Returns all files of the scene, with their current modification times and lengths.
    pub fn files(&self) -> WatchedFiles {
        let value_of = |path: PathBuf| {
            let stamp = path
                .metadata()
                .ok()
                .and_then(|metadata| Some((metadata.modified().ok()?, metadata.len())));
            (path, stamp)
        };
        self.loaded
            .inputs
            .files()
            .map(|path| value_of(path.to_owned()))
            .collect()
    }
}

/// Modification time and length of each file; `None` for a missing file.
pub type WatchedFiles = BTreeMap<PathBuf, Option<(SystemTime, u64)>>;

fn rungs(task: &RenderTask) -> &[RungChoice] {
    &task.choices.rungs
}

/// Resolves the settings of the picture. A scene without a camera gets a camera that frames it, so
/// that the page has a camera to turn.
fn settle(
    task: &RenderTask,
    loaded: &mut Loaded,
    silhouette: &OnceCell<Silhouette>,
) -> Result<PicturePlan, Failure> {
    let mut plan = task.settle_shot(&mut loaded.scene, &task.shots[0], silhouette)?;
    let [width, height] = plan.settings.size.map(f64::from);
    plan.settings.camera.get_or_insert_with(|| {
        let silhouette = silhouette.get_or_init(|| Silhouette::from_scene(&loaded.scene));
        silhouette.frame(silhouette.front(), FIELD_OF_VIEW, width / height)
    });
    Ok(plan)
}
