//! Count of everything in a scene that takes memory: objects, meshes and images.

use std::collections::HashSet;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use raywright_bvh::{Geometry, GeometryMemory, Real};

use crate::affine::affine_from_steps;
use crate::extent::MeshUseCounts;
use crate::generate::objects_with_counts;
use crate::light::max_sky_table_bytes;
use crate::lookup::SceneLookup;
use crate::motion::object_transforms_at_ends;
use crate::prepare::emitter_filter::{EmitterFilter, MaterialEmission};
use crate::prepare::emitters::emission_grid_size;
use crate::prepare::tangents::{TangentKey, tangent_key};
use crate::scene::{
    ImageData, Material, MeshData, Object, Scene, Shape, SideRule, Sky, TextureFilter,
};
use crate::settings::Settings;
use crate::shape::convert_moved_shape;
use crate::sky_picture::SkyPicture;
use crate::texture::mipmap;

/// Numbers of items, and bytes, that the preparation of a scene needs.
#[derive(Default)]
pub(super) struct MemoryNeeds {
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
