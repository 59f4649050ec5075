//! Preparation of a validated scene for an integrator. Preparation may fail, allocate, sort and
//! decide; rendering may not.

mod collapse;
mod emitters;
mod error;
mod estimate;
mod gap;
mod geometry;
mod inputs;
mod leak;
mod material;
mod prepared_scene;
mod studio;
mod studio_setup;
mod tangents;
mod unreached;

use raywright_bvh::{Occlusion, Real, Vector};

use crate::camera::PreparedCamera;
use crate::effects::{Effect, EffectSet, chosen_integrator};
use crate::framing::{FIELD_OF_VIEW, Silhouette};
use crate::light::{
    DeltaLight, EmitterList, EmitterStrategy, Emitters, Irradiance, Lights, prepare_sky,
};
use crate::lookup::SceneLookup;
use crate::motion::{camera_with_simulated_motion, scene_with_simulated_motion};
use crate::observer::Observer;
use crate::origin::{StorageOrigin, camera_relative_to, light_relative_to};
use crate::scene::{self, Integrator, Scene, ShadowRule, Sky, Studio};
use crate::settings::{AreaShadows, Background, LightSampling, MicrofacetEnergy, Settings};

pub(crate) use collapse::{find_collapsed_objects, round_to_scalar};
pub use error::PrepareError;
pub(crate) use error::check_cancelled;
pub(crate) use estimate::estimate_memory;
pub use gap::UnresolvedGap;
use geometry::GeometryNeeds;
pub(crate) use geometry::{ObjectMesh, ObjectRecord, build_geometry};
pub use leak::{LampRef, LightLeak};
pub(crate) use material::{
    AnisotropyFrame, ClassicInputs, ConstantIor, FilmThickness, InputFieldTypes, LayeredInputs,
    PhysicalInputs, PhysicalTransmission, PreparedMaterial, RefractiveIndex, SpecularInputs,
};
use prepared_scene::PreparedClassicRules;
pub(crate) use prepared_scene::PreparedSpawnRule;
pub use prepared_scene::{PreparedScene, TableCounts};
use studio::Backdrop;
pub use unreached::UnreachedLight;

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
        let whole = scene;
        let scene = &*scene_with_simulated_motion(whole, settings.camera.as_ref(), simulated);
        if let Some((i, model)) = scene.models.iter().enumerate().next() {
            // The loader replaces models by their objects, and other creators of a scene must do
            // the same.
            return Err(PrepareError::Missing {
                path: format!("models[{i}].file"),
                kind: "loaded model",
                name: model.file.clone(),
            });
        }
        let names = expression_constants(scene);
        let lookup = SceneLookup::new(scene);
        let shown = geometry::object_materials(scene, &lookup)?;
        let mut used = vec![false; scene.materials.len()];
        shown
            .iter()
            .for_each(|&material| used[material as usize] = true);
        let paths = chosen_integrator(scene, settings) == Integrator::Path;
        let compensates = settings.microfacets == MicrofacetEnergy::Compensated;
        let (without, fresnel) = (settings.without, settings.fresnel);
        let mut context = material::MaterialContext {
            layers: Vec::new(),
            is_path_tracing: paths,
            disabled_effects: without,
            fresnel,
            multiple_scattering: compensates,
        };
        let origin = StorageOrigin::from_scene::<R>(scene, &lookup);
        let mut inputs = inputs::InputCompiler::new(&names, &lookup, origin.origin);
        let mut materials = Vec::with_capacity(scene.materials.len());
        let mut reads_coordinates = Vec::with_capacity(scene.materials.len());
        for (index, material) in scene.materials.iter().enumerate() {
            check_cancelled(observer)?;
            let first = inputs.texture_tables.textures.len() as u32;
            inputs.dependencies = inputs::InputDependencies::default();
            materials.push(if used[index] {
                material::prepare_material(material, index, scene, &mut inputs, &mut context)?
            } else {
                PreparedMaterial::Unused
            });
            inputs
                .texture_tables
                .material_textures
                .push(first..inputs.texture_tables.textures.len() as u32);
            reads_coordinates.push(inputs.dependencies.coordinates);
        }
        material::required_tables(&context.layers).compute_tables();
        settings.filter.sampler();
        let hard_shadows = settings.area_shadows == AreaShadows::Hard;
        let geometry_needs = material_geometry_needs(
            scene,
            (&materials, &context.layers),
            &reads_coordinates,
            (paths, hard_shadows),
        );
        let mut built = geometry::build_geometry_with_materials::<R>(
            (scene, origin),
            &lookup,
            settings.accelerator,
            (&shown, &geometry_needs),
            observer,
        )?;
        check_cancelled(observer)?;
        let tangents = tangents::generate_missing_tangents(scene, &mut built, observer)?;
        let aspect = f64::from(settings.size[0]) / f64::from(settings.size[1]);
        // The default camera frames the whole motion of all objects, even if the picture shows them
        // at rest.
        let framed = || {
            let silhouette = Silhouette::from_scene(whole);
            silhouette.frame_camera(silhouette.default_view(), FIELD_OF_VIEW, aspect)
        };
        let view =
            camera_with_simulated_motion(settings.camera.clone().unwrap_or_else(framed), simulated);
        let view = camera_relative_to(origin.origin, &view);
        let studio = scene_studio(scene);
        let lit_by = studio.map(|studio| crate::studio::studio_sky(&studio, &view));
        let sky = prepare_sky::<R>(
            (lit_by.as_ref().or(scene.sky.as_ref()), origin.origin),
            &lookup,
            &names,
        )?;
        let lit = simulated.has(Effect::DirectLight) || simulated.has(Effect::Highlights);
        let casters = simulated.has(Effect::Shadows);
        let irradiance = (simulated.has(Effect::SkyLight) && !paths && !sky.is_black())
            .then(|| Irradiance::new(&sky));
        let requested = emitters::EmitterFilter {
            uniform: simulated.has(Effect::SoftShadows),
            varying: paths && simulated.has(Effect::TexturedEmitters),
            evaluated_at_hits: paths,
        };
        let emitters = if requested.uniform || requested.varying {
            emitters::list_emitters::<R>(
                (scene, origin.origin),
                &lookup,
                (&materials, &inputs.texture_tables),
                requested,
                observer,
            )?
        } else {
            EmitterList::default()
        };
        // Lights whose effect is disabled are not built, so that no loop runs over them.
        let placed = scene
            .lights
            .iter()
            .map(|light| light_relative_to(origin.origin, light));
        let delta = if lit {
            placed
                .map(|light| DeltaLight::new(&light, casters))
                .collect()
        } else {
            Vec::new()
        };
        let mut lights = Lights::new(
            delta,
            Emitters::new(emitters),
            sky,
            &built.geometry.bounded_primitives_box(),
        );
        if paths {
            lights.emitters.strategy = EmitterStrategy::SolidAngle;
            lights.emitters.find_triangles(&built.geometry);
            if simulated.has(Effect::SkyLight) {
                lights.build_sky_sampler();
                if settings.light_sampling == LightSampling::Both {
                    lights.restrict_sky_to_excess();
                }
            }
            lights.build_light_sampler();
        }
        let backdrop = match settings.background {
            Background::Environment => None,
            Background::Transparent => Some(Backdrop::Constant(Vector::ZERO)),
        };
        let camera = PreparedCamera::for_scene_bounds(
            &view,
            settings.size,
            &built.geometry.bounded_primitives_box(),
        );
        let absorbs = simulated.has(Effect::Absorption)
            && materials
                .iter()
                .any(|material| material.absorption().is_some());
        let priorities = if paths && simulated.has(Effect::NestedMedia) {
            medium_priorities(scene)
        } else {
            Vec::new()
        };
        let mut prepared = Self {
            geometry_bytes: built.geometry.memory_bytes(),
            geometry: built.geometry,
            meshes: built.meshes,
            objects: built.objects,
            collapsed_meshes: built.collapsed_meshes,
            origin,
            absorbs,
            tracks_media: absorbs || !priorities.is_empty(),
            transmits_straight: paths
                && (!priorities.is_empty() || materials.iter().any(PreparedMaterial::is_thin)),
            priorities,
            tangents,
            materials,
            cone: (!inputs.texture_tables.pyramids.is_empty()).then(|| camera.ray_cone()),
            texture_tables: inputs.texture_tables,
            lights,
            backdrop,
            ground: None,
            studio_backdrop: None,
            irradiance,
            camera,
            rules: PreparedClassicRules::new(&scene.classic),
            layers: context.layers,
            light_sampling: settings.light_sampling,
            hard_shadows,
            roulette: settings.roulette,
            clamp: settings.clamp.map(R::from_f64),
            compensates,
            veil: Vector::from_f64(scene.render.veil.0.into()),
            draws_edges: settings.wireframe,
        };
        if let Some(studio) = &studio {
            prepared.add_studio(studio, &view, settings, simulated);
        }
        Ok(prepared)
    }

    /// Switches the prepared scene to another camera that needs the same effects; only data that
    /// depends on the camera is rebuilt. The result is the same as if the scene had been prepared
    /// for this camera. The camera must have no open shutter. Returns false and changes nothing if
    /// the lights of a studio cannot be prepared.
    #[must_use]
    pub(crate) fn set_camera(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        view: &scene::Camera,
        simulated: EffectSet,
    ) -> bool {
        let view = camera_relative_to(
            self.origin.origin,
            &camera_with_simulated_motion(view.clone(), simulated),
        );
        let studio = scene_studio(scene);
        let lit_by = studio.map(|studio| crate::studio::studio_sky(&studio, &view));
        let prepared = |lit_by| {
            prepare_sky::<R>(
                (Some(&lit_by), self.origin.origin),
                &SceneLookup::new(scene),
                &expression_constants(scene),
            )
        };
        let Ok(sky) = lit_by.map(prepared).transpose() else {
            return false;
        };
        self.camera = PreparedCamera::for_scene_bounds(
            &view,
            settings.size,
            &self.geometry.bounded_primitives_box(),
        );
        self.cone = self.cone.is_some().then(|| self.camera.ray_cone());
        let (Some(studio), Some(sky)) = (studio, sky) else {
            return true;
        };
        self.irradiance = self.irradiance.is_some().then(|| Irradiance::new(&sky));
        self.lights.sky = sky;
        if self.lights.sky_sampler().is_some() {
            self.lights.build_sky_sampler();
            if settings.light_sampling == LightSampling::Both {
                self.lights.restrict_sky_to_excess();
            }
            self.lights.build_light_sampler();
        }
        self.add_studio(&studio, &view, settings, simulated);
        true
    }
}

