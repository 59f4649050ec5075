//! Copies of one generator that overlap: a ray enters a copy while it is inside another one.

use raywright_bvh::{Hit, Real};

use super::facts::{SceneFacts, SurfaceKind};
use super::ray_survey::{RayPoint, RaySurvey, record_sighting};

/// Least length of a ray in both copies, as a share of the ray's length. Copies that touch may be
/// crossed in any order.
const OVERLAP: f64 = 1e-4;

/// The copies of generators that a ray has entered.
#[derive(Debug, Default)]
pub(super) struct CopyCrossings {
    entries: Vec<CopyEntry>,
    /// Generators whose overlap is recorded already.
    recorded: Vec<usize>,
}

/// The point at which a ray enters a copy, and the copy: its generator, and its index among all
/// objects.
#[derive(Debug)]
struct CopyEntry {
    generator: usize,
    copy: u32,
    point: RayPoint,
}

impl CopyCrossings {
    /// Records that a ray enters or leaves the surface of a hit. `object` is the index of its facts.
    /// An overlap is recorded where the ray leaves a copy: at touching copies, rounding may hide
    /// that from the ray.
    pub fn cross_surface<R: Real>(
        &mut self,
        scene_facts: &SceneFacts<'_>,
        hit: &Hit<R>,
        (object, enters): (usize, bool),
        point: RayPoint,
        survey: &mut RaySurvey,
    ) {
        let object_facts = &scene_facts.objects[object];
        let is_body = object_facts.surface_kind == SurfaceKind::Body;
        if object < scene_facts.scene.objects.len() || !is_body || object_facts.hides_back_faces() {
            return;
        }
        let copy = hit.outermost_id();
        if enters {
            return self.entries.push(CopyEntry {
                generator: object,
                copy,
                point,
            });
        }
        let of_copy = self.entries.iter().rfind(|entry| entry.copy == copy);
        let Some(start) = of_copy.map(|entry| entry.point.distance) else {
            return;
        };
        let end = point.distance * (1.0 - OVERLAP);
        let is_between = |entry: &&CopyEntry| {
            let distance = entry.point.distance;
            entry.generator == object && entry.copy != copy && (start..end).contains(&distance)
        };
        if !self.recorded.contains(&object)
            && let Some(entry) = self.entries.iter().find(is_between)
        {
            record_sighting(&mut survey.nested, [object; 2], entry.point);
            self.recorded.push(object);
        }
    }
}
