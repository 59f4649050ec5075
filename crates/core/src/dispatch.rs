//! Entry points: [`prepare()`], and the [`ReadyScene`] that renders. This module alone converts
//! choices at run time (precision and integrator) to generic parameters.

/// Evaluates an expression for a prepared scene, whichever of the two precisions the scene has.
macro_rules! each {
    ($ready:expr, $prepared:ident => $value:expr) => {
        match $ready {
            PreparedInPrecision::Robust($prepared) => $value,
            PreparedInPrecision::Reference($prepared) => $value,
        }
    };
}

mod inspection;
mod rendering;

use raywright_bvh::Real;

use crate::effects::{Effect, EffectReport, EffectSet, RenderSetup};
use crate::extent::{self, SceneExtent};
use crate::fault::Fault;
use crate::lookup::SceneLookup;
use crate::memory::{MemoryUse, can_allocate};
use crate::observer::Observer;
use crate::prepare::{self, PrepareError, PreparedScene};
use crate::scene::{Camera, Integrator, Light, Scene, Sky};
use crate::settings::{PrecisionChoice, Settings, SkyChoice};
use crate::studio::headlight;

pub use inspection::estimate_scene_memory;
use inspection::{bytes_still_to_allocate, estimate_memory};

/// A scene prepared for one set of settings, ready to render. It also reports effects, memory, and
/// parts of the scene that cannot be rendered correctly.
pub struct ReadyScene {
    prepared: PreparedInPrecision,
    is_path_traced: bool,
    settings: Settings,
    effects: EffectReport,
    has_headlight: bool,
}

/// A prepared scene in its precision.
enum PreparedInPrecision {
    Robust(Box<PreparedScene<f32>>),
    Reference(Box<PreparedScene<f64>>),
}

/// A task on a prepared scene, generic over the precision.
pub(crate) trait PreparedSceneTask {
    /// Result of the task.
    type Output;

    /// Runs the task.
    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Self::Output;
}

