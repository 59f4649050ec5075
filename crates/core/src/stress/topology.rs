//! Connectivity of a mesh's triangles. Vertices at the same position count as one corner, even if
//! the file lists them separately.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::count::CountAndFirst;
use super::fans::{TriangleFan, find_triangle_fans};
use super::seams::seam_width;
use super::stray::StrayVertices;
use super::windings::count_flipped_triangles;
use crate::scene::MeshData;

/// An edge, by its two corners, with one of its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TriangleEdge {
    pub triangle: u32,
    pub ends: [u32; 2],
}

/// A connected part of a mesh. `first` is its first triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshComponent {
    pub triangles: u64,
    pub first: u32,
    /// Signed volume without spikes, positive if the part is oriented outwards.
    pub volume: f64,
    /// Sum of the absolute values of the terms of `volume`. It bounds the rounding error.
    volume_terms: f64,
    bounds: [DVec3; 2],
    is_closed: bool,
}

impl MeshComponent {
    /// Returns whether the part is oriented inwards. Two coinciding shells of opposite orientation
    /// have no volume beyond rounding, and count as oriented outwards.
    fn is_inverted(&self) -> bool {
        self.volume < -1e-10 * self.volume_terms
    }

    /// Returns whether both parts are closed and oriented outwards, and the bounding box of `inner`
    /// lies inside that of this part.
    pub fn encloses_outward_part(&self, inner: &Self) -> bool {
        let [least, greatest] = self.bounds;
        let is_filled = |part: &Self| part.is_closed && part.volume > 1e-10 * part.volume_terms;
        is_filled(self)
            && is_filled(inner)
            && least.cmplt(inner.bounds[0]).all()
            && greatest.cmpgt(inner.bounds[1]).all()
    }
}

/// An edge between two triangles, as a target of aimed rays. `across` are the corners opposite the
/// edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SharedEdge {
    pub ends: [u32; 2],
    pub across: [u32; 2],
}

/// Connectivity of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Topology {
    /// Triangles that repeat an earlier triangle: those with the same orientation, and those with
    /// the opposite one.
    pub duplicates: [CountAndFirst; 2],
    pub edges: u64,
    pub open_edges: CountAndFirst<TriangleEdge>,
    /// Greatest separation of the corners of a seam, if merging nearly coincident corners closes
    /// all open edges.
    pub seam: Option<f64>,
    pub non_manifold_edges: CountAndFirst<TriangleEdge>,
    /// Triangles whose orientation differs from most of their connected part.
    pub flipped_triangles: CountAndFirst,
    pub components: Vec<MeshComponent>,
    /// Index of each triangle's part in `components`. `u32::MAX` for repeated and degenerate
    /// triangles.
    pub component_of: Vec<u32>,
    /// Some edges of exactly two triangles with consistent orientation.
    pub shared_edges: Vec<SharedEdge>,
    /// Some corners that are surrounded by triangles.
    pub fans: Vec<TriangleFan>,
}

/// Number of shared edges that are kept as targets, approximately.
const AIMED: usize = 1 << 12;

impl Topology {
    pub fn from_mesh(data: &MeshData) -> Self {
        let corners = weld_vertices(data);
        let mut topology = Self::default();
        let kept = topology.mark_duplicate_triangles(&data.indices, &corners);
        let edges = sorted_edges(&data.indices, &corners, &kept);
        let mut parents: Vec<u32> = (0..data.positions.len() as u32).collect();
        let mut irregular = IrregularEdges::default();
        for run in edges.chunk_by(|a, b| a.0 == b.0) {
            topology.classify_edge(data, run, &mut irregular);
            // All corners of a triangle hang together by its edges.
            let [low, high] = [(run[0].0 >> 32) as u32, run[0].0 as u32];
            union_sets(&mut parents, low, high);
        }
        let every = (topology.shared_edges.len() / AIMED).max(1);
        topology.shared_edges = topology
            .shared_edges
            .iter()
            .copied()
            .step_by(every)
            .collect();
        if irregular.inconsistent_pairs.count > 0 {
            let turned = count_flipped_triangles(data.indices.len(), &edges);
            // A band with one side has none that are turned more than others.
            topology.flipped_triangles = if turned.count > 0 {
                turned
            } else {
                irregular.inconsistent_pairs
            };
        }
        topology.seam = seam_width(data, &irregular.open);
        let open = &irregular.corners;
        topology.fans = find_triangle_fans(&data.indices, &corners, &kept, open);
        (topology.components, topology.component_of) =
            connected_components(data, (&corners, &kept), &mut parents, open);
        topology
    }

