//! Numbers of rays and samples of a render. Each thread counts its own, and the counts are added at
//! the end.

use core::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Largest number of surfaces that the rays of a sample may pass straight through. Such surfaces
/// have an alpha below 1 or lie between equal media, and passing them starts no new path segment.
/// The limit only guarantees termination. Rays that reach it are counted.
pub(crate) const MOST_PASSAGES: u32 = 1 << 13;

/// Numbers of rays by kind, and numbers of samples that were added to the film or dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Number of camera rays.
    pub camera: u64,
    /// Number of mirror-reflected rays.
    pub reflection: u64,
    /// Number of refracted rays.
    pub refraction: u64,
    /// Number of rays scattered into a random direction.
    pub scatter: u64,
    /// Number of shadow rays.
    pub shadow: u64,
    /// Number of paths that may find caustics. Such a path continued, after a diffuse bounce, by a
    /// mirror, a nearly specular lobe or glass. A lamp or sun that it hits then cannot be sampled
    /// directly. Counted only if the scene has lamps or a sky with small bright parts.
    #[serde(default)]
    pub unaided: u64,
    /// Number of times that the paths counted in `unaided` hit a lamp or a small bright part of the
    /// sky.
    #[serde(default)]
    pub found: u64,
    /// Number of path segments that find light by chance alone. A wider lobe spread the path before,
    /// and its latest lobe is far denser than the light sample: hardly any light sample stands in
    /// for what the segment hits.
    #[serde(default)]
    pub narrow: u64,
    /// Sum over the segments counted in `narrow` of the squared radiance that a hit of the sampled
    /// light would bring, in units of 1/1024.
    #[serde(default)]
    pub narrow_power: u64,
    /// Sum of the squared radiance that these segments found, in the same units.
    #[serde(default)]
    pub narrow_found: u64,
    /// Number of samples that were added to the film.
    pub samples: u64,
    /// Number of samples dropped because their value was not finite.
    pub dropped: u64,
    /// Number of rays that ended early. The rays of their sample had passed the largest number of
    /// surfaces with an alpha below 1 or between equal media.
    #[serde(default)]
    pub cut_short: u64,
    /// Number of samples whose camera ray hit a surface.
    #[serde(rename = "met")]
    pub hits: u64,
    /// Densities of media below zero or above their stated maximum.
    #[serde(default, skip_serializing_if = "DensityExcess::is_empty")]
    pub excess: DensityExcess,
}

/// Points at which the density of a medium was below zero, above the stated maximum, or not a
/// number: how many, and the worst. Numbers are kept as bits, whose order is that of positive
/// numbers, so that sums do not depend on their order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct DensityExcess {
    /// Number of such points.
    pub count: u64,
    worst: [u64; 5],
}

/// Bit of a material's word that tells a density below zero.
const NEGATIVE: u64 = 1 << 63;

impl DensityExcess {
    /// One point, in world coordinates. `density` is relative to the stated maximum, and `material`
    /// is that of the body, `None` for the air.
    pub(crate) fn new(material: Option<u32>, density: f64, point: [f64; 3]) -> Self {
        let [x, y, z] = point.map(f64::to_bits);
        let material = material.map_or(0, |material| 1 + u64::from(material));
        let sign = if density < 0.0 { NEGATIVE } else { 0 };
        Self {
            count: 1,
            worst: [density.abs().to_bits(), material | sign, x, y, z],
        }
    }

    fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the density that is farthest from its bounds, relative to its stated maximum.
    pub fn ratio(&self) -> f64 {
        let [size, material, ..] = self.worst;
        let sign = if material & NEGATIVE == 0 { 1.0 } else { -1.0 };
        sign * f64::from_bits(size)
    }

    /// Returns the path, in the scene file, of the medium with this density.
    pub fn owner(&self) -> String {
        match (self.worst[1] & !NEGATIVE).checked_sub(1) {
            Some(material) => format!("materials[{material}].model.physical.interior"),
            None => "air".to_owned(),
        }
    }

    /// Returns the point of this density, in world coordinates.
    pub fn point(&self) -> [f64; 3] {
        let [_, _, x, y, z] = self.worst;
        [x, y, z].map(f64::from_bits)
    }
}

impl AddAssign for DensityExcess {
    fn add_assign(&mut self, other: Self) {
        self.count += other.count;
        self.worst = self.worst.max(other.worst);
    }
}

/// Number of units of a squared radiance of one. Sums of integers do not depend on their order.
pub(crate) const POWER_UNITS: f64 = 1024.0;

/// Adds a squared radiance to a sum in units of 1/[`POWER_UNITS`], which it may fill.
pub(crate) fn add_power(sum: &mut u64, radiance: f64) {
    *sum = sum.saturating_add((radiance * radiance * POWER_UNITS) as u64);
}

impl Counters {
    /// Returns the number of rays of all kinds.
    pub fn ray_count(&self) -> u64 {
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
        self.narrow += other.narrow;
        self.narrow_power = self.narrow_power.saturating_add(other.narrow_power);
        self.narrow_found = self.narrow_found.saturating_add(other.narrow_found);
        self.samples += other.samples;
        self.dropped += other.dropped;
        self.cut_short += other.cut_short;
        self.hits += other.hits;
        self.excess += other.excess;
    }
}
