//! The prepared scene that integrators read.

use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::{Geometry, Real, Vector};

use super::context::PrepareContext;
use super::geometry::{BuiltGeometry, ObjectRecord};
use super::material::{LayeredInputs, PreparedMaterial};
use super::material_set::MaterialSet;
use super::medium::{PreparedAir, PreparedMedium, measure_bodies};
use super::studio::{Backdrop, StudioGround};
use super::tangents::CornerTangents;
use crate::camera::{PreparedCamera, RayCone};
use crate::effects::Effect;
use crate::light::{Irradiance, LightId, LightUsage, Lights, Openings, placed_lights};
use crate::memory::MemoryUse;
use crate::scene::{
    self, ClassicRules, DepthLimit, ImageData, MeshData, OffsetDirection, Scene, ShadowRule,
    SpawnRule,
};
use crate::settings::{AreaShadows, Background, LightSampling, MicrofacetEnergy, RouletteStart};
use crate::storage_origin::StorageOrigin;
use crate::texture::InputTables;

/// Rule for the origins of spawned rays, in the scalar `R` (see [`SpawnRule`]).
#[derive(Clone, Copy, Debug)]
pub(crate) enum PreparedSpawnRule<R: Real> {
    /// Each spawned ray starts outside the error bound of its hit point.
    ErrorBound,
    /// Each spawned ray is moved by constant offsets.
    Constant {
        offset: R,
        along_ray: bool,
        camera_min: R,
        secondary_min: R,
        shadow_min: R,
    },
}

/// The rules that all classic materials share, in the scalar `R` (see [`ClassicRules`]).
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedClassicRules<R: Real> {
    pub spawn: PreparedSpawnRule<R>,
    /// Whether only the first occluder in the order of the scene's objects blocks light. False for
    /// path tracing, whose shadow rays end at any opaque occluder.
    pub first_occluder_decides: bool,
    /// Farthest occluder of a directional light in metres; infinite without a limit.
    pub shadow_max_distance: R,
    /// Whether a surface hit at the depth limit shows its local term. Otherwise it shows nothing.
    pub local_only_at_limit: bool,
}

impl<R: Real> PreparedClassicRules<R> {
    pub(super) fn new(rules: &ClassicRules, is_path_tracing: bool) -> Self {
        let spawn = match rules.spawn {
            SpawnRule::ErrorBound => PreparedSpawnRule::ErrorBound,
            SpawnRule::Constant(c) => PreparedSpawnRule::Constant {
                offset: R::from_f64(c.offset),
                along_ray: c.along == OffsetDirection::Ray,
                camera_min: R::from_f64(c.camera_min),
                secondary_min: R::from_f64(c.secondary_min),
                shadow_min: R::from_f64(c.shadow_min),
            },
        };
        Self {
            spawn,
            first_occluder_decides: rules.shadow == ShadowRule::FirstInOrder && !is_path_tracing,
            shadow_max_distance: R::from_f64(rules.shadow_max_distance.unwrap_or(f64::INFINITY)),
            local_only_at_limit: rules.depth_limit == DepthLimit::LocalOnly,
        }
    }
}

