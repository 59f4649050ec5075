//! Clipping of a mesh by a plane, triangle by triangle (Sutherland and Hodgman, "Reentrant Polygon
//! Clipping", 1974). The edges that the cut leaves in the plane form the outline of the cap.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};
use raywright_core::scene::{MeshData, VertexPositions};

use super::SectionPlane;
use super::cap::{CapCorner, CapTrapezoids, SectionOutline};

/// Result of clipping a mesh by a plane.
pub(super) enum MeshCutResult {
    /// The whole mesh is kept.
    Unchanged,
    /// No part of the mesh is kept.
    Removed,
    /// A part of the mesh is kept.
    Partial(Box<CutMesh>),
}

/// The kept part of a mesh, and the cap that closes its opening; the cap may be empty. `is_open`
/// states that a part of the opening has no cap, because the mesh is not closed.
pub(super) struct CutMesh {
    pub mesh: MeshData,
    pub cap: MeshData,
    pub is_open: bool,
}

/// State of clipping a mesh. A vertex is an entry of the mesh's vertex lists; a point is a
/// position, which several vertices can share.
pub(super) struct MeshCutter<'a> {
    data: &'a MeshData,
    /// Distance of each vertex from the plane in world space, positive on the removed side.
    heights: &'a [f64],
    map: DAffine3,
    section: &'a SectionPlane,
    out: MeshData,
    positions: Vec<DVec3>,
    /// For each new vertex: the index of the vertex's point, and whether the point lies in the
    /// plane.
    points: Vec<(u32, bool)>,
    /// Index of the new vertex that copies a kept vertex of the old mesh, by index of the old
    /// vertex.
    kept_vertices: HashMap<u32, u32>,
    edge_vertices: HashMap<[u32; 2], u32>,
    /// Index of the point of each old vertex.
    vertex_points: Vec<u32>,
    edge_points: HashMap<[u32; 2], u32>,
    /// Edges of new triangles that lie in the plane. The key is the pair of points at the ends; the
    /// value is the list of edges, each a pair of new vertices.
    plane_edges: HashMap<[u32; 2], Vec<[u32; 2]>>,
}

impl<'a> MeshCutter<'a> {
    pub fn new(
        data: &'a MeshData,
        heights: &'a [f64],
        map: DAffine3,
        section: &'a SectionPlane,
    ) -> Self {
        let mut places = HashMap::new();
        let welded: Vec<u32> = data
            .positions
            .offsets()
            .iter()
            .map(|offset| {
                let next = places.len() as u32;
                // Adding 0 maps −0 to 0.
                *places
                    .entry(offset.map(|x| (x + 0.0).to_bits()))
                    .or_insert(next)
            })
            .collect();
        let uvs = vec![Vec::new(); data.uvs.len()];
        Self {
            data,
            heights,
            map,
            section,
            out: MeshData {
                uvs,
                ..MeshData::default()
            },
            positions: Vec::new(),
            points: Vec::new(),
            kept_vertices: HashMap::new(),
            edge_vertices: HashMap::new(),
            vertex_points: welded,
            edge_points: HashMap::new(),
            plane_edges: HashMap::new(),
        }
    }

    /// Clips the mesh, and builds the cap.
    pub fn clip_mesh(mut self) -> MeshCutResult {
        let maximum = self
            .heights
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        let minimum = self.heights.iter().copied().fold(f64::INFINITY, f64::min);
        if maximum <= 0.0 && (minimum < 0.0 || self.data.indices.is_empty()) {
            return MeshCutResult::Unchanged;
        }
        if minimum >= 0.0 && maximum > 0.0 {
            return MeshCutResult::Removed;
        }
        for &triangle in &self.data.indices {
            self.clip_triangle(triangle);
        }
        let (outline, is_open) = self.section_outline();
        let cap = self.build_cap(&outline);
        self.out.positions = self.to_positions(self.positions.iter().copied());
        MeshCutResult::Partial(Box::new(CutMesh {
            mesh: self.out,
            cap,
            is_open,
        }))
    }

