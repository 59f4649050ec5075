//! Vectors perpendicular to an axis, and angles around it.

use glam::DVec3;

use crate::scalar::{Real, Vector};

/// Returns a unit vector perpendicular to the unit vector `axis`. It is the x axis, projected onto
/// the perpendicular plane, or the y axis if `axis` is close to x. So angles around +y run from x
/// to z. The tangent and the bitangent of a floor are the world's x and z.
pub(crate) fn tangent(axis: DVec3) -> DVec3 {
    let start = if axis.x.abs() < 0.9 {
        DVec3::X
    } else {
        DVec3::Y
    };
    (start - axis * axis.dot(start)).normalize()
}

/// Returns the unit tangent of an axis of any length, and the unit bitangent, which is tangent ×
/// axis.
fn tangent_and_bitangent(axis: DVec3) -> (DVec3, DVec3) {
    let axis = axis.normalize();
    let tangent = tangent(axis);
    (tangent, tangent.cross(axis))
}

/// Computes the angle of an offset around an axis as a texture coordinate in [0, 1]. Also returns
/// the derivative of the offset by that coordinate. Seen from outside with the axis up, the
/// coordinate grows to the right, like the columns of an image. For an offset along the axis, the
/// coordinate is one half and the derivative zero.
pub(crate) fn angle_coordinate<R: Real>(offset: DVec3, axis: DVec3) -> (R, R::Vec3) {
    let (t, b) = tangent_and_bitangent(axis);
    let (x, y) = (offset.dot(t), offset.dot(b));
    let full = R::from_f64(core::f64::consts::TAU);
    let angle = R::from_f64(y).atan2(R::from_f64(x));
    (
        R::from_f64(0.5) - angle / full,
        R::Vec3::from_f64((t * y - b * x) * core::f64::consts::TAU),
    )
}

/// Returns the unit vector perpendicular to an axis, at the fraction `u` of a turn around it.
pub(crate) fn radial_direction(axis: DVec3, u: f64) -> DVec3 {
    let (t, b) = tangent_and_bitangent(axis);
    let angle = u * core::f64::consts::TAU;
    t * libm::cos(angle) + b * libm::sin(angle)
}

/// Splits an offset into two components. The first is along the axis, as a fraction of the axis.
/// The second is perpendicular to the axis.
#[inline(always)]
pub(crate) fn split_along_axis(offset: DVec3, axis: DVec3) -> (f64, DVec3) {
    let along = offset.dot(axis) / axis.dot(axis);
    (along, offset - axis * along)
}

/// Support function of a disk: the maximum of p·direction over all points p of the disk.
pub(crate) fn eval_disk_support(centre: DVec3, axis: DVec3, radius: f64, direction: DVec3) -> f64 {
    centre.dot(direction) + radius * direction.cross(axis).length() / axis.length()
}

/// Length of the vector (x, y), by a square root. The platform's `hypot` would give different bits
/// on different platforms.
pub(crate) fn length_2d(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}
