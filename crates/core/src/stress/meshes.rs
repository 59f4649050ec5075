//! Meshes: single triangles, how they hang together, their normals and texture coordinates.

use std::collections::{BTreeMap, HashSet};

use glam::DVec3;

use super::cameras::{CameraView, item_nearest_to_camera};
use super::count::CountAndFirst;
use super::facts::{ObjectFacts, SceneFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, Severity, StressFinding, format_decimal};
use super::ray_survey::{RaySurvey, SightingCounts};
use super::topology::{Topology, TriangleEdge};
use super::triangles::TriangleDefects;
use crate::scene::{MaterialModel, MeshData};

/// Share of the rays that see an object from which on what they see of it counts.
const SEEN: f64 = 0.01;

/// How triangles of the shown meshes hang together.
pub(super) fn mesh_topologies(scene_facts: &SceneFacts<'_>) -> BTreeMap<usize, Topology> {
    scene_facts
        .shown_meshes()
        .into_iter()
        .map(|(mesh, (data, _))| (mesh, Topology::from_mesh(data)))
        .collect()
}

/// What is wrong with the meshes of a scene.
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
            data,
            objects,
            survey,
            views,
            nothing_left,
        };
        shown_mesh.check_triangles(&counts[&mesh], &mut findings);
        shown_mesh.check_duplicates(topology, &mut findings);
        shown_mesh.check_edges(topology, &mut findings);
        shown_mesh.check_orientation(topology, &mut findings);
        shown_mesh.check_texture_coordinates(&mut findings);
    }
    findings
}

/// A mesh with the objects that show it.
struct UsedMesh<'a> {
    data: &'a MeshData,
    objects: Vec<&'a ObjectFacts<'a>>,
    survey: &'a RaySurvey,
    views: &'a [CameraView],
    /// Whether no triangle of any object has an area.
    nothing_left: bool,
}