    /// Triangulates the outline of the cap. Each triangle has three vertices of its own.
    fn build_cap(&self, outline: &SectionOutline) -> MeshData {
        let at = |corner: CapCorner| {
            let [a, b] = corner
                .vertices
                .map(|vertex| self.positions[vertex as usize]);
            a.lerp(b, corner.fraction)
        };
        let corners: Vec<DVec3> = CapTrapezoids::from_outline(outline)
            .triangles()
            .flatten()
            .map(at)
            .collect();
        // The triangles are reversed in two cases, which cancel: if the side of greater coordinates
        // is kept, and if the transform is a reflection.
        let is_reversed = self.section.keeps_above != (self.map.matrix3.determinant() < 0.0);
        let triangle = |k: u32| {
            if is_reversed {
                [3 * k, 3 * k + 2, 3 * k + 1]
            } else {
                [3 * k, 3 * k + 1, 3 * k + 2]
            }
        };
        let indices = (0..corners.len() as u32 / 3).map(triangle).collect();
        MeshData {
            positions: self.to_positions(corners.into_iter()),
            indices,
            is_cap: true,
            ..MeshData::default()
        }
    }

    /// Converts positions to single precision relative to the origin of the mesh.
    fn to_positions(&self, points: impl Iterator<Item = DVec3>) -> VertexPositions {
        let origin = self.data.positions.origin();
        let mut positions = VertexPositions::with_origin(origin);
        positions.extend_offsets(points.map(|point| (point - origin).as_vec3().to_array()));
        positions
    }

    /// Adds the part of a triangle that lies on the kept side.
    fn clip_triangle(&mut self, triangle: [u32; 3]) {
        let heights = triangle.map(|vertex| self.heights[vertex as usize]);
        // A triangle in the plane belongs to the surface of the kept body only if it faces the
        // removed side.
        if heights == [0.0; 3] && !self.faces_removed_side(triangle) {
            return;
        }
        let mut corners = Vec::with_capacity(4);
        for i in 0..3 {
            let ([from, to], [a, b]) = (
                [triangle[i], triangle[(i + 1) % 3]],
                [heights[i], heights[(i + 1) % 3]],
            );
            if a <= 0.0 {
                corners.push(self.copy_kept_vertex(from));
            }
            if a * b < 0.0 {
                corners.push(self.cut_edge_at_plane(from, to));
            }
        }
        if corners.len() < 3 {
            return;
        }
        self.out
            .indices
            .extend((2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]));
        for i in 0..corners.len() {
            let edge = [corners[i], corners[(i + 1) % corners.len()]];
            let [(from, a), (to, b)] = edge.map(|vertex| self.points[vertex as usize]);
            if a && b && from != to {
                self.plane_edges.entry([from, to]).or_default().push(edge);
            }
        }
    }

    /// Whether a triangle that lies in the plane faces the removed side.
    fn faces_removed_side(&self, triangle: [u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|vertex| self.data.positions.position(vertex as usize));
        let normal = self.map.matrix3.inverse().transpose() * (b - a).cross(c - a);
        self.section.side_sign() * normal[self.section.axis] > 0.0
    }

    /// Returns the index of the new vertex for a kept old vertex, which is copied on first use.
    fn copy_kept_vertex(&mut self, vertex: u32) -> u32 {
        if let Some(&known) = self.kept_vertices.get(&vertex) {
            return known;
        }
        let new = self.add_interpolated_vertex(
            [vertex; 2],
            0.0,
            self.vertex_points[vertex as usize],
            self.heights[vertex as usize] == 0.0,
        );
        self.kept_vertices.insert(vertex, new);
        new
    }

    /// Returns the index of the new vertex where an edge crosses the plane. Both directions of an
    /// edge have the same new vertex. All edges between the same two points cross the plane at the
    /// same point.
    fn cut_edge_at_plane(&mut self, from: u32, to: u32) -> u32 {
        // The ends are sorted, so that both directions of an edge give the point the same bits.
        let [a, b] = if self.vertex_points[from as usize] < self.vertex_points[to as usize] {
            [from, to]
        } else {
            [to, from]
        };
        if let Some(&known) = self.edge_vertices.get(&[a, b]) {
            return known;
        }
        let next = (self.vertex_points.len() + self.edge_points.len()) as u32;
        let point = *self
            .edge_points
            .entry([a, b].map(|vertex| self.vertex_points[vertex as usize]))
            .or_insert(next);
        let [low, high] = [a, b].map(|vertex| self.heights[vertex as usize]);
        let new = self.add_interpolated_vertex([a, b], low / (low - high), point, true);
        self.edge_vertices.insert([a, b], new);
        new
    }

    /// Adds a new vertex, interpolated at the fraction `share` between two old vertices, and
    /// returns its index.
    fn add_interpolated_vertex(
        &mut self,
        [a, b]: [u32; 2],
        share: f64,
        point: u32,
        in_plane: bool,
    ) -> u32 {
        let [a, b] = [a, b].map(|vertex| vertex as usize);
        let MeshData {
            positions,
            normals,
            tangents,
            uvs,
            colours,
            ..
        } = self.data;
        self.positions
            .push(positions.position(a).lerp(positions.position(b), share));
        self.out
            .normals
            .extend((!normals.is_empty()).then(|| lerp_array(normals[a], normals[b], share)));
        self.out
            .tangents
            .extend((!tangents.is_empty()).then(|| lerp_tangent(tangents[a], tangents[b], share)));
        self.out
            .colours
            .extend((!colours.is_empty()).then(|| lerp_array(colours[a], colours[b], share)));
        for (out, set) in self.out.uvs.iter_mut().zip(uvs) {
            out.extend((!set.is_empty()).then(|| lerp_array(set[a], set[b], share)));
        }
        self.points.push((point, in_plane));
        self.points.len() as u32 - 1
    }

    /// Returns the outline of the cap, and whether the mesh is open. The outline consists of the
    /// closed loops of edges in the plane; the mesh is open if further edges form no closed loop.
    fn section_outline(&self) -> (SectionOutline, bool) {
        let mut edges: Vec<([u32; 2], [u32; 2])> = Vec::new();
        for (points, of) in &self.plane_edges {
            let opposite = self
                .plane_edges
                .get(&[points[1], points[0]])
                .map_or(0, Vec::len);
            edges.extend(
                of.iter()
                    .skip(opposite)
                    .map(|&[from, to]| ([points[1], points[0]], [to, from])),
            );
        }
        // The order of entries in a hash table differs between runs.
        edges.sort_unstable();
        let closed = build_closed_component_test(edges.iter().map(|(points, _)| *points));
        let all = edges.len();
        let axes = [1, 2].map(|k| (self.section.axis + k) % 3);
        let flat = |vertex: u32| {
            let point = self.map.transform_point3(self.positions[vertex as usize]);
            axes.map(|axis| point[axis])
        };
        let edges: Vec<_> = edges
            .iter()
            .filter(|(points, _)| closed(points[0]))
            .map(|&(_, edge)| (edge, edge.map(flat)))
            .collect();
        let is_open = edges.len() < all;
        (SectionOutline { edges }, is_open)
    }
}

