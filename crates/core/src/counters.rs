//! Counts of a render's work: counted per worker, summed at the end.

use core::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Limit on the surfaces that the rays of a sample may pass unchanged: fully or partly transparent
/// coverage, or a boundary between equal media. Such a passage is no segment of a path. The limit
/// only guarantees termination; rays that reach it are counted.
pub(crate) const MOST_PASSAGES: u32 = 1 << 13;

/// Rays by kind, and samples kept and dropped.
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
    /// Paths that continued by a mirror, a lobe as narrow, or glass after a diffuse scattering
    /// event. Lamps and suns that such a path hits cannot be sampled directly, so their light is
    /// found by chance alone. Counted where the scene has lamps or a sky with small bright parts.
    #[serde(default)]
    pub unaided: u64,
    /// Lamps, and small bright parts of a sky, that such paths hit.
    #[serde(default)]
    pub found: u64,
    /// Samples that entered the film.
    pub samples: u64,
    /// Samples dropped because their value was not finite.
    pub dropped: u64,
    /// Rays that ended because the rays of their sample had passed the greatest number of surfaces
    /// with no or partial coverage.
    #[serde(default)]
    pub cut_short: u64,
    /// Samples whose camera ray hit a surface.
    #[serde(rename = "met")]
    pub hits: u64,
}

/// Loss of samples or rays, to be reported with the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleLoss {
    /// Samples dropped because their value was not finite.
    NotFinite {
        /// Number of dropped samples.
        dropped: u64,
        /// Number of all samples.
        of: u64,
    },
    /// Rays that ended because the rays of their sample had passed the greatest number of surfaces
    /// with no or partial coverage.
    CutShort {
        /// Number of rays.
        rays: u64,
        /// Greatest number of surfaces that the rays of a sample may pass.
        most: u32,
    },
}

impl Counters {
    /// Returns the losses that occurred.
    pub fn losses(&self) -> impl Iterator<Item = SampleLoss> + use<> {
        let Self {
            samples,
            dropped,
            cut_short: rays,
            ..
        } = *self;
        let not_finite = (dropped > 0).then_some(SampleLoss::NotFinite {
            dropped,
            of: samples + dropped,
        });
        let cut_short = (rays > 0).then_some(SampleLoss::CutShort {
            rays,
            most: MOST_PASSAGES,
        });
        not_finite.into_iter().chain(cut_short)
    }

    /// Returns the number of rays of all kinds.
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
        self.cut_short += other.cut_short;
        self.hits += other.hits;
    }
}
