//! Glass that rays do not cross as a body: thinner than rounding, hidden from one side, or within
//! more bodies than a path knows at once.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use super::bodies::{BodyChecks, SEEN};
use super::facts::{ObjectFacts, SurfaceKind, finite_point, object_bounds};
use super::finding::{FindingCode, StressFinding};
use super::numbers::{append_metre_unit, format_metres, format_rounded_up};
use super::ray_survey::{RaySurvey, SightingCount};
use crate::integrator::MAX_MEDIA;
use crate::scene::{MaterialModel, Shape, SideRule};

/// Thickness that is resolved, as a share of the separation of two objects that is.
const RESOLVED: f64 = 0.25;

impl BodyChecks<'_> {
    /// Returns the thickness of a body in metres if it is too thin for the precision at a position:
    /// the least edge of its bounding box in object space.
    pub fn unresolved_thickness(
        &self,
        object_facts: &ObjectFacts<'_>,
        position: DVec3,
    ) -> Option<f64> {
        let (lookup, meshes) = (&self.scene_facts.lookup, &mut BTreeMap::new());
        let bounds = object_bounds(lookup, meshes, object_facts.object, DAffine3::IDENTITY)?;
        let matrix = object_facts.object_to_world.matrix3;
        let widths = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.length());
        let thickness = (bounds.extent() * DVec3::from(widths)).min_element();
        let least = RESOLVED * self.resolution.min_separation_at(position);
        (thickness > 0.0 && thickness < least).then_some(thickness)
    }

    /// Finds glass of which `side` hides one side, so that rays enter it and never leave it, or the
    /// reverse; and closed glass that is thinner than rounding.
    pub fn check_sides_and_thickness(&self) -> Vec<StressFinding> {
        let finding = |(&object, sighting): (&usize, &SightingCount)| {
            let object_facts = &self.scene_facts.objects[object];
            let hidden = match object_facts.object.side {
                SideRule::Outside => "enter it and never leave it",
                SideRule::Inside => "leave it without entering it",
                SideRule::Both | SideRule::Culled => "",
            };
            let is_endless = matches!(object_facts.object.shape, Shape::Plane { .. });
            let is_body = object_facts.surface_kind == SurfaceKind::Body;
            if !is_body || is_endless || sighting.count < 3 {
                return None;
            }
            let place = finite_point(sighting.position);
            if !hidden.is_empty() {
                let reason = format!(
                    "its `side` hides one side of this glass, so that rays {hidden}, and are bent and tinted wrongly"
                );
                let remedy = "remove `side` from the object, or set `thin_walled` for its material, if it should be a pane without an inside";
                let code = FindingCode::OpenBody;
                return Some(
                    self.wrong_picture_finding(code, object, reason, remedy)
                        .with_place(place),
                );
            }
            let thickness = self.unresolved_thickness(object_facts, sighting.position)?;
            if !self.is_closed_body(object_facts) {
                return None;
            }
            let least = self.resolution.min_separation_at(sighting.position);
            let reason = format!(
                "this glass is only {} thick, too thin for the precision at that place: light that enters the glass misses its other side",
                format_metres(thickness)
            );
            let remedy = format!(
                "set `thin_walled` for its material, or make the glass {} thick or more",
                append_metre_unit(&format_rounded_up(least))
            );
            let finding =
                self.wrong_picture_finding(FindingCode::ClosedGap, object, reason, remedy);
            Some(finding.with_place(place))
        };
        self.survey.first_hits.iter().filter_map(finding).collect()
    }

    /// Returns whether a body differs from some other body by more than the priority.
    fn is_other_glass_than_some(&self, object: usize) -> bool {
        let glass = |object_facts: &ObjectFacts<'_>| {
            let (_, material) = object_facts.material?;
            let mut model = material.model.clone();
            if let MaterialModel::Physical(m) = &mut model {
                m.priority = 0;
            }
            Some(model)
        };
        let objects = &self.scene_facts.objects;
        let own = glass(&objects[object]);
        let mut bodies = objects
            .iter()
            .filter(|o| o.surface_kind == SurfaceKind::Body);
        bodies.any(|other| glass(other) != own)
    }

    /// Finds more bodies in one place, in a scene with priorities, than a path knows at once.
    pub fn check_number_of_bodies(&self) -> Option<StressFinding> {
        let sightings = &self.survey.beyond_most_bodies;
        let most = sightings.iter().max_by_key(|(_, sighting)| sighting.count);
        let (&object, sighting) = most.filter(|_| self.has_priorities())?;
        if !self.is_other_glass_than_some(object) {
            return None;
        }
        let hit_count = RaySurvey::sighting_count(&self.survey.sightings, &object);
        if sighting.count < 3 || (sighting.count as f64) < SEEN * hit_count as f64 {
            return None;
        }
        let reason = format!(
            "it lies inside {MAX_MEDIA} or more other bodies, but a path knows at most {MAX_MEDIA} bodies at once: the boundaries of the others do not bend or tint light"
        );
        let remedy = format!("let at most {MAX_MEDIA} bodies of glass overlap in one place");
        let predicate = "that enter it were already inside that many other bodies";
        Some(
            self.wrong_picture_finding(FindingCode::NestedGlass, object, reason, remedy)
                .with_count(sighting.count, hit_count, "rays", predicate)
                .with_place(finite_point(sighting.position)),
        )
    }
}