    /// Returns whether the mesh is closed and consistently oriented. At each edge, as many
    /// triangles run in one direction as in the other.
    pub fn is_closed(&self) -> bool {
        self.edges > 0
            && self.open_edges.count == 0
            && self.flipped_triangles.count == 0
            && self.non_manifold_edges.count == 0
    }

    /// Returns the closed parts that are oriented inwards. Parts inside an outward-oriented part
    /// are left out: they are cavities.
    pub fn inverted_components(&self) -> Vec<MeshComponent> {
        const MOST: usize = 1000;
        if self.components.len() > MOST {
            return Vec::new();
        }
        let holds = |outer: &MeshComponent, inner: &MeshComponent| {
            let [least, greatest] = outer.bounds;
            outer.volume > 0.0
                && least.cmplt(inner.bounds[0]).all()
                && greatest.cmpgt(inner.bounds[1]).all()
        };
        let is_wrong = |part: &&MeshComponent| {
            part.is_closed
                && part.is_inverted()
                && !self.components.iter().any(|outer| holds(outer, part))
        };
        self.components.iter().filter(is_wrong).copied().collect()
    }

    /// Returns which triangles are kept. Triangles with coinciding corners and repetitions with the
    /// same orientation are dropped. All repetitions are counted in `duplicates`.
    fn mark_duplicate_triangles(&mut self, indices: &[[u32; 3]], corners: &[u32]) -> Vec<bool> {
        let mut sorted: Vec<([u32; 3], bool, u32)> = Vec::with_capacity(indices.len());
        for (i, triangle) in indices.iter().enumerate() {
            let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            let mut ordered = [a, b, c];
            ordered.sort_unstable();
            let is_even = [a, b, c] == ordered || [b, c, a] == ordered || [c, a, b] == ordered;
            sorted.push((ordered, is_even, i as u32));
        }
        sorted.par_sort_unstable();
        let mut kept = vec![false; indices.len()];
        for run in sorted.chunk_by(|a, b| a.0 == b.0) {
            kept[run[0].2 as usize] = true;
            for pair in run.windows(2) {
                let turned = pair[1].1 != pair[0].1;
                self.duplicates[usize::from(turned)].add_item(pair[1].2);
                kept[pair[1].2 as usize] = turned;
            }
        }
        kept
    }

    /// Classifies an edge by its triangles. `run` holds the entries of the edge from
    /// `sorted_edges`.
    fn classify_edge(
        &mut self,
        data: &MeshData,
        run: &[(u64, u32)],
        irregular: &mut IrregularEdges,
    ) {
        self.edges += 1;
        let forwards = run.iter().filter(|(_, triangle)| triangle & 1 == 0).count();
        let ends = [(run[0].0 >> 32) as u32, run[0].0 as u32];
        let edge = TriangleEdge {
            triangle: run[0].1 >> 1,
            ends,
        };
        match run.len() {
            1 => {
                self.open_edges.add_item(edge);
                let [low, high] = ends;
                let is_forwards = forwards == 1;
                irregular.open.push(if is_forwards {
                    [low, high]
                } else {
                    [high, low]
                });
            }
            2 if forwards == 1 => {
                let every = (data.indices.len() as u64 / (4 * AIMED as u64)).max(1);
                if self.edges.is_multiple_of(every) {
                    self.shared_edges
                        .extend(shared_edge(data, [run[0].1 >> 1, run[1].1 >> 1]));
                }
                return;
            }
            2 => irregular.inconsistent_pairs.add_item(edge.triangle),
            // Bodies that touch along an edge have as many triangles each way.
            _ if 2 * forwards == run.len() => return,
            _ => self.non_manifold_edges.add_item(edge),
        }
        irregular.corners.extend(ends);
    }
}

/// Edges that a closed, consistently oriented surface would not have.
#[derive(Default)]
struct IrregularEdges {
    /// Open edges, from the first to the second corner in the direction of their triangle.
    open: Vec<[u32; 2]>,
    /// Corners of irregular edges: open, inconsistently oriented, or with more than two triangles.
    corners: Vec<u32>,
    /// A triangle at each edge where the orientation of two triangles differs.
    inconsistent_pairs: CountAndFirst,
}

