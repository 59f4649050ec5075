//! Estimate of a render's memory from the scene and the settings alone. The estimate precedes every
//! allocation, so that a render that cannot fit is refused at once.

use core::ops::Range;
use std::collections::HashSet;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use raywright_bvh::{Geometry, GeometryMemory, Real};

use super::emitter_filter::{EmitterFilter, MaterialEmission};
use super::emitters::emission_grid_size;
use super::geometry::ObjectRecord;
use super::material::{LayeredInputs, PreparedMaterial, count_layered_materials};
use super::medium::PreparedMedium;
use super::tangents::{TangentKey, tangent_key};
use crate::affine::affine_from_steps;
use crate::effects::{Effect, RenderSetup};
use crate::extent::MeshUseCounts;
use crate::film::FilmPlan;
use crate::generate::{count_objects, objects_with_counts};
use crate::light::{DeltaLight, EmitterList, LightSampler, LightUsage, max_sky_table_bytes};
use crate::lookup::SceneLookup;
use crate::memory::MemoryUse;
use crate::motion::{object_transforms_at_ends, scene_with_simulated_motion};
use crate::scene::{
    ImageData, Integrator, Material, MaterialModel, MeshData, Object, Projection, Scene, Shape,
    SideRule, Sky, TextureFilter,
};
use crate::settings::Settings;
use crate::shape::convert_moved_shape;
use crate::sky_picture::SkyPicture;
use crate::texture::{TextureBinding, mipmap};

/// Estimates the memory of a render from above, by counts alone: at most twice the actual use (more
/// in a wide tree, see [`crate::estimate_scene_memory`]). Only a build determines the number of
/// nodes of a tree, and the number of area lights whose area can be sampled. For these two numbers
/// the estimate uses upper bounds.
pub(crate) fn estimate_memory<R: Real>(render_setup: &RenderSetup<'_>) -> MemoryUse {
    let (settings, simulated) = (&render_setup.settings, render_setup.effects.simulated());
    let scene =
        &*scene_with_simulated_motion(&render_setup.scene, settings.camera.as_ref(), simulated);
    let lookup = SceneLookup::new(scene);
    let paths = render_setup.integrator() == Integrator::Path;
    let requested = EmitterFilter::from_effects(simulated, paths);
    let needs = MemoryNeeds::from_scene::<R>(scene, settings, &lookup, requested);
    let lens = match settings.camera.as_ref().map(|camera| &camera.projection) {
        Some(Projection::ThinLens {
            aperture_radius, ..
        }) => *aperture_radius > 0.0,
        _ => false,
    };
    let random = paths || lens || needs.lamps > 0 || !settings.sampling.is_fixed();
    let lights = needs.lamps.saturating_add(scene.lights.len() as u64);
    let choice = if paths {
        LightSampler::estimate_bytes(lights, needs.lamps)
            .saturating_add(LightUsage::estimate_bytes(lights))
    } else {
        0
    };
    let plan = FilmPlan::new(settings, random, simulated.has(Effect::GroundShadow));
    let times = |count: u64, each: usize| count.saturating_mul(each as u64);
    let interior = |material: &Material| match &material.model {
        MaterialModel::Physical(physical) => {
            physical.interior.as_ref().map(PreparedMedium::most_bytes)
        }
        _ => None,
    };
    let interiors = scene.materials.iter().filter_map(interior);
    let air = scene.air.as_ref().map(PreparedMedium::most_bytes);
    let tables = [
        if paths { interiors.chain(air).sum() } else { 0 },
        times(count_objects(scene), size_of::<ObjectRecord<R>>()),
        times(
            scene.materials.len() as u64,
            size_of::<PreparedMaterial<R>>() + size_of::<Range<u32>>(),
        ),
        times(
            if paths {
                count_layered_materials(scene, settings.fresnel)
            } else {
                0
            },
            size_of::<LayeredInputs<R>>(),
        ),
        times(needs.texture_uses, size_of::<TextureBinding<R>>()),
        times(scene.lights.len() as u64, size_of::<DeltaLight<R>>()),
        choice,
        EmitterList::<R>::estimate_bytes(
            needs.lamps,
            needs.transformed_lamps,
            count_objects(scene),
            needs.varying_emission,
        ),
    ];
    MemoryUse {
        geometry: needs
            .geometry_memory
            .max_geometry_bytes::<R>(settings.accelerator)
            .saturating_add(needs.shared_geometry_bytes),
        meshes: needs.meshes,
        tables: tables.into_iter().fold(0, u64::saturating_add),
        textures: needs.images,
        film: plan.bytes(),
    }
}

