//! Glass that touches an opaque object. Rays hit only one of the two surfaces, which are at the
//! same distance.
//!
//! If rays hit the opaque surface, the picture is that of glass that reaches into the object: light
//! is reflected within the glass. If they hit the glass, light leaves it and starts beyond the
//! opaque surface.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_bvh::{Interval, Ray, Real, Vector};

use super::facts::{SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::ray_crossings::RayCrossing;
use super::ray_hits::{PLACE_HITS, PLACE_REACH, hits_along_ray};
use super::ray_survey::{RayPoint, RaySurvey, SightingCount, record_sighting};
use super::rays::SurveyRayTracer;

/// Share of the rays through a body of glass from which on a lost surface shows in the picture.
const SEEN: f64 = 0.05;

/// Remedy for glass that touches an opaque object.
pub(super) fn sunk_glass_remedy(other: &str) -> String {
    format!(
        "let the glass reach into {other}, if only by a millimetre (a gap between the two, however narrow, would be a film of air, and look different)"
    )
}

impl<R: Real> SurveyRayTracer<'_, R> {
    /// Surveys a crossing at which glass and an opaque object touch and the ray hits only one of
    /// them. Counts the boundary of the glass as crossed. Records that the opaque object is lost.
    pub fn survey_glass_contact(
        &self,
        ray: &Ray<R>,
        (crossing, seen): (&RayCrossing<R>, RayPoint),
        depths: &mut BTreeMap<usize, i64>,
        survey: &mut RaySurvey,
    ) {
        let (surface, direction) = (&crossing.surface, ray.direction.to_f64());
        let objects = &self.scene_facts.objects;
        let is_glass = objects[crossing.object].surface_kind == SurfaceKind::Body;
        let place: [DVec3; 2] = [seen.position, surface.normal.to_f64()];
        for (other, outward) in self.overlaps.glass_contacts(crossing.object, place) {
            let visible = objects[other].visible_normal(outward);
            if visible.is_some_and(|side| side.dot(direction) >= 0.0)
                || self.hits_nearby(ray, crossing, other)
            {
                continue;
            }
            if is_glass {
                record_sighting(&mut survey.contacts_lost, [crossing.object, other], seen);
            } else if !objects[other].hides_back_faces() {
                let enters = outward.dot(direction) < 0.0;
                *depths.entry(other).or_insert(0) += if enters { 1 } else { -1 };
            }
        }
    }

    /// Returns whether the ray hits an object close to a crossing.
    fn hits_nearby(&self, ray: &Ray<R>, crossing: &RayCrossing<R>, object: usize) -> bool {
        let half = crossing.surface.error * R::from_f64(PLACE_REACH);
        let at = (crossing.surface.point - ray.origin).dot(ray.direction)
            / ray.direction.dot(ray.direction);
        let range = Interval {
            min: at - half,
            max: at + half,
        };
        hits_along_ray(&self.prepared.geometry, ray, range)
            .take(PLACE_HITS)
            .any(|hit| self.scene_facts.facts_index(hit.outermost_id()) == object)
    }
}

/// Returns the findings about opaque objects that are lost where glass touches them.
pub(super) fn check_glass_contacts(
    scene_facts: &SceneFacts<'_>,
    survey: &RaySurvey,
) -> Vec<StressFinding> {
    let finding = |(&[glass, other], sighting): (&[usize; 2], &SightingCount)| {
        let all = RaySurvey::sighting_count(&survey.sightings, &glass);
        if sighting.count < 3 || (sighting.count as f64) < SEEN * all as f64 {
            return None;
        }
        let named = scene_facts.objects[other]
            .subject
            .display_name(scene_facts.scene);
        let reason = format!(
            "it touches {named}, and rays hit the glass alone, which is the first of the two in the file: light that leaves the glass there passes through {named}"
        );
        let (code, severity) = (FindingCode::ClosedGap, Severity::PictureWrong);
        let subject = scene_facts.objects[glass].subject;
        let finding =
            StressFinding::new(code, severity, subject, reason, sunk_glass_remedy(&named));
        let predicate = "through the glass cross the common face";
        Some(
            finding
                .with_count(sighting.count, all, "rays", predicate)
                .with_place(finite_point(sighting.position)),
        )
    };
    survey.contacts_lost.iter().filter_map(finding).collect()
}