/// The prepared scene, which integrators read. It consists of flat arrays that refer to each other
/// by index. No object, material or primitive has a pointer, closure or trait object of its own.
/// Meshes and images are not copied: each is shared with the scene by one pointer.
#[derive(Clone, Debug)]
pub(crate) struct PreparedScene<R: Real> {
    pub(crate) geometry: Geometry<R>,
    /// The meshes in use.
    pub(crate) meshes: Vec<Arc<MeshData>>,
    /// Data of the objects by their index in the scene, generated objects last.
    pub(crate) objects: Vec<ObjectRecord<R>>,
    /// Generated tangents of meshes with normal maps or anisotropy.
    pub(crate) tangents: Vec<CornerTangents>,
    pub(crate) materials: Vec<PreparedMaterial<R>>,
    /// Tables of the materials' inputs.
    pub(crate) texture_tables: InputTables<R>,
    /// Delta lights, area lights and the sky. Lights whose effect is disabled are left out.
    pub lights: Lights<R>,
    /// Background of camera rays that hit nothing; `None` if they see the sky.
    pub(crate) backdrop: Option<Backdrop<R>>,
    /// Invisible ground of a studio, whose shadow dims the backdrop; `None` without a ground.
    pub(crate) ground: Option<StudioGround<R>>,
    /// Radiance of a studio's backdrop at an exposure of 0; `None` until the first camera is set.
    pub(crate) studio_backdrop: Option<f64>,
    /// Factor on the backdrop's radiance, which undoes the exposure of the picture.
    pub(crate) backdrop_factor: f64,
    /// Cosine-weighted mean of the sky's radiance; `None` if no material reads it.
    pub(crate) irradiance: Option<Irradiance<R>>,
    pub(crate) camera: PreparedCamera<R>,
    /// Ray cone of the camera, which selects mipmap levels; `None` without textures that use them.
    pub(crate) cone: Option<RayCone<R>>,
    pub(crate) rules: PreparedClassicRules<R>,
    /// Whether any material absorbs light inside its body.
    pub(crate) absorbs: bool,
    /// Whether any medium scatters light, or has a density that varies.
    pub(crate) scatters: bool,
    /// Media inside bodies.
    pub(crate) media: Vec<PreparedMedium>,
    /// Lamps without size that are sampled along segments in media; empty without media.
    pub(crate) equiangular_lamps: Vec<(u32, Option<DVec3>)>,
    /// The air; `None` if it is clear.
    pub(crate) air: Option<PreparedAir>,
    /// Priority of each material's bodies. Where bodies overlap, light is in the body of the
    /// greatest priority. Empty if priorities are not simulated.
    pub(crate) priorities: Vec<u32>,
    /// Whether a path tracks which bodies it is inside.
    pub(crate) tracks_media: bool,
    /// Whether light samples may pass straight through surfaces. Shadow rays then visit the hits of
    /// such surfaces in order.
    pub(crate) transmits_straight: bool,
    /// Layers of the materials that have layers.
    pub(crate) layers: Vec<LayeredInputs<R>>,
    /// Sampling strategy of the path tracer for area lights and the sky.
    pub(super) light_sampling: LightSampling,
    /// Whether area lights cast hard shadows: only their centres are sampled.
    pub(crate) hard_shadows: bool,
    /// Segment of a path at which Russian roulette starts.
    pub(crate) roulette: RouletteStart,
    /// Greatest radiance of a sample's brightest channel; `None` without clamping.
    pub(crate) clamp: Option<R>,
    /// Whether rough surfaces include the multiple scattering among their microfacets.
    pub(crate) compensates: bool,
    /// Radiance added to every sample.
    pub(crate) veil: R::Vec3,
    /// Whether camera rays show the edges of triangles.
    pub(crate) draws_edges: bool,
    /// Indices, ascending, of the objects whose mesh collapses when stored.
    pub(crate) collapsed_meshes: Vec<u32>,
    /// Storage origin of all coordinates.
    pub(crate) origin: StorageOrigin,
    /// Bytes of primitives and accelerators; geometry shared by instances counts once.
    pub(super) geometry_bytes: usize,
}

/// Sizes of the tables of a prepared scene, for reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TableSizes {
    /// Primitives of the scene's top level; an instance counts as one primitive.
    pub primitives: usize,
    /// Unbounded primitives of the top level.
    pub unbounded: usize,
    /// Instances of the top level.
    pub instances: usize,
    /// Delta lights.
    pub lights: usize,
    /// Emissive shapes and triangles of positive power.
    pub emitters: usize,
    /// Materials in use.
    pub materials: usize,
    /// Materials with layers.
    pub layered: usize,
    /// Whether the cosine-weighted mean of the sky was computed.
    pub irradiance: bool,
    /// Cells in which the sky is sampled through openings.
    pub openings: usize,
    /// Bytes of decoded images.
    pub texture_bytes: usize,
}

impl<R: Real> PreparedScene<R> {
    /// Returns the strategy by which path tracing samples a light. Lamps with hard shadows are only
    /// sampled directly: a path that hits a lamp by chance does not know whether the lamp's centre
    /// is visible.
    #[inline(always)]
    pub(crate) fn light_sampling_strategy(&self, light: LightId) -> LightSampling {
        match light {
            LightId::Emitter(i)
                if self.casts_hard_shadow(i) && self.light_sampling == LightSampling::Both =>
            {
                LightSampling::Lights
            }
            _ => self.light_sampling,
        }
    }

    /// Whether an area light casts hard shadows. A light of varying emission does not: its emission
    /// is evaluated at the shadow ray's hit, which must be the sampled point.
    #[inline(always)]
    pub(crate) fn casts_hard_shadow(&self, emitter: u32) -> bool {
        self.hard_shadows && !self.lights.emitters.has_varying_emission(emitter)
    }