// Count of everything in a scene that takes memory: objects, meshes and images.

/// Numbers of items, and bytes, that the preparation of a scene needs.
#[derive(Default)]
struct MemoryNeeds {
    /// Counts of the primitives on the scene's top level.
    pub geometry_memory: GeometryMemory,
    /// Bytes of the geometries that instances share.
    pub shared_geometry_bytes: u64,
    /// Bytes of the meshes in use, without duplicates.
    pub meshes: u64,
    /// Number of emissive shapes and triangles.
    pub lamps: u64,
    /// Number of emissive shapes that are rotated or scaled.
    pub transformed_lamps: u64,
    /// Number of triangles of varying emission, followed by the number of points along each side of
    /// a triangle at which it is evaluated.
    pub varying_emission: [u64; 2],
    /// Number of texture uses.
    pub texture_uses: u64,
    /// Bytes of the images in use with their mipmaps, without duplicates.
    pub images: u64,
}

impl MemoryNeeds {
    /// Counts what a scene needs. `requested` selects the emitters.
    pub fn from_scene<R: Real>(
        scene: &Scene,
        settings: &Settings,
        lookup: &SceneLookup<'_>,
        requested: EmitterFilter,
    ) -> Self {
        let mut counter = MemoryCounter {
            needs: Self::default(),
            settings,
            lookup,
            uses: MeshUseCounts::from_scene(scene),
            counted_meshes: HashSet::new(),
            counted_tangents: HashSet::new(),
            counted_geometries: HashSet::new(),
        };
        let mut used = HashSet::new();
        for (object, count) in objects_with_counts(scene) {
            used.insert(object.material.as_str());
            counter.count_object::<R>(object, count, requested);
        }
        let mut needs = counter.needs;
        needs.varying_emission[1] = emission_grid_size(needs.varying_emission[0]);
        needs.add_images(scene, lookup, &used);
        needs
    }

    /// Adds `count` instances of a shared geometry. `moves` is whether they move.
    fn add_instances(&mut self, count: u64, moves: bool) {
        self.geometry_memory.instances = self.geometry_memory.instances.saturating_add(count);
        self.geometry_memory.moving_instances = self
            .geometry_memory
            .moving_instances
            .saturating_add(if moves { count } else { 0 });
    }

    /// Adds the bytes of a geometry that instances share.
    fn add_shared_geometry<R: Real>(&mut self, alone: &GeometryMemory, settings: &Settings) {
        self.shared_geometry_bytes +=
            size_of::<Geometry<R>>() as u64 + alone.max_geometry_bytes::<R>(settings.accelerator);
    }

    /// Adds emissive shapes or triangles.
    fn add_lamps(&mut self, count: u64) {
        self.lamps = self.lamps.saturating_add(count);
    }

    /// Adds the images, mipmaps and texture uses of the used materials and of the sky.
    fn add_images(&mut self, scene: &Scene, lookup: &SceneLookup<'_>, used: &HashSet<&str>) {
        let mut images: HashSet<*const ImageData> = HashSet::new();
        let mut pyramids = HashSet::new();
        let mut image = |name: &str| {
            let data = lookup.image(name)?.data.as_ref()?;
            Some(if images.insert(Arc::as_ptr(data)) {
                data.byte_size() as u64
            } else {
                0
            })
        };
        for material in used.iter().filter_map(|name| lookup.material(name)) {
            let textures = material
                .1
                .textures()
                .filter_map(|reference| lookup.texture(&reference.name));
            for texture in textures {
                let Some(data) = lookup
                    .image(&texture.image)
                    .and_then(|image| image.data.as_ref())
                else {
                    continue;
                };
                self.texture_uses += 1;
                self.images += image(&texture.image).unwrap_or(0);
                if texture.filter == TextureFilter::Mipmaps {
                    // An alpha mask has a second texture use, without mipmaps.
                    self.texture_uses += 1;
                    let first = pyramids.insert((Arc::as_ptr(data), texture.colour_space));
                    self.images += if first {
                        mipmap::mipmap_bytes(data.width, data.height)
                    } else {
                        0
                    };
                }
            }
        }
        match &scene.sky {
            Some(Sky::Map(map)) => {
                self.images += image(&map.image).unwrap_or(0);
                self.images += lookup
                    .image(&map.image)
                    .and_then(|image| image.data.as_ref())
                    .map_or(0, max_sky_table_bytes);
            }
            Some(Sky::Studio(studio)) if studio.strength > 0.0 => {
                let picture = SkyPicture::Studio.image();
                self.images += picture.byte_size() as u64 + max_sky_table_bytes(&picture);
            }
            _ => {}
        }
    }
}

