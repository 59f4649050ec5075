//! Preparation of a validated scene for an integrator. Preparation may fail, allocate, sort and
//! decide; rendering may not.

mod collapsed_shapes;
mod context;
mod emitter_filter;
mod emitters;
mod error;
mod estimate;
mod faults;
mod geometry;
mod inputs;
mod light_leaks;
mod material;
mod material_set;
mod medium;
mod openings;
mod prepared_scene;
mod studio;
mod studio_setup;
mod tangents;

use std::collections::BTreeMap;

use raywright_bvh::{AcceleratorKind, Real};

use crate::camera::PreparedCamera;
use crate::effects::EffectSet;
use crate::framing::{FIELD_OF_VIEW, Silhouette};
use crate::light::{Irradiance, prepare_sky};
use crate::lookup::SceneLookup;
use crate::motion::{camera_with_simulated_motion, scene_with_simulated_motion};
use crate::observer::Observer;
use crate::scene::{self, Scene, Sky, Studio};
use crate::settings::{LightSampling, Settings, SkyChoice};
use crate::storage_origin::camera_relative_to;
use crate::studio::studio_sky;

pub(crate) use collapsed_shapes::find_collapsed_objects;
use context::PrepareContext;
use emitters::{build_sky_sampler, prepare_irradiance, prepare_lights};
pub use error::PrepareError;
pub(crate) use error::check_cancelled;
pub(crate) use estimate::estimate_memory;
pub use faults::LightRays;
pub(crate) use faults::{lost_object, unreached_light, unresolved_object};
pub(crate) use geometry::{ObjectMesh, ObjectRecord, UniformSurface, build_geometry};
pub use light_leaks::LampRef;
pub(crate) use light_leaks::{LightLeak, UnresolvedGap};
pub(crate) use material::{
    AnisotropyFrame, ClassicInputs, ConstantIor, FilmThickness, InputFieldTypes, LayeredInputs,
    PhysicalInputs, PhysicalTransmission, PreparedMaterial, ReflectionInputs, RefractiveIndex,
    SpecularInputs, TransmissionInputs, tinted_shadow_transmittance,
};
use material_set::MaterialSet;
pub(crate) use medium::{PreparedMedium, ROUNDING, RaySegment};
use prepared_scene::PreparedParts;
pub use prepared_scene::TableSizes;
pub(crate) use prepared_scene::{PreparedScene, PreparedSpawnRule};

impl<R: Real> PreparedScene<R> {
    /// Prepares a scene for rendering with the simulated effects. Tables of other effects stay
    /// empty. Only materials that an object uses are prepared.
    ///
    /// # Errors
    /// Undefined names, invalid expressions and files that are not loaded, all of which
    /// validation reports with a location; shapes that the geometry rejects; cancellation.
    pub fn new(
        scene: &Scene,
        settings: &Settings,
        simulated: EffectSet,
        observer: &dyn Observer,
    ) -> Result<Self, PrepareError> {
        check_cancelled(observer)?;
        let simulated_scene =
            scene_with_simulated_motion(scene, settings.camera.as_ref(), simulated);
        refuse_unloaded_models(&simulated_scene)?;
        let (lookup, constants) = (
            SceneLookup::new(&simulated_scene),
            expression_constants(&simulated_scene),
        );
        let object_materials = geometry::object_materials(&simulated_scene, &lookup)?;
        let context = PrepareContext::new::<R>(
            (&simulated_scene, settings, simulated),
            &lookup,
            &constants,
            observer,
        );
        let materials = MaterialSet::prepare(&context, &object_materials)?;
        // The filter's table is computed here, because rendering may not allocate.
        settings.filter.sampler();
        let mut built = geometry::build_geometry_with_materials::<R>(
            (context.scene, context.origin),
            &lookup,
            settings.accelerator,
            (&object_materials, &materials.geometry_needs(&context)),
            observer,
        )?;
        check_cancelled(observer)?;
        let tangents = tangents::generate_missing_tangents(context.scene, &mut built, observer)?;
        let camera = settings
            .camera
            .clone()
            .unwrap_or_else(|| default_camera(scene, settings));
        let camera = camera_with_simulated_motion(camera, simulated);
        let view = camera_relative_to(context.origin.origin, &camera);
        let studio = scene_studio(context.scene);
        let sky = match &studio {
            Some(studio) => studio_sky(studio, &view),
            None => prepare_sky::<R>(
                (context.scene.sky.as_ref(), context.origin.origin),
                &lookup,
                &constants,
            )?,
        };
        let irradiance = prepare_irradiance(&context, &sky);
        let parts = PreparedParts {
            lights: prepare_lights(&context, &materials, sky, &built.geometry)?,
            camera: PreparedCamera::for_scene_bounds(
                &view,
                settings.size,
                &built.geometry.bounded_primitives_box(),
            ),
            built,
            tangents,
            materials,
            irradiance,
        };
        let mut prepared = Self::from_parts(&context, parts);
        if let Some(studio) = &studio {
            prepared.add_studio(studio, &view, settings, simulated);
        }
        prepared.add_openings((scene, settings, simulated), observer)?;
        Ok(prepared)
    }

