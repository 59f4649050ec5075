//! Meshes: single triangles, how they hang together, their normals and texture coordinates.

use std::collections::{BTreeMap, HashSet};

use glam::DVec3;

use super::facts::{Matter, ObjectFacts, SceneFacts, place};
use super::finding::{Code, Finding, Severity};
use super::ray_survey::{RaySurvey, Sightings};
use super::topology::{Tally, Topology, TriangleCounts};
use crate::scene::{MeshData, Model};

/// Share of the rays that see an object from which on what they see of it counts.
const SEEN: f64 = 0.01;

/// How triangles of the shown meshes hang together.
pub(super) fn topologies(facts: &SceneFacts<'_>) -> BTreeMap<usize, Topology> {
    facts
        .shown_meshes()
        .into_iter()
        .map(|(mesh, (data, _))| (mesh, Topology::of(data)))
        .collect()
}

/// What is wrong with the meshes of a scene.
pub(super) fn check(
    facts: &SceneFacts<'_>,
    topologies: &BTreeMap<usize, Topology>,
    seen: &RaySurvey,
) -> Vec<Finding> {
    let mut found = Vec::new();
    for (mesh, (data, objects)) in facts.shown_meshes() {
        let Some(topology) = topologies.get(&mesh) else {
            continue;
        };
        let shown = Shown {
            data,
            objects,
            seen,
        };
        shown.single(&TriangleCounts::of(data), &mut found);
        shown.duplicates(topology, &mut found);
        shown.edges(topology, &mut found);
        shown.flipped(topology, &mut found);
        shown.texture_coordinates(&mut found);
    }
    found
}

/// A mesh with the objects that show it.
struct Shown<'a> {
    data: &'a MeshData,
    objects: Vec<&'a ObjectFacts<'a>>,
    seen: &'a RaySurvey,
}

