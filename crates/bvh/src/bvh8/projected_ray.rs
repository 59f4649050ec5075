//! A ray as prepared for the triangle test in registers.

use glam::DVec3;

use crate::shapes::PreparedRay;

/// Ray values for the exact test. The projection across the ray is that of [`PreparedRay`], of
/// whose six numbers two are zero and four are components of the direction. With the axes rotated
/// so that the direction's largest component comes first, (p, q, r), the two coordinates of a
/// corner are q·a + p·b and r·c + p·d.
#[derive(Clone, Copy)]
pub(crate) struct ProjectedRay {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
    /// Axis of the direction's largest component; the two axes after it follow cyclically.
    pub major: usize,
    /// The four numbers above.
    pub across: [f64; 4],
    pub inverse_length_squared: f64,
}

/// Rounding could change the sign of an edge function, or the triangle is edge-on: the
/// single-triangle test decides.
pub(super) struct UncertainSign;

/// The entries for an axis and the two axes after it, cyclically.
#[inline(always)]
pub(super) fn rotated_axes<T: Copy>([x, y, z]: [T; 3], major: usize) -> (T, T, T) {
    let (around, major) = ([x, y, z, x, y], major.min(2));
    (around[major], around[major + 1], around[major + 2])
}

impl ProjectedRay {
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        let d = DVec3::from_array(direction.map(f64::from));
        Self::with(origin.map(f64::from), d, 1.0 / d.dot(d))
    }

    /// The same values from a prepared ray.
    #[inline(always)]
    pub fn of(prepared_ray: &PreparedRay) -> Self {
        Self::with(
            prepared_ray.origin.to_array(),
            prepared_ray.direction,
            prepared_ray.inverse_length_squared,
        )
    }

    #[inline(always)]
    fn with(origin: [f64; 3], d: DVec3, inverse_length_squared: f64) -> Self {
        let size = d.abs();
        // Without branches, which bounced rays would often mispredict.
        let [first, second] =
            [(size.x > size.y) & (size.x > size.z), size.y > size.z].map(usize::from);
        let major = (1 - first) * (2 - second);
        let (p, q, r) = rotated_axes([d.x, d.y, d.z], major);
        let sign = 1.0_f64.copysign(p);
        Self {
            origin,
            direction: d.to_array(),
            major,
            across: [p * sign, -q * sign, p, -r],
            inverse_length_squared,
        }
    }
}
