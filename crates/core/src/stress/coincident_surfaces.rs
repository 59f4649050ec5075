//! Surfaces of two objects in one place. On a long ray the distances of both may round to one
//! number, of which a query returns one hit alone. A short ray across the place resolves them.

use raywright_bvh::{Hit, Interval, Ray, Real};

use super::ray_crossings::coincident_distance;
use super::ray_hits::{PLACE_HITS, PLACE_REACH, hits_along_ray};
use super::ray_survey::{RaySurvey, record_maximum, record_sighting};
use super::rays::SurveyRayTracer;

impl<R: Real> SurveyRayTracer<'_, R> {
    /// Records the objects whose surfaces coincide with the first hit of a camera's ray.
    pub fn survey_coincident_surface(
        &self,
        ray: &Ray<R>,
        hit: &Hit<R>,
        index: u64,
        survey: &mut RaySurvey,
    ) {
        let geometry = &self.prepared.geometry;
        let first = self.ray_crossing(ray, hit);
        let seen = self.sighted_point(&first.surface, hit, index);
        let half = first.surface.error * R::from_f64(PLACE_REACH);
        let short = Ray {
            origin: first.surface.point - ray.direction * half,
            ..*ray
        };
        let range = Interval {
            min: R::ZERO,
            max: half + half,
        };
        let mut found: Vec<usize> = Vec::new();
        for hit in hits_along_ray(geometry, &short, range).take(PLACE_HITS) {
            let other = self.ray_crossing(&short, &hit);
            let apart = coincident_distance(ray, &first, &other);
            if let Some(apart) = apart.filter(|_| !found.contains(&other.object)) {
                let pair = [first.object, other.object];
                record_sighting(&mut survey.coincident, pair, seen);
                record_maximum(&mut survey.max_separations, pair, apart);
                found.push(other.object);
            }
        }
    }
}
