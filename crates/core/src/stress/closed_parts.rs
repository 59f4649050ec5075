//! Closed parts of a mesh inside each other, and small holes in otherwise closed surfaces.

use std::collections::HashMap;

use glam::DVec3;

use super::cameras::item_nearest_to_camera;
use super::count::CountAndFirst;
use super::facts::{ObjectFacts, SurfaceKind, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::ray_survey::RaySurvey;
use super::topology::{MeshComponent, Topology};
use super::used_mesh::UsedMesh;
use crate::scene::{MeshData, SideRule};

/// Greatest number of triangles tested in total to find out which parts contain others.
const MOST_TESTS: usize = 1 << 26;
/// Greatest number of parts of a mesh for which containment is tested.
const MOST_PARTS: usize = 1000;
/// A surface counts as closed apart from its holes if at most one of `FEW` edges is open.
const FEW: u64 = 10;

/// A hole with three edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangularHole {
    corners: [u32; 3],
    /// A triangle that borders the hole.
    beside: u32,
}

impl Topology {
    /// Returns closed parts that lie inside another closed part, both oriented outwards. If they
    /// are walls of bubbles, they should be oriented inwards.
    pub fn find_outward_inner_parts(&self, data: &MeshData) -> Vec<MeshComponent> {
        if self.components.len() < 2 || self.components.len() > MOST_PARTS {
            return Vec::new();
        }
        let mut room = MOST_TESTS;
        let mut is_filled = |inner: usize| {
            let mut outer_parts = (0..self.components.len()).filter(|&outer| outer != inner);
            outer_parts.any(|outer| {
                let [outer_part, inner_part] = [outer, inner].map(|i| &self.components[i]);
                if !outer_part.encloses_outward_part(inner_part) || room < data.indices.len() {
                    return false;
                }
                room -= data.indices.len();
                self.is_triangle_inside_part(data, inner_part.first, outer as u32)
            })
        };
        let filled: Vec<usize> = (0..self.components.len())
            .filter(|&i| is_filled(i))
            .collect();
        filled
            .into_iter()
            .map(|part| self.components[part])
            .collect()
    }

    /// Returns whether a triangle is inside a closed part. A ray from the triangle then crosses the
    /// part an odd number of times.
    fn is_triangle_inside_part(&self, data: &MeshData, triangle: u32, part: u32) -> bool {
        // No direction along which models are built.
        let direction = DVec3::new(0.539_134, 0.617_291, 0.573_008);
        let corners = |triangle: usize| {
            data.indices[triangle].map(|corner| data.positions.position(corner as usize))
        };
        let from = corners(triangle as usize).iter().sum::<DVec3>() / 3.0;
        let own = (0..data.indices.len()).filter(|&i| self.component_of.get(i) == Some(&part));
        let crossings = own.filter(|&i| crosses_triangle(from, direction, corners(i)));
        crossings.count() % 2 == 1
    }

    /// Returns the holes with three edges. Empty if the mesh has any other open edge.
    pub fn find_triangular_holes(&self) -> CountAndFirst<TriangularHole> {
        let open = &self.open_edges;
        let is_all_kept = open.count == open.some.len() as u64;
        if open.count == 0 || !is_all_kept || open.count * FEW > self.edges || self.seam.is_some() {
            return CountAndFirst::default();
        }
        let mut edges_of: HashMap<u32, Vec<usize>> = HashMap::new();
        for (index, edge) in open.some.iter().enumerate() {
            for end in edge.ends {
                edges_of.entry(end).or_default().push(index);
            }
        }
        let mut holes = CountAndFirst::default();
        for (index, edge) in open.some.iter().enumerate() {
            let other =
                |end: u32, but: usize| edges_of[&end].iter().copied().find(|&other| other != but);
            let [a, b] = edge.ends;
            let (Some(from_a), Some(from_b)) = (other(a, index), other(b, index)) else {
                return CountAndFirst::default();
            };
            let across = |other: usize, end: u32| {
                let [low, high] = open.some[other].ends;
                if low == end { high } else { low }
            };
            let triangles = [index, from_a, from_b].map(|edge| open.some[edge].triangle);
            let is_alone = triangles[0] == triangles[1] || triangles[0] == triangles[2];
            let is_hole = edges_of[&a].len() == 2
                && edges_of[&b].len() == 2
                && across(from_a, a) == across(from_b, b)
                && !is_alone;
            if !is_hole {
                return CountAndFirst::default();
            }
            // Each hole is met by each of its edges.
            if index < from_a && index < from_b {
                holes.add_item(TriangularHole {
                    corners: [a, b, across(from_a, a)],
                    beside: edge.triangle,
                });
            }
        }
        holes
    }
}

