//! The prepared scene that integrators read.

use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::{Geometry, Real, Vector};

use super::geometry::ObjectRecord;
use super::material::{LayeredInputs, PreparedMaterial};
use super::studio::{Backdrop, StudioGround};
use super::tangents::CornerTangents;
use crate::camera::{Cone, PreparedCamera};
use crate::light::{Irradiance, LightId, LightUsage, Lights};
use crate::memory::Memory;
use crate::origin::StorageOrigin;
use crate::scene::{
    ClassicRules, DepthLimit, ImageData, MeshData, OffsetDirection, ShadowRule, SpawnRule,
};
use crate::settings::{LightSampling, Roulette};
use crate::texture::TextureTables;

/// Rule for the origins of spawned rays, in the precision's scalar.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PreparedSpawn<R: Real> {
    ErrorBound,
    Constant {
        offset: R,
        along_ray: bool,
        camera_min: R,
        secondary_min: R,
        shadow_min: R,
    },
}

/// The classic model's rules in the precision's scalar.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedRules<R: Real> {
    pub spawn: PreparedSpawn<R>,
    pub first_occluder_decides: bool,
    /// Infinite without a limit in the scene.
    pub shadow_max_distance: R,
    pub local_only_at_limit: bool,
}

impl<R: Real> PreparedRules<R> {
    pub(super) fn new(rules: &ClassicRules) -> Self {
        let spawn = match rules.spawn {
            SpawnRule::ErrorBound => PreparedSpawn::ErrorBound,
            SpawnRule::Constant(c) => PreparedSpawn::Constant {
                offset: R::from_f64(c.offset),
                along_ray: c.along == OffsetDirection::Ray,
                camera_min: R::from_f64(c.camera_min),
                secondary_min: R::from_f64(c.secondary_min),
                shadow_min: R::from_f64(c.shadow_min),
            },
        };
        Self {
            spawn,
            first_occluder_decides: rules.shadow == ShadowRule::FirstInOrder,
            shadow_max_distance: R::from_f64(rules.shadow_max_distance.unwrap_or(f64::INFINITY)),
            local_only_at_limit: rules.depth_limit == DepthLimit::LocalOnly,
        }
    }
}

/// The prepared scene: flat arrays that refer to each other by index, without a pointer, closure or
/// trait object per object, material or primitive. Meshes and images are shared with the scene by
/// one pointer for each buffer, so that nothing is copied and every array can be read directly.
#[derive(Clone, Debug)]
pub struct Prepared<R: Real> {
    pub(crate) geometry: Geometry<R>,
    /// The meshes in use.
    pub(crate) meshes: Vec<Arc<MeshData>>,
    /// Objects by their index in the scene, generated objects last.
    pub(crate) objects: Vec<ObjectRecord<R>>,
    /// Generated tangents of meshes with normal maps or anisotropy.
    pub(crate) tangents: Vec<CornerTangents>,
    pub(crate) materials: Vec<PreparedMaterial<R>>,
    /// Tables of the materials' inputs.
    pub(crate) texture_tables: TextureTables<R>,
    /// Delta lights, area lights and the sky; lights without effect are left out.
    pub lights: Lights<R>,
    /// Background of camera rays that hit nothing; `None` for the sky.
    pub(crate) backdrop: Option<Backdrop<R>>,
    /// Ground with the shadow that dims the backdrop; `None` without a studio's ground.
    pub(crate) ground: Option<StudioGround<R>>,
    /// Radiance of a studio's backdrop, once decided.
    pub(crate) studio_backdrop: Option<f64>,
    /// The sky's cosine-weighted mean; `None` if no material needs it.
    pub(crate) irradiance: Option<Irradiance<R>>,
    pub(crate) camera: PreparedCamera<R>,
    /// Ray cone of the camera for texture filtering; `None` without filtered textures.
    pub(crate) cone: Option<Cone<R>>,
    pub(crate) rules: PreparedRules<R>,
    /// Whether any material absorbs light inside.
    pub(crate) absorbs: bool,
    /// Priority of overlapping media, by material; empty if all are equal.
    pub(crate) priorities: Vec<u32>,
    /// Whether paths keep track of the media around them.
    pub(crate) tracks_media: bool,
    /// Whether sampled light may pass straight through surfaces, so that shadow rays visit them in
    /// order.
    pub(crate) lets_straight: bool,
    /// Layers of layered materials.
    pub(crate) layers: Vec<LayeredInputs<R>>,
    /// Sampling strategy of the path tracer for area lights and the sky.
    pub(super) light_sampling: LightSampling,
    /// Whether area lights cast hard shadows, by their centres.
    pub(crate) hard_shadows: bool,
    /// Russian roulette setting.
    pub(crate) roulette: Roulette,
    /// Limit of a sample's brightest channel; `None` without clamping.
    pub(crate) clamp: Option<R>,
    /// Whether rough surfaces include multiple scattering among microfacets.
    pub(crate) compensates: bool,
    pub(crate) veil: R::Vec3,
    /// Whether camera rays show the edges of triangles.
    pub(crate) draws_edges: bool,
    /// Objects with a mesh that vanishes when stored, ascending.
    pub(crate) lost: Vec<u32>,
    /// Origin of all coordinates.
    pub(crate) origin: StorageOrigin,
    /// Bytes of geometry and accelerators, shared geometry counted once.
    pub(super) geometry_bytes: usize,
}

