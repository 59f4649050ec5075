//! Directions across an axis, and angles about it.

use glam::DVec3;

use crate::scalar::{Real, Vector};

/// A unit vector across a unit vector: x as far as the axis allows it, so that about +y angles run
/// from x to z, and on a floor tangent and bitangent are world x and z.
pub(crate) fn tangent(axis: DVec3) -> DVec3 {
    let start = if axis.x.abs() < 0.9 {
        DVec3::X
    } else {
        DVec3::Y
    };
    (start - axis * axis.dot(start)).normalize()
}

/// Tangent and bitangent, which is tangent × axis; the axis may have any length.
fn across(axis: DVec3) -> (DVec3, DVec3) {
    let axis = axis.normalize();
    let tangent = tangent(axis);
    (tangent, tangent.cross(axis))
}

/// The angle of an offset about an axis as a texture coordinate in [0, 1], and the derivative of
/// the offset by it. Seen from outside with the axis up it grows to the right, as an image's
/// columns do. At the axis itself one half and zero.
pub(crate) fn turn<R: Real>(offset: DVec3, axis: DVec3) -> (R, R::Vec3) {
    let (t, b) = across(axis);
    let (x, y) = (offset.dot(t), offset.dot(b));
    let full = R::from_f64(core::f64::consts::TAU);
    let angle = R::from_f64(y).atan2(R::from_f64(x));
    (
        R::from_f64(0.5) - angle / full,
        R::Vec3::from_f64((t * y - b * x) * core::f64::consts::TAU),
    )
}

/// The unit vector across an axis at a fraction `u` of the way round.
pub(crate) fn spoke(axis: DVec3, u: f64) -> DVec3 {
    let (t, b) = across(axis);
    let angle = u * core::f64::consts::TAU;
    t * libm::cos(angle) + b * libm::sin(angle)
}

/// The part of an offset along an axis, as a fraction of the axis, and the part across it.
#[inline(always)]
pub(crate) fn split(offset: DVec3, axis: DVec3) -> (f64, DVec3) {
    let along = offset.dot(axis) / axis.dot(axis);
    (along, offset - axis * along)
}

/// How far a disk reaches in a direction.
pub(crate) fn disk_support(centre: DVec3, axis: DVec3, radius: f64, direction: DVec3) -> f64 {
    centre.dot(direction) + radius * direction.cross(axis).length() / axis.length()
}

/// Length of a vector of two components: a square root and no platform's hypot, for the sake of
/// equal bits.
pub(crate) fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}
