//! Meshes: single triangles, how they hang together, their normals and texture coordinates.

use std::collections::{BTreeMap, HashSet};

use glam::DVec3;

use super::cameras::{View, nearest};
use super::facts::{Matter, ObjectFacts, SceneFacts, place};
use super::finding::{Code, Finding, Severity, decimal};
use super::ray_survey::{RaySurvey, Sightings};
use super::topology::{Tally, Topology, TriangleEdge};
use super::triangles::TriangleCounts;
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
    views: &[View],
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
            views,
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
    views: &'a [View],
}

impl Shown<'_> {
    /// Where a triangle of an object is.
    fn place(&self, facts: &ObjectFacts<'_>, triangle: u32) -> DVec3 {
        let corners = self.data.indices[triangle as usize];
        self.middle(facts, &corners)
    }

    /// The middle of some corners as an object shows them.
    fn middle(&self, facts: &ObjectFacts<'_>, corners: &[u32]) -> DVec3 {
        let sum: DVec3 = corners
            .iter()
            .map(|&corner| self.data.positions.at(corner as usize))
            .sum();
        facts.map.transform_point3(sum / corners.len() as f64)
    }

    /// A finding about triangles, at the one that is nearest to a camera.
    fn about_triangles(
        &self,
        (code, severity): (Code, Severity),
        facts: &ObjectFacts<'_>,
        (tally, predicate): (&Tally, &'static str),
        (why, remedy): (&str, &str),
    ) -> Finding {
        let places = tally
            .some
            .iter()
            .map(|&triangle| (triangle, self.place(facts, triangle)));
        let near = nearest(self.views, places);
        let finding = Finding::new(code, severity, facts.subject, why, remedy).counted(
            tally.count,
            self.triangles(),
            "triangles",
            predicate,
        );
        Finding {
            primitive: near.map(|(triangle, _)| triangle),
            ..finding
        }
        .at(near.and_then(|(_, at)| place(at)))
    }

    /// A finding about edges, in the middle of the one that is nearest to a camera, with its
    /// triangle.
    fn about_edges(
        &self,
        (code, severity): (Code, Severity),
        facts: &ObjectFacts<'_>,
        (tally, of, predicate): (&Tally<TriangleEdge>, u64, &'static str),
        (why, remedy): (&str, &str),
    ) -> Finding {
        let places = tally
            .some
            .iter()
            .map(|edge| (edge.triangle, self.middle(facts, &edge.ends)));
        let near = nearest(self.views, places);
        let finding = Finding::new(code, severity, facts.subject, why, remedy);
        Finding {
            primitive: near.map(|(triangle, _)| triangle),
            ..finding.counted(tally.count, of, "edges", predicate)
        }
        .at(near.and_then(|(_, at)| place(at)))
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
        let mut add = |kind, facts: &ObjectFacts<'_>, what: (&Tally, &'static str), words| {
            if what.0.count > 0 {
                found.push(self.about_triangles(kind, facts, what, words));
            }
        };
        let harmless = Severity::Harmless;
        let words = (
            "triangles have no area, so that no ray meets them: two corners are one, or all three lie on a line",
            "nothing, or remove them where the model is made",
        );
        let what = (&counts.degenerate, "had no area");
        add((Code::DegenerateTriangles, harmless), first, what, words);
        let words = (
            "triangles are over 10,000 times as long as they are high",
            "nothing, unless shading looks broken there: mesh that part anew",
        );
        let what = (&counts.slivers, "had such a shape");
        add((Code::SliverTriangles, harmless), first, what, words);
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
        let what = (&counts.against, "had such normals");
        let facts = worst.copied().unwrap_or(first);
        add((Code::NormalsAgainstFaces, severity), facts, what, words);
    }

    fn duplicates(&self, topology: &Topology, found: &mut Vec<Finding>) {
        let [same, turned] = &topology.duplicates;
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
        let words = (why, "remove the copies");
        let kind = (Code::DuplicateTriangles, severity);
        found.push(self.about_triangles(kind, facts, (tally, "repeated another"), words));
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
        if topology.open.count > 0 {
            let (why, remedy) = open_words(topology.seam, severity);
            let what = (&topology.open, topology.edges, "had one triangle only");
            let kind = (Code::OpenEdges, severity);
            found.push(self.about_edges(kind, facts, what, (&why, &remedy)));
        }
        if topology.non_manifold.count > 0 {
            let what = (
                &topology.non_manifold,
                topology.edges,
                "had more than two triangles",
            );
            let why = "more than two triangles meet at an edge of a body of glass, so that its inside is not told from its outside";
            let remedy = "divide the body there, or remove the walls within it";
            let kind = (Code::NonManifoldEdges, severity);
            found.push(self.about_edges(kind, facts, what, (why, remedy)));
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
            let what = (&topology.flipped, "faced the other way than most");
            let why = why("triangles disagree with their neighbours about which side is out");
            let kind = (Code::FlippedTriangles, severity);
            found.push(self.about_triangles(kind, facts, what, (&why, remedy)));
        }
        if !inside_out.is_empty() {
            let tally = Tally {
                count: inside_out.iter().map(|part| part.triangles).sum(),
                some: inside_out.iter().map(|part| part.first).collect(),
            };
            let why = why("closed surfaces have their outside within");
            let (kind, what) = ((Code::InsideOut, severity), (&tally, "belonged to them"));
            found.push(self.about_triangles(kind, facts, what, (&why, remedy)));
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
                let why = match (set, is_there) {
                    (_, true) => format!(
                        "the material shows an image by set {set} of texture coordinates, which the mesh lacks or which is (0, 0) everywhere: one texel is shown everywhere"
                    ),
                    (0, false) => "the material shows an image and the mesh has no texture coordinates: each triangle shows its own copy of a corner of it".to_owned(),
                    _ => format!(
                        "the material reads set {set} of texture coordinates, which the mesh does not have: one texel is shown everywhere"
                    ),
                };
                let remedy = "export the mesh with texture coordinates, or take the image away";
                let finding = Finding::new(
                    Code::NoTextureCoordinates,
                    Severity::PictureWrong,
                    facts.subject,
                    why,
                    remedy,
                );
                let all = (0..self.triangles().min(1 << 10) as u32)
                    .map(|triangle| ((), self.place(facts, triangle)));
                let at = nearest(self.views, all).and_then(|(_, at)| place(at));
                found.push(finding.at(at));
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
        let what = (&tally, "had such coordinates");
        let kind = (Code::FlatTextureCoordinates, severity);
        (tally.count > 0).then(|| self.about_triangles(kind, facts, what, words))
    }
}

/// What open edges of glass make, and what to do.
fn open_words(seam: Option<f64>, severity: Severity) -> (String, String) {
    let is_seen = severity == Severity::PictureWrong;
    if let Some(apart) = seam {
        let seen = if is_seen {
            "rays come through it"
        } else {
            "no ray of the cameras has come through it"
        };
        // The same for meshes that differ in rounding alone.
        let apart = decimal(libm::pow(10.0, apart.log10().ceil()));
        let why = format!(
            "a body of glass has a seam: its corners there are less than {apart} metres apart, where rounding has parted what was one corner; {seen}"
        );
        let remedy =
            "merge them by distance where the model is made: 1e-5 of the mesh's size is enough";
        return (why, remedy.to_owned());
    }
    let why = if is_seen {
        "a body of glass is open: light goes in and does not come out, or the other way round, and is bent and tinted wrongly"
    } else {
        "a body of glass has open edges; no ray of the cameras has come through one"
    };
    let remedy = "close the body, or set `thin_walled` where it is to be a pane without an inside";
    (why.to_owned(), remedy.to_owned())
}
