//! Rays between the lights of a scene and its surfaces.

use glam::DVec3;
use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use super::RayDeadline;
use super::facts::SceneFacts;
use super::ray_hits::{HITS, hits_along_ray};
use crate::prepare::PreparedScene;

/// Traces rays from lights and to lights in a prepared scene, for the camera at `eye`.
pub(super) struct LightTracer<'a, R: Real> {
    pub prepared: &'a PreparedScene<R>,
    pub scene_facts: &'a SceneFacts<'a>,
    pub eye: DVec3,
    pub deadline: &'a RayDeadline<'a>,
}

/// A surface point that the camera sees. The normal points to the camera's side.
pub(super) struct VisiblePoint {
    pub position: DVec3,
    pub normal: DVec3,
}

impl<R: Real> LightTracer<'_, R> {
    /// Returns the closest hit of a ray in world space, between two distances.
    pub fn closest(&self, from: DVec3, direction: DVec3, range: [f64; 2]) -> Option<Hit<R>> {
        let (ray, range) = self.stored_ray(from, direction, range);
        self.prepared.geometry.closest(&ray, range, &mut ())
    }

    /// Follows a ray in world space through surfaces. Calls `find` with the object of each hit and
    /// its distance, until `find` returns a value. Returns that value.
    pub fn find_along_ray<T>(
        &self,
        from: DVec3,
        direction: DVec3,
        range: [f64; 2],
        mut find: impl FnMut(usize, f64) -> Option<T>,
    ) -> Option<T> {
        let (ray, range) = self.stored_ray(from, direction, range);
        let mut hits = hits_along_ray(&self.prepared.geometry, &ray, range).take(HITS);
        hits.find_map(|hit| find(self.facts_index(&hit), hit.t.to_f64()))
    }

    fn stored_ray(
        &self,
        from: DVec3,
        direction: DVec3,
        [min, max]: [f64; 2],
    ) -> (Ray<R>, Interval<R>) {
        let from = from - self.prepared.origin.origin;
        let [start, direction] = [from, direction].map(R::Vec3::from_f64);
        let [min, max] = [min, max].map(R::from_f64);
        (Ray::new(start, direction), Interval { min, max })
    }

    /// Returns the index of the facts of the object that was hit.
    pub fn facts_index(&self, hit: &Hit<R>) -> usize {
        self.scene_facts.facts_index(hit.outermost_id())
    }
}