/// Prepares a validated scene on the current thread pool: detects the effects that the scene needs,
/// then builds their data. A scene whose studio cannot light the camera's surroundings is prepared
/// once more, with a lamp at the camera.
///
/// # Errors
/// See [`PrepareError`].
pub fn prepare(
    scene: &Scene,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<ReadyScene, PrepareError> {
    let ready = prepare_listed_lights(scene, settings, observer)?;
    let Some(light) = ready.missing_headlight(scene, settings.camera.as_ref()) else {
        return Ok(ready);
    };
    drop(ready);
    let mut lit_scene = scene.clone();
    lit_scene.lights.push(light);
    Ok(ReadyScene {
        has_headlight: true,
        ..prepare_listed_lights(&lit_scene, settings, observer)?
    })
}

/// Prepares a scene as [`prepare()`], but does not search for openings to the sky, so that a first
/// preview does not wait for it. [`ReadyScene::complete`] does the rest.
///
/// # Errors
/// See [`PrepareError`].
pub fn prepare_for_previews(
    scene: &Scene,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<ReadyScene, PrepareError> {
    let without_search = Settings {
        sky_choice: SkyChoice::Power,
        ..settings.clone()
    };
    Ok(ReadyScene {
        settings: settings.clone(),
        ..prepare(scene, &without_search, observer)?
    })
}

/// Prepares a scene with the lights that it lists.
fn prepare_listed_lights(
    scene: &Scene,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<ReadyScene, PrepareError> {
    settings.check().map_err(PrepareError::Settings)?;
    let render_setup = RenderSetup::new(scene, settings);
    let simulated = render_setup.effects.simulated();
    let needed = estimate_memory_within_limit(&render_setup)?;
    if !can_allocate(bytes_still_to_allocate(&needed, scene)) {
        return Err(PrepareError::OutOfMemory { needed });
    }
    let inner = PreparedInPrecision::new(
        &render_setup.scene,
        &render_setup.settings,
        simulated,
        observer,
    )?;
    let follows_paths = render_setup.integrator() == Integrator::Path;
    Ok(ReadyScene {
        prepared: inner,
        is_path_traced: follows_paths,
        settings: settings.clone(),
        effects: render_setup.effects,
        has_headlight: false,
    })
}

/// Estimates the memory of a render.
///
/// # Errors
/// [`PrepareError::Memory`] beyond the limit of the settings.
fn estimate_memory_within_limit(setup: &RenderSetup<'_>) -> Result<MemoryUse, PrepareError> {
    let needed = estimate_memory(setup);
    match setup.settings.max_memory {
        Some(allowed) if needed.total() > allowed => Err(PrepareError::Memory { needed, allowed }),
        _ => Ok(needed),
    }
}

/// Returns the extent of a scene in world units, with coordinates rounded as in the given
/// precision. Only the scene's data are read; nothing is built.
pub fn measure_scene_extent(scene: &Scene, precision: PrecisionChoice) -> SceneExtent {
    let lookup = SceneLookup::new(scene);
    match precision {
        PrecisionChoice::Robust => extent::scene_extent::<f32>(scene, &lookup),
        PrecisionChoice::Reference => extent::scene_extent::<f64>(scene, &lookup),
    }
}

/// Returns a problem for each object that the given precision cannot show, because the object
/// collapses when its coordinates are rounded. Preparation would fail with the same problems. Every
/// listed object and the first object of every generator are tested. At most a hundred problems are
/// returned.
pub fn find_collapsed_objects(scene: &Scene, precision: PrecisionChoice) -> Vec<Fault> {
    match precision {
        PrecisionChoice::Robust => prepare::find_collapsed_objects::<f32>(scene),
        PrecisionChoice::Reference => prepare::find_collapsed_objects::<f64>(scene),
    }
}

impl PreparedInPrecision {
    /// Prepares a scene in the precision of the settings.
    fn new(
        scene: &Scene,
        settings: &Settings,
        simulated: EffectSet,
        observer: &dyn Observer,
    ) -> Result<Self, PrepareError> {
        Ok(match settings.precision {
            PrecisionChoice::Robust => Self::Robust(Box::new(PreparedScene::new(
                scene, settings, simulated, observer,
            )?)),
            PrecisionChoice::Reference => Self::Reference(Box::new(PreparedScene::new(
                scene, settings, simulated, observer,
            )?)),
        })
    }
}

impl ReadyScene {
    /// Replaces the camera and keeps all prepared data that do not depend on it. `scene` must be
    /// the prepared scene. The result equals a new preparation to the bit. Returns false and
    /// changes nothing if the new camera requires a new preparation: because of a shutter, other
    /// effects, or effects switched off.
    pub fn replace_camera(&mut self, scene: &Scene, camera: &Camera) -> bool {
        self.replace_view(scene, camera, self.settings.size)
    }

    /// Replaces the camera and the size of the picture, as [`Self::replace_camera`]. A picture that
    /// takes too much memory requires a new preparation, which refuses it.
    pub fn replace_view(&mut self, scene: &Scene, camera: &Camera, size: [u32; 2]) -> bool {
        let settings = Settings {
            camera: Some(camera.clone()),
            size,
            ..self.settings.clone()
        };
        let setup = RenderSetup::new(scene, &settings);
        if size != self.settings.size && estimate_memory_within_limit(&setup).is_err() {
            return false;
        }
        let RenderSetup {
            settings: prepared,
            effects,
            ..
        } = setup;
        let has_shutter = |settings: &Settings| {
            settings
                .camera
                .as_ref()
                .is_some_and(|camera| camera.shutter.is_some())
        };
        let simulated = effects.simulated();
        let differs = simulated != self.effects.simulated() || !settings.without.is_empty();
        let needs_headlight = || self.missing_headlight(scene, Some(camera)).is_some();
        if self.has_headlight
            || differs
            || needs_headlight()
            || has_shutter(&settings)
            || has_shutter(&self.settings)
        {
            return false;
        }
        each!(&mut self.prepared, p => p.set_camera(scene, &prepared, camera, simulated));
        (self.settings, self.effects) = (settings, effects);
        true
    }

    /// Completes a scene of [`prepare_for_previews()`], which then equals one of [`prepare()`].
    /// `scene` must be the prepared scene.
    ///
    /// # Errors
    /// Cancellation; for a linear scan, those of [`prepare()`].
    pub fn complete(&mut self, scene: &Scene, observer: &dyn Observer) -> Result<(), PrepareError> {
        let setup = RenderSetup::new(scene, &self.settings);
        let simulated = self.effects.simulated();
        each!(&mut self.prepared, p => p.add_openings((&setup.scene, &setup.settings, simulated), observer))
    }

    /// Returns a lamp at the camera if surfaces enclose it, so that the light of a studio does not
    /// reach what it sees. A scene with emissive surfaces or lights gets none.
    fn missing_headlight(&self, scene: &Scene, camera: Option<&Camera>) -> Option<Light> {
        let Some(Sky::Studio(studio)) = &scene.sky else {
            return None;
        };
        let simulated = self.effects.simulated();
        let camera = camera.filter(|_| {
            studio.strength > 0.0
                && simulated.has(Effect::SkyLight)
                && !simulated.has(Effect::DirectLight)
                && !simulated.has(Effect::Emission)
        })?;
        each!(&self.prepared, p => p.encloses_camera(camera)).then(|| headlight(studio, camera))
    }

    /// Changes the greatest number of segments of a path. No prepared data depend on numbers from 2
    /// on.
    pub(crate) fn set_max_depth(&mut self, max_depth: u32) {
        self.settings.max_depth = max_depth;
    }

    /// Runs a task on the prepared scene, in its precision.
    pub(crate) fn run_task<W: PreparedSceneTask>(&self, work: &W) -> W::Output {
        each!(&self.prepared, p => work.run(p))
    }
}
