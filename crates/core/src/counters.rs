//! What a render did, counted per worker and summed at the end.

use core::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Rays by kind and samples by fate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Rays from the camera.
    pub camera: u64,
    /// Mirror-reflected rays.
    pub reflection: u64,
    /// Refracted rays.
    pub refraction: u64,
    /// Rays scattered into a random direction.
    pub scatter: u64,
    /// Rays towards lights.
    pub shadow: u64,
    /// Paths that went on by a mirror, or a lobe as narrow, or through glass after they had been scattered: lamps and suns that they meet can't
    /// be asked for, so that such light is found by chance alone. Counted where there are lamps, and where a sky has small bright parts.
    #[serde(default)]
    pub unaided: u64,
    /// Lamps, and small bright parts of a sky, met by such paths.
    #[serde(default)]
    pub found: u64,
    /// Samples that entered the film.
    pub samples: u64,
    /// Samples dropped because they were not finite.
    pub dropped: u64,
    /// Samples whose camera ray met something.
    pub met: u64,
}

impl Counters {
    /// Rays of all kinds.
    pub fn rays(&self) -> u64 {
        self.camera + self.reflection + self.refraction + self.scatter + self.shadow
    }
}

impl AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.camera += other.camera;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
        self.scatter += other.scatter;
        self.shadow += other.shadow;
        self.unaided += other.unaided;
        self.found += other.found;
        self.samples += other.samples;
        self.dropped += other.dropped;
        self.met += other.met;
    }
}