/// Counter of what a scene's objects need. It counts a shared mesh once.
struct MemoryCounter<'a> {
    needs: MemoryNeeds,
    settings: &'a Settings,
    lookup: &'a SceneLookup<'a>,
    uses: MeshUseCounts<'a>,
    /// Addresses of the meshes counted so far.
    counted_meshes: HashSet<*const MeshData>,
    /// Meshes (by address) and keys of their generated tangents that are counted so far.
    counted_tangents: HashSet<(*const MeshData, TangentKey)>,
    /// Meshes and side rules whose shared geometry is counted.
    counted_geometries: HashSet<(&'a str, SideRule)>,
}

impl<'a> MemoryCounter<'a> {
    /// Counts `count` objects that differ only in their position. An object whose mesh is undefined
    /// needs nothing.
    fn count_object<R: Real>(&mut self, object: &'a Object, count: u64, requested: EmitterFilter) {
        let material = self
            .lookup
            .material(&object.material)
            .map(|(_, material)| material);
        let emission = material.and_then(|material| requested.selected_emission(material));
        let Shape::Mesh(name) = &object.shape else {
            self.count_shape::<R>(object, count, emission.is_some());
            return;
        };
        let Some(data) = self.lookup.mesh_data(name) else {
            return;
        };
        self.count_mesh::<R>((object, name, data), count, material);
        let triangles = count.saturating_mul(data.indices.len() as u64);
        if emission.is_some() {
            self.needs.add_lamps(triangles);
        }
        if emission == Some(MaterialEmission::Varying) {
            self.needs.varying_emission[0] =
                self.needs.varying_emission[0].saturating_add(triangles);
        }
    }

    /// Counts the memory of a mesh with its tangents, and its triangles or instances.
    fn count_mesh<R: Real>(
        &mut self,
        (object, name, data): (&'a Object, &'a str, &Arc<MeshData>),
        count: u64,
        material: Option<&Material>,
    ) {
        let triangles = data.indices.len() as u64;
        if self.counted_meshes.insert(Arc::as_ptr(data)) {
            self.needs.meshes += data.byte_size() as u64;
        }
        if let Some(key) = tangent_key(material, data)
            && self.counted_tangents.insert((Arc::as_ptr(data), key))
        {
            self.needs.meshes += triangles * size_of::<[[f32; 4]; 3]>() as u64;
        }
        if !self.uses.is_shared(name, object.side) {
            self.needs.geometry_memory.triangles += triangles;
            return;
        }
        self.needs
            .add_instances(count, object_transforms_at_ends(object).is_some());
        if self.counted_geometries.insert((name, object.side)) {
            self.needs.add_shared_geometry::<R>(
                &GeometryMemory::from_triangle_count(triangles),
                self.settings,
            );
        }
    }

    /// Counts `count` shapes other than meshes. They are primitives, or instances if they move.
    fn count_shape<R: Real>(&mut self, object: &Object, count: u64, emits: bool) {
        let shape = convert_moved_shape::<R>(&object.shape, DVec3::ZERO);
        if object_transforms_at_ends(object).is_some() {
            if let Some(shape) = shape {
                let mut alone = GeometryMemory::default();
                alone.add_shapes(&shape, false, 1);
                self.needs.add_shared_geometry::<R>(&alone, self.settings);
                self.needs.add_instances(count, true);
            }
        } else {
            let is_mapped = affine_from_steps(&object.transform).matrix3 != DMat3::IDENTITY;
            if let Some(shape) = shape {
                self.needs
                    .geometry_memory
                    .add_shapes(&shape, is_mapped, count);
            }
            if emits && is_mapped {
                self.needs.transformed_lamps = self.needs.transformed_lamps.saturating_add(count);
            }
        }
        if emits {
            self.needs.add_lamps(count);
        }
    }
}