/// Returns the studio of a scene whose sky is a studio.
fn scene_studio(scene: &Scene) -> Option<Studio> {
    if let Some(Sky::Studio(studio)) = &scene.sky {
        Some(*studio)
    } else {
        None
    }
}

/// Returns the priority of each material's bodies. Where bodies overlap, light is in the body of
/// the greatest priority.
fn medium_priorities(scene: &Scene) -> Vec<u32> {
    let value_of = |material: &scene::Material| {
        if let scene::MaterialModel::Physical(m) = &material.model {
            m.priority
        } else {
            0
        }
    };
    scene.materials.iter().map(value_of).collect()
}

/// Returns the properties of each material that the geometry needs. An opaque occluder blocks
/// shadow rays without a filter, unless the order or the distance of occluders matters.
fn material_geometry_needs<R: Real>(
    scene: &Scene,
    (materials, layers): (&[PreparedMaterial<R>], &[LayeredInputs<R>]),
    reads_coordinates: &[bool],
    (paths, hard): (bool, bool),
) -> Vec<GeometryNeeds> {
    let asks = scene.classic.shadow == ShadowRule::FirstInOrder
        || materials
            .iter()
            .any(PreparedMaterial::reads_occluder_distance);
    let facet =
        |((material, data), &coordinates): ((&PreparedMaterial<R>, &scene::Material), &bool)| {
            let sets = data
                .uv_sets()
                .into_iter()
                .filter(|&set| (set as usize) < scene::MOST_UV_SETS);
            let solid = if paths {
                material.blocks_straight_rays()
            } else {
                material.is_opaque() && !asks
            };
            GeometryNeeds {
                // For hard shadows, a ray to a lamp's centre passes through the lamp's own surface.
                occlusion: if solid && !(hard && material.emits()) {
                    Occlusion::Opaque
                } else {
                    Occlusion::Filtered
                },
                // A path tracer filters each hit by the kind of light: objects without a shadow
                // still block the light of emitters and of the sky.
                without_shadow: if paths {
                    Occlusion::Filtered
                } else {
                    Occlusion::None
                },
                needs_uv: coordinates,
                needs_tangents: material.needs_tangents(layers),
                uv_sets: sets.fold(u8::from(coordinates), |bits, set| bits | 1 << set),
            }
        };
    materials
        .iter()
        .zip(&scene.materials)
        .zip(reads_coordinates)
        .map(facet)
        .collect()
}

/// Returns the names that expressions may read as constants: the time `t` and the parameters.
pub(crate) fn expression_constants(scene: &Scene) -> std::collections::BTreeMap<String, f64> {
    let mut names = scene.parameters.clone();
    names.insert("t".to_owned(), scene.t);
    names
}

#[cfg(test)]
mod tests;
