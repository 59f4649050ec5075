//! Choice of a storage origin near a box. Coordinates far from zero lose digits when they are
//! stored. Coordinates relative to a near origin keep their digits.

use glam::DVec3;
use raywright_bvh::Aabb;

/// Distance from zero beyond which a scene is stored relative to an origin near it, as a multiple
/// of the size of the scene's box. Most scenes are nearer, so their coordinates are stored
/// unchanged.
pub(crate) const SCENE_DISTANCE_LIMIT: f64 = 4.0;
/// Distance from zero beyond which a mesh or shape is stored relative to an origin near it, as a
/// multiple of the size of its box. A nearer mesh loses at most six of 24 bits. The limit is larger
/// than [`SCENE_DISTANCE_LIMIT`], because a mesh may stand anywhere in its scene.
pub(crate) const MESH_DISTANCE_LIMIT: f64 = 64.0;

/// Returns a storage origin near a box. Along an axis, it is zero if the distance of the box's
/// centre from zero is at most `far` times the size of the box.
///
/// The origin lies on a grid whose step is a power of two and at least the size of the box. So
/// coordinates that `f32` represents exactly stay exact relative to the origin.
pub(crate) fn storage_origin_near(bounds: &Aabb, far: f64) -> DVec3 {
    let size = bounds.extent().max_element();
    if bounds.is_empty() || !size.is_finite() {
        return DVec3::ZERO;
    }
    let grid = if size > 0.0 {
        libm::ldexp(1.0, libm::ilogb(size) + 1)
    } else {
        0.0
    };
    let along = |centre: f64| {
        let on_grid = (centre / grid).round() * grid;
        let origin = if on_grid.is_finite() { on_grid } else { centre };
        if centre.abs() > far * size {
            origin
        } else {
            0.0
        }
    };
    bounds.centre().to_array().map(along).into()
}
