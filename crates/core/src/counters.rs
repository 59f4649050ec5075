//! What a render did, counted per worker and summed at the end.

use core::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Surfaces that the rays of a sample may pass as they go on unchanged, because nothing is there,
/// or a part, or the same on both sides. It is no segment of a path, and a limit only so that there
/// is an end: rays that reach it are counted.
pub(crate) const MOST_PASSAGES: u32 = 1 << 13;

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
    /// Paths that went on by a mirror, or a lobe as narrow, or through glass after they had been
    /// scattered: lamps and suns that they meet can't be asked for, so that such light is found by
    /// chance alone. Counted where there are lamps, and where a sky has small bright parts.
    #[serde(default)]
    pub unaided: u64,
    /// Lamps, and small bright parts of a sky, met by such paths.
    #[serde(default)]
    pub found: u64,
    /// Samples that entered the film.
    pub samples: u64,
    /// Samples dropped because they were not finite.
    pub dropped: u64,
    /// Rays that ended because those of their sample had passed as many surfaces as they may that
    /// were not there, or there in part.
    #[serde(default)]
    pub cut_short: u64,
    /// Samples whose camera ray met something.
    pub met: u64,
}

/// What is not in a picture, though it was to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleLoss {
    /// Samples were dropped because they were not finite.
    NotFinite {
        /// How many.
        dropped: u64,
        /// Of so many.
        of: u64,
    },
    /// Rays ended because those of their sample had passed as many surfaces as they may that were
    /// not there, or there in part.
    CutShort {
        /// How many.
        rays: u64,
        /// Surfaces that the rays of a sample may pass.
        most: u32,
    },
}

impl Counters {
    /// What was lost of the samples.
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
        self.cut_short += other.cut_short;
        self.met += other.met;
    }
}
