//! Findings about glass bodies and coinciding surfaces, from the rays of the cameras and from rays
//! that start at surfaces.

use std::collections::{BTreeMap, BTreeSet};

use super::aimed::AimedRayResult;
use super::coplanar::DepthResolution;
use super::duplicates::DuplicateObjects;
use super::facts::{ObjectFacts, SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::glass_contacts::{check_glass_contacts, sunk_glass_remedy};
use super::numbers::{append_metre_unit, format_metres, format_rounded_up};
use super::overlap_table::OverlapTable;
use super::overlaps::{TOUCHING_GLASS_REMEDY, separation_remedy};
use super::ray_survey::{RaySurvey, SightingCount};
use super::topology::Topology;
use super::twin_shadows::check_twin_shadows;
use crate::prepare::{LampRef, LightLeak, UnresolvedGap};
use crate::scene::{Material, MaterialModel, Shape};

/// Share of the rays through an object above which a fault of the object shows in the picture.
pub(super) const SEEN: f64 = 0.02;
/// The same share for bodies that are open or touch. Touching faces that few rays cross have no
/// visible effect.
const OPEN: f64 = 0.05;
/// The same share for overlapping copies of a generator. A few of many copies at random positions
/// always overlap, with hardly any visible effect.
const COPIES: f64 = 0.1;
/// Share of all rays that start at surfaces above which a fault shows in the picture.
const OF_ALL: f64 = 0.002;

/// Inputs of the checks of bodies and surfaces.
pub(super) struct BodyChecks<'a> {
    pub scene_facts: &'a SceneFacts<'a>,
    pub topologies: &'a BTreeMap<usize, Topology>,
    pub doubles: &'a DuplicateObjects,
    pub survey: &'a RaySurvey,
    pub resolution: &'a DepthResolution<'a>,
    pub overlaps: &'a OverlapTable,
}

