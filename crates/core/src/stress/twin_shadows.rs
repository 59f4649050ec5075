//! Two surfaces of one material so close that rays which start at one hit the other. Both look alike,
//! but the lower one is in the shadow of the upper one, where rounding lets rays hit it.

use raywright_bvh::{Hit, Ray, Real, Surface, Vector};

use super::coplanar::DepthResolution;
use super::facts::{SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::numbers::{append_metre_unit, format_rounded_up};
use super::ray_survey::{RayPoint, RaySurvey, SightingCount, record_sighting};
use super::rays::SurveyRayTracer;
use crate::settings::PrecisionChoice;

/// Greatest separation of the two surfaces, in units of the sum of their hits' errors.
const ERRORS: f64 = 4.0;
/// Least number of rays, and least share of the rays that hit one of the two objects first, from
/// which on the shadows show in the picture.
const FEW: u64 = 10;
const SEEN: f64 = 0.01;

impl<R: Real> SurveyRayTracer<'_, R> {
    /// Records that a ray which starts at a surface hits a parallel opaque surface next to it.
    pub fn survey_twin_shadow(
        &self,
        own: &Surface<R>,
        (ray, hit): (&Ray<R>, &Hit<R>),
        (object, seen): (usize, RayPoint),
        survey: &mut RaySurvey,
    ) {
        let other = self.scene_facts.facts_index(hit.outermost_id());
        let surface = self.prepared.geometry.surface(ray, hit);
        let [m, n] = [own.normal.to_f64(), surface.normal.to_f64()];
        let apart = (surface.point.to_f64() - own.point.to_f64()).dot(m).abs();
        let error = own.error.to_f64() + surface.error.to_f64();
        let is_opaque =
            |object: usize| self.scene_facts.objects[object].surface_kind == SurfaceKind::Opaque;
        if apart <= ERRORS * error
            && m.dot(n).abs() > 1.0 - 1e-6
            && is_opaque(object)
            && is_opaque(other)
        {
            let pair = [object.min(other), object.max(other)];
            record_sighting(&mut survey.twin_shadows, pair, seen);
        }
    }
}

/// Returns the findings about surfaces of one material that shadow each other. Those of two
/// materials are reported by what is seen of them.
pub(super) fn check_twin_shadows(
    scene_facts: &SceneFacts<'_>,
    survey: &RaySurvey,
    resolution: &DepthResolution<'_>,
) -> Vec<StressFinding> {
    let finding = |(&[a, b], sighting): (&[usize; 2], &SightingCount)| {
        let objects = &scene_facts.objects;
        let hits = [a, b].map(|object| RaySurvey::sighting_count(&survey.first_hits, &object));
        let all = if a == b { hits[0] } else { hits[0] + hits[1] };
        let is_seen = sighting.count >= FEW && sighting.count as f64 >= SEEN * all as f64;
        if !is_seen || objects[a].object.material != objects[b].object.material {
            return None;
        }
        let least = append_metre_unit(&format_rounded_up(
            resolution.min_separation_at(sighting.position),
        ));
        let exact = match resolution.precision {
            PrecisionChoice::Robust => ", or render with --precision reference",
            PrecisionChoice::Reference => "",
        };
        let (place, remedy) = match a == b {
            true => (
                format!("two layers of its surface lie less than {least} apart"),
                format!("remove one of the two layers in the modelling program{exact}"),
            ),
            false => (
                format!(
                    "its surface lies less than {least} from that of {}",
                    objects[a].subject.display_name(scene_facts.scene)
                ),
                format!("remove one of the two, or leave {least} or more between them{exact}"),
            ),
        };
        let reason = format!(
            "{place}, too close for the precision: where rays hit the lower one, it is in the shadow of the upper one, which shows as dark speckles"
        );
        let (code, severity) = (FindingCode::FlickeringSurfaces, Severity::PictureWrong);
        let predicate = "that start at one hit the other at once";
        let finding = StressFinding::new(code, severity, objects[b].subject, reason, remedy);
        Some(
            finding
                .with_count(sighting.count, survey.spawned_rays, "rays", predicate)
                .with_place(finite_point(sighting.position)),
        )
    };
    survey.twin_shadows.iter().filter_map(finding).collect()
}
