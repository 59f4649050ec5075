//! Directions of the rays that leave a light.

use glam::DVec3;

/// Returns directions spread evenly over a cone. `lowest` is the cosine of its half angle.
pub(super) fn directions_in_cone(
    axis: DVec3,
    lowest: f64,
    count: usize,
) -> impl Iterator<Item = DVec3> {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let (x, y) = axis.any_orthonormal_pair();
    (0..count).map(move |i| {
        let z = 1.0 - (1.0 - lowest) * (i as f64 + 0.5) / count as f64;
        let (sin, cos) = libm::sincos(GOLDEN_ANGLE * i as f64);
        let ring = (1.0 - z * z).max(0.0).sqrt();
        axis * z + x * (ring * cos) + y * (ring * sin)
    })
}