impl BodyChecks<'_> {
    /// Returns the findings of all checks of bodies and surfaces. `aimed` holds the results of rays
    /// aimed at edges and corners, for each camera.
    pub fn check_bodies(&self, aimed: &[AimedRayResult]) -> Vec<StressFinding> {
        let mut findings = self.check_open_bodies();
        findings.extend(self.check_sides_and_thickness());
        findings.extend(self.check_number_of_bodies());
        findings.extend(self.check_nested_bodies());
        findings.extend(self.check_flickering_surfaces());
        findings.extend(self.check_ray_starts());
        findings.extend(check_glass_contacts(self.scene_facts, self.survey));
        findings.extend(check_twin_shadows(
            self.scene_facts,
            self.survey,
            self.resolution,
        ));
        let sent = aimed.iter().map(|rays| rays.sent).sum();
        for (&object, &(count, point)) in aimed.iter().flat_map(|rays| &rays.leaks) {
            let reason = "rays pass between triangles that share an edge or a corner";
            let remedy = "please report this fault of the program, with the scene file";
            let predicate = "aimed at edges and corners passed";
            findings.push(
                self.wrong_picture_finding(FindingCode::Leak, object, reason, remedy)
                    .with_count(count, sent, "rays", predicate)
                    .with_place(finite_point(point)),
            );
        }
        findings
    }

    /// Returns a finding that makes the picture wrong.
    pub fn wrong_picture_finding(
        &self,
        code: FindingCode,
        object: usize,
        reason: impl Into<String>,
        remedy: impl Into<String>,
    ) -> StressFinding {
        let subject = self.scene_facts.objects[object].subject;
        StressFinding::new(code, Severity::PictureWrong, subject, reason, remedy)
    }

    /// Checks rays that start at a surface: whether they hit it again, or start beyond another
    /// surface.
    fn check_ray_starts(&self) -> Vec<StressFinding> {
        let survey = self.survey;
        let mut findings = Vec::new();
        for (&object, sighting) in &survey.self_hits {
            let reason = "rays that start at this surface hit it again at their start, which shows as dark speckles";
            let remedy = "remove `classic.spawn` from the scene file, or set a larger `offset` in `classic.spawn`";
            let predicate = "that start at a surface hit it again";
            findings.push(
                self.wrong_picture_finding(FindingCode::SelfHit, object, reason, remedy)
                    .with_count(sighting.count, survey.spawned_rays, "rays", predicate)
                    .with_place(finite_point(sighting.position)),
            );
        }
        let many =
            |sighting: &SightingCount| sighting.count as f64 > OF_ALL * survey.spawned_rays as f64;
        for (&object, sighting) in survey
            .starts_behind_surface
            .iter()
            .filter(|(_, sighting)| many(sighting))
        {
            let reason = "rays that start at this surface begin behind another surface, whose shadow and reflection are missing there";
            let remedy = "remove `classic.spawn` from the scene file, or set a smaller `offset` in `classic.spawn`";
            let predicate = "that start at a surface began behind another surface";
            findings.push(
                self.wrong_picture_finding(FindingCode::StartBeyondSurface, object, reason, remedy)
                    .with_count(sighting.count, survey.spawned_rays, "rays", predicate)
                    .with_place(finite_point(sighting.position)),
            );
        }
        findings
    }

    /// Finds glass bodies that rays enter without leaving, or leave without entering. Meshes with
    /// open or inconsistent edges are left to the checks of meshes.
    fn check_open_bodies(&self) -> Vec<StressFinding> {
        let finding = |(&object, sighting): (&usize, &SightingCount)| {
            let object_facts = &self.scene_facts.objects[object];
            let is_closed = self.is_closed_body(object_facts);
            let edges_tell = matches!(object_facts.object.shape, Shape::Mesh(_)) && !is_closed;
            let hit_count = RaySurvey::sighting_count(&self.survey.sightings, &object);
            // What has no end has an inside that nothing leaves.
            let is_endless = matches!(object_facts.object.shape, Shape::Plane { .. });
            let is_few = sighting.count < 3 || (sighting.count as f64) < OPEN * hit_count as f64;
            let is_thin = self
                .unresolved_thickness(object_facts, sighting.position)
                .is_some();
            // Rays that hit the opaque body alone count as rays that leave the glass. Contacts that are
            // not in the table are not known to be such.
            let is_unknown = is_closed && !self.overlaps.has_all_contacts;
            if is_thin
                || is_unknown
                || edges_tell
                || is_endless
                || is_few
                || self.doubles.has_duplicate(object)
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
            Some(
                self.wrong_picture_finding(FindingCode::OpenBody, object, reason, remedy)
                    .with_count(sighting.count, hit_count, "rays", predicate)
                    .with_place(finite_point(sighting.position)),
            )
        };
        self.survey.unbalanced.iter().filter_map(finding).collect()
    }

    /// Returns whether a material has a priority.
    pub fn has_priorities(&self) -> bool {
        let is_nested = |material: &Material| matches!(&material.model, MaterialModel::Physical(m) if m.has_priority());
        let used = self.scene_facts.used_materials();
        used.iter().any(|(_, material)| is_nested(material))
    }

    /// Returns whether a body is closed by its shape. Of the meshes, those without open or
    /// inconsistent edges are.
    pub fn is_closed_body(&self, object_facts: &ObjectFacts<'_>) -> bool {
        match object_facts.object.shape {
            Shape::Mesh(_) => self
                .scene_facts
                .mesh_of_object(object_facts.object)
                .and_then(|(mesh, _)| self.topologies.get(&mesh))
                .is_none_or(Topology::is_closed),
            Shape::Sphere { .. }
            | Shape::Box { .. }
            | Shape::Ellipsoid { .. }
            | Shape::Cone { .. }
            | Shape::Torus { .. } => true,
            Shape::Cylinder { caps, height, .. } => caps && height.is_some(),
            _ => false,
        }
    }

    fn check_nested_bodies(&self) -> Vec<StressFinding> {
        if self.has_priorities() {
            return Vec::new();
        }
        let is_seen = |(pair, sighting): &(&[usize; 2], &SightingCount)| {
            let hit_count = RaySurvey::sighting_count(&self.survey.sightings, &pair[1]);
            let seen = if pair[0] == pair[1] { COPIES } else { SEEN };
            let is_few = sighting.count < 3 || (sighting.count as f64) < seen * hit_count as f64;
            !is_few && !self.doubles.are_duplicates(**pair)
        };
        let seen: Vec<_> = self.survey.nested.iter().filter(is_seen).collect();
        let most = seen.iter().max_by_key(|(_, sighting)| sighting.count);
        let Some(&(&[outer, inner], sighting)) = most else {
            return Vec::new();
        };
        let subject = |object: usize| self.scene_facts.objects[object].subject;
        let around = subject(outer).display_name(self.scene_facts.scene);
        let others: BTreeSet<usize> = seen
            .iter()
            .map(|(pair, _)| pair[1])
            .filter(|&other| other != inner)
            .collect();
        let more = match others.len() {
            0 => String::new(),
            1 => "; one more body overlaps others too".to_owned(),
            more => format!("; {more} more bodies overlap others too"),
        };
        let place = match outer == inner {
            true => "copies of this generator overlap each other".to_owned(),
            false => format!("this glass body overlaps {around} or is inside it"),
        };
        let reason = format!(
            "{place}{more}: each boundary then bends light as if there were air between the bodies"
        );
        let material = |object: usize| self.scene_facts.objects[object].material.map(|m| m.0);
        let remedy = match material(outer) == material(inner) {
            false => {
                "set a `priority` for the material of each body, and let bodies that touch reach into each other: where bodies overlap, the one with the greatest priority counts"
            }
            true => {
                "if the bodies should be one, set a `priority` for their material; if one should be a hollow in the other, give each body its own material with a `priority`, and the hollow the greater `priority` and `ior = 1`"
            }
        };
        let finding = self.wrong_picture_finding(FindingCode::NestedGlass, inner, reason, remedy);
        let finding = if others.is_empty() {
            let hit_count = RaySurvey::sighting_count(&self.survey.sightings, &inner);
            let predicate = match outer == inner {
                true => "that hit one were inside another copy",
                false => "that enter it were inside the other body",
            };
            finding.with_count(sighting.count, hit_count, "rays", predicate)
        } else {
            let all = &self.scene_facts.objects;
            let is_body = |object: &&ObjectFacts<'_>| object.surface_kind == SurfaceKind::Body;
            let bodies = all.iter().filter(is_body).count() as u64;
            let count = 1 + others.len() as u64;
            finding.with_count(count, bodies, "glass bodies", "overlap another one")
        };
        vec![StressFinding {
            others: others.into_iter().map(subject).collect(),
            ..finding.with_place(finite_point(sighting.position))
        }]
    }

    /// Returns whether two coinciding surfaces are visible in turns: each is the nearest surface
    /// for a twentieth of the rays or more.
    pub fn is_flickering_pair(&self, [a, b]: [usize; 2]) -> bool {
        let objects = &self.scene_facts.objects;
        let [one, other] =
            [[a, b], [b, a]].map(|pair| RaySurvey::sighting_count(&self.survey.coincident, &pair));
        let differ = objects[a].object.material != objects[b].object.material;
        differ && one + other >= 10 && 20 * one.min(other) >= one + other
    }

    /// Finds pairs of coinciding surfaces that are visible in turns.
    fn check_flickering_surfaces(&self) -> Vec<StressFinding> {
        let finding = |(pair, sighting): (&[usize; 2], &SightingCount)| {
            let [a, b] = *pair;
            if a > b || !self.is_flickering_pair(*pair) || self.doubles.are_duplicates(*pair) {
                return None;
            }
            let pairs = [[a, b], [b, a]];
            let all = pairs.map(|pair| RaySurvey::sighting_count(&self.survey.coincident, &pair));
            let apart = pairs
                .iter()
                .filter_map(|pair| self.survey.max_separations.get(pair))
                .fold(0.0_f64, |maximum, &apart| maximum.max(apart));
            let with = self.scene_facts.objects[b]
                .subject
                .display_name(self.scene_facts.scene);
            let reason = format!(
                "it lies in the same place as {with}, at most {} away, so that rounding decides from ray to ray which of the two is seen",
                format_metres(apart)
            );
            let remedy = separation_remedy(
                self.resolution.min_separation_at(sighting.position),
                apart,
                self.resolution.precision,
            );
            let predicate = "of the cameras hit both in one place";
            Some(
                self.wrong_picture_finding(FindingCode::FlickeringSurfaces, a, reason, remedy)
                    .with_count(all.iter().sum(), self.survey.rays, "rays", predicate)
                    .with_place(finite_point(sighting.position)),
            )
        };
        self.survey.coincident.iter().filter_map(finding).collect()
    }
}