impl Shown<'_> {
    /// Where a triangle of an object is.
    fn place(&self, facts: &ObjectFacts<'_>, triangle: Option<u32>) -> Option<[f64; 3]> {
        let corners = self.data.indices.get(triangle? as usize)?;
        let middle = corners
            .iter()
            .map(|&corner| self.data.positions.at(corner as usize))
            .sum::<DVec3>()
            / 3.0;
        place(facts.map.transform_point3(middle))
    }

    fn finding(
        &self,
        (code, severity): (Code, Severity),
        facts: &ObjectFacts<'_>,
        (tally, of, unit): (Tally, u64, &'static str),
        (why, remedy): (&str, &str),
    ) -> Finding {
        let finding =
            Finding::new(code, severity, facts.subject, why, remedy).counted(tally.count, of, unit);
        Finding {
            primitive: tally.first,
            ..finding
        }
        .at(self.place(facts, tally.first))
    }

    fn triangles(&self) -> u64 {
        self.data.indices.len() as u64
    }

    /// Whether more than a hundredth of the rays that see an object saw something of it.
    fn is_seen(&self, sightings: &Sightings<usize>, facts: &ObjectFacts<'_>) -> bool {
        let of = |sightings| RaySurvey::count(sightings, &facts.subject.index()) as f64;
        of(sightings) > 2.0 && of(sightings) > SEEN * of(&self.seen.met)
    }

    fn single(&self, counts: &TriangleCounts, found: &mut Vec<Finding>) {
        let Some(&first) = self.objects.first() else {
            return;
        };
        let mut add =
            |code, severity, facts: &ObjectFacts<'_>, tally: Tally, words: (&str, &str)| {
                if tally.count > 0 {
                    found.push(self.finding(
                        (code, severity),
                        facts,
                        (tally, self.triangles(), "triangles"),
                        words,
                    ));
                }
            };
        let harmless = Severity::Harmless;
        let words = (
            "triangles have no area, so that no ray meets them: two corners are one, or all three lie on a line",
            "nothing, or remove them where the model is made",
        );
        add(
            Code::DegenerateTriangles,
            harmless,
            first,
            counts.degenerate,
            words,
        );
        let words = (
            "triangles are over 10,000 times as long as they are high",
            "nothing, unless shading looks broken there: mesh that part anew",
        );
        add(
            Code::SliverTriangles,
            harmless,
            first,
            counts.slivers,
            words,
        );
        let worst = self
            .objects
            .iter()
            .find(|facts| self.is_seen(&self.seen.against, facts));
        let severity = if worst.is_some() {
            Severity::PictureWrong
        } else {
            harmless
        };
        let words = (
            "all three vertex normals point to the other side than the triangle, so that it is shaded as if it were turned away",
            "compute the normals anew, or turn the triangles over",
        );
        add(
            Code::NormalsAgainstFaces,
            severity,
            worst.copied().unwrap_or(first),
            counts.against,
            words,
        );
    }

    fn duplicates(&self, topology: &Topology, found: &mut Vec<Finding>) {
        let [same, turned] = topology.duplicates;
        let tally = if same.count > 0 { same } else { turned };
        let passes = self
            .objects
            .iter()
            .find(|facts| facts.matter != Matter::Opaque && same.count > 0);
        let Some(&facts) = passes.or(self.objects.first()).filter(|_| tally.count > 0) else {
            return;
        };
        let (severity, why) = match passes {
            Some(_) => (
                Severity::PictureWrong,
                "triangles are there twice, and light that passes them is bent or dimmed twice",
            ),
            None => (
                Severity::Harmless,
                "triangles are there twice in one place; one of each two is never seen",
            ),
        };
        let what = (tally, self.triangles(), "triangles");
        found.push(self.finding(
            (Code::DuplicateTriangles, severity),
            facts,
            what,
            (why, "remove the copies"),
        ));
    }

    /// Edges of bodies that have to be closed.
    fn edges(&self, topology: &Topology, found: &mut Vec<Finding>) {
        let bodies = || {
            self.objects
                .iter()
                .filter(|facts| facts.matter == Matter::Body)
        };
        let seen = bodies().find(|facts| self.is_seen(&self.seen.unbalanced, facts));
        let Some(&facts) = seen.or(bodies().next()) else {
            return;
        };
        let severity = if seen.is_some() {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let remedy =
            "close the body, or set `thin_walled` where it is to be a pane without an inside";
        let why = match severity {
            Severity::PictureWrong => {
                "a body of glass is open: light goes in and does not come out, or the other way round, and is bent and tinted wrongly"
            }
            _ => "a body of glass has open edges; no ray of the cameras has come through one",
        };
        if topology.open.count > 0 {
            let what = (topology.open, topology.edges, "edges");
            found.push(self.finding((Code::OpenEdges, severity), facts, what, (why, remedy)));
        }
        if topology.non_manifold.count > 0 {
            let what = (topology.non_manifold, topology.edges, "edges");
            let why = "more than two triangles meet at an edge of a body of glass, so that its inside is not told from its outside";
            let remedy = "divide the body there, or remove the walls within it";
            found.push(self.finding(
                (Code::NonManifoldEdges, severity),
                facts,
                what,
                (why, remedy),
            ));
        }
    }

    /// What is turned over, by how it is seen.
    fn flipped(&self, topology: &Topology, found: &mut Vec<Finding>) {
        let inside_out = topology.inside_out();
        if topology.flipped.count == 0 && inside_out.is_empty() {
            return;
        }
        let is_wrong = |facts: &&&ObjectFacts<'_>| match facts.matter {
            Matter::Body => self.is_seen(&self.seen.unbalanced, facts),
            _ => facts.hides_back() && self.is_seen(&self.seen.backs, facts),
        };
        let worst = self.objects.iter().find(is_wrong);
        let Some(&facts) = worst.or(self.objects.first()) else {
            return;
        };
        let severity = if worst.is_some() {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let why = |what: &str| match (severity, facts.matter) {
            (Severity::PictureWrong, Matter::Body) => {
                format!("{what}, so that glass bends light the wrong way there")
            }
            (Severity::PictureWrong, _) => format!("{what}, so that the camera looks through them"),
            _ => format!("{what}; both sides are shown alike, so nothing of it is seen"),
        };
        let remedy = "turn them over where the model is made (\"recalculate outside\")";
        if topology.flipped.count > 0 {
            let what = (topology.flipped, topology.edges, "edges");
            let why = why("neighbouring triangles disagree about which side is out");
            found.push(self.finding(
                (Code::FlippedTriangles, severity),
                facts,
                what,
                (&why, remedy),
            ));
        }
        if !inside_out.is_empty() {
            let first = inside_out.iter().map(|part| part.first).min();
            let tally = Tally {
                count: inside_out.iter().map(|part| part.triangles).sum(),
                first,
            };
            let why = why("closed surfaces have their outside within");
            found.push(self.finding(
                (Code::InsideOut, severity),
                facts,
                (tally, self.triangles(), "triangles"),
                (&why, remedy),
            ));
        }
    }

    fn texture_coordinates(&self, found: &mut Vec<Finding>) {
        let mut judged = HashSet::new();
        for facts in &self.objects {
            let Some((_, material)) = facts.material.filter(|(index, _)| judged.insert(*index))
            else {
                continue;
            };
            let sets = material.uv_sets();
            let lacks = |set: u32| self.data.uvs.get(set as usize).is_none_or(Vec::is_empty);
            if let Some(set) = sets.iter().copied().find(|&set| lacks(set)) {
                let why = if set == 0 {
                    "the material shows an image and the mesh has no texture coordinates: each triangle shows its own copy of a corner of it".to_owned()
                } else {
                    format!(
                        "the material reads set {set} of texture coordinates, which the mesh does not have: one texel is shown everywhere"
                    )
                };
                let remedy = "export the mesh with texture coordinates, or take the image away";
                let finding = Finding::new(
                    Code::NoTextureCoordinates,
                    Severity::PictureWrong,
                    facts.subject,
                    why,
                    remedy,
                );
                found.push(
                    finding
                        .counted(self.triangles(), self.triangles(), "triangles")
                        .at(self.place(facts, Some(0))),
                );
                return;
            }
            let Model::Physical(m) = &material.model else {
                continue;
            };
            let Some(set) = m
                .bent_by()
                .filter(|texture| texture.uv.is_none())
                .map(|texture| texture.uv_set)
            else {
                continue;
            };
            if let Some(finding) = self.flat_coordinates(facts, set) {
                found.push(finding);
                return;
            }
        }
    }

    /// Triangles on which no direction of a normal map is known.
    fn flat_coordinates(&self, facts: &ObjectFacts<'_>, set: u32) -> Option<Finding> {
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
        let tally = Tally::of(flat.map(|(index, _)| index as u32));
        let most = 2 * tally.count > self.triangles();
        let severity = if most {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let why = "triangles with a normal map have texture coordinates without area, so that the map's directions are not known there";
        let words = (why, "unwrap the mesh anew, or give it tangents");
        let what = (tally, self.triangles(), "triangles");
        (tally.count > 0)
            .then(|| self.finding((Code::FlatTextureCoordinates, severity), facts, what, words))
    }
}