/// Returns whether a ray crosses a triangle ("Fast, Minimum Storage Ray-Triangle Intersection",
/// Möller, Trumbore 1997).
fn crosses_triangle(from: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let (u_edge, v_edge) = (b - a, c - a);
    let p = direction.cross(v_edge);
    let determinant = u_edge.dot(p);
    if determinant == 0.0 {
        return false;
    }
    let s = from - a;
    let q = s.cross(u_edge);
    let [u, v, t] = [s.dot(p), direction.dot(q), v_edge.dot(q)].map(|x| x / determinant);
    u >= 0.0 && v >= 0.0 && u + v < 1.0 && t > 0.0
}

impl UsedMesh<'_> {
    /// Returns a finding about bubbles in glass whose walls are oriented the wrong way.
    pub fn check_bubble_walls(&self, topology: &Topology) -> Option<StressFinding> {
        let is_body = |object: &&&ObjectFacts<'_>| object.surface_kind == SurfaceKind::Body;
        let bodies = || self.objects.iter().filter(is_body);
        bodies().next()?;
        let filled = topology.find_outward_inner_parts(self.data);
        let seen = bodies().find(|object| self.is_fault_visible_on(&self.survey.sightings, object));
        let object_facts = seen.or(bodies().next())?;
        let severity = match seen {
            Some(_) => Severity::PictureWrong,
            None => Severity::Harmless,
        };
        let tally = CountAndFirst {
            count: filled.iter().map(|part| part.triangles).sum(),
            some: filled.iter().map(|part| part.first).collect(),
        };
        let reason = "closed surfaces inside this glass are oriented outwards like the surface around them: they are not bubbles but a second layer of glass";
        let remedy = "in the modelling program, flip the inner surfaces if they are walls of bubbles, otherwise remove them";
        let kind = (FindingCode::InsideOut, severity);
        (!filled.is_empty()).then(|| {
            let label = (&tally, "belong to these surfaces");
            self.triangle_finding(kind, object_facts, label, (reason, remedy))
        })
    }

    /// Returns a finding about triangular holes in an opaque, otherwise closed surface. The picture
    /// is wrong if a camera sees through a hole.
    pub fn check_holes(&self, topology: &Topology) -> Option<StressFinding> {
        let opaque = || {
            let all = self.objects.iter();
            all.filter(|object| object.surface_kind == SurfaceKind::Opaque)
        };
        opaque().next()?;
        let holes = topology.find_triangular_holes();
        let is_seen_through = |object: &&&ObjectFacts<'_>| match object.object.side {
            // Rays that come through it meet the inside.
            SideRule::Both => {
                let (index, survey) = (object.subject.list_index(), self.survey);
                RaySurvey::sighting_count(&survey.first_within, &index) > 0
            }
            // The inside is not there, so that they meet what is behind.
            side => {
                let is_visible = self.is_fault_visible_on(&self.survey.sightings, object);
                let faces = |hole: &TriangularHole| self.is_hole_visible_from_outside(object, hole);
                is_visible
                    && holes
                        .some
                        .iter()
                        .any(|hole| faces(hole) == (side != SideRule::Inside))
            }
        };
        let seen = opaque().find(is_seen_through);
        let &object_facts = seen.or(opaque().next())?;
        let (severity, end) = match seen {
            Some(_) => (Severity::PictureWrong, "and a camera sees through the hole"),
            None => (Severity::Harmless, "but no camera sees through the hole"),
        };
        let places = holes.some.iter().map(|hole| {
            let centre = self.corner_centroid(object_facts, &hole.corners);
            ((), centre)
        });
        let (_, place) = item_nearest_to_camera(self.views, places)?;
        let reason = format!(
            "a triangle is missing in an otherwise closed surface, {end}: light enters through the hole, and the inside or the background can show"
        );
        let remedy = "fill the hole in the modelling program";
        let (code, subject) = (FindingCode::OpenEdges, object_facts.subject);
        let finding = StressFinding::new(code, severity, subject, reason, remedy).with_count(
            holes.count,
            0,
            "holes",
            "with three edges",
        );
        Some(finding.with_place(finite_point(place)))
    }

    /// Returns whether a hole is in view of a camera on the outer side of the triangle that borders
    /// it.
    fn is_hole_visible_from_outside(
        &self,
        object_facts: &ObjectFacts<'_>,
        hole: &TriangularHole,
    ) -> bool {
        let corners = self.data.indices[hole.beside as usize];
        let [a, b, c] = corners.map(|corner| {
            let position = self.data.positions.position(corner as usize);
            object_facts.object_to_world.transform_point3(position)
        });
        let turn = object_facts.object_to_world.matrix3.determinant().signum();
        let normal = (b - a).cross(c - a) * turn;
        let centre = self.corner_centroid(object_facts, &hole.corners);
        self.views.iter().any(|view| {
            view.project_point(centre).is_some() && normal.dot(view.eye() - centre) > 0.0
        })
    }
}
