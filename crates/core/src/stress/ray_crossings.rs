//! Surfaces that a ray crosses, and what their order says.

use std::collections::BTreeMap;

use raywright_bvh::{Ray, Real, Surface, Vector};

use super::ray_survey::{RayPoint, RaySurvey, record_sighting};

/// A surface that a ray crosses.
pub(super) struct RayCrossing<R: Real> {
    pub object: usize,
    pub surface: Surface<R>,
    pub enters: bool,
}

/// Returns the separation of two successive surfaces on a ray, in metres. Returns `None` if they
/// belong to one object, or if their separation exceeds the error of the hits.
pub(super) fn coincident_distance<R: Real>(
    ray: &Ray<R>,
    first: &RayCrossing<R>,
    second: &RayCrossing<R>,
) -> Option<f64> {
    let (a, b) = (&first.surface, &second.surface);
    let [m, n] = [a.normal.to_f64(), b.normal.to_f64()];
    let apart = (b.point.to_f64() - a.point.to_f64()).dot(m).abs();
    let error = 2.0 * (a.error.to_f64() + b.error.to_f64());
    let is_slanted = m.dot(ray.direction.to_f64()).abs() > 0.05;
    let is_one = is_slanted && m.dot(n).abs() > 1.0 - 1e-6 && apart <= error;
    (first.object != second.object && is_one).then_some(apart)
}

/// Records the bodies that a ray entered and left unequally often, at the end of the ray.
pub(super) fn record_unclosed_bodies(
    depths: &BTreeMap<usize, i64>,
    hits: &[(usize, RayPoint)],
    survey: &mut RaySurvey,
) {
    for (&object, &depth) in depths.iter().filter(|(_, depth)| **depth != 0) {
        let of = if depth == -1 {
            &mut survey.bodies_around_camera
        } else {
            &mut survey.unbalanced
        };
        if let Some(&(_, seen)) = hits.iter().find(|(other, _)| *other == object) {
            record_sighting(of, object, seen);
        }
    }
}