/// Returns the findings about gaps and lamp covers that are lost when coordinates are rounded for
/// storage.
pub(super) fn closed_gap_findings(
    scene_facts: &SceneFacts<'_>,
    (doubles, overlaps): (&DuplicateObjects, &OverlapTable),
    gaps: &[UnresolvedGap],
    leaks: &[LightLeak],
) -> Vec<StressFinding> {
    let subject =
        |object: usize| scene_facts.objects[scene_facts.facts_index(object as u32)].subject;
    let words = |object: usize| subject(object).display_name(scene_facts.scene);
    let opaque_one = |gap: &UnresolvedGap| {
        let is_opaque = |object: &usize| {
            let index = scene_facts.facts_index(*object as u32);
            scene_facts.objects[index].surface_kind == SurfaceKind::Opaque
        };
        [gap.object, gap.other].into_iter().find(is_opaque)
    };
    let gap = |gap: &UnresolvedGap| {
        let reason = format!(
            "it touches {other}, or is less than {} away from it, too close for the precision: light that leaves one of the two misses the surface of the other",
            append_metre_unit(&format_rounded_up(gap.resolved_width)),
            other = words(gap.other)
        );
        let least = append_metre_unit(&format_rounded_up(gap.resolved_width));
        let remedy = gap_remedy(&least, opaque_one(gap).map(words));
        StressFinding::new(
            FindingCode::ClosedGap,
            Severity::PictureWrong,
            subject(gap.object),
            reason,
            remedy,
        )
    };
    let leak = |leak: &LightLeak| {
        let lamp = match leak.lamp {
            LampRef::Light(index) => FindingSubject::Light(index),
            LampRef::Object(object) => subject(object),
        };
        let reason = format!(
            "it is so close to {}, which is opaque, that the precision does not tell which of the two is in front: its light passes through that object, or the lamp itself is not seen",
            words(leak.cover)
        );
        let remedy = format!(
            "move it {} or more away from that object, to the side to which it should shine, or render with --precision reference",
            append_metre_unit(&format_rounded_up(leak.resolved_distance))
        );
        StressFinding::new(
            FindingCode::LightThroughCover,
            Severity::PictureWrong,
            lamp,
            reason,
            remedy,
        )
    };
    // The same gap is found from either side.
    let mut pairs = BTreeSet::new();
    let apart = gaps.iter().filter(|gap| {
        let pair = [gap.object, gap.other].map(|object| scene_facts.facts_index(object as u32));
        let is_new = pairs.insert([gap.object.min(gap.other), gap.object.max(gap.other)]);
        is_new && !doubles.are_duplicates(pair)
    });
    // In one plane neither is in front.
    let in_front = leaks.iter().filter(|leak| match leak.lamp {
        LampRef::Light(_) => true,
        LampRef::Object(object) => {
            let pair = [object, leak.cover].map(|object| scene_facts.facts_index(object as u32));
            overlaps.gap_between(pair) != Some(0.0)
        }
    });
    apart.map(gap).chain(in_front.map(leak)).collect()
}

/// Returns the remedy for a gap beside glass that is narrower than `least`. `opaque` names the
/// opaque object beside the gap, if one is.
fn gap_remedy(least: &str, opaque: Option<String>) -> String {
    let touch = match opaque {
        Some(opaque) => sunk_glass_remedy(&opaque),
        None => TOUCHING_GLASS_REMEDY.to_owned(),
    };
    format!(
        "if the two should touch, {touch}; if there should be air between them, leave {least} or more, or render with --precision reference"
    )
}
