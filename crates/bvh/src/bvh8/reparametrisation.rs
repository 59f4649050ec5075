//! Distances along a ray of an instance's space, from where the walk in f32 starts and in its unit.

use glam::DVec3;

use crate::aabb::Aabb;

/// 2⁻²⁴.
const U: f64 = 5.960_464_477_539_063e-8;

/// A distance t is (t − start) · scale to the walk.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayReparametrisation {
    pub start: f64,
    /// A power of two.
    pub scale: f64,
}

impl RayReparametrisation {
    /// Starts where the ray comes to the sphere around the box, or at `near` where that is later, so that no distance that counts
    /// is below zero. Steps are of about unit length.
    pub fn new(origin: DVec3, direction: DVec3, near: f64, bounds: &Aabb) -> Self {
        let squared = direction.length_squared();
        let (middle, length) = ((bounds.centre() - origin).dot(direction) / squared, squared.sqrt());
        let sphere = middle - (bounds.extent().length() * 0.51 / length + middle.abs() * 1e-12);
        // What is stored as more than `near` may be that much less.
        let start = sphere.max(near - near.abs() * (2.0 * U));
        // The greatest power of two that is not above the length: its exponent alone.
        let scale = f64::from_bits(length.to_bits() & 0x7ff << 52);
        let sane = start.is_finite() && scale.is_normal();
        if sane { Self { start, scale } } else { Self { start: 0.0, scale: 1.0 } }
    }

    /// A distance as the walk has it, rounded to the nearest.
    pub fn rebased(&self, t: f64) -> f32 {
        ((t - self.start) * self.scale) as f32
    }

    /// A far end: later than all that rounds to a stored distance up to it.
    pub fn far(&self, t: f32) -> f32 {
        let t = f64::from(t);
        self.rebased(t + (t.abs() + self.start.abs()) * (2.0 * U)).next_up()
    }
}
