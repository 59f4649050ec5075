//! Finds the body of glass around a lamp: paths meet a lamp within glass by chance alone.

use glam::DVec3;
use raywright_bvh::Aabb;

use super::directions::directions_in_cone;
use super::facts::{SceneFacts, SurfaceKind};

/// Bodies of glass that are considered, by their order in the scene.
const BODIES: usize = 1000;
/// Surfaces that a ray from a lamp crosses at most.
const HITS: usize = 64;
/// Rays from a lamp.
const RAYS: usize = 14;
/// Rays that cross a body which is around the lamp; the body may have holes.
const CROSSINGS: usize = 12;

/// The bodies of glass of a scene, each by the index of its facts, with its bounding box.
pub(super) struct GlassBodies {
    bodies: Vec<(usize, Aabb)>,
}

impl GlassBodies {
    pub fn from_scene(scene_facts: &SceneFacts<'_>) -> Self {
        let objects = scene_facts.objects.iter().enumerate();
        let bodies = objects
            .filter(|(_, object)| object.surface_kind == SurfaceKind::Body)
            .filter_map(|(index, object)| Some((index, object.bounds?)))
            .take(BODIES)
            .collect();
        Self { bodies }
    }

    /// The index of the first body around an object whose bounding box is `inner`. The box of that
    /// body contains `inner`, and nearly all rays from the centre of `inner` cross the body.
    ///
    /// `closest_hit` takes the start of a ray, its direction and the least distance. It returns the
    /// object that the ray hits first, and the distance to the hit.
    pub fn find_around(
        &self,
        inner: &Aabb,
        closest_hit: impl Fn(DVec3, DVec3, f64) -> Option<(usize, f64)>,
    ) -> Option<usize> {
        let contains_inner =
            |outer: &Aabb| outer.min.cmplt(inner.min).all() && outer.max.cmpgt(inner.max).all();
        let crosses = |body: usize, direction: DVec3| {
            let mut distance = 0.0;
            for _ in 0..HITS {
                match closest_hit(inner.centre(), direction, distance) {
                    Some((object, _)) if object == body => return true,
                    Some((_, hit_distance)) => distance = hit_distance,
                    None => return false,
                }
            }
            false
        };
        let is_around = |body: usize| {
            let directions = directions_in_cone(DVec3::Y, -1.0, RAYS);
            let crossings = directions.filter(|&direction| crosses(body, direction));
            crossings.count() >= CROSSINGS
        };
        let mut candidates = self.bodies.iter();
        let around = candidates.find(|(body, outer)| contains_inner(outer) && is_around(*body));
        around.map(|(body, _)| *body)
    }
}
