//! Numbers that are the same in every run, for benches that make things at random.

use glam::DVec3;

use crate::split_mix::step;

/// Numbers by SplitMix64.
pub struct Random(pub u64);

impl Random {
    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (step(&mut self.0) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In the cube from −1 to 1.
    pub fn cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}