/// Returns the common edge of two triangles, found by vertex positions.
fn shared_edge(data: &MeshData, [one, other]: [u32; 2]) -> Option<SharedEdge> {
    let corners = |triangle: u32| data.indices[triangle as usize];
    let same =
        |a: u32, b: u32| data.positions.position(a as usize) == data.positions.position(b as usize);
    let [a, b] = [corners(one), corners(other)];
    let mut common = a
        .into_iter()
        .filter(|&corner| b.iter().any(|&o| same(corner, o)));
    let ends = [common.next()?, common.next()?];
    let apart = |of: [u32; 3]| {
        of.into_iter()
            .find(|&corner| !ends.iter().any(|&end| same(corner, end)))
    };
    Some(SharedEdge {
        ends,
        across: [apart(a)?, apart(b)?],
    })
}

/// Returns for each vertex the first vertex at the same position.
fn weld_vertices(data: &MeshData) -> Vec<u32> {
    let offsets = data.positions.offsets();
    // Both zeros are one place.
    let key = |vertex: u32| offsets[vertex as usize].map(|x| (x + 0.0).to_bits());
    let mut order: Vec<([u32; 3], u32)> = (0..offsets.len() as u32)
        .into_par_iter()
        .map(|vertex| (key(vertex), vertex))
        .collect();
    order.par_sort_unstable();
    let mut first = vec![0; offsets.len()];
    for run in order.chunk_by(|a, b| a.0 == b.0) {
        run.iter()
            .for_each(|&(_, vertex)| first[vertex as usize] = run[0].1);
    }
    first
}

/// Returns the edges of the kept triangles, sorted. Each entry holds two values:
/// - The smaller corner in the upper 32 bits, the larger corner in the lower ones.
/// - Twice the triangle's index, plus 1 if the triangle runs from the larger to the smaller corner.
fn sorted_edges(indices: &[[u32; 3]], corners: &[u32], kept: &[bool]) -> Vec<(u64, u32)> {
    let mut edges: Vec<(u64, u32)> = Vec::with_capacity(3 * indices.len());
    for (i, triangle) in indices.iter().enumerate().filter(|(i, _)| kept[*i]) {
        let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let key = u64::from(from.min(to)) << 32 | u64::from(from.max(to));
            edges.push((key, 2 * i as u32 + u32::from(from > to)));
        }
    }
    edges.par_sort_unstable();
    edges
}

fn union_find_root(parents: &mut [u32], mut corner: u32) -> u32 {
    while parents[corner as usize] != corner {
        parents[corner as usize] = parents[parents[corner as usize] as usize];
        corner = parents[corner as usize];
    }
    corner
}

fn union_sets(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (union_find_root(parents, a), union_find_root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

/// Returns the connected parts, and the index of each triangle's part. `open` lists the corners of
/// irregular edges, whose parts are not closed.
fn connected_components(
    data: &MeshData,
    (corners, kept): (&[u32], &[bool]),
    parents: &mut [u32],
    open: &[u32],
) -> (Vec<MeshComponent>, Vec<u32>) {
    let mut component_of = vec![u32::MAX; data.indices.len()];
    let mut places: HashMap<u32, usize> = HashMap::new();
    let mut parts: Vec<MeshComponent> = Vec::new();
    // A spike has so large a volume that it would decide on the orientation of its whole part.
    let spikes = StrayVertices::from_mesh(data).triangles;
    let offset =
        |corner: u32| DVec3::from(data.positions.offsets()[corner as usize].map(f64::from));
    let middle = (0..data.indices.len() as u32)
        .find(|i| !spikes.is_empty() && spikes.binary_search(i).is_err())
        .map_or(DVec3::ZERO, |i| offset(data.indices[i as usize][0]));
    for (i, triangle) in data.indices.iter().enumerate().filter(|(i, _)| kept[*i]) {
        let total = union_find_root(parents, corners[triangle[0] as usize]);
        let index = *places.entry(total).or_insert_with(|| {
            let bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            parts.push(MeshComponent {
                triangles: 0,
                first: i as u32,
                volume: 0.0,
                volume_terms: 0.0,
                bounds,
                is_closed: true,
            });
            parts.len() - 1
        });
        let [a, b, c] = triangle.map(|corner| offset(corner) - middle);
        component_of[i] = index as u32;
        let part = &mut parts[index];
        part.triangles += 1;
        if spikes.binary_search(&(i as u32)).is_ok() {
            continue;
        }
        let volume = a.dot(b.cross(c)) / 6.0;
        part.volume += volume;
        part.volume_terms += volume.abs();
        for corner in [a, b, c] {
            part.bounds = [part.bounds[0].min(corner), part.bounds[1].max(corner)];
        }
    }
    for &corner in open {
        if let Some(&index) = places.get(&union_find_root(parents, corner)) {
            parts[index].is_closed = false;
        }
    }
    (parts, component_of)
}
