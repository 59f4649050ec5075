//! Corners of a mesh with all the triangles around them, for rays that are aimed at them.

use std::collections::{HashMap, HashSet};

/// Corners that are kept.
const MOST: usize = 1 << 11;

/// A corner, and of each triangle around it the other two.
#[derive(Clone, Debug)]
pub(crate) struct TriangleFan {
    pub corner: u32,
    pub across: Vec<[u32; 2]>,
}

/// Some corners at which no edge is open, by corners that are one for all vertices in a place.
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