    /// Adds the table of the scene's openings if the settings choose the sky's directions by it.
    /// Nothing is searched twice.
    ///
    /// # Errors
    /// Cancellation, and those of [`Self::new`] for a linear scan, whose search prepares the scene
    /// with a tree: a scan would take hours for the rays of a second. The hits are the same.
    pub(crate) fn add_openings(
        &mut self,
        (scene, settings, simulated): (&Scene, &Settings, EffectSet),
        observer: &dyn Observer,
    ) -> Result<(), PrepareError> {
        if settings.sky_choice != SkyChoice::Openings
            || settings.light_sampling == LightSampling::Scattering
            || self.lights.sky_sampler().is_none()
            || self.lights.openings().is_some()
            || scene_studio(scene).is_some()
        {
            return Ok(());
        }
        check_cancelled(observer)?;
        let openings = if settings.accelerator == AcceleratorKind::Linear {
            let accelerator = AcceleratorKind::default();
            let settings = Settings {
                accelerator,
                ..settings.clone()
            };
            let with_tree = Self::new(scene, &settings, simulated, observer)?;
            with_tree.lights.openings().cloned()
        } else {
            self.find_openings()
        };
        self.lights.set_openings(openings);
        Ok(())
    }

    /// Switches the prepared scene to another camera that needs the same effects; only data that
    /// depends on the camera is rebuilt. The result is the same as if the scene had been prepared
    /// for this camera. The camera must have no open shutter.
    pub(crate) fn set_camera(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        view: &scene::Camera,
        simulated: EffectSet,
    ) {
        let view = camera_relative_to(
            self.origin.origin,
            &camera_with_simulated_motion(view.clone(), simulated),
        );
        self.camera = PreparedCamera::for_scene_bounds(
            &view,
            settings.size,
            &self.geometry.bounded_primitives_box(),
        );
        self.cone = self.cone.is_some().then(|| self.camera.ray_cone());
        let Some(studio) = scene_studio(scene) else {
            return;
        };
        self.lights.sky = studio_sky(&studio, &view);
        self.irradiance = (self.irradiance.is_some()).then(|| Irradiance::new(&self.lights.sky));
        if self.lights.sky_sampler().is_some() {
            build_sky_sampler(&mut self.lights, settings);
            self.lights.build_light_sampler();
        }
        self.add_studio(&studio, &view, settings, simulated);
    }
}

/// Refuses a scene that still refers to files of models. The loader replaces models by their
/// objects; a program that creates a scene must do the same.
///
/// # Errors
/// [`PrepareError::Missing`] for the first model.
fn refuse_unloaded_models(scene: &Scene) -> Result<(), PrepareError> {
    scene.models.first().map_or(Ok(()), |model| {
        Err(PrepareError::Missing {
            path: "models[0].file".to_owned(),
            kind: "loaded model",
            name: model.file.clone(),
        })
    })
}

/// Returns the camera of a picture without a camera. It frames the whole motion of all objects,
/// even if the picture shows them at rest.
fn default_camera(scene: &Scene, settings: &Settings) -> scene::Camera {
    let aspect = f64::from(settings.size[0]) / f64::from(settings.size[1]);
    let silhouette = Silhouette::from_scene(scene);
    silhouette.frame_camera(silhouette.default_view(), FIELD_OF_VIEW, aspect)
}

/// Returns the studio of a scene whose sky is a studio.
fn scene_studio(scene: &Scene) -> Option<Studio> {
    if let Some(Sky::Studio(studio)) = &scene.sky {
        Some(*studio)
    } else {
        None
    }
}

/// Returns the names that expressions may read as constants: the time `t` and the parameters.
fn expression_constants(scene: &Scene) -> BTreeMap<String, f64> {
    let mut names = scene.parameter_values();
    names.insert("t".to_owned(), scene.t);
    names
}

#[cfg(test)]
mod tests;