    /// Converts a point from stored coordinates, relative to the storage origin, to those of the
    /// scene file.
    #[inline]
    pub(crate) fn to_world(&self, point: R::Vec3) -> DVec3 {
        let stored = point.to_f64();
        if self.origin.origin == DVec3::ZERO {
            stored
        } else {
            stored + self.origin.origin
        }
    }

    /// Returns the memory of the prepared scene, without the film.
    pub(crate) fn memory_use(&self) -> MemoryUse {
        let tables = size_of_val(self.objects.as_slice())
            + size_of_val(self.materials.as_slice())
            + size_of_val(self.layers.as_slice())
            + size_of_val(self.media.as_slice())
            + (self.media.iter())
                .chain(self.air.iter().map(|air| &air.medium))
                .map(PreparedMedium::cell_bytes)
                .sum::<usize>()
            + size_of_val(self.priorities.as_slice())
            + size_of_val(self.texture_tables.textures.as_slice())
            + size_of_val(self.texture_tables.material_textures.as_slice())
            + size_of_val(self.lights.delta.as_slice());
        let choice = self.lights.light_sampler().bytes();
        // Only an integrator that chooses among lights counts the usage of each light.
        let counted = if self.lights.light_sampler().is_empty() {
            0
        } else {
            self.lights.delta.len() + self.lights.emitters.len()
        };
        let tangents = self
            .tangents
            .iter()
            .map(|corners| size_of_val(corners.as_slice()) as u64)
            .sum::<u64>();
        MemoryUse {
            geometry: self.geometry_bytes as u64,
            meshes: self
                .meshes
                .iter()
                .map(|mesh| mesh.byte_size() as u64)
                .sum::<u64>()
                + tangents,
            tables: tables as u64
                + choice
                + self.lights.emitters.bytes()
                + self.lights.openings().map_or(0, Openings::bytes)
                + LightUsage::estimate_bytes(counted as u64),
            textures: self.texture_bytes() as u64 + self.lights.sky.bytes(),
            film: 0,
        }
    }

    /// Returns the bytes of the images of materials and sky with their mipmaps. An image that is
    /// used several times counts once.
    fn texture_bytes(&self) -> usize {
        let sky = self.lights.sky.image().filter(|&sky| {
            !self
                .texture_tables
                .images
                .iter()
                .any(|image| Arc::ptr_eq(image, sky))
        });
        let pyramids = self.texture_tables.pyramids.iter().flatten();
        self.texture_tables
            .images
            .iter()
            .chain(sky)
            .map(|image| image.byte_size())
            .sum::<usize>()
            + pyramids.map(ImageData::byte_size).sum::<usize>()
    }

    /// Returns the sizes of the tables. Tables of absent effects are empty.
    pub fn table_counts(&self) -> TableSizes {
        TableSizes {
            primitives: self.geometry.len(),
            unbounded: self.geometry.unbounded_count(),
            instances: self.geometry.instance_count(),
            lights: self.lights.delta.len(),
            emitters: self.lights.emitters.powered_count(),
            materials: self
                .materials
                .iter()
                .filter(|m| !matches!(m, PreparedMaterial::Unused))
                .count(),
            layered: self.layers.len(),
            irradiance: self.irradiance.is_some(),
            openings: self.lights.openings().map_or(0, Openings::cell_count),
            texture_bytes: self.texture_bytes(),
        }
    }
}

// Assembly of a prepared scene from its separately prepared parts.

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
        let object_media: Vec<_> = (parts.built.objects.iter())
            .map(|object| materials.materials[object.material as usize].medium())
            .collect();
        let tables = &materials.texture_tables;
        if simulates_media && !media.is_empty() {
            let is_open = |material: u32| materials.materials[material as usize].is_open();
            measure_bodies(
                &mut media,
                context,
                &object_media,
                (tables, &parts.lights),
                is_open,
            );
        }
        let bounds = parts.built.geometry.bounded_primitives_box();
        let placement = (&bounds, context.origin.origin);
        let air = materials
            .air
            .filter(|_| simulates_media)
            .map(|medium| PreparedAir::new(medium, tables, scene, placement));
        let scatters = simulates_media && (air.is_some() || !media.is_empty());
        let has_open_bodies = materials.materials.iter().any(PreparedMaterial::is_open);
        let has_thin_walls = materials
            .materials
            .iter()
            .any(PreparedMaterial::is_thin_wall);
        let mut objects = parts.built.objects;
        for object in &mut objects {
            let is_at_rest = object.mesh.is_some_and(|mesh| !mesh.rotates);
            let material = &materials.materials[object.material as usize];
            object.uniform = material.uniform_surface().filter(|_| is_at_rest);
            object.is_smooth = material.is_smooth();
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
