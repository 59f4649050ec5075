//! Estimate of a render's memory from the scene and the settings alone. The estimate precedes every
//! allocation, so that a render that cannot fit is refused at once.

use core::ops::Range;
use std::collections::HashSet;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use raywright_bvh::{Geometry, GeometryMemory, Real};

use super::emitters::{Emission, EmitterFilter, points_across};
use super::geometry::ObjectRecord;
use super::material::{LayeredInputs, PreparedMaterial, count_layered};
use super::tangents;
use crate::affine::affine;
use crate::effects::{Effect, RenderSetup};
use crate::extent::MeshUses;
use crate::film::FilmPlan;
use crate::generate::{count, counted};
use crate::light::packed_bytes;
use crate::light::{DeltaLight, EmitterList, LightChoice, LightUsage};
use crate::lookup::SceneLookup;
use crate::memory::Memory;
use crate::motion::{ends, simulated_scene};
use crate::scene::{Filter, ImageData, Integrator, Projection, Scene, Shape, Sky};
use crate::settings::Settings;
use crate::shape::any_shape;
use crate::texture::{TextureBinding, pyramid};

/// Estimates the memory of a render from above, by counts alone: at most twice the actual use (more
/// in a wide tree, see `crate::estimate`). Two numbers are bounded, because only a build determines
/// them: the nodes of a tree, and the area lights whose area can be sampled.
pub(crate) fn estimate<R: Real>(render_setup: &RenderSetup<'_>) -> Memory {
    let (settings, simulated) = (&render_setup.settings, render_setup.effects.simulated());
    let scene = &*simulated_scene(&render_setup.scene, settings.camera.as_ref(), simulated);
    let lookup = SceneLookup::new(scene);
    let paths = render_setup.integrator() == Integrator::Path;
    let requested = EmitterFilter {
        even: simulated.has(Effect::SoftShadows),
        varied: paths && simulated.has(Effect::TexturedEmitters),
        read: paths,
    };
    let needs = MemoryNeeds::of::<R>(scene, settings, &lookup, requested);
    let lens = match settings.camera.as_ref().map(|camera| &camera.projection) {
        Some(Projection::ThinLens {
            aperture_radius, ..
        }) => *aperture_radius > 0.0,
        _ => false,
    };
    let random = paths || lens || needs.lamps > 0 || !settings.sampling.is_fixed();
    let lights = needs.lamps.saturating_add(scene.lights.len() as u64);
    let choice = if paths {
        LightChoice::bytes_of(lights, needs.lamps).saturating_add(LightUsage::bytes_of(lights))
    } else {
        0
    };
    let plan = FilmPlan::new(settings, random, simulated.has(Effect::GroundShadow));
    let times = |count: u64, each: usize| count.saturating_mul(each as u64);
    let tables = [
        times(count(scene), size_of::<ObjectRecord<R>>()),
        times(
            scene.materials.len() as u64,
            size_of::<PreparedMaterial<R>>() + size_of::<Range<u32>>(),
        ),
        times(
            if paths {
                count_layered(scene, settings.fresnel)
            } else {
                0
            },
            size_of::<LayeredInputs<R>>(),
        ),
        times(needs.texture_uses, size_of::<TextureBinding<R>>()),
        times(scene.lights.len() as u64, size_of::<DeltaLight<R>>()),
        choice,
        EmitterList::<R>::bytes_of(needs.lamps, needs.placed_lamps, count(scene), needs.varied),
    ];
    Memory {
        geometry: needs
            .geometry_memory
            .most_bytes::<R>(settings.accelerator)
            .saturating_add(needs.shared),
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
    shared: u64,
    /// Bytes of the meshes in use, without duplicates.
    meshes: u64,
    /// Number of emissive shapes and triangles.
    lamps: u64,
    /// Number of emissive shapes that are rotated or scaled.
    placed_lamps: u64,
    /// Number of triangles of varying emission, and the number of points along each side of a
    /// triangle.
    varied: [u64; 2],
    /// Number of texture uses.
    texture_uses: u64,
    /// Bytes of the images in use with their mipmaps, without duplicates.
    images: u64,
}

impl MemoryNeeds {
    /// Counts the needs of a scene with the selected emitters.
    fn of<R: Real>(
        scene: &Scene,
        settings: &Settings,
        lookup: &SceneLookup<'_>,
        requested: EmitterFilter,
    ) -> Self {
        let (mut needs, uses) = (Self::default(), MeshUses::of(scene));
        let (mut anisotropy, mut meshes, mut shared, mut used) = (
            HashSet::new(),
            HashSet::new(),
            HashSet::new(),
            HashSet::new(),
        );
        for (object, count) in counted(scene) {
            used.insert(object.material.as_str());
            let material = lookup
                .material(&object.material)
                .map(|(_, material)| material);
            let glow = material.and_then(|material| requested.of(material));
            let glows = glow.is_some();
            let (mut each, moves) = (1, ends(object).is_some());
            match &object.shape {
                Shape::Mesh(name) => {
                    let Some(data) = lookup.mesh_data(name) else {
                        continue;
                    };
                    each = data.indices.len() as u64;
                    if meshes.insert(Arc::as_ptr(data)) {
                        needs.meshes += data.bytes() as u64;
                    }
                    if let Some(tangent_key) = tangents::tangent_source(material, data)
                        && anisotropy.insert((Arc::as_ptr(data), tangent_key))
                    {
                        needs.meshes += each * size_of::<[[f32; 4]; 3]>() as u64;
                    }
                    if !uses.share(name, object.side) {
                        needs.geometry_memory.triangles += each;
                    } else {
                        needs.instances(count, moves);
                        if shared.insert((name, object.side)) {
                            needs.part::<R>(&GeometryMemory::of_triangles(each), settings);
                        }
                    }
                }
                shape if moves => {
                    if let Some(shape) = any_shape::<R>(shape, DVec3::ZERO) {
                        let mut alone = GeometryMemory::default();
                        alone.add(&shape, false, 1);
                        needs.part::<R>(&alone, settings);
                        needs.instances(count, true);
                    }
                }
                shape => {
                    let mapped = affine(&object.transform).matrix3 != DMat3::IDENTITY;
                    if let Some(shape) = any_shape::<R>(shape, DVec3::ZERO) {
                        needs.geometry_memory.add(&shape, mapped, count);
                    }
                    needs.placed_lamps =
                        needs
                            .placed_lamps
                            .saturating_add(if glows && mapped { count } else { 0 });
                }
            }
            needs.lamps =
                needs
                    .lamps
                    .saturating_add(if glows { count.saturating_mul(each) } else { 0 });
            let in_cells = glow == Some(Emission::Varied) && matches!(object.shape, Shape::Mesh(_));
            needs.varied[0] = needs.varied[0].saturating_add(if in_cells {
                count.saturating_mul(each)
            } else {
                0
            });
        }
        needs.varied[1] = points_across(needs.varied[0]);
        needs.look_up_images(scene, lookup, &used);
        needs
    }

    /// Adds a number of moving or static instances.
    fn instances(&mut self, count: u64, moves: bool) {
        self.geometry_memory.instances = self.geometry_memory.instances.saturating_add(count);
        self.geometry_memory.moving =
            self.geometry_memory
                .moving
                .saturating_add(if moves { count } else { 0 });
    }

    /// Adds the bytes of a geometry that instances share.
    fn part<R: Real>(&mut self, alone: &GeometryMemory, settings: &Settings) {
        self.shared +=
            size_of::<Geometry<R>>() as u64 + alone.most_bytes::<R>(settings.accelerator);
    }

    /// Adds the images, mipmaps and texture uses of the used materials and of the sky.
    fn look_up_images(&mut self, scene: &Scene, lookup: &SceneLookup<'_>, used: &HashSet<&str>) {
        let mut images: HashSet<*const ImageData> = HashSet::new();
        let mut pyramids = HashSet::new();
        let mut image = |name: &str| {
            let data = lookup.image(name)?.data.as_ref()?;
            Some(if images.insert(Arc::as_ptr(data)) {
                data.bytes() as u64
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
                if texture.filter == Filter::Mipmaps {
                    // An alpha mask has a second texture use, without mipmaps.
                    self.texture_uses += 1;
                    let first = pyramids.insert((Arc::as_ptr(data), texture.colour_space));
                    self.images += if first {
                        pyramid::bytes_of(data.width, data.height)
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
                .map_or(0, packed_bytes);
        }
    }
}
