//! Findings about glass bodies and coinciding surfaces, from the rays of the cameras and from rays
//! that start at surfaces.

use super::facts::object_bounds;
use super::*;
use crate::prepare::{LampRef, LightLeak, UnresolvedGap};
use crate::topology::Topology;

/// Share of the rays through an object above which a fault of the object shows in the picture.
const SEEN: f64 = 0.02;
/// The same share for bodies that are open or touch. Touching faces that few rays cross have no
/// visible effect.
const OPEN: f64 = 0.05;
/// The same share for overlapping copies of a generator. A few of many copies at random positions
/// always overlap, with hardly any visible effect.
const COPIES: f64 = 0.1;
/// The same share for surfaces of one material that shadow each other.
const SHADOWED: f64 = 0.01;
/// Share of all rays that start at surfaces above which a fault shows in the picture.
const OF_ALL: f64 = 0.002;
/// Least number of search rays that find a gap in front of all opaque surfaces for the gap to show.
const FEWEST_GAP_RAYS: u32 = 3;
/// Number of search rays for gaps, of a camera.
const GAP_RAYS: f64 = 576.0;
/// Thickness of glass that is resolved, as a share of the separation of two objects that is.
const RESOLVED: f64 = 0.25;

/// Remedy for two bodies of glass that touch.
pub(super) const TOUCHING_GLASS_REMEDY: &str =
    "let one reach into the other and set a `priority` for the material of each";

/// Remedy for glass that touches an opaque object.
fn sunk_glass_remedy(other: &str) -> String {
    format!(
        "let the glass reach into {other}, if only by a millimetre (a gap between the two, however narrow, would be a film of air, and look different)"
    )
}