/// Sizes of the built tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuiltCounts {
    /// Primitives of the scene's top-level set, an instance counting as one.
    pub primitives: usize,
    /// Unbounded primitives among them.
    pub unbounded: usize,
    /// Instances among them.
    pub instances: usize,
    /// Delta lights.
    pub lights: usize,
    /// Emissive shapes and triangles of positive power.
    pub emitters: usize,
    /// Materials in use.
    pub materials: usize,
    /// Layered materials among them.
    pub layered: usize,
    /// Whether the sky's cosine-weighted mean was computed.
    pub irradiance: bool,
    /// Bytes of decoded images.
    pub texture_bytes: usize,
}

impl<R: Real> Prepared<R> {
    /// Sampling strategy of a path tracer for an area light or the sky. Lamps with hard shadows are
    /// found by light sampling alone, since a path that hits one by chance does not know whether
    /// the lamp's centre is visible.
    #[inline(always)]
    pub(crate) fn sampling_of(&self, light: LightId) -> LightSampling {
        match light {
            LightId::Emitter(i)
                if self.casts_hard(i) && self.light_sampling == LightSampling::Both =>
            {
                LightSampling::Lights
            }
            _ => self.light_sampling,
        }
    }

    /// Whether a lamp casts hard shadows. Varying emission is evaluated at the shadow ray's hit,
    /// which must be the sampled point.
    #[inline(always)]
    pub(crate) fn casts_hard(&self, emitter: u32) -> bool {
        self.hard_shadows && !self.lights.emitters.varies(emitter)
    }

    /// A point in the scene file's coordinates.
    #[inline]
    pub(crate) fn in_world(&self, point: R::Vec3) -> DVec3 {
        let stored = point.to_f64();
        if self.origin.origin == DVec3::ZERO {
            stored
        } else {
            stored + self.origin.origin
        }
    }

    /// Memory of the prepared scene, without the film.
    pub(crate) fn memory(&self) -> Memory {
        let tables = size_of_val(self.objects.as_slice())
            + size_of_val(self.materials.as_slice())
            + size_of_val(self.layers.as_slice())
            + size_of_val(self.priorities.as_slice())
            + size_of_val(self.texture_tables.textures.as_slice())
            + size_of_val(self.texture_tables.of_materials.as_slice())
            + size_of_val(self.lights.delta.as_slice());
        let choice = self.lights.choice().bytes();
        // Only integrators that choose among lights count their usage.
        let counted = if self.lights.choice().is_empty() {
            0
        } else {
            self.lights.delta.len() + self.lights.emitters.len()
        };
        let tangents = self
            .tangents
            .iter()
            .map(|corners| size_of_val(corners.as_slice()) as u64)
            .sum::<u64>();
        Memory {
            geometry: self.geometry_bytes as u64,
            meshes: self
                .meshes
                .iter()
                .map(|mesh| mesh.bytes() as u64)
                .sum::<u64>()
                + tangents,
            tables: tables as u64
                + choice
                + self.lights.emitters.bytes()
                + LightUsage::bytes_of(counted as u64),
            textures: self.texture_bytes() as u64 + self.lights.sky.bytes(),
            film: 0,
        }
    }

    /// Bytes of the images of materials and sky, each counted once, with their mip maps.
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
            .map(|image| image.bytes())
            .sum::<usize>()
            + pyramids.map(ImageData::bytes).sum::<usize>()
    }

    /// Sizes of the tables; those of absent effects are empty.
    pub fn tables(&self) -> BuiltCounts {
        BuiltCounts {
            primitives: self.geometry.len(),
            unbounded: self.geometry.unbounded_count(),
            instances: self.geometry.instance_count(),
            lights: self.lights.delta.len(),
            emitters: self.lights.emitters.lit(),
            materials: self
                .materials
                .iter()
                .filter(|m| !matches!(m, PreparedMaterial::Unused))
                .count(),
            layered: self.layers.len(),
            irradiance: self.irradiance.is_some(),
            texture_bytes: self.texture_bytes(),
        }
    }
}
