//! Corners of a mesh with the triangles around them, as targets of aimed rays.

use std::collections::{HashMap, HashSet};

/// Greatest number of corners that are kept.
const MOST: usize = 1 << 11;

/// A corner with its triangles. Each triangle is stored as its two other corners.
#[derive(Clone, Debug)]
pub(crate) struct TriangleFan {
    pub corner: u32,
    pub across: Vec<[u32; 2]>,
}

/// Returns corners that are surrounded by triangles: none of their edges is open. `corners` maps
/// each vertex to the first vertex at its position. `kept` marks the triangles in use. `open` lists
/// the corners with an irregular edge.
pub(super) fn find_triangle_fans(
    indices: &[[u32; 3]],
    corners: &[u32],
    kept: &[bool],
    open: &[u32],
) -> Vec<TriangleFan> {
    let open: HashSet<u32> = open.iter().copied().collect();
    let own: Vec<u32> = (0..corners.len() as u32)
        .filter(|&v| corners[v as usize] == v && !open.contains(&v))
        .collect();
    let every = own.len().div_ceil(MOST).max(1);
    let mut fans: Vec<TriangleFan> = own
        .into_iter()
        .step_by(every)
        .map(|corner| TriangleFan {
            corner,
            across: Vec::new(),
        })
        .collect();
    let places: HashMap<u32, usize> = fans
        .iter()
        .enumerate()
        .map(|(index, fan)| (fan.corner, index))
        .collect();
    for (triangle, _) in indices.iter().zip(kept).filter(|(_, kept)| **kept) {
        for turn in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|k| triangle[(k + turn) % 3]);
            if let Some(&index) = places.get(&corners[a as usize]) {
                fans[index].across.push([b, c]);
            }
        }
    }
    fans.retain(|fan| fan.across.len() >= 3);
    fans
}
