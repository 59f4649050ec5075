//! Findings about meshes: single triangles, connectivity and orientation.

use std::collections::BTreeMap;

use glam::DVec3;

use super::cameras::{CameraView, item_nearest_to_camera};
use super::count::CountAndFirst;
use super::facts::{ObjectFacts, SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::numbers::format_decimal;
use super::ray_survey::{RaySurvey, SightingCounts};
use super::topology::{Topology, TriangleEdge};
use super::triangles::TriangleDefects;
use super::used_mesh::UsedMesh;
use crate::scene::MeshData;

/// Share of the rays through an object above which a fault of the object shows in the picture.
const SEEN: f64 = 0.01;
/// Number of rays up to which a fault counts as unseen.
const FEW_RAYS: u64 = 2;

/// Returns the topology of each mesh in use, by the index of the mesh.
pub(super) fn mesh_topologies(scene_facts: &SceneFacts<'_>) -> BTreeMap<usize, Topology> {
    scene_facts
        .shown_meshes()
        .into_iter()
        .map(|(mesh, (data, _))| (mesh, Topology::from_mesh(data)))
        .collect()
}

/// Returns the findings about the meshes of a scene.
pub(super) fn check_meshes(
    scene_facts: &SceneFacts<'_>,
    topologies: &BTreeMap<usize, Topology>,
    survey: &RaySurvey,
    views: &[CameraView],
) -> Vec<StressFinding> {
    let mut findings = Vec::new();
    let shown = scene_facts.shown_meshes();
    let counts: BTreeMap<usize, TriangleDefects> = shown
        .iter()
        .map(|(&mesh, (data, _))| (mesh, TriangleDefects::from_mesh(data)))
        .collect();
    let is_flat = |(mesh, (data, _)): &(&usize, &(&MeshData, Vec<&ObjectFacts<'_>>))| {
        counts[*mesh].degenerate.count == data.indices.len() as u64
    };
    let flat: usize = shown
        .iter()
        .filter(is_flat)
        .map(|(_, (_, objects))| objects.len())
        .sum();
    let nothing_left = flat == scene_facts.objects.len();
    for (mesh, (data, objects)) in shown {
        let Some(topology) = topologies.get(&mesh) else {
            continue;
        };
        let shown_mesh = UsedMesh {
            scene_facts,
            data,
            objects,
            survey,
            views,
            scene_has_no_area: nothing_left,
        };
        shown_mesh.check_triangles(&counts[&mesh], &mut findings);
        shown_mesh.check_duplicates(topology, &mut findings);
        shown_mesh.check_edges(topology, &mut findings);
        shown_mesh.check_orientation(topology, &mut findings);
        findings.extend(shown_mesh.check_stray_vertices(&counts[&mesh].strays));
        findings.extend(shown_mesh.check_bubble_walls(topology));
        findings.extend(shown_mesh.check_holes(topology));
        findings.extend(shown_mesh.check_texture_coordinates());
    }
    findings
}

impl UsedMesh<'_> {
    /// Returns the centre of a triangle of an object, in world space.
    pub fn triangle_centre(&self, object_facts: &ObjectFacts<'_>, triangle: u32) -> DVec3 {
        let corners = self.data.indices[triangle as usize];
        self.corner_centroid(object_facts, &corners)
    }

    /// Returns the mean of some corners of an object, in world space.
    pub fn corner_centroid(&self, object_facts: &ObjectFacts<'_>, corners: &[u32]) -> DVec3 {
        let sum: DVec3 = corners
            .iter()
            .map(|&corner| self.data.positions.position(corner as usize))
            .sum();
        object_facts
            .object_to_world
            .transform_point3(sum / corners.len() as f64)
    }

    /// Returns a finding about triangles. Its position is the triangle nearest to a camera.
    pub fn triangle_finding(
        &self,
        (code, severity): (FindingCode, Severity),
        object_facts: &ObjectFacts<'_>,
        (tally, predicate): (&CountAndFirst, &'static str),
        (reason, remedy): (&str, &str),
    ) -> StressFinding {
        let places = tally
            .some
            .iter()
            .map(|&triangle| (triangle, self.triangle_centre(object_facts, triangle)));
        let near = item_nearest_to_camera(self.views, places);
        let finding = StressFinding::new(code, severity, object_facts.subject, reason, remedy)
            .with_count(tally.count, self.triangle_count(), "triangles", predicate);
        StressFinding {
            primitive: near.map(|(triangle, _)| triangle),
            ..finding
        }
        .with_place(near.and_then(|(_, point)| finite_point(point)))
    }

    /// Returns a finding about edges. Its position is the middle of the edge nearest to a camera;
    /// its primitive is a triangle at this edge.
    fn edge_finding(
        &self,
        (code, severity): (FindingCode, Severity),
        object_facts: &ObjectFacts<'_>,
        (tally, total, predicate): (&CountAndFirst<TriangleEdge>, u64, &'static str),
        (reason, remedy): (&str, &str),
    ) -> StressFinding {
        let places = tally.some.iter().map(|edge| {
            (
                edge.triangle,
                self.corner_centroid(object_facts, &edge.ends),
            )
        });
        let near = item_nearest_to_camera(self.views, places);
        let finding = StressFinding::new(code, severity, object_facts.subject, reason, remedy);
        StressFinding {
            primitive: near.map(|(triangle, _)| triangle),
            ..finding.with_count(tally.count, total, "edges", predicate)
        }
        .with_place(near.and_then(|(_, point)| finite_point(point)))
    }

    pub fn triangle_count(&self) -> u64 {
        self.data.indices.len() as u64
    }

    /// Returns whether a fault of an object is visible. `sightings` counts the rays that hit the
    /// fault. More than two rays must hit it, and more than a hundredth of the rays through the
    /// object.
    pub fn is_fault_visible_on(
        &self,
        sightings: &SightingCounts<usize>,
        object_facts: &ObjectFacts<'_>,
    ) -> bool {
        let index = object_facts.subject.list_index();
        let [rays, all] = [sightings, &self.survey.sightings]
            .map(|sightings| RaySurvey::sighting_count(sightings, &index));
        rays > FEW_RAYS && rays as f64 > SEEN * all as f64
    }

    fn check_triangles(&self, counts: &TriangleDefects, findings: &mut Vec<StressFinding>) {
        let Some(&first) = self.objects.first() else {
            return;
        };
        let mut add =
            |kind, object_facts: &ObjectFacts<'_>, label: (&CountAndFirst, &'static str), words| {
                if label.0.count > 0 {
                    findings.push(self.triangle_finding(kind, object_facts, label, words));
                }
            };
        let harmless = Severity::Harmless;
        let label = (&counts.degenerate, "had no area");
        let (severity, words) = self.degenerate_triangle_texts(counts);
        add(
            (FindingCode::DegenerateTriangles, severity),
            first,
            label,
            words,
        );
        let worst = self.objects.iter().find(|object_facts| {
            self.is_fault_visible_on(&self.survey.opposed_normals, object_facts)
        });
        let severity = if worst.is_some() {
            Severity::PictureWrong
        } else {
            harmless
        };
        let words = (
            "all three vertex normals of these triangles point to the back, so that the triangles are shaded as if turned away",
            "recompute the normals, or flip the triangles, in the modelling program",
        );
        let label = (&counts.opposed_normals, "had such normals");
        let object_facts = worst.copied().unwrap_or(first);
        add(
            (FindingCode::NormalsAgainstFaces, severity),
            object_facts,
            label,
            words,
        );
    }

    /// Returns the severity, the reason and the remedy for triangles without area. The picture is
    /// wrong if no object of the scene has any other triangle.
    fn degenerate_triangle_texts(
        &self,
        counts: &TriangleDefects,
    ) -> (Severity, (&'static str, &'static str)) {
        let severity = match self.scene_has_no_area {
            true => Severity::PictureWrong,
            false => Severity::Harmless,
        };
        if counts.degenerate.count < self.triangle_count() {
            let words = (
                "triangles have no area, so that no ray hits them: two corners coincide, or all three lie on a line",
                "nothing, or remove the triangles in the modelling program",
            );
            return (Severity::Harmless, words);
        }
        let words = (
            "none of its triangles has an area, so that it is invisible: a scale of 0 has flattened it, or the corners of each triangle coincide or lie on a line",
            "look for a scale of 0 in the object or its parent nodes, and replace it; if the object should be invisible, remove it",
        );
        (severity, words)
    }

    fn check_duplicates(&self, topology: &Topology, findings: &mut Vec<StressFinding>) {
        let [same, turned] = &topology.duplicates;
        let tally = if same.count > 0 { same } else { turned };
        let blended = self
            .objects
            .iter()
            .find(|object_facts| object_facts.is_blended() && same.count > 0);
        let Some(&object_facts) = blended.or(self.objects.first()).filter(|_| tally.count > 0)
        else {
            return;
        };
        let (severity, reason) = match blended {
            Some(_) => (
                Severity::PictureWrong,
                "triangles are repeated in one place, and both dim the light that passes",
            ),
            None => (
                Severity::Harmless,
                "triangles are repeated in one place; of each two, only one is seen",
            ),
        };
        let words = (
            reason,
            "remove the repeated triangles in the modelling program",
        );
        let kind = (FindingCode::DuplicateTriangles, severity);
        findings.push(self.triangle_finding(
            kind,
            object_facts,
            (tally, "repeated another"),
            words,
        ));
    }

    /// Finds irregular edges of glass bodies, which have to be closed.
    fn check_edges(&self, topology: &Topology, findings: &mut Vec<StressFinding>) {
        let bodies = || {
            self.objects
                .iter()
                .filter(|object_facts| object_facts.surface_kind == SurfaceKind::Body)
        };
        // Through a seam pass a few rays without effect. Through a hole, a few rays are its pixels.
        let has_holes = topology.open_edges.count > 0 && topology.seam.is_none();
        let is_seen = |object_facts: &&&ObjectFacts<'_>| {
            let index = object_facts.subject.list_index();
            let unbalanced = RaySurvey::sighting_count(&self.survey.unbalanced, &index);
            self.is_fault_visible_on(&self.survey.unbalanced, object_facts)
                || has_holes && unbalanced > FEW_RAYS
        };
        let seen_object_facts = bodies().find(is_seen);
        let Some(&object_facts) = seen_object_facts.or(bodies().next()) else {
            return;
        };
        let severity = if seen_object_facts.is_some() {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        if topology.open_edges.count > 0 {
            let (reason, remedy) = open_edge_texts(topology.seam, severity);
            let label = (
                &topology.open_edges,
                topology.edges,
                "had one triangle only",
            );
            let kind = (FindingCode::OpenEdges, severity);
            findings.push(self.edge_finding(kind, object_facts, label, (&reason, &remedy)));
        }
        if topology.non_manifold_edges.count > 0 {
            let label = (
                &topology.non_manifold_edges,
                topology.edges,
                "had more than two triangles",
            );
            let reason = "more than two triangles meet at edges of this glass body, so that its inside and outside are undefined there";
            let remedy = "split the body at these edges, or remove the walls inside the body";
            let kind = (FindingCode::NonManifoldEdges, severity);
            findings.push(self.edge_finding(kind, object_facts, label, (reason, remedy)));
        }
    }
}

/// Returns the reason and the remedy for open edges of glass. `seam` is the width of the seam, if
/// rounding alone has opened it.
fn open_edge_texts(seam: Option<f64>, severity: Severity) -> (String, String) {
    let is_seen = severity == Severity::PictureWrong;
    if let Some(apart) = seam {
        let seen = if is_seen {
            "rays pass through the seams"
        } else {
            "hardly any ray of the cameras passes through them"
        };
        // The same for meshes that differ in rounding alone.
        let apart = format_decimal(libm::pow(10.0, apart.log10().ceil()));
        let reason = format!(
            "this glass body has open seams: corners that should coincide are up to {apart} apart, in the units of the mesh; {seen}"
        );
        let remedy = format!(
            "merge vertices by distance in the modelling program: a distance of {apart} is enough"
        );
        return (reason, remedy);
    }
    let reason = if is_seen {
        "this glass body has holes: light that enters it does not leave it, or the reverse, and is bent and tinted wrongly"
    } else {
        "this glass body has open edges, but no ray of the cameras passes through one"
    };
    let remedy = "close the body; if it should be a pane without an inside, set `thin_walled` for its material";
    (reason.to_owned(), remedy.to_owned())
}
