//! An origin near a box, from which coordinates are counted that would lose digits where they are.

use glam::DVec3;
use raywright_bvh::Aabb;

/// Distance from zero, in sizes, from which on a scene is far, and a mesh or shape in its own
/// space. The former costs no bit of a scene that is about zero, as nearly all are; the latter
/// stands anywhere in its scene, and loses six bits of 24 at the most.
pub(crate) const FAR: f64 = 4.0;
pub(crate) const FAR_FROM_OWN: f64 = 64.0;

/// An origin near a box, zero along each axis on which the box is not so many sizes away from zero.
/// It lies on a grid of a power of two as wide as the box, so that coordinates which f32 holds are
/// exact when counted from it.
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
