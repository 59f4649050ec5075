//! What rays of a camera saw: how many of them, and where the first did, so that sums do not depend
//! on the order of rays.

use std::collections::BTreeMap;

use glam::DVec3;

use super::finding::CheckRun;

/// A point on the way of a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayPoint {
    pub ray: u64,
    pub position: DVec3,
    /// From where the ray starts, in metres.
    pub distance: f64,
}

/// Rays that saw something, and the nearest place where one did.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SightingCount {
    pub count: u64,
    pub position: DVec3,
    ray: u64,
    distance: f64,
}

impl From<RayPoint> for SightingCount {
    fn from(at: RayPoint) -> Self {
        let RayPoint {
            ray,
            position,
            distance,
        } = at;
        Self {
            count: 1,
            position,
            ray,
            distance,
        }
    }
}

/// Sightings by what they are of.
pub(crate) type SightingCounts<K> = BTreeMap<K, SightingCount>;

pub(super) fn record_sighting<K: Ord>(sightings: &mut SightingCounts<K>, key: K, at: RayPoint) {
    merge_sighting(sightings, key, at.into());
}

fn merge_sighting<K: Ord>(sightings: &mut SightingCounts<K>, key: K, other: SightingCount) {
    let sighting = sightings
        .entry(key)
        .or_insert(SightingCount { count: 0, ..other });
    let count = sighting.count + other.count;
    if (other.distance, other.ray) < (sighting.distance, sighting.ray) {
        *sighting = other;
    }
    sighting.count = count;
}

/// Keeps a value where it is the greatest of its key.
pub(super) fn record_maximum<K: Ord>(greatest: &mut BTreeMap<K, f64>, key: K, value: f64) {
    let known = greatest.entry(key).or_insert(value);
    *known = known.max(value);
}

/// A value of a material, by its key in the scene.
pub(crate) type ValueKey = (usize, &'static str);

/// What rays of a camera saw. Objects are named by their facts.
#[derive(Clone, Debug, Default)]
pub(crate) struct RaySurvey {
    pub rays: u64,
    pub planned: u64,
    /// Rays that met anything.
    pub hits: u64,
    /// Rays on whose way an object is, and rays that see it first.
    pub sightings: SightingCounts<usize>,
    pub first: SightingCounts<usize>,
    /// Rays that see it first from within.
    pub first_within: SightingCounts<usize>,
    /// Rays that leave a body once more often than they enter it, of a camera within.
    pub within: SightingCounts<usize>,
    /// Rays that enter a body and do not leave it, or leave it and did not enter it.
    pub unbalanced: SightingCounts<usize>,
    /// Bodies that rays enter within another one.
    pub nested: SightingCounts<[usize; 2]>,
    /// The first surface of a ray and the next one, where they are in one place and of two objects.
    pub coincident: SightingCounts<[usize; 2]>,
    /// How far apart these are at most, in metres.
    pub apart: BTreeMap<[usize; 2], f64>,
    /// Rays that see the first of two objects where both have a face in one plane.
    pub coplanar: SightingCounts<[usize; 2]>,
    /// Backs that the camera looks through.
    pub backs: SightingCounts<usize>,
    /// Vertex normals that point to the other side than what is hit.
    pub against: SightingCounts<usize>,
    pub starts: u64,
    pub self_hits: SightingCounts<usize>,
    pub beyond: SightingCounts<usize>,
    pub not_numbers: SightingCounts<ValueKey>,
    pub out_of_range: SightingCounts<ValueKey>,
    /// The greatest of those that are out of range.
    pub greatest: BTreeMap<ValueKey, f64>,
}

impl RaySurvey {
    /// Adds what other rays saw.
    #[must_use]
    pub fn combine(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.planned += other.planned;
        self.hits += other.hits;
        self.starts += other.starts;
        for (own, others) in [
            (&mut self.sightings, other.sightings),
            (&mut self.first, other.first),
            (&mut self.first_within, other.first_within),
            (&mut self.within, other.within),
            (&mut self.unbalanced, other.unbalanced),
            (&mut self.backs, other.backs),
            (&mut self.against, other.against),
            (&mut self.self_hits, other.self_hits),
            (&mut self.beyond, other.beyond),
        ] {
            others
                .into_iter()
                .for_each(|(key, sighting)| merge_sighting(own, key, sighting));
        }
        for (own, others) in [
            (&mut self.nested, other.nested),
            (&mut self.coincident, other.coincident),
            (&mut self.coplanar, other.coplanar),
        ] {
            others
                .into_iter()
                .for_each(|(key, sighting)| merge_sighting(own, key, sighting));
        }
        for (own, others) in [
            (&mut self.not_numbers, other.not_numbers),
            (&mut self.out_of_range, other.out_of_range),
        ] {
            others
                .into_iter()
                .for_each(|(key, sighting)| merge_sighting(own, key, sighting));
        }
        for (key, value) in other.greatest {
            record_maximum(&mut self.greatest, key, value);
        }
        for (pair, apart) in other.apart {
            record_maximum(&mut self.apart, pair, apart);
        }
        self
    }

    /// How often something was seen.
    pub fn sighting_count<K: Ord>(of: &SightingCounts<K>, key: &K) -> u64 {
        of.get(key).map_or(0, |sighting| sighting.count)
    }

    /// Of a camera's rays, tells those of a camera within a body, which nearly all leave it, from
    /// those that came into it unseen.
    pub(super) fn separate_camera_body(&mut self) {
        const NEARLY: f64 = 0.9;
        let rays = self.rays as f64;
        let (within, unseen) = core::mem::take(&mut self.within)
            .into_iter()
            .partition(|(_, left)| left.count as f64 > NEARLY * rays);
        self.within = within;
        let unseen: SightingCounts<usize> = unseen;
        unseen
            .into_iter()
            .for_each(|(object, sighting)| merge_sighting(&mut self.unbalanced, object, sighting));
    }

    pub fn to_check_run(&self) -> CheckRun {
        CheckRun {
            name: "rays of the cameras",
            looked_at: self.rays,
            unit: "rays",
            planned: self.planned,
        }
    }
}
