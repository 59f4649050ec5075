//! Observations of a camera's rays. Each is a number of rays and the nearest position at which one
//! was made. Sums of observations do not depend on the order of the rays.

use std::collections::BTreeMap;

use glam::DVec3;

use super::finding::CheckRun;

/// A point on a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayPoint {
    pub ray: u64,
    pub position: DVec3,
    /// Distance from the ray's origin, in metres.
    pub distance: f64,
}

/// A surface on a ray: its object, its primitive, and the point.
#[derive(Clone, Copy)]
pub(super) struct SurfaceOnRay {
    pub object: usize,
    pub primitive: u32,
    pub point: RayPoint,
}

/// Number of rays that made the same observation, and the position of the nearest one.
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

/// Observations, by the object, pair of objects or material value that they concern.
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

/// Records a value if it is the greatest of its key.
pub(super) fn record_maximum<K: Ord>(greatest: &mut BTreeMap<K, f64>, key: K, value: f64) {
    let known = greatest.entry(key).or_insert(value);
    *known = known.max(value);
}

/// A value of a material: the index of the material and the name of the value in the scene file.
pub(crate) type ValueKey = (usize, &'static str);

/// Results of the rays of a camera, or of several cameras. Objects are indices in
/// `SceneFacts::objects`.
#[derive(Clone, Debug, Default)]
pub(crate) struct RaySurvey {
    pub rays: u64,
    pub planned: u64,
    /// Number of rays that hit an object.
    pub hits: u64,
    /// `sightings`: rays that cross an object, also behind other surfaces. `first_hits`: rays that hit
    /// it first.
    pub sightings: SightingCounts<usize>,
    pub first_hits: SightingCounts<usize>,
    /// Rays that first hit the inside of an object.
    pub first_within: SightingCounts<usize>,
    /// Rays that leave a body once more often than they enter it, while the camera is inside the
    /// body.
    pub bodies_around_camera: SightingCounts<usize>,
    /// Rays that enter a body without leaving it, or leave it without entering it.
    pub unbalanced: SightingCounts<usize>,
    /// Rays that enter a body within another body: the outer and the inner one.
    pub nested: SightingCounts<[usize; 2]>,
    /// Rays that hit glass in place of an opaque object that it touches: the glass, and the object.
    pub contacts_lost: SightingCounts<[usize; 2]>,
    /// Rays that enter a body while they are in as many others as a path knows at once.
    pub beyond_most_bodies: SightingCounts<usize>,
    /// Rays whose first two hits coincide and belong to two objects, in this order.
    pub coincident: SightingCounts<[usize; 2]>,
    /// Greatest separation of the surfaces of a pair in `coincident`, in metres.
    pub max_separations: BTreeMap<[usize; 2], f64>,
    /// Rays whose first hit lies in the overlap of two coplanar objects. The object that was hit
    /// comes first.
    pub coplanar: SightingCounts<[usize; 2]>,
    /// Rays whose first surface is a back that is hidden from the camera.
    pub hidden_backs_hit: SightingCounts<usize>,
    /// Rays whose first surface is a triangle of a one-sided object with the wrong orientation:
    /// flipped and hidden from the camera, flipped and visible, or of a part that is inside out and
    /// hidden from the camera.
    pub flipped_hidden: SightingCounts<usize>,
    pub flipped_shown: SightingCounts<usize>,
    pub inside_out_hidden: SightingCounts<usize>,
    /// Rays that hit a triangle whose vertex normals point to its opposite side.
    pub opposed_normals: SightingCounts<usize>,
    pub spawned_rays: u64,
    pub self_hits: SightingCounts<usize>,
    /// Rays that start at a surface and hit a parallel one less than the rounding errors away: the
    /// objects of both, which may be the same.
    pub twin_shadows: SightingCounts<[usize; 2]>,
    pub starts_behind_surface: SightingCounts<usize>,
    pub not_numbers: SightingCounts<ValueKey>,
    /// Rays that find a base colour above 1, by the index of the material, and the greatest of these
    /// colours.
    pub colours_above_one: SightingCounts<usize>,
    pub greatest_colours: BTreeMap<usize, f64>,
}

impl RaySurvey {
    /// Adds the results of other rays.
    #[must_use]
    pub fn combine(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.planned += other.planned;
        self.hits += other.hits;
        self.spawned_rays += other.spawned_rays;
        for (own, others) in [
            (&mut self.sightings, other.sightings),
            (&mut self.first_hits, other.first_hits),
            (&mut self.first_within, other.first_within),
            (&mut self.bodies_around_camera, other.bodies_around_camera),
            (&mut self.unbalanced, other.unbalanced),
            (&mut self.beyond_most_bodies, other.beyond_most_bodies),
            (&mut self.hidden_backs_hit, other.hidden_backs_hit),
            (&mut self.flipped_hidden, other.flipped_hidden),
            (&mut self.flipped_shown, other.flipped_shown),
            (&mut self.inside_out_hidden, other.inside_out_hidden),
            (&mut self.opposed_normals, other.opposed_normals),
            (&mut self.self_hits, other.self_hits),
            (&mut self.starts_behind_surface, other.starts_behind_surface),
            (&mut self.colours_above_one, other.colours_above_one),
        ] {
            others
                .into_iter()
                .for_each(|(key, sighting)| merge_sighting(own, key, sighting));
        }
        for (own, others) in [
            (&mut self.nested, other.nested),
            (&mut self.contacts_lost, other.contacts_lost),
            (&mut self.twin_shadows, other.twin_shadows),
            (&mut self.coincident, other.coincident),
            (&mut self.coplanar, other.coplanar),
        ] {
            others
                .into_iter()
                .for_each(|(key, sighting)| merge_sighting(own, key, sighting));
        }
        for (key, sighting) in other.not_numbers {
            merge_sighting(&mut self.not_numbers, key, sighting);
        }
        for (material, value) in other.greatest_colours {
            record_maximum(&mut self.greatest_colours, material, value);
        }
        for (pair, apart) in other.max_separations {
            record_maximum(&mut self.max_separations, pair, apart);
        }
        self
    }

    /// Returns the number of rays that made an observation.
    pub fn sighting_count<K: Ord>(of: &SightingCounts<K>, key: &K) -> u64 {
        of.get(key).map_or(0, |sighting| sighting.count)
    }

    /// Decides for each body in `within` whether the camera is inside it: nearly all rays leave
    /// such a body. The observations of the other bodies move to `unbalanced`.
    pub(super) fn separate_bodies_around_camera(&mut self) {
        const NEARLY: f64 = 0.9;
        let rays = self.rays as f64;
        let (within, unseen) = core::mem::take(&mut self.bodies_around_camera)
            .into_iter()
            .partition(|(_, left)| left.count as f64 > NEARLY * rays);
        self.bodies_around_camera = within;
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
