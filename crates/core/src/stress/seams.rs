//! Seams of a mesh: slits so narrow that the corners on both sides nearly coincide, as rounding or
//! an export leaves them.

use std::collections::HashMap;

use crate::scene::MeshData;

/// Greatest separation of corners on a seam, as a share of the diagonal of the mesh's bounds.
const NEAR: f64 = 1e-4;

/// Returns the greatest separation of the corners of a seam. Returns `None` unless all open edges
/// close when nearly coincident corners are merged. Open edges run in the direction of their
/// triangle.
pub(super) fn seam_width(data: &MeshData, open: &[[u32; 2]]) -> Option<f64> {
    let at = |corner: u32| data.positions.position(corner as usize);
    let bounds = raywright_bvh::Aabb::from_points(data.positions.iter());
    let reach = NEAR * bounds.extent().length();
    if open.is_empty() || reach == 0.0 || !reach.is_finite() {
        return None;
    }
    let mut corners: Vec<u32> = open.iter().flatten().copied().collect();
    corners.sort_unstable();
    corners.dedup();
    let mut cells: HashMap<[i64; 3], u32> = HashMap::with_capacity(corners.len());
    let mut merged: HashMap<u32, u32> = HashMap::with_capacity(corners.len());
    let mut apart: f64 = 0.0;
    for corner in corners {
        let position = at(corner);
        let cell = ((position - bounds.min) / reach).floor().as_i64vec3();
        let near = (0..27)
            .map(|i| cell + glam::I64Vec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))
            .filter_map(|cell| cells.get(&cell.to_array()).copied())
            .map(|other| (at(other).distance(position), other))
            .filter(|(distance, _)| *distance <= reach)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match near {
            Some((distance, other)) => {
                apart = apart.max(distance);
                merged.insert(corner, other);
            }
            None => {
                cells.entry(cell.to_array()).or_insert(corner);
                merged.insert(corner, corner);
            }
        }
    }
    let mut balance: HashMap<[u32; 2], i64> = HashMap::new();
    for edge in open {
        let [from, to] = edge.map(|corner| merged[&corner]);
        if from != to {
            let direction = if from < to { 1 } else { -1 };
            *balance.entry([from.min(to), from.max(to)]).or_insert(0) += direction;
        }
    }
    let is_closed = apart > 0.0 && balance.values().all(|&ways| ways == 0);
    is_closed.then_some(apart)
}

#[cfg(test)]
mod tests {
    use super::super::topology::Topology;
    use crate::scene::MeshData;

    /// Two triangles back to back. The second is shifted by `apart` along x.
    fn pillow(apart: f32) -> MeshData {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.3_f32]];
        let moved = corners.map(|[x, y, z]| [x + apart, y, z]);
        let positions: Vec<[f32; 3]> = corners.into_iter().chain(moved).collect();
        let data = serde_json::json!({ "positions": positions, "indices": [[0, 1, 2], [3, 5, 4]] });
        serde_json::from_value(data).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Protects: edges opened by rounding or by narrow cracks are a seam with the right width. The
    /// wider edges of a hole are no seam.
    #[test]
    fn a_seam_is_no_hole() {
        let value_of = |apart| {
            let topology = Topology::from_mesh(&pillow(apart));
            (topology.open_edges.count, topology.seam)
        };
        let (open, seam) = value_of(1e-6);
        assert_eq!(open, 6);
        assert!(
            seam.is_some_and(|wide| (wide - 1e-6).abs() < 1e-7),
            "{seam:?}"
        );
        assert!(value_of(1e-4).1.is_some());
        assert_eq!(value_of(1e-3), (6, None));
    }
}
