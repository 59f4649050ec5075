//! Repeatable random numbers for benches.

use glam::DVec3;

use crate::split_mix::step;

/// SplitMix64.
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (step(&mut self.0) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in the cube [−1, 1]³.
    pub fn cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}
