//! What is looked at: a scene that was read and prepared once, for as long as what is wished for
//! allows.

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

/// What was done for a wish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Nothing but how the same picture is shown.
    Display,
    /// The camera was turned.
    Camera,
    /// The scene was prepared anew, because a setting asks for it.
    Preparation,
    /// It was read anew, because what is read depends on it.
    Reading,
}

/// A scene as it is looked at.
pub struct Subject {
    pub loaded: Loaded,
    pub ready: Ready,
    pub plan: Plan,
    pub task: Task,
    silhouette: OnceCell<Silhouette>,
    /// Middle and radius of what has an end.
    pub reach: ([f64; 3], f64),
}

impl Subject {
    /// Reads and prepares a scene.
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

    /// Does no more than a wish asks for; where that fails, what there is stays.
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

    /// How it was read.
    pub fn options(&self) -> &LoadOptions {
        &self.task.options
    }

    /// Every file that it was read from, as it is now.
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

/// When files were last written and how long they are; none of what is not there.
pub type Files = BTreeMap<PathBuf, Option<(SystemTime, u64)>>;

fn rungs(task: &Task) -> &[Choice] {
    &task.choices.rungs
}

/// How the picture is made. A scene without a camera gets the one that preparation would frame, so
/// that it can be turned away and back.
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
