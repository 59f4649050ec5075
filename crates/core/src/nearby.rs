//! Storage origin near a box: coordinates far from zero lose digits, coordinates relative to a near
//! origin keep them.

use glam::DVec3;
use raywright_bvh::Aabb;

/// Distance from zero, in sizes of the box, beyond which a scene counts as far; and the same for a
/// mesh or shape in its own space. The first limit leaves every bit of a scene about zero
/// unchanged, as nearly all scenes are. The second allows a loss of at most six of 24 bits, because
/// a mesh or shape stands anywhere in its scene.
pub(crate) const FAR: f64 = 4.0;
pub(crate) const FAR_FROM_OWN: f64 = 64.0;

/// Returns an origin near a box: zero along each axis on which the box is less than `far` sizes
/// away from zero. The origin lies on a grid whose step is a power of two, as wide as the box, so
/// that coordinates representable in f32 stay exact relative to it.
pub(crate) fn near(bounds: &Aabb, far: f64) -> DVec3 {
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
