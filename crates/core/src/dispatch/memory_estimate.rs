//! Estimate of a render's memory, before preparation.

use crate::effects::RenderSetup;
use crate::memory::MemoryUse;
use crate::prepare;
use crate::scene::{MeshSource, Scene};
use crate::settings::{PrecisionChoice, Settings};

/// Returns the bytes that preparation and rendering still have to allocate. `needed` is the
/// estimate of the total, of which meshes and images are already in memory. Added are temporary
/// lists for building a tree, about as large as the tree, and a reordered copy of the picture for
/// writing a file.
pub(super) fn bytes_still_to_allocate(needed: &MemoryUse, scene: &Scene) -> u64 {
    let images = scene
        .images
        .iter()
        .filter_map(|image| image.data.as_ref())
        .map(|data| data.byte_size() as u64);
    let meshes = scene.meshes.iter().map(|mesh| match &mesh.source {
        MeshSource::Inline(data) => data.byte_size() as u64,
        MeshSource::File(_) => 0,
    });
    let in_memory = images.sum::<u64>() + meshes.sum::<u64>();
    needed
        .total()
        .saturating_sub(in_memory)
        .saturating_add(needed.geometry)
        .saturating_add(needed.film / 2)
}

/// Estimates the memory that a scene takes, before preparation. The estimate is never below the
/// memory in use after preparation (`ReadyScene::memory`). It is at most twice as large, with
/// three exceptions:
///
/// - three times with the tree of the precision `robust`;
/// - four times where triangles may be split (`build=high`);
/// - five times where triangles and shapes mix.
pub fn estimate_scene_memory(scene: &Scene, settings: &Settings) -> MemoryUse {
    estimate_memory(&RenderSetup::new(scene, settings))
}

/// Estimates the memory of a render in its precision.
pub(super) fn estimate_memory(render_setup: &RenderSetup<'_>) -> MemoryUse {
    match render_setup.settings.precision {
        PrecisionChoice::Robust => prepare::estimate_memory::<f32>(render_setup),
        PrecisionChoice::Reference => prepare::estimate_memory::<f64>(render_setup),
    }
}
