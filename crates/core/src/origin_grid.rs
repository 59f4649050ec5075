//! Choice of a storage origin near a box. Coordinates far from zero lose digits when stored;
//! coordinates relative to a near origin keep their digits.

use glam::DVec3;
use raywright_bvh::Aabb;

/// Distance of a scene from zero, in sizes of its box, beyond which the scene counts as far. Most
/// scenes are nearer, so their coordinates keep every bit.
pub(crate) const SCENE_DISTANCE_LIMIT: f64 = 4.0;
/// Distance of a mesh or shape from the origin of its own space, in sizes of its box, beyond which
/// it counts as far. A nearer mesh loses at most six of 24 bits. The limit is larger than
/// [`SCENE_DISTANCE_LIMIT`], because a mesh may stand anywhere in its scene.
pub(crate) const MESH_DISTANCE_LIMIT: f64 = 64.0;

/// Returns an origin near a box. Along each axis on which the box's centre is at most `far` sizes
/// of the box from zero, the origin is zero. The origin lies on a grid whose step is a power of
/// two, at least as wide as the box, so that coordinates representable in `f32` stay exact relative
/// to the origin.
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
