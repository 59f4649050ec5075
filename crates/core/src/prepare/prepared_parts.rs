//! Assembly of a prepared scene from its separately prepared parts.

use raywright_bvh::{Real, Vector};

use super::context::PrepareContext;
use super::geometry::BuiltGeometry;
use super::material::PreparedMaterial;
use super::material_set::MaterialSet;
use super::medium::{PreparedAir, mark_unbounded_media};
use super::prepared_scene::{PreparedClassicRules, PreparedScene};
use super::studio::Backdrop;
use super::tangents::CornerTangents;
use crate::camera::PreparedCamera;
use crate::effects::Effect;
use crate::light::{Irradiance, Lights, placed_lights};
use crate::scene::{self, Scene};
use crate::settings::{AreaShadows, Background, MicrofacetEnergy};

/// The separately prepared parts of a scene.
pub(super) struct PreparedParts<R: Real> {
    pub built: BuiltGeometry<R>,
    /// Generated tangents of meshes.
    pub tangents: Vec<CornerTangents>,
    pub materials: MaterialSet<R>,
    pub lights: Lights<R>,
    /// Cosine-weighted mean of the sky's radiance; `None` if no material needs it.
    pub irradiance: Option<Irradiance<R>>,
    pub camera: PreparedCamera<R>,
}

impl<R: Real> PreparedScene<R> {
    /// Assembles a prepared scene. A studio's backdrop and ground are not yet included. Properties
    /// of all materials together, such as whether any absorbs light, are computed here once.
    pub(super) fn from_parts(context: &PrepareContext<'_>, parts: PreparedParts<R>) -> Self {
        let (scene, settings) = (context.scene, context.settings);
        let materials = parts.materials;
        let absorbs =
            context.simulated.has(Effect::Absorption) && materials.has_absorbing_material();
        let priorities = if context.is_path_tracing && context.simulated.has(Effect::NestedMedia) {
            medium_priorities(scene)
        } else {
            Vec::new()
        };
        let simulates_media = context.simulated.has(Effect::ScatteringMedia);
        let mut media = materials.media;
        mark_unbounded_media(
            &mut media,
            scene,
            parts.built.objects.iter().map(|object| object.material),
        );
        let bounds = parts.built.geometry.bounded_primitives_box();
        let air = materials
            .air
            .filter(|_| simulates_media)
            .map(|medium| PreparedAir::new(medium, scene, &bounds, context.origin.origin));
        let scatters = simulates_media && (air.is_some() || !media.is_empty());
        let has_open_bodies = materials.materials.iter().any(PreparedMaterial::is_open);
        let has_thin_walls = materials
            .materials
            .iter()
            .any(PreparedMaterial::is_thin_wall);
        let mut objects = parts.built.objects;
        for object in &mut objects {
            let is_at_rest = object.mesh.is_some_and(|mesh| !mesh.rotates);
            object.uniform = materials.materials[object.material as usize]
                .uniform_surface()
                .filter(|_| is_at_rest);
        }
        Self {
            geometry_bytes: parts.built.geometry.memory_bytes(),
            geometry: parts.built.geometry,
            meshes: parts.built.meshes,
            objects,
            collapsed_meshes: parts.built.collapsed_meshes,
            origin: context.origin,
            absorbs,
            tracks_media: absorbs || scatters || has_open_bodies || !priorities.is_empty(),
            transmits_straight: context.is_path_tracing
                && (!priorities.is_empty() || has_thin_walls || has_open_bodies),
            scatters,
            equiangular_lamps: if scatters {
                placed_lights(&parts.lights.delta)
            } else {
                Vec::new()
            },
            media,
            air,
            priorities,
            tangents: parts.tangents,
            materials: materials.materials,
            cone: (!materials.texture_tables.pyramids.is_empty()).then(|| parts.camera.ray_cone()),
            texture_tables: materials.texture_tables,
            lights: parts.lights,
            backdrop: match settings.background {
                Background::Environment => None,
                Background::Transparent => Some(Backdrop::Constant(Vector::ZERO)),
            },
            ground: None,
            studio_backdrop: None,
            backdrop_factor: 1.0,
            irradiance: parts.irradiance,
            camera: parts.camera,
            rules: PreparedClassicRules::new(&scene.classic, context.is_path_tracing),
            layers: materials.layers,
            light_sampling: settings.light_sampling,
            hard_shadows: settings.area_shadows == AreaShadows::Hard,
            roulette: settings.roulette,
            clamp: settings.clamp.map(R::from_f64),
            compensates: settings.microfacets == MicrofacetEnergy::Compensated,
            veil: Vector::from_f64(scene.render.veil.0.into()),
            draws_edges: settings.wireframe,
        }
    }
}

/// Returns the priority of each material's bodies. Where bodies overlap, light is in the body of
/// the greatest priority.
fn medium_priorities(scene: &Scene) -> Vec<u32> {
    let priority = |material: &scene::Material| {
        if let scene::MaterialModel::Physical(m) = &material.model {
            m.priority
        } else {
            0
        }
    };
    scene.materials.iter().map(priority).collect()
}
