//! Estimate of a render's memory from the scene and the settings alone. The estimate precedes every
//! allocation, so that a render that cannot fit is refused at once.

use core::ops::Range;
use std::collections::HashSet;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use raywright_bvh::{Geometry, GeometryMemory, Real};

use super::emitters::{Emission, EmitterFilter, emission_grid_size};
use super::geometry::ObjectRecord;
use super::material::{LayeredInputs, PreparedMaterial, count_layered_materials};
use super::tangents;
use crate::affine::affine_from_steps;
use crate::effects::{Effect, RenderSetup};
use crate::extent::MeshUseCounts;
use crate::film::FilmPlan;
use crate::generate::{count_objects, objects_with_counts};
use crate::light::max_table_bytes;
use crate::light::{DeltaLight, EmitterList, LightSampler, LightUsage};
use crate::lookup::SceneLookup;
use crate::memory::MemoryUse;
use crate::motion::{object_transforms_at_ends, scene_with_simulated_motion};
use crate::scene::{ImageData, Integrator, Projection, Scene, Shape, Sky, TextureFilter};
use crate::settings::Settings;
use crate::shape::convert_moved_shape;
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
    let requested = EmitterFilter {
        uniform: simulated.has(Effect::SoftShadows),
        varying: paths && simulated.has(Effect::TexturedEmitters),
        evaluated_at_hits: paths,
    };
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
    let tables = [
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

/// Counts and bytes that the preparation of a scene needs.
#[derive(Default)]
struct MemoryNeeds {
    /// Counts of the primitives on the scene's top level.
    geometry_memory: GeometryMemory,
    /// Bytes of the geometries that instances share.
    shared_geometry_bytes: u64,
    /// Bytes of the meshes in use, without duplicates.
    meshes: u64,
    /// Number of emissive shapes and triangles.
    lamps: u64,
    /// Number of emissive shapes that are rotated or scaled.
    transformed_lamps: u64,
    /// Number of triangles of varying emission, and the number of points along each side of a
    /// triangle.
    varying_emission: [u64; 2],
    /// Number of texture uses.
    texture_uses: u64,
    /// Bytes of the images in use with their mipmaps, without duplicates.
    images: u64,
}

impl MemoryNeeds {
    /// Counts the needs of a scene with the selected emitters.
    fn from_scene<R: Real>(
        scene: &Scene,
        settings: &Settings,
        lookup: &SceneLookup<'_>,
        requested: EmitterFilter,
    ) -> Self {
        let (mut needs, uses) = (Self::default(), MeshUseCounts::from_scene(scene));
        let (mut anisotropy, mut meshes, mut shared, mut used) = (
            HashSet::new(),
            HashSet::new(),
            HashSet::new(),
            HashSet::new(),
        );
        for (object, count) in objects_with_counts(scene) {
            used.insert(object.material.as_str());
            let material = lookup
                .material(&object.material)
                .map(|(_, material)| material);
            let glow = material.and_then(|material| requested.selected_emission(material));
            let glows = glow.is_some();
            let (mut each, moves) = (1, object_transforms_at_ends(object).is_some());
            match &object.shape {
                Shape::Mesh(name) => {
                    let Some(data) = lookup.mesh_data(name) else {
                        continue;
                    };
                    each = data.indices.len() as u64;
                    if meshes.insert(Arc::as_ptr(data)) {
                        needs.meshes += data.byte_size() as u64;
                    }
                    if let Some(tangent_key) = tangents::tangent_key(material, data)
                        && anisotropy.insert((Arc::as_ptr(data), tangent_key))
                    {
                        needs.meshes += each * size_of::<[[f32; 4]; 3]>() as u64;
                    }
                    if !uses.is_shared(name, object.side) {
                        needs.geometry_memory.triangles += each;
                    } else {
                        needs.add_instances(count, moves);
                        if shared.insert((name, object.side)) {
                            needs.add_shared_geometry::<R>(
                                &GeometryMemory::from_triangle_count(each),
                                settings,
                            );
                        }
                    }
                }
                shape if moves => {
                    if let Some(shape) = convert_moved_shape::<R>(shape, DVec3::ZERO) {
                        let mut alone = GeometryMemory::default();
                        alone.add_shapes(&shape, false, 1);
                        needs.add_shared_geometry::<R>(&alone, settings);
                        needs.add_instances(count, true);
                    }
                }
                shape => {
                    let mapped = affine_from_steps(&object.transform).matrix3 != DMat3::IDENTITY;
                    if let Some(shape) = convert_moved_shape::<R>(shape, DVec3::ZERO) {
                        needs.geometry_memory.add_shapes(&shape, mapped, count);
                    }
                    needs.transformed_lamps = needs
                        .transformed_lamps
                        .saturating_add(if glows && mapped { count } else { 0 });
                }
            }
            needs.lamps =
                needs
                    .lamps
                    .saturating_add(if glows { count.saturating_mul(each) } else { 0 });
            let in_cells =
                glow == Some(Emission::Varying) && matches!(object.shape, Shape::Mesh(_));
            needs.varying_emission[0] = needs.varying_emission[0].saturating_add(if in_cells {
                count.saturating_mul(each)
            } else {
                0
            });
        }
        needs.varying_emission[1] = emission_grid_size(needs.varying_emission[0]);
        needs.add_images(scene, lookup, &used);
        needs
    }

    /// Adds a number of moving or static instances.
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
        if let Some(Sky::Map(map)) = &scene.sky {
            self.images += image(&map.image).unwrap_or(0);
            self.images += lookup
                .image(&map.image)
                .and_then(|image| image.data.as_ref())
                .map_or(0, max_table_bytes);
        }
    }
}
