//! Surfaces that camera rays pass through because they are hidden from that side.

use raywright_bvh::{Hit, Interval, Ray, Real};

use super::facts::largest_extent;
use super::orientation::OrientationFault;
use super::ray_hits::hits_along_ray;
use super::ray_survey::{RayPoint, RaySurvey, SurfaceOnRay, record_sighting};
use super::rays::SurveyRayTracer;
use crate::scene::SideRule;

/// Greatest number of surfaces that a ray passes on its way back.
const HITS: usize = 128;

impl<R: Real> SurveyRayTracer<'_, R> {
    /// Records a ray's first surface if it is hidden from the camera, or flipped. `visible` is the
    /// first surface that the ray hits, with whether the ray enters there.
    pub fn survey_hidden_backs(
        &self,
        ray: &Ray<R>,
        index: u64,
        visible: Option<(SurfaceOnRay, bool)>,
        survey: &mut RaySurvey,
    ) {
        if !self.has_one_sided {
            return;
        }
        let side = |object: usize| self.scene_facts.objects[object].object.side;
        let end = visible.map(|(surface, _)| surface.point.distance);
        let hidden = self.nearest_hidden_back(ray, index, end).or_else(|| {
            // Only camera rays pass through the backs of culled surfaces.
            let (surface, enters) = visible?;
            (side(surface.object) == SideRule::Culled && !enters).then_some(surface)
        });
        let Some(surface) = hidden.or(visible.map(|(surface, _)| surface)) else {
            return;
        };
        let fault = self.orientation_fault(&surface, hidden.is_some());
        let (object, point) = (surface.object, surface.point);
        if hidden.is_some() {
            record_sighting(&mut survey.hidden_backs_hit, object, point);
        }
        let sightings = match (fault, hidden.is_some()) {
            (Some(OrientationFault::Flipped), true) => &mut survey.flipped_hidden,
            (Some(OrientationFault::Flipped), false) => &mut survey.flipped_shown,
            (Some(OrientationFault::InsideOut), true) => &mut survey.inside_out_hidden,
            _ => return,
        };
        record_sighting(sightings, object, point);
    }

    /// Returns the fault of a one-sided surface's orientation.
    fn orientation_fault(&self, surface: &SurfaceOnRay, hidden: bool) -> Option<OrientationFault> {
        let object_facts = &self.scene_facts.objects[surface.object];
        if !object_facts.hides_back_faces() {
            return None;
        }
        let (mesh, _) = self.scene_facts.mesh_of_object(object_facts.object)?;
        self.orientations.fault_of(mesh, surface.primitive, hidden)
    }

    /// Returns the first surface on a ray, up to a distance, that no ray hits from this side. A ray
    /// in the opposite direction hits it.
    fn nearest_hidden_back(
        &self,
        ray: &Ray<R>,
        index: u64,
        end: Option<f64>,
    ) -> Option<SurfaceOnRay> {
        let bounds = &self.scene_facts.bounds;
        let origin = self.prepared.to_world(ray.origin);
        let beyond = || origin.distance(bounds.centre()) + 2.0 * largest_extent(bounds);
        let end = end.unwrap_or_else(beyond);
        let way_back = Ray {
            origin: ray.at(R::from_f64(end)),
            direction: -ray.direction,
            ..*ray
        };
        let range = Interval {
            min: R::ZERO,
            max: R::from_f64(end),
        };
        let is_one_sided = |hit: &Hit<R>| {
            let object = self.scene_facts.facts_index(hit.outermost_id());
            let side = self.scene_facts.objects[object].object.side;
            matches!(side, SideRule::Outside | SideRule::Inside)
        };
        let hits = hits_along_ray(&self.prepared.geometry, &way_back, range).take(HITS);
        let hit = hits.filter(is_one_sided).last()?;
        let surface = self.prepared.geometry.surface(&way_back, &hit);
        Some(SurfaceOnRay {
            object: self.scene_facts.facts_index(hit.outermost_id()),
            primitive: hit.primitive,
            point: RayPoint {
                ray: index,
                position: self.prepared.to_world(surface.point),
                distance: end - hit.t.to_f64(),
            },
        })
    }
}
