//! Meshes with the wrong orientation, judged by what the cameras see of it. A one-sided mesh is
//! hidden where it should be visible, or the reverse.

use std::collections::{BTreeMap, BTreeSet};

use super::count::CountAndFirst;
use super::facts::{ObjectFacts, SurfaceKind};
use super::finding::{FindingCode, Severity, StressFinding};
use super::topology::Topology;
use super::used_mesh::UsedMesh;

/// Fault of a triangle's orientation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OrientationFault {
    /// The triangle differs from its neighbours.
    Flipped,
    /// The triangle belongs to a closed part that is oriented inwards.
    InsideOut,
}

/// Triangles with the wrong orientation, by the index of their mesh.
pub(super) struct OrientationTable<'a> {
    meshes: BTreeMap<usize, MeshOrientation<'a>>,
}

struct MeshOrientation<'a> {
    /// The flipped triangles, sorted.
    flipped: Vec<u32>,
    /// Whether there are more flipped triangles than `flipped` holds.
    has_more: bool,
    /// For each part of the mesh, whether it is inside out.
    inside_out: Vec<bool>,
    component_of: &'a [u32],
}

impl<'a> OrientationTable<'a> {
    pub fn new(topologies: &'a BTreeMap<usize, Topology>) -> Self {
        let faults = |(&mesh, topology): (&usize, &'a Topology)| {
            let inverted = topology.inverted_components();
            let tally = &topology.flipped_triangles;
            if tally.count == 0 && inverted.is_empty() {
                return None;
            }
            let mut flipped = tally.some.clone();
            flipped.sort_unstable();
            let inverted: BTreeSet<u32> = inverted.iter().map(|part| part.first).collect();
            let parts = topology.components.iter();
            let orientation = MeshOrientation {
                has_more: tally.count > flipped.len() as u64,
                flipped,
                inside_out: parts.map(|part| inverted.contains(&part.first)).collect(),
                component_of: &topology.component_of,
            };
            Some((mesh, orientation))
        };
        Self {
            meshes: topologies.iter().filter_map(faults).collect(),
        }
    }

    /// Returns the fault of a triangle, or `None`. Of a mesh with too many flipped triangles, all
    /// `hidden` triangles count as flipped.
    pub fn fault_of(&self, mesh: usize, triangle: u32, hidden: bool) -> Option<OrientationFault> {
        let orientation = self.meshes.get(&mesh)?;
        let part = *orientation.component_of.get(triangle as usize)?;
        let is_inside_out = orientation.inside_out.get(part as usize) == Some(&true);
        let is_flipped = match orientation.has_more {
            true => hidden,
            false => orientation.flipped.binary_search(&triangle).is_ok(),
        };
        match (is_inside_out, is_flipped) {
            (true, _) => Some(OrientationFault::InsideOut),
            (_, true) => Some(OrientationFault::Flipped),
            _ => None,
        }
    }
}

/// Effect of a wrong orientation on the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OrientationEffect {
    /// Glass bends light the wrong way.
    Glass,
    /// Cameras look through triangles whose visible side is turned away.
    Hidden,
    /// Cameras see triangles whose neighbours are hidden.
    Shown,
}

impl UsedMesh<'_> {
    /// Finds triangles and closed parts with the wrong orientation. The severity depends on whether
    /// the cameras see the effect.
    pub fn check_orientation(&self, topology: &Topology, findings: &mut Vec<StressFinding>) {
        if topology.flipped_triangles.count > 0 {
            findings.extend(self.orientation_finding(
                OrientationFault::Flipped,
                (&topology.flipped_triangles, "faced the other way than most"),
            ));
        }
        let inside_out = topology.inverted_components();
        if !inside_out.is_empty() {
            let tally = CountAndFirst {
                count: inside_out.iter().map(|part| part.triangles).sum(),
                some: inside_out.iter().map(|part| part.first).collect(),
            };
            findings.extend(self.orientation_finding(
                OrientationFault::InsideOut,
                (&tally, "belong to these surfaces"),
            ));
        }
    }

    fn orientation_finding(
        &self,
        fault: OrientationFault,
        label: (&CountAndFirst, &'static str),
    ) -> Option<StressFinding> {
        let effect_on = |object| Some((self.orientation_effect(fault, object)?, object));
        let worst = self.objects.iter().find_map(|&object| effect_on(object));
        let object_facts =
            worst.map_or(self.objects.first().copied(), |(_, object)| Some(object))?;
        let (code, what) = match fault {
            OrientationFault::Flipped => (
                FindingCode::FlippedTriangles,
                "triangles are oriented differently from their neighbours",
            ),
            OrientationFault::InsideOut => (
                FindingCode::InsideOut,
                "closed surfaces are oriented inwards",
            ),
        };
        let (severity, end) = match worst {
            Some((effect, _)) => (Severity::PictureWrong, effect_text(effect)),
            None => (Severity::Harmless, self.harmless_text()),
        };
        let remedy = "flip them in the modelling program (\"recalculate outside\")";
        let words = (&*format!("{what}{end}"), remedy);
        Some(self.triangle_finding((code, severity), object_facts, label, words))
    }

    /// Returns what the cameras see of a fault on an object, or `None`.
    fn orientation_effect(
        &self,
        fault: OrientationFault,
        object_facts: &ObjectFacts<'_>,
    ) -> Option<OrientationEffect> {
        let survey = self.survey;
        let is_visible = |sightings| self.is_fault_visible_on(sightings, object_facts);
        match (object_facts.surface_kind, fault) {
            // Rays leave such a body before they enter it, but do so in pairs.
            (SurfaceKind::Body, OrientationFault::InsideOut) => {
                is_visible(&survey.sightings).then_some(OrientationEffect::Glass)
            }
            (SurfaceKind::Body, OrientationFault::Flipped) => {
                is_visible(&survey.unbalanced).then_some(OrientationEffect::Glass)
            }
            (_, OrientationFault::InsideOut) => {
                is_visible(&survey.inside_out_hidden).then_some(OrientationEffect::Hidden)
            }
            (_, OrientationFault::Flipped) if is_visible(&survey.flipped_hidden) => {
                Some(OrientationEffect::Hidden)
            }
            (_, OrientationFault::Flipped) => {
                is_visible(&survey.flipped_shown).then_some(OrientationEffect::Shown)
            }
        }
    }

    /// Returns why a wrong orientation is harmless for all objects of the mesh.
    fn harmless_text(&self) -> &'static str {
        let is_two_sided = |object: &&ObjectFacts<'_>| {
            object.surface_kind != SurfaceKind::Body && !object.hides_back_faces()
        };
        match self.objects.iter().all(is_two_sided) {
            true => "; both sides look alike, so that the fault is not visible",
            false => "; no camera sees an effect of it",
        }
    }
}

fn effect_text(effect: OrientationEffect) -> &'static str {
    match effect {
        OrientationEffect::Glass => ", so that glass bends light the wrong way there",
        OrientationEffect::Hidden => ", so that the camera sees through them",
        OrientationEffect::Shown => {
            ", so that the camera sees them where their neighbours are hidden"
        }
    }
}
