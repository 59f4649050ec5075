//! A ray as the exact test of triangles in registers knows it.

use glam::DVec3;

use crate::shapes::PreparedRay;

/// What the exact test needs of a ray. The projection across it is that of [`PreparedRay`], of
/// whose six numbers two are zero and four are components of the direction: with the axes turned so
/// that the direction's largest component comes first, (p, q, r), a corner's two coordinates are
/// q·a + p·b and r·c + p·d.
#[derive(Clone, Copy)]
pub(crate) struct ProjectedRay {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
    /// The axis of the direction's largest component; the two that follow it come next.
    pub major: usize,
    /// The four numbers, as above.
    pub across: [f64; 4],
    pub inverse_length_squared: f64,
}

/// Rounding could have taken the sign of an edge function, or the face is seen edge-on: the test of
/// single triangles decides.
pub(super) struct Unsure;

/// What belongs to an axis and to the two that follow it.
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

    /// The same as a probe.
    #[inline(always)]
    pub fn of(probe: &PreparedRay) -> Self {
        Self::with(
            probe.origin.to_array(),
            probe.direction,
            probe.inverse_length_squared,
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
