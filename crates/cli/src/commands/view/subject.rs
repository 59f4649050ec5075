//! The displayed scene, loaded and prepared, and updated by no more work than a wish requires.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::SystemTime;

use raywright_core::framing::{FIELD_OF_VIEW, Silhouette};
use raywright_core::ladder::Choice;
use raywright_core::settings::Settings;
use raywright_core::{Ready, extent};
use raywright_io::{LoadOptions, Loaded};

use crate::beginning::Beginning;
use crate::commands::render::picture::refuse_files;
use crate::failure::Failure;
use crate::plan::{Plan, Task};
use crate::ready::prepared;
use crate::scene_input;
use crate::watch::Watch;

/// Work done for a wish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Only the display of the same picture changed.
    Display,
    /// The camera moved.
    Camera,
    /// A changed setting required a new preparation.
    Preparation,
    /// A changed option required a new load.
    Reading,
}

/// The displayed scene.
pub struct Subject {
    pub loaded: Loaded,
    pub ready: Ready,
    pub plan: Plan,
    pub task: Task,
    silhouette: OnceCell<Silhouette>,
    /// Centre and radius of the bounded shapes.
    pub reach: ([f64; 3], f64),
}

impl Subject {
    /// Loads and prepares a scene.
    pub fn read(name: &OsStr, task: Task, stop: &AtomicBool) -> Result<Self, Failure> {
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
        let ready = prepared(&loaded, &plan.settings, &watch)?;
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

    /// Applies a wish with the least work; a failure leaves the scene unchanged.
    pub fn change(
        &mut self,
        name: &OsStr,
        task: Task,
        stop: &AtomicBool,
    ) -> Result<Change, Failure> {
        refuse_files(&task)?;
        if task.options != self.task.options || rungs(&task) != rungs(&self.task) {
            *self = Self::read(name, task, stop)?;
            return Ok(Change::Reading);
        }
        let plan = settle(&task, &mut self.loaded, &self.silhouette)?;
        let of_scene = |settings: &Settings| Settings {
            camera: None,
            ..settings.clone()
        };
        let change = match &plan.settings.camera {
            _ if plan.settings == self.plan.settings => Change::Display,
            Some(camera)
                if of_scene(&plan.settings) == of_scene(&self.plan.settings)
                    && self.ready.turn_to(&self.loaded.scene, camera) =>
            {
                Change::Camera
            }
            _ => {
                let _beginning = Beginning::of(name, task.options.limits.memory_bytes, None)?;
                self.ready = prepared(&self.loaded, &plan.settings, &Watch::until(stop))?;
                Change::Preparation
            }
        };
        (self.plan, self.task) = (plan, task);
        Ok(change)
    }

    /// Load options of the scene.
    pub fn options(&self) -> &LoadOptions {
        &self.task.options
    }

    /// All files of the scene, with their current stamps.
    pub fn files(&self) -> Files {
        let of = |path: PathBuf| {
            let stamp = path
                .metadata()
                .ok()
                .and_then(|there| Some((there.modified().ok()?, there.len())));
            (path, stamp)
        };
        self.loaded
            .inputs
            .files()
            .map(|path| of(path.to_owned()))
            .collect()
    }
}

/// Modification time and length of each file; `None` for a missing file.
pub type Files = BTreeMap<PathBuf, Option<(SystemTime, u64)>>;

fn rungs(task: &Task) -> &[Choice] {
    &task.choices.rungs
}

/// Resolves the settings of the picture. A scene without a camera gets the framed one, so that the
/// page can turn it.
fn settle(
    task: &Task,
    loaded: &mut Loaded,
    silhouette: &OnceCell<Silhouette>,
) -> Result<Plan, Failure> {
    let mut plan = task.settle_shot(&mut loaded.scene, &task.shots[0], silhouette)?;
    let [width, height] = plan.settings.size.map(f64::from);
    plan.settings.camera.get_or_insert_with(|| {
        let silhouette = silhouette.get_or_init(|| Silhouette::of(&loaded.scene));
        silhouette.frame(silhouette.front(), FIELD_OF_VIEW, width / height)
    });
    Ok(plan)
}
