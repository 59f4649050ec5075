//! Facts about emissive objects, from rays. For a lamp in glass: the light that it would send to the
//! visible surfaces if the glass were absent. Paths that hit such a lamp are too rare to tell.

use core::f64::consts::PI;
use core::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use raywright_bvh::{Aabb, Real};

use super::enclosing_glass::GlassBodies;
use super::facts::SurfaceKind;
use super::light_survey::Lamp;
use super::light_tracer::{LightTracer, VisiblePoint};
use super::light_walks::{WalkResult, walk_count};
use crate::scene::MaterialModel;

/// Greatest number of lamps around which a body of glass is looked for, and from which rays start.
const LAMPS: usize = 1000;
/// Assumed share of the light that the visible surfaces reflect.
const ALBEDO: f64 = 0.5;

impl<R: Real> LightTracer<'_, R> {
    /// Returns facts about all emissive objects.
    pub fn measure_lamps(&self, seen: &[VisiblePoint]) -> Vec<Lamp> {
        let emitters = &self.prepared.lights.emitters;
        let glass_bodies = GlassBodies::from_scene(self.scene_facts);
        let crosses = |body: usize, from: DVec3, direction: DVec3| {
            let is_hit = |object: usize, _| (object == body).then_some(());
            let hit = self.find_along_ray(from, direction, [0.0, f64::INFINITY], is_hit);
            hit.is_some()
        };
        let glass_around = |bounds: Aabb| glass_bodies.find_around(&bounds, crosses);
        let facts: Vec<_> = emitters.areas_and_powers().collect();
        let ranges: Vec<Range<u32>> = emitters.emitters_by_object().map(|(_, of)| of).collect();
        let walks = walk_count(facts.len().min(LAMPS));
        let lamp = |index: usize| {
            let (object, area, power, radiance) = facts[index];
            let object = self.scene_facts.facts_index(object as u32);
            let bounds = self.scene_facts.objects[object].bounds;
            let is_surveyed = index < LAMPS && !self.deadline.has_passed();
            let glass = bounds.filter(|_| is_surveyed).and_then(glass_around);
            Lamp {
                object,
                area,
                power,
                radiance,
                eye_distance: bounds.map_or(0.0, |b| b.centre().distance(self.eye)),
                glass,
                arriving: glass.map_or(0.0, |_| self.arriving_light(object, power / 3.0, seen)),
                target_ratio: glass.map_or(1.0, |glass| self.target_area_ratio(object, glass)),
                walks: match is_surveyed {
                    true => self.walk_from_lamp(object, ranges[index].clone(), walks, seen),
                    false => WalkResult::default(),
                },
            }
        };
        (0..facts.len()).into_par_iter().map(lamp).collect()
    }

    /// Returns the mean radiance that the visible points reflect of a lamp's light. `power` is the
    /// lamp's radiance times its area. The lamp counts as a point at its centre, equally bright to
    /// all sides; glass lets all light pass.
    pub fn arriving_light(&self, object: usize, power: f64, seen: &[VisiblePoint]) -> f64 {
        let Some(bounds) = self.scene_facts.objects[object].bounds else {
            return 0.0;
        };
        // The mean over all directions of the area that a convex body shows is a quarter of its area.
        let intensity = 0.25 * power;
        let nearest = 0.5 * bounds.extent().length();
        let radiance = |place: &VisiblePoint| {
            let away = bounds.centre() - place.position;
            let distance = away.length().max(nearest);
            let direction = away.normalize_or_zero();
            let cosine = place.normal.dot(direction);
            if cosine <= 1e-3 || self.is_lamp_covered(place.position, direction, distance, object) {
                return 0.0;
            }
            ALBEDO / PI * intensity * cosine / (distance * distance)
        };
        seen.iter().map(radiance).sum::<f64>() / seen.len().max(1) as f64
    }

    /// Returns whether an opaque object is in the way to a lamp.
    fn is_lamp_covered(&self, from: DVec3, direction: DVec3, distance: f64, lamp: usize) -> bool {
        let blocker = |object: usize, _| {
            let object_facts = &self.scene_facts.objects[object];
            let is_opaque = object_facts.surface_kind == SurfaceKind::Opaque;
            (object == lamp || is_opaque && object_facts.object.casts_shadow).then_some(object)
        };
        let first = self.find_along_ray(from, direction, [1e-4 * distance, distance], blocker);
        first.is_some_and(|object| object != lamp)
    }

    /// Returns the area of a target that paths have to hit, in multiples of the lamp's own: rough
    /// glass scatters light samples of its surface to the lamp, so that hits near the lamp suffice.
    fn target_area_ratio(&self, lamp: usize, glass: usize) -> f64 {
        let [lamp, glass] = [lamp, glass].map(|object| &self.scene_facts.objects[object]);
        let roughness = glass
            .material
            .map_or(0.0, |(_, material)| match &material.model {
                MaterialModel::Physical(m) => m.roughness.constant().unwrap_or(0.0),
                MaterialModel::Classic(_) => 0.0,
            });
        let [own, around] = [lamp, glass].map(|object| {
            let extent = object
                .bounds
                .map_or(0.0, |bounds| bounds.extent().min_element());
            0.5 * extent
        });
        let alpha = roughness * roughness;
        let radius = (own + alpha * around).min(around.max(own));
        let ratio = radius / own;
        if ratio.is_finite() {
            ratio * ratio
        } else {
            1.0
        }
    }
}
