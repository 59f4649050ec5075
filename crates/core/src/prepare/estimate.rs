//! Estimate of a render's memory from the scene and the settings alone. The estimate precedes every
//! allocation, so that a render that cannot fit is refused at once.

mod memory_needs;

use core::ops::Range;

use raywright_bvh::Real;

use super::emitter_filter::EmitterFilter;
use super::geometry::ObjectRecord;
use super::material::{LayeredInputs, PreparedMaterial, count_layered_materials};
use crate::effects::{Effect, RenderSetup};
use crate::film::FilmPlan;
use crate::generate::count_objects;
use crate::light::{DeltaLight, EmitterList, LightSampler, LightUsage};
use crate::lookup::SceneLookup;
use crate::memory::MemoryUse;
use crate::motion::scene_with_simulated_motion;
use crate::scene::{Integrator, Projection};
use crate::texture::TextureBinding;

use memory_needs::MemoryNeeds;

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
