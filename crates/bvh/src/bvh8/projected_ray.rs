//! The values of a ray that the exact triangle test in SIMD registers uses.

use glam::DVec3;

use crate::shapes::PreparedRay;

/// Values of a ray for the exact triangle test. The test projects corners onto the plane
/// perpendicular to the ray, as [`PreparedRay`] does. Of the six components of the two projection
/// axes, two are zero. The other four are components of the direction, up to the sign.
///
/// Let the coordinate axes be rotated so that the direction's largest component comes first. Let
/// (p, q, r) be a corner relative to the ray's origin. The projected coordinates of the corner are
/// then q·a + p·b and r·c + p·d, with a, b, c, d from `projection`.
#[derive(Clone, Copy)]
pub(crate) struct ProjectedRay {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
    /// Axis of the direction's largest component. The other two axes follow cyclically.
    pub major: usize,
    /// The numbers a, b, c and d of the projection.
    pub projection: [f64; 4],
    pub inverse_length_squared: f64,
}

/// Result of the exact test in SIMD registers if it can't decide: rounding could change the sign of
/// an edge function, or the triangle is edge-on. The scalar test of [`crate::shapes::Triangle`]
/// must then decide.
pub(super) struct UncertainSign;

/// Returns the entries of an array for the axis `major` and for the two axes that follow
/// cyclically.
#[inline(always)]
pub(super) fn rotate_axes<T: Copy>([x, y, z]: [T; 3], major: usize) -> (T, T, T) {
    let (around, major) = ([x, y, z, x, y], major.min(2));
    (around[major], around[major + 1], around[major + 2])
}

impl ProjectedRay {
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        let d = DVec3::from_array(direction.map(f64::from));
        Self::from_f64(origin.map(f64::from), d, 1.0 / d.dot(d))
    }

    /// Copies the values of a prepared ray.
    #[inline(always)]
    pub fn from_prepared(prepared_ray: &PreparedRay) -> Self {
        Self::from_f64(
            prepared_ray.origin.to_array(),
            prepared_ray.direction,
            prepared_ray.inverse_length_squared,
        )
    }

    #[inline(always)]
    fn from_f64(origin: [f64; 3], d: DVec3, inverse_length_squared: f64) -> Self {
        let size = d.abs();
        // Computed without branches, which would often be mispredicted for bounced rays.
        let [first, second] =
            [(size.x > size.y) & (size.x > size.z), size.y > size.z].map(usize::from);
        let major = (1 - first) * (2 - second);
        let (p, q, r) = rotate_axes([d.x, d.y, d.z], major);
        let sign = 1.0_f64.copysign(p);
        Self {
            origin,
            direction: d.to_array(),
            major,
            projection: [p * sign, -q * sign, p, -r],
            inverse_length_squared,
        }
    }
}
