//! Faults of single triangles of a mesh, and vertices far away from the rest of the mesh. The
//! triangles of such vertices are spikes, or too thin for any ray to hit.

use std::collections::BTreeSet;

use glam::DVec3;
use rayon::prelude::*;

use super::CountAndFirst;
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
pub(crate) struct StrayVertices {
    /// Indices of these triangles, in order.
    pub triangles: Vec<u32>,
    /// Indices of the stray vertices, in order.
    pub vertices: Vec<u32>,
    /// Radius about the middle of the mesh that holds nearly all vertices, in the mesh's own space.
    pub reach: f64,
}

impl StrayVertices {
    pub fn from_mesh(data: &MeshData) -> Self {
        let count = data.positions.len();
        if count < 2 {
            return Self::default();
        }
        let sample = || (0..count).step_by(count.div_ceil(SAMPLES));
        // Of few vertices a single one may be stray.
        let quantile = |mut values: Vec<f64>, share: f64| {
            let index = (values.len() as f64 * share) as usize;
            let index = index.min(values.len().saturating_sub(2));
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
        if reach == 0.0 || vertices.len() as f64 > (FEW * count as f64).max(1.0) {
            return Self::default();
        }
        let is_far = |corner: &u32| vertices.binary_search(corner).is_ok();
        // A triangle of which all corners are far out is a thing of its own.
        let is_spike = |&triangle: &u32| {
            let corners = data.indices[triangle as usize].iter();
            matches!(corners.filter(|c| is_far(c)).count(), 1 | 2)
        };
        let triangles: Vec<u32> = (0..data.indices.len() as u32)
            .into_par_iter()
            .filter(is_spike)
            .collect();
        let corners = triangles
            .iter()
            .flat_map(|&triangle| data.indices[triangle as usize]);
        let joined: BTreeSet<u32> = corners.filter(is_far).collect();
        Self {
            triangles,
            vertices: joined.into_iter().collect(),
            reach,
        }
    }
}

/// Faulty triangles of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct TriangleFaults {
    /// Triangles without area. Triangles that reach to stray vertices are not counted.
    pub degenerate: CountAndFirst,
    /// Triangles whose three vertex normals point to the opposite side.
    pub opposed_normals: CountAndFirst,
    pub strays: StrayVertices,
}

impl TriangleFaults {
    pub fn from_mesh(data: &MeshData) -> Self {
        let strays = StrayVertices::from_mesh(data);
        // Whether a faulty triangle has an area.
        let fault = |index: u32| {
            if strays.triangles.binary_search(&index).is_ok() {
                return None;
            }
            let corners = data.indices[index as usize].map(|corner| corner as usize);
            let [a, b, c] = corners.map(|corner| data.positions.position(corner));
            let normal = (b - a).cross(c - a);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            // As validation judges single triangles: edges whose angle has no sine.
            let is_flat =
                a == b || b == c || c == a || normal.length() <= 1e-12 * longest * longest;
            let is_opposed = || {
                corners.iter().all(|&corner| {
                    let own = data.normals.get(corner);
                    own.is_some_and(|n| DVec3::from(n.map(f64::from)).dot(normal) < 0.0)
                })
            };
            (is_flat || is_opposed()).then_some((index, !is_flat))
        };
        let triangles = (0..data.indices.len() as u32).into_par_iter();
        let faults: Vec<(u32, bool)> = triangles.filter_map(fault).collect();
        let of = |has_area: bool| {
            let own = faults.iter().filter(|(_, own)| *own == has_area);
            own.map(|(index, _)| *index).collect()
        };
        Self {
            degenerate: of(false),
            opposed_normals: of(true),
            strays,
        }
    }
}
