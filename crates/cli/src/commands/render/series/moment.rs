//! A scene at a moment, with what its pictures have in common.

use std::cell::OnceCell;
use std::sync::atomic::AtomicBool;

use raywright_core::Ready;
use raywright_core::framing::Silhouette;
use raywright_io::Loaded;

use crate::failure::Failure;
use crate::plan::{Plan, Shot, Task};
use crate::ready::prepared;
use crate::threads::Threads;
use crate::watch::Watch;

/// A scene at a moment.
pub struct Moment {
    /// As it was read, on the rungs of the last picture.
    pub loaded: Loaded,
    /// Made where a camera is to show the whole of it.
    silhouette: OnceCell<Silhouette>,
    /// Made for a picture.
    pub ready: Option<Ready>,
}

impl Moment {
    /// Nothing is made of it yet.
    pub fn new(loaded: Loaded) -> Self {
        Self {
            loaded,
            silhouette: OnceCell::new(),
            ready: None,
        }
    }

    /// How a picture of it is made.
    pub fn settle(&mut self, task: &Task, shot: &Shot) -> Result<Plan, Failure> {
        task.settle_shot(&mut self.loaded.scene, shot, &self.silhouette)
    }

    /// Makes it ready for a picture, by turning the camera alone where that is all that changed.
    pub fn prepare(
        &mut self,
        plan: &Plan,
        threads: &Threads,
        stop: &AtomicBool,
    ) -> Result<(), Failure> {
        let turned = match (&mut self.ready, &plan.settings.camera) {
            (Some(ready), Some(camera)) => ready.turn_to(&self.loaded.scene, camera),
            _ => false,
        };
        if !turned {
            self.ready =
                Some(threads.run(|| prepared(&self.loaded, &plan.settings, &Watch::until(stop)))?);
        }
        Ok(())
    }
}