impl SceneFacts<'_> {
    /// Returns the findings about bodies and surfaces. `gaps` holds the pairs whose closed gap is told.
    pub fn check_bodies(&self, survey: &RaySurvey, gaps: &BTreeSet<[usize; 2]>) -> Vec<Fault> {
        let events = survey.events.iter();
        let of_event = |(&event, at): (&RayEvent, &Sighting)| match event {
            RayEvent::Unbalanced(object) => self.open_body_finding(survey, object, at),
            RayEvent::FirstHit(object) => self
                .hidden_side_finding(object, at)
                .or_else(|| self.thin_glass_finding(object, at)),
            RayEvent::ContactLost([a, b]) if gaps.contains(&[a.min(b), a.max(b)]) => None,
            RayEvent::ContactLost(pair) => self.lost_contact_finding(survey, pair, at),
            RayEvent::TwinShadow(pair) => self.twin_shadow_finding(survey, pair, at),
            RayEvent::SelfHit(object) => {
                let finding = SelfHit.fault(object,
                    "rays that start at this surface hit it again at their start, which shows as dark speckles",
                    "remove `classic.spawn` from the scene file, or set a larger `offset` in `classic.spawn`",
                );
                let predicate = "that start at a surface hit it again";
                Some(finding.with_rays(at.count, survey.spawned_rays, predicate))
            }
            RayEvent::StartBehindSurface(object) => {
                let finding = StartBeyondSurface.fault(object,
                    "rays that start at this surface begin behind another surface, whose shadow and reflection are missing there",
                    "remove `classic.spawn` from the scene file, or set a smaller `offset` in `classic.spawn`",
                );
                let predicate = "that start at a surface began behind another surface";
                let is_seen = at.count as f64 > OF_ALL * survey.spawned_rays as f64;
                is_seen.then(|| finding.with_rays(at.count, survey.spawned_rays, predicate))
            }
            _ => None,
        };
        let of_event = |(event, at)| Some(of_event((event, at))?.with_place(at.position));
        let mut findings: Vec<Fault> = events.filter_map(of_event).collect();
        findings.extend(self.nested_glass_finding(survey));
        findings
    }

    /// Returns whether a material has a priority.
    fn has_priorities(&self) -> bool {
        let is_nested = |material: &Material| matches!(&material.model, MaterialModel::Physical(m) if m.has_priority());
        self.used_materials().into_values().any(is_nested)
    }

    /// Returns whether a body is closed by its shape. Of the meshes, those without open or
    /// inconsistent edges are.
    pub fn is_closed_body(&self, object: &ObjectFacts<'_>) -> bool {
        match (object.mesh, &object.object.shape) {
            (Some(_), _) => self.topology(object).is_none_or(Topology::is_closed),
            (_, Shape::Cylinder { caps, height, .. }) => *caps && height.is_some(),
            (_, shape) => matches!(
                shape,
                Shape::Sphere { .. }
                    | Shape::Box { .. }
                    | Shape::Ellipsoid { .. }
                    | Shape::Cone { .. }
                    | Shape::Torus { .. }
            ),
        }
    }

    /// Returns the finding about a glass body that rays enter without leaving, or leave without
    /// entering. Meshes with open or inconsistent edges are left to the checks of meshes.
    fn open_body_finding(&self, survey: &RaySurvey, object: usize, at: &Sighting) -> Option<Fault> {
        let body = &self.objects[object];
        let is_closed = self.is_closed_body(body);
        let edges_tell = body.mesh.is_some() && !is_closed;
        let all = survey.count(RayEvent::Crossed(object));
        let is_few = at.count < 3 || (at.count as f64) < OPEN * all as f64;
        // What has no end has an inside that nothing leaves.
        let is_endless = matches!(body.object.shape, Shape::Plane { .. });
        if is_few
            || is_endless
            || edges_tell
            || self.unresolved_thickness(body, at.position).is_some()
            || self.duplicates.has_duplicate(object)
        {
            return None;
        }
        let (reason, remedy) = match is_closed {
            true => (
                "this glass body touches another surface: rays that enter it do not leave it, or the reverse, and are bent and tinted wrongly",
                format!(
                    "if it touches another body of glass, {TOUCHING_GLASS_REMEDY}; if it touches an opaque object, {}",
                    sunk_glass_remedy("that object")
                ),
            ),
            false => (
                "this glass body is open: rays that enter it do not leave it, or the reverse, and are bent and tinted wrongly",
                "close the body (a cylinder with `caps`), or, if it should be a pane without an inside, set `thin_walled` for its material".to_owned(),
            ),
        };
        let predicate = "enter it without leaving, or leave it without entering";
        let finding = OpenBody.fault(body.index, reason, remedy);
        Some(finding.with_rays(at.count, all, predicate))
    }

    /// Returns the finding about glass of which `side` hides one side, so that rays enter it and
    /// never leave it, or the reverse.
    fn hidden_side_finding(&self, object: usize, at: &Sighting) -> Option<Fault> {
        let body = self.seen_body(object, at)?;
        let hidden = match body.object.side {
            SideRule::Outside => "enter it and never leave it",
            SideRule::Inside => "leave it without entering it",
            SideRule::Both | SideRule::Culled => return None,
        };
        let finding = OpenBody.fault(body.index,
            format!("its `side` hides one side of this glass, so that rays {hidden}, and are bent and tinted wrongly"),
            "remove `side` from the object, or set `thin_walled` for its material, if it should be a pane without an inside",
        );
        Some(finding)
    }

    /// Returns the finding about closed glass that is thinner than rounding.
    fn thin_glass_finding(&self, object: usize, at: &Sighting) -> Option<Fault> {
        let body = self.seen_body(object, at)?;
        let thickness = self.unresolved_thickness(body, at.position)?;
        let least = format_metres(round_up(self.min_separation_at(at.position)));
        let finding = ClosedGap.fault(body.index,
            format!(
                "this glass is only {} thick, too thin for the precision at that place: light that enters the glass misses its other side",
                format_metres(thickness)
            ),
            format!("set `thin_walled` for its material, or make the glass {least} thick or more"),
        );
        self.is_closed_body(body).then_some(finding)
    }

    /// Returns a body of glass with an end, if more than a few rays hit it.
    fn seen_body(&self, object: usize, at: &Sighting) -> Option<&ObjectFacts<'_>> {
        let body = &self.objects[object];
        let is_plane = matches!(body.object.shape, Shape::Plane { .. });
        (body.is_body() && !is_plane && at.count >= 3).then_some(body)
    }

    /// Returns the thickness of a body in metres if it is too thin for the precision at a position:
    /// the least edge of its bounding box in object space.
    fn unresolved_thickness(&self, body: &ObjectFacts<'_>, position: DVec3) -> Option<f64> {
        let bounds = object_bounds(body, DAffine3::IDENTITY, &mut HashMap::new())?;
        let matrix = body.object_to_world.matrix3;
        let widths = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::length);
        let thickness = (bounds.extent() * DVec3::from(widths)).min_element();
        let least = RESOLVED * self.min_separation_at(position);
        (thickness > 0.0 && thickness < least).then_some(thickness)
    }

    /// Returns the finding about an opaque object that is lost where glass touches it.
    fn lost_contact_finding(
        &self,
        survey: &RaySurvey,
        [glass, other]: [usize; 2],
        at: &Sighting,
    ) -> Option<Fault> {
        let all = survey.count(RayEvent::Crossed(glass));
        if at.count < 3 || (at.count as f64) < OPEN * all as f64 {
            return None;
        }
        let named = self.object_name(other);
        let finding = ClosedGap.fault(glass,
            format!("it touches {named}, and rays hit the glass alone, which is the first of the two in the file: light that leaves the glass there passes through {named}"),
            sunk_glass_remedy(&named),
        );
        let predicate = "through the glass cross the common face";
        Some(finding.with_rays(at.count, all, predicate))
    }

    /// Returns the finding about bodies of glass inside each other, in a scene without priorities.
    fn nested_glass_finding(&self, survey: &RaySurvey) -> Option<Fault> {
        let mut nested = survey.of(|event| match event {
            RayEvent::Nested(pair) => Some(pair),
            _ => None,
        });
        nested.retain(|&([outer, inner], at)| {
            let least = if outer == inner { COPIES } else { SEEN };
            let all = survey.count(RayEvent::Crossed(inner)) as f64;
            let is_few = at.count < 3 || (at.count as f64) < least * all;
            !is_few && !self.duplicates.are_duplicates([outer, inner])
        });
        let most = nested.iter().max_by_key(|(_, at)| at.count);
        let &([outer, inner], at) = most.filter(|_| !self.has_priorities())?;
        let others: BTreeSet<usize> = nested
            .iter()
            .map(|([_, other], _)| *other)
            .filter(|&other| other != inner)
            .collect();
        let more = match others.len() {
            0 => String::new(),
            1 => "; one more body overlaps others too".to_owned(),
            more => format!("; {more} more bodies overlap others too"),
        };
        let (place, predicate) = match outer == inner {
            true => (
                "copies of this generator overlap each other".to_owned(),
                "that hit one were inside another copy",
            ),
            false => (
                format!(
                    "this glass body overlaps {} or is inside it",
                    self.object_name(outer)
                ),
                "that enter it were inside the other body",
            ),
        };
        let material = |object: usize| self.objects[object].material.map(|(index, _)| index);
        let remedy = match material(outer) == material(inner) {
            false => {
                "set a `priority` for the material of each body, and let bodies that touch reach into each other: where bodies overlap, the one with the greatest priority counts"
            }
            true => {
                "if the bodies should be one, set a `priority` for their material; if one should be a hollow in the other, give each body its own material with a `priority`, and the hollow the greater `priority` and `ior = 1`"
            }
        };
        let reason = format!(
            "{place}{more}: each boundary then bends light as if there were air between the bodies"
        );
        let subject = Subject::Object(inner);
        let finding = NestedGlass.fault(subject, reason, remedy);
        let bodies = self.objects.iter().filter(|o| o.is_body()).count();
        let finding = match others.len() {
            0 => finding.with_rays(at.count, survey.count(RayEvent::Crossed(inner)), predicate),
            more => finding.with_count(
                1 + more as u64,
                bodies as u64,
                "glass bodies",
                "overlap another one",
            ),
        };
        Some(Fault {
            others: others.into_iter().map(Subject::Object).collect(),
            ..finding.with_place(at.position)
        })
    }

    /// Returns the finding about two surfaces of one material so close that rays which start at one
    /// hit the other. Both look alike, but the lower one is in the shadow of the upper one. Those of
    /// two materials are reported by what is seen of them.
    fn twin_shadow_finding(
        &self,
        survey: &RaySurvey,
        [a, b]: [usize; 2],
        at: &Sighting,
    ) -> Option<Fault> {
        let objects = BTreeSet::from([a, b]).into_iter();
        let all: u64 = objects.map(|o| survey.count(RayEvent::FirstHit(o))).sum();
        let is_seen = at.count >= 10 && at.count as f64 >= SHADOWED * all as f64;
        if !is_seen || self.objects[a].object.material != self.objects[b].object.material {
            return None;
        }
        let least = format_metres(round_up(self.min_separation_at(at.position)));
        let exact = self.settings.precision.or_reference();
        let (place, remedy) = match a == b {
            true => (
                format!("two layers of its surface lie less than {least} apart"),
                format!("remove one of the two layers in the modelling program{exact}"),
            ),
            false => (
                format!(
                    "its surface lies less than {least} from that of {}",
                    self.object_name(a)
                ),
                format!("remove one of the two, or leave {least} or more between them{exact}"),
            ),
        };
        let finding = FlickeringSurfaces.fault(b,
            format!("{place}, too close for the precision: where rays hit the lower one, it is in the shadow of the upper one, which shows as dark speckles"),
            remedy,
        );
        let predicate = "that start at one hit the other at once";
        Some(finding.with_rays(at.count, survey.spawned_rays, predicate))
    }

    /// Returns the remedy for two surfaces that are too close. `minimum` is the least
    /// distinguishable separation, `gap` the actual one, both in metres.
    pub fn separation_remedy(&self, minimum: f64, gap: f64) -> String {
        let exact = if gap > 0.0 {
            self.settings.precision.or_reference()
        } else {
            ""
        };
        // In double precision, files have fewer digits than storage.
        let minimum = match self.settings.precision {
            PrecisionChoice::Robust => minimum,
            PrecisionChoice::Reference => 1e6 * minimum,
        };
        let least = format_metres(round_up(minimum));
        format!(
            "leave {least} or more between the two: move the object that should be seen to the side from which it should be seen, or remove the other{exact}"
        )
    }

    /// Returns the findings about gaps beside glass that are lost when coordinates are rounded for
    /// storage. Rays find a gap from either side. A gap that few of the rays through the glass find has
    /// no visible effect.
    pub fn gap_findings(&self, survey: &RaySurvey, gaps: &[UnresolvedGap]) -> Vec<Fault> {
        let mut pairs = BTreeSet::new();
        let finding = |gap: &UnresolvedGap| {
            let pair = [gap.object, gap.other].map(|object| self.facts_index(object as u32));
            let is_new = pairs.insert(self.sorted_pair([gap.object, gap.other]));
            if !is_new || self.duplicates.are_duplicates(pair) {
                return None;
            }
            let through = survey.count(RayEvent::Crossed(pair[0])) as f64;
            let found = f64::from(gap.rays) / GAP_RAYS * survey.rays as f64;
            let is_seen = gap.rays >= FEWEST_GAP_RAYS && found >= OPEN * through;
            let finding = gap.fault(self.scene, self.settings.precision);
            Some(finding.if_seen_or(is_seen, "; hardly any ray of the cameras gets there"))
        };
        gaps.iter().filter_map(finding).collect()
    }

    /// Returns the lamp and the cover of a leak. `None` for a light without size.
    pub fn leaking_pair(&self, leak: &LightLeak) -> Option<[usize; 2]> {
        match leak.lamp {
            LampRef::Light(_) => None,
            LampRef::Object(object) => Some(self.sorted_pair([object, leak.cover])),
        }
    }
}
