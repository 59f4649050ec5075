//! Findings about single triangles of a mesh.

use glam::DVec3;
use rayon::prelude::*;

use super::count::CountAndFirst;
use super::stray::StrayVertices;
use crate::scene::MeshData;

/// Faulty triangles of a mesh, by fault.
#[derive(Clone, Debug, Default)]
pub(super) struct TriangleDefects {
    pub degenerate: CountAndFirst,
    /// Triangles whose three vertex normals point to the opposite side.
    pub opposed_normals: CountAndFirst,
    /// Stray vertices. Triangles that reach to them are not counted as degenerate.
    pub strays: StrayVertices,
}

impl TriangleDefects {
    pub fn from_mesh(data: &MeshData) -> Self {
        const BLOCK: usize = 1 << 14;
        let strays = StrayVertices::from_mesh(data);
        let block = |(block, triangles): (usize, &[[u32; 3]])| {
            let mut counts = Self::default();
            for (i, corners) in triangles.iter().enumerate() {
                let index = (block * BLOCK + i) as u32;
                if strays.triangles.binary_search(&index).is_err() {
                    counts.classify_triangle(data, index, corners.map(|c| c as usize));
                }
            }
            counts
        };
        let plus = |a: Self, b: Self| Self {
            degenerate: a.degenerate.merge(b.degenerate),
            opposed_normals: a.opposed_normals.merge(b.opposed_normals),
            strays: StrayVertices::default(),
        };
        let counts = data
            .indices
            .par_chunks(BLOCK)
            .enumerate()
            .map(block)
            .reduce(Self::default, plus);
        Self { strays, ..counts }
    }

    fn classify_triangle(&mut self, data: &MeshData, index: u32, corners: [usize; 3]) {
        let [a, b, c] = corners.map(|corner| data.positions.position(corner));
        let (normal, longest) = ((b - a).cross(c - a), longest_edge([a, b, c]));
        let height = normal.length() / longest;
        // As validation judges single triangles: edges whose angle has no sine.
        if a == b || b == c || c == a || height <= 1e-12 * longest {
            return self.degenerate.add_item(index);
        }
        let normals = corners.map(|corner| data.normals.get(corner));
        if normals
            .iter()
            .all(|n| n.is_some_and(|n| DVec3::from(n.map(f64::from)).dot(normal) < 0.0))
        {
            self.opposed_normals.add_item(index);
        }
    }
}

fn longest_edge([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).length().max((c - b).length()).max((a - c).length())
}
