//! A scene at a fixed time of its animation, with the data shared by its pictures at that time.

use std::cell::OnceCell;

use raywright_core::ReadyScene;
use raywright_core::framing::Silhouette;
use raywright_io::LoadedScene;

use crate::failure::Failure;
use crate::plan::{PicturePlan, RenderTask, Shot};
use crate::preparation::prepare_loaded;
use crate::session::Session;

/// A scene at a fixed time of its animation.
pub struct SceneAtTime {
    /// The loaded scene, changed by the rungs (quality levels) that were chosen for the last
    /// picture.
    pub loaded: LoadedScene,
    /// Silhouette of the scene, computed only if a camera frames the whole scene.
    silhouette: OnceCell<Silhouette>,
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

    /// Resolves the settings of a picture of this scene.
    pub fn resolve_plan(&mut self, task: &RenderTask, shot: &Shot) -> Result<PicturePlan, Failure> {
        task.resolve_shot(&mut self.loaded.scene, shot, &self.silhouette)
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
