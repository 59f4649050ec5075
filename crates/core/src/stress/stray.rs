//! Vertices far away from the rest of their mesh. Their triangles are spikes, or too thin for any
//! ray to hit.

use glam::DVec3;
use rayon::prelude::*;

use super::cameras::item_nearest_to_camera;
use super::facts::{ObjectFacts, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::numbers::{format_decimal, format_metres};
use super::used_mesh::UsedMesh;
use crate::scene::MeshData;

/// Least distance of a stray vertex from the middle of the mesh, in multiples of its reach.
const FAR: f64 = 1e4;
/// Greatest number of vertices from which the middle and the reach of a mesh are estimated.
const SAMPLES: usize = 1 << 12;
/// `NEARLY_ALL`: share of the sampled vertices within the mesh's reach. `FEW`: greatest share of
/// all vertices that may be stray.
const NEARLY_ALL: f64 = 0.95;
const FEW: f64 = 0.01;

/// Stray vertices of a mesh, and the triangles that connect them with the rest.
#[derive(Clone, Debug, Default)]
pub(super) struct StrayVertices {
    /// Indices of these triangles, in order.
    pub triangles: Vec<u32>,
    /// Indices of the stray vertices, in order.
    pub vertices: Vec<u32>,
    /// Radius about the middle of the mesh that holds nearly all vertices, in the mesh's own space.
    reach: f64,
}

impl StrayVertices {
    pub fn from_mesh(data: &MeshData) -> Self {
        let count = data.positions.len();
        if count == 0 {
            return Self::default();
        }
        let sample = || (0..count).step_by(count.div_ceil(SAMPLES));
        let quantile = |mut values: Vec<f64>, share: f64| {
            let index = (values.len() as f64 * share) as usize;
            let index = index.min(values.len() - 1);
            *values.select_nth_unstable_by(index, f64::total_cmp).1
        };
        let along = |axis: usize| sample().map(move |i| data.positions.position(i)[axis]);
        let middle = DVec3::from([0, 1, 2].map(|axis| quantile(along(axis).collect(), 0.5)));
        let distance = |vertex: usize| data.positions.position(vertex).distance(middle);
        let reach = quantile(sample().map(distance).collect(), NEARLY_ALL);
        let vertices: Vec<u32> = (0..count as u32)
            .into_par_iter()
            .filter(|&vertex| distance(vertex as usize) > FAR * reach)
            .collect();
        if vertices.is_empty()
            || reach == 0.0
            || vertices.len() as f64 > (FEW * count as f64).max(1.0)
        {
            return Self::default();
        }
        let far = |corner: &u32| vertices.binary_search(corner).is_ok();
        // A triangle of which all corners are far out is a thing of its own.
        let triangles: Vec<u32> = (0..data.indices.len() as u32)
            .into_par_iter()
            .filter(|&triangle| {
                let number = data.indices[triangle as usize]
                    .iter()
                    .filter(|c| far(c))
                    .count();
                number == 1 || number == 2
            })
            .collect();
        let mut joined: Vec<u32> = triangles
            .iter()
            .flat_map(|&triangle| data.indices[triangle as usize])
            .filter(far)
            .collect();
        joined.sort_unstable();
        joined.dedup();
        Self {
            triangles,
            vertices: joined,
            reach,
        }
    }
}

impl UsedMesh<'_> {
    /// Returns a finding that names the first stray vertex. The picture is wrong if a camera has
    /// the other ends of its triangles in view.
    pub fn check_stray_vertices(&self, strays: &StrayVertices) -> Option<StressFinding> {
        let (&vertex, &object_facts) = (strays.vertices.first()?, self.objects.first()?);
        let is_seen = |point| {
            self.views
                .iter()
                .any(|view| view.project_point(point).is_some())
        };
        let scale = object_facts
            .object_to_world
            .matrix3
            .determinant()
            .abs()
            .cbrt();
        // The mesh hides many of the near ends, and hardly any point far out on a spike.
        let at = |distance: f64| {
            let places = self.places_on_spikes(strays, object_facts, distance);
            item_nearest_to_camera(self.views, places.into_iter())
        };
        let far_out = [1.0, 2.0, 0.5].into_iter().find_map(|reaches| {
            at(reaches * strays.reach * scale).filter(|(_, place)| is_seen(*place))
        });
        let (triangle, place) = far_out.or_else(|| at(0.0))?;
        let (severity, end) = match is_seen(place) {
            true => (Severity::PictureWrong, ""),
            false => (Severity::Harmless, "; no camera has it in view"),
        };
        let [x, y, z] = self
            .vertex_position(object_facts, vertex)
            .to_array()
            .map(format_decimal);
        let (named, what) = match strays.vertices.len() {
            1 => (format!("vertex {vertex} is"), "it"),
            more => (format!("vertex {vertex} and {} more are", more - 1), "them"),
        };
        let reason = format!(
            "{named} far out, at ({x}, {y}, {z}) metres, while nearly all others are within {} of the middle of the mesh: the triangles that reach to {what} are spikes, or too thin for any ray to hit{end}",
            format_metres(strays.reach * scale)
        );
        let remedy = format!(
            "in the modelling program, move {what} to the rest of the mesh, or remove {what}: probably a coordinate has lost its decimal point, or was not set"
        );
        let (code, subject) = (FindingCode::StrayVertices, object_facts.subject);
        let finding = StressFinding::new(code, severity, subject, reason, remedy)
            .with_count(
                strays.triangles.len() as u64,
                self.triangle_count(),
                "triangles",
                "reach to such a vertex",
            )
            .with_primitive(triangle);
        Some(finding.with_place(finite_point(place)))
    }

    /// Returns the stray triangles, each with points at a distance in metres from the corners that
    /// are not stray, towards its stray vertex.
    fn places_on_spikes(
        &self,
        strays: &StrayVertices,
        object_facts: &ObjectFacts<'_>,
        distance: f64,
    ) -> Vec<(u32, DVec3)> {
        let is_stray = |corner: &u32| strays.vertices.binary_search(corner).is_ok();
        let at = |corner: u32| self.vertex_position(object_facts, corner);
        let of_triangle = |&triangle: &u32| {
            let corners = self.data.indices[triangle as usize];
            let tip = corners
                .into_iter()
                .find(is_stray)
                .map(at)
                .unwrap_or_default();
            let near = corners.into_iter().filter(move |corner| !is_stray(corner));
            near.map(move |corner| {
                let start = at(corner);
                (
                    triangle,
                    start + (tip - start).normalize_or_zero() * distance,
                )
            })
        };
        strays.triangles.iter().flat_map(of_triangle).collect()
    }

    fn vertex_position(&self, object_facts: &ObjectFacts<'_>, vertex: u32) -> DVec3 {
        let position = self.data.positions.position(vertex as usize);
        object_facts.object_to_world.transform_point3(position)
    }
}