/// Returns a function that tests whether the connected component of a point is closed: each point
/// of the component has as many incoming as outgoing edges.
fn build_closed_component_test(
    edges: impl Iterator<Item = [u32; 2]> + Clone,
) -> impl Fn(u32) -> bool {
    let mut parents: HashMap<u32, u32> = HashMap::new();
    fn find_root(parents: &mut HashMap<u32, u32>, point: u32) -> u32 {
        let mut root = point;
        while let Some(&parent) = parents.get(&root).filter(|parent| **parent != root) {
            root = parent;
        }
        // Every visited point is linked to the root directly (path compression), which keeps later
        // searches short.
        let mut index = point;
        while index != root {
            index = parents.insert(index, root).unwrap_or(root);
        }
        root
    }
    let mut balance: HashMap<u32, i32> = HashMap::new();
    for [from, to] in edges.clone() {
        let [a, b] = [from, to].map(|point| find_root(&mut parents, point));
        parents.insert(a, b);
        *balance.entry(from).or_default() += 1;
        *balance.entry(to).or_default() -= 1;
    }
    let roots: HashMap<u32, u32> = balance
        .keys()
        .map(|&point| (point, find_root(&mut parents, point)))
        .collect();
    let open: std::collections::HashSet<u32> = balance
        .iter()
        .filter(|(_, balance)| **balance != 0)
        .filter_map(|(point, _)| roots.get(point).copied())
        .collect();
    move |point| roots.get(&point).is_some_and(|root| !open.contains(root))
}

fn lerp_array<const N: usize>(a: [f32; N], b: [f32; N], share: f64) -> [f32; N] {
    core::array::from_fn(|i| (f64::from(a[i]) + share * (f64::from(b[i]) - f64::from(a[i]))) as f32)
}

/// Interpolates a tangent. The sign in the fourth component is not interpolated.
fn lerp_tangent(a: [f32; 4], b: [f32; 4], share: f64) -> [f32; 4] {
    let [x, y, z, _] = lerp_array(a, b, share);
    [x, y, z, a[3]]
}
