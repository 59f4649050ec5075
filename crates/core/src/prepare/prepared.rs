//! A scene as integrators walk it.

use std::sync::Arc;

use glam::DVec3;
use raywright_bvh::{Geometry, Real, Vector};

use super::geometry::ObjectRecord;
use super::material::{LayeredInputs, Material};
use super::studio::{Backdrop, Ground};
use super::tangents::Corners;
use crate::camera::{Camera, Cone};
use crate::light::{Irradiance, LightId, LightUsage, Lights};
use crate::memory::Memory;
use crate::origin::StorageOrigin;
use crate::scene::{
    ClassicRules, DepthLimit, ImageData, MeshData, OffsetDirection, ShadowRule, SpawnRule,
};
use crate::settings::{LightSampling, Roulette};
use crate::texture::Sources;

/// Where spawned rays start, in the precision's scalar.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Spawn<R: Real> {
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
pub(crate) struct Rules<R: Real> {
    pub spawn: Spawn<R>,
    pub first_occluder_decides: bool,
    /// Infinite where the scene sets none.
    pub shadow_max_distance: R,
    pub local_only_at_limit: bool,
}

impl<R: Real> Rules<R> {
    pub(super) fn new(rules: &ClassicRules) -> Self {
        let spawn = match rules.spawn {
            SpawnRule::ErrorBound => Spawn::ErrorBound,
            SpawnRule::Constant(c) => Spawn::Constant {
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

/// A scene as an integrator walks it: flat arrays that refer to each other by index, with no
/// pointer, closure or trait object for each object, material or primitive. What it shares with the
/// scene, meshes and images, lies in tables too, one pointer for each buffer, so that nothing is
/// copied and every array can be read as it is.
#[derive(Clone, Debug)]
pub struct Prepared<R: Real> {
    pub(crate) geometry: Geometry<R>,
    /// The meshes that objects show.
    pub(crate) meshes: Vec<Arc<MeshData>>,
    /// By index of the scene's objects, generated ones last.
    pub(crate) objects: Vec<ObjectRecord<R>>,
    /// Tangents made for meshes whose normals an image bends.
    pub(crate) tangents: Vec<Corners>,
    pub(crate) materials: Vec<Material<R>>,
    /// What the materials' inputs refer to.
    pub(crate) sources: Sources<R>,
    /// Lights, emissive surfaces and the sky; no table holds what no surface would answer to.
    pub lights: Lights<R>,
    /// What camera rays see that hit nothing; none: the sky.
    pub(crate) backdrop: Option<Backdrop<R>>,
    /// What the backdrop is dimmed by; none where no studio has one.
    pub(crate) ground: Option<Ground<R>>,
    /// Radiance of a studio's backdrop, once it is decided.
    pub(crate) studio_backdrop: Option<f64>,
    /// The sky's cosine-weighted average; none where no material asks for it.
    pub(crate) irradiance: Option<Irradiance<R>>,
    pub(crate) camera: Camera<R>,
    /// How wide its rays are, by which textures are filtered; none where no texture asks.
    pub(crate) cone: Option<Cone<R>>,
    pub(crate) rules: Rules<R>,
    /// Whether some material absorbs what passes through it.
    pub(crate) absorbs: bool,
    /// Which body light is in where several overlap, by material; empty where all bodies are alike.
    pub(crate) priorities: Vec<u32>,
    /// Whether paths keep track of the bodies that they are in.
    pub(crate) tracks_media: bool,
    /// Whether light asked for may arrive straight through surfaces, so that shadow rays meet them
    /// in order.
    pub(crate) lets_straight: bool,
    /// What lies over, under and in materials that have such.
    pub(crate) layers: Vec<LayeredInputs<R>>,
    /// How a path tracer finds light with a size.
    pub(super) light_sampling: LightSampling,
    /// Whether it is the middle of a lamp that has to be seen.
    pub(crate) hard_shadows: bool,
    /// When chance may end a path.
    pub(crate) roulette: Roulette,
    /// What the brightest channel of a sample is brought down to; none: nothing is.
    pub(crate) clamp: Option<R>,
    /// Whether rough surfaces give back what their facets send to each other.
    pub(crate) compensates: bool,
    pub(crate) veil: R::Vec3,
    /// Whether camera rays see the edges of triangles.
    pub(crate) draws_edges: bool,
    /// Objects of whose mesh storing leaves nothing, ascending.
    pub(crate) lost: Vec<u32>,
    /// What all coordinates are counted from.
    pub(crate) origin: StorageOrigin,
    /// Bytes of geometry and accelerators, shared geometry counted once.
    pub(super) geometry_bytes: usize,
}

/// How much was built of what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tables {
    /// Primitives of the scene's own set, an instance counting as one.
    pub primitives: usize,
    /// Those without bounds.
    pub unbounded: usize,
    /// Those that are instances.
    pub instances: usize,
    /// Light sources besides the sky and surfaces.
    pub lights: usize,
    /// Emissive shapes and triangles that light others.
    pub emitters: usize,
    /// Materials that something shows.
    pub materials: usize,
    /// Those of them that are layered.
    pub layered: usize,
    /// Whether the sky's cosine-weighted average was computed.
    pub irradiance: bool,
    /// Bytes of decoded images.
    pub texture_bytes: usize,
}

impl<R: Real> Prepared<R> {
    /// How a path tracer finds a light with a size. Lamps of which the middle alone counts are
    /// asked, since a path that meets one by chance does not know what the middle sees.
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

    /// Whether a lamp's shadows are hard. Where its light varies it is read where a shadow ray
    /// meets it, which has to be a point that was drawn.
    #[inline(always)]
    pub(crate) fn casts_hard(&self, emitter: u32) -> bool {
        self.hard_shadows && !self.lights.emitters.varies(emitter)
    }

    /// A point in the file's own coordinates.
    #[inline]
    pub(crate) fn in_world(&self, point: R::Vec3) -> DVec3 {
        let stored = point.to_f64();
        if self.origin.origin == DVec3::ZERO {
            stored
        } else {
            stored + self.origin.origin
        }
    }

    /// What it takes, without the film.
    pub(crate) fn memory(&self) -> Memory {
        let tables = size_of_val(self.objects.as_slice())
            + size_of_val(self.materials.as_slice())
            + size_of_val(self.layers.as_slice())
            + size_of_val(self.priorities.as_slice())
            + size_of_val(self.sources.textures.as_slice())
            + size_of_val(self.sources.of_materials.as_slice())
            + size_of_val(self.lights.delta.as_slice());
        let choice = self.lights.choice().bytes();
        // Only what chooses among lights counts what became of them.
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

    /// Bytes of the images that materials and sky show, each counted once, with their mip maps.
    fn texture_bytes(&self) -> usize {
        let sky = self.lights.sky.image().filter(|&sky| {
            !self
                .sources
                .images
                .iter()
                .any(|image| Arc::ptr_eq(image, sky))
        });
        let pyramids = self.sources.pyramids.iter().flatten();
        self.sources
            .images
            .iter()
            .chain(sky)
            .map(|image| image.bytes())
            .sum::<usize>()
            + pyramids.map(ImageData::bytes).sum::<usize>()
    }

    /// Sizes of the tables that effects need; an absent effect's are empty.
    pub fn tables(&self) -> Tables {
        Tables {
            primitives: self.geometry.len(),
            unbounded: self.geometry.unbounded_count(),
            instances: self.geometry.instance_count(),
            lights: self.lights.delta.len(),
            emitters: self.lights.emitters.lit(),
            materials: self
                .materials
                .iter()
                .filter(|m| !matches!(m, Material::Unused))
                .count(),
            layered: self.layers.len(),
            irradiance: self.irradiance.is_some(),
            texture_bytes: self.texture_bytes(),
        }
    }
}