impl UsedMesh<'_> {
    /// Where a triangle of an object is.
    fn triangle_centre(&self, object_facts: &ObjectFacts<'_>, triangle: u32) -> DVec3 {
        let corners = self.data.indices[triangle as usize];
        self.corner_centroid(object_facts, &corners)
    }

    /// The middle of some corners as an object shows them.
    fn corner_centroid(&self, object_facts: &ObjectFacts<'_>, corners: &[u32]) -> DVec3 {
        let sum: DVec3 = corners
            .iter()
            .map(|&corner| self.data.positions.position(corner as usize))
            .sum();
        object_facts
            .map
            .transform_point3(sum / corners.len() as f64)
    }

    /// A finding about triangles, at the one that is nearest to a camera.
    fn triangle_finding(
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

    /// A finding about edges, in the middle of the one that is nearest to a camera, with its
    /// triangle.
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

    fn triangle_count(&self) -> u64 {
        self.data.indices.len() as u64
    }

    /// Whether more than a hundredth of the rays that see an object saw something of it.
    fn is_visible_on(
        &self,
        sightings: &SightingCounts<usize>,
        object_facts: &ObjectFacts<'_>,
    ) -> bool {
        let value_of = |sightings| {
            RaySurvey::sighting_count(sightings, &object_facts.subject.list_index()) as f64
        };
        value_of(sightings) > 2.0 && value_of(sightings) > SEEN * value_of(&self.survey.sightings)
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
        let (severity, words) = self.words_of_degenerate(counts);
        add(
            (FindingCode::DegenerateTriangles, severity),
            first,
            label,
            words,
        );
        let words = (
            "triangles are over 10,000 times as long as they are high",
            "nothing, unless shading looks broken there: mesh that part anew",
        );
        let label = (&counts.slivers, "had such a shape");
        add(
            (FindingCode::SliverTriangles, harmless),
            first,
            label,
            words,
        );
        let worst = self
            .objects
            .iter()
            .find(|object_facts| self.is_visible_on(&self.survey.against, object_facts));
        let severity = if worst.is_some() {
            Severity::PictureWrong
        } else {
            harmless
        };
        let words = (
            "all three vertex normals point to the other side than the triangle, so that it is shaded as if it were turned away",
            "compute the normals anew, or turn the triangles over",
        );
        let label = (&counts.against, "had such normals");
        let object_facts = worst.copied().unwrap_or(first);
        add(
            (FindingCode::NormalsAgainstFaces, severity),
            object_facts,
            label,
            words,
        );
    }

    /// How bad triangles without area are, why and what to do: nothing is left of a mesh all of
    /// whose triangles are such, and of a picture in which nothing else is met.
    fn words_of_degenerate(
        &self,
        counts: &TriangleDefects,
    ) -> (Severity, (&'static str, &'static str)) {
        let severity = match self.nothing_left {
            true => Severity::PictureWrong,
            false => Severity::Harmless,
        };
        if counts.degenerate.count < self.triangle_count() {
            let words = (
                "triangles have no area, so that no ray meets them: two corners are one, or all three lie on a line",
                "nothing, or remove them where the model is made",
            );
            return (Severity::Harmless, words);
        }
        let words = (
            "no triangle of it has an area, so that nothing of it is seen: a scale of 0 has made it flat, or corners of each triangle are in one place or on a line",
            "look for a scale of 0 of it or of what it hangs on, and give it another; take the object away if it is to vanish",
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
                "triangles are there twice, and light that passes them is dimmed twice",
            ),
            None => (
                Severity::Harmless,
                "triangles are there twice in one place; one of each two is never seen",
            ),
        };
        let words = (reason, "remove the copies");
        let kind = (FindingCode::DuplicateTriangles, severity);
        findings.push(self.triangle_finding(
            kind,
            object_facts,
            (tally, "repeated another"),
            words,
        ));
    }

    /// Edges of bodies that have to be closed.
    fn check_edges(&self, topology: &Topology, findings: &mut Vec<StressFinding>) {
        let bodies = || {
            self.objects
                .iter()
                .filter(|object_facts| object_facts.matter == SurfaceKind::Body)
        };
        let seen_object_facts =
            bodies().find(|object_facts| self.is_visible_on(&self.survey.unbalanced, object_facts));
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
            let reason = "more than two triangles meet at an edge of a body of glass, so that its inside is not told from its outside";
            let remedy = "divide the body there, or remove the walls within it";
            let kind = (FindingCode::NonManifoldEdges, severity);
            findings.push(self.edge_finding(kind, object_facts, label, (reason, remedy)));
        }
    }

    /// What is turned over, by how it is seen.
    fn check_orientation(&self, topology: &Topology, findings: &mut Vec<StressFinding>) {
        let inside_out = topology.inverted_components();
        if topology.flipped_triangles.count == 0 && inside_out.is_empty() {
            return;
        }
        let is_wrong = |object_facts: &&&ObjectFacts<'_>| match object_facts.matter {
            // Rays leave a body before they enter it, but do so in pairs.
            SurfaceKind::Body if !inside_out.is_empty() => {
                self.is_visible_on(&self.survey.sightings, object_facts)
            }
            SurfaceKind::Body => self.is_visible_on(&self.survey.unbalanced, object_facts),
            _ => {
                object_facts.hides_back_faces()
                    && self.is_visible_on(&self.survey.backs, object_facts)
            }
        };
        let worst = self.objects.iter().find(is_wrong);
        let Some(&object_facts) = worst.or(self.objects.first()) else {
            return;
        };
        let severity = if worst.is_some() {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let reason = |label: &str| match (severity, object_facts.matter) {
            (Severity::PictureWrong, SurfaceKind::Body) => {
                format!("{label}, so that glass bends light the wrong way there")
            }
            (Severity::PictureWrong, _) => {
                format!("{label}, so that the camera looks through them")
            }
            _ => format!("{label}; both sides are shown alike, so nothing of it is seen"),
        };
        let remedy = "turn them over where the model is made (\"recalculate outside\")";
        if topology.flipped_triangles.count > 0 {
            let label = (&topology.flipped_triangles, "faced the other way than most");
            let reason = reason("triangles disagree with their neighbours about which side is out");
            let kind = (FindingCode::FlippedTriangles, severity);
            findings.push(self.triangle_finding(kind, object_facts, label, (&reason, remedy)));
        }
        if !inside_out.is_empty() {
            let tally = CountAndFirst {
                count: inside_out.iter().map(|part| part.triangles).sum(),
                some: inside_out.iter().map(|part| part.first).collect(),
            };
            let reason = reason("closed surfaces have their outside within");
            let (kind, label) = (
                (FindingCode::InsideOut, severity),
                (&tally, "belonged to them"),
            );
            findings.push(self.triangle_finding(kind, object_facts, label, (&reason, remedy)));
        }
    }

    fn check_texture_coordinates(&self, findings: &mut Vec<StressFinding>) {
        let mut judged = HashSet::new();
        for object_facts in &self.objects {
            let Some((_, material)) = object_facts
                .material
                .filter(|(index, _)| judged.insert(*index))
            else {
                continue;
            };
            let sets = material.uv_sets();
            // Readers put (0, 0) where a file has none.
            let lacks = |set: u32| {
                let uvs = self.data.uvs.get(set as usize);
                uvs.is_none_or(|uvs| uvs.iter().all(|uv| *uv == [0.0; 2]))
            };
            if let Some(set) = sets.iter().copied().find(|&set| lacks(set)) {
                let is_there = self
                    .data
                    .uvs
                    .get(set as usize)
                    .is_some_and(|uvs| !uvs.is_empty());
                let reason = match (set, is_there) {
                    (_, true) => format!(
                        "the material shows an image by set {set} of texture coordinates, which the mesh lacks or which is (0, 0) everywhere: one texel is shown everywhere"
                    ),
                    (0, false) => "the material shows an image and the mesh has no texture coordinates: each triangle shows its own copy of a corner of it".to_owned(),
                    _ => format!(
                        "the material reads set {set} of texture coordinates, which the mesh does not have: one texel is shown everywhere"
                    ),
                };
                let remedy = "export the mesh with texture coordinates, or take the image away";
                let finding = StressFinding::new(
                    FindingCode::NoTextureCoordinates,
                    Severity::PictureWrong,
                    object_facts.subject,
                    reason,
                    remedy,
                );
                let all = (0..self.triangle_count().min(1 << 10) as u32)
                    .map(|triangle| ((), self.triangle_centre(object_facts, triangle)));
                let at = item_nearest_to_camera(self.views, all)
                    .and_then(|(_, point)| finite_point(point));
                findings.push(finding.with_place(at));
                return;
            }
            let MaterialModel::Physical(m) = &material.model else {
                continue;
            };
            let Some(set) = m
                .active_normal_map()
                .filter(|texture| texture.uv.is_none())
                .map(|texture| texture.uv_set)
            else {
                continue;
            };
            if let Some(finding) = self.degenerate_uv_finding(object_facts, set) {
                findings.push(finding);
                return;
            }
        }
    }

    /// Triangles on which no direction of a normal map is known.
    fn degenerate_uv_finding(
        &self,
        object_facts: &ObjectFacts<'_>,
        set: u32,
    ) -> Option<StressFinding> {
        let uvs = self
            .data
            .uvs
            .get(set as usize)
            .filter(|_| self.data.tangents.is_empty())?;
        let is_flat = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| {
                uvs.get(corner as usize)
                    .copied()
                    .unwrap_or_default()
                    .map(f64::from)
            });
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            area == 0.0
        };
        let flat = self
            .data
            .indices
            .iter()
            .enumerate()
            .filter(|(_, corners)| is_flat(corners));
        let tally = CountAndFirst::from_items(flat.map(|(index, _)| index as u32));
        let most = 2 * tally.count > self.triangle_count();
        let severity = if most {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let reason = "triangles with a normal map have texture coordinates without area, so that the map's directions are not known there";
        let words = (reason, "unwrap the mesh anew, or give it tangents");
        let label = (&tally, "had such coordinates");
        let kind = (FindingCode::FlatTextureCoordinates, severity);
        (tally.count > 0).then(|| self.triangle_finding(kind, object_facts, label, words))
    }
}

/// What open edges of glass make, and what to do.
fn open_edge_texts(seam: Option<f64>, severity: Severity) -> (String, String) {
    let is_seen = severity == Severity::PictureWrong;
    if let Some(apart) = seam {
        let seen = if is_seen {
            "rays come through it"
        } else {
            "no ray of the cameras has come through it"
        };
        // The same for meshes that differ in rounding alone.
        let apart = format_decimal(libm::pow(10.0, apart.log10().ceil()));
        let reason = format!(
            "a body of glass has a seam: its corners there are less than {apart} metres apart, where rounding has parted what was one corner; {seen}"
        );
        let remedy =
            "merge them by distance where the model is made: 1e-5 of the mesh's size is enough";
        return (reason, remedy.to_owned());
    }
    let reason = if is_seen {
        "a body of glass is open: light goes in and does not come out, or the other way round, and is bent and tinted wrongly"
    } else {
        "a body of glass has open edges; no ray of the cameras has come through one"
    };
    let remedy = "close the body, or set `thin_walled` where it is to be a pane without an inside";
    (reason.to_owned(), remedy.to_owned())
}
