//! Finds the glass body around a lamp. Paths hit a lamp inside glass only by chance.

use glam::DVec3;
use raywright_bvh::Aabb;

use super::directions::directions_in_cone;
use super::facts::{SceneFacts, SurfaceKind};

/// Greatest number of glass bodies that are considered, in the order of the scene.
const BODIES: usize = 1000;
/// Number of rays from a lamp, and number of them that must cross a body around it. The body may
/// have holes.
const RAYS: usize = 14;
const CROSSINGS: usize = 12;

/// Glass bodies of a scene: the index of each body's facts, and its bounding box.
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

    /// Returns the index of the first body around an object with the bounding box `inner`. The box
    /// of that body contains `inner`, and nearly all rays from the centre of `inner` cross the body.
    /// `crosses` returns whether the ray with a start and a direction crosses a body.
    pub fn find_around(
        &self,
        inner: &Aabb,
        crosses: impl Fn(usize, DVec3, DVec3) -> bool,
    ) -> Option<usize> {
        let contains_inner =
            |outer: &Aabb| outer.min.cmplt(inner.min).all() && outer.max.cmpgt(inner.max).all();
        let is_around = |body: usize| {
            let directions = directions_in_cone(DVec3::Y, -1.0, RAYS);
            let crossings =
                directions.filter(|&direction| crosses(body, inner.centre(), direction));
            crossings.count() >= CROSSINGS
        };
        let mut candidates = self.bodies.iter();
        let around = candidates.find(|(body, outer)| contains_inner(outer) && is_around(*body));
        around.map(|(body, _)| *body)
    }
}
