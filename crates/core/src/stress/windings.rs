//! Orientation of a mesh's triangles relative to their neighbours.

use super::count::CountAndFirst;

/// Returns the triangles whose orientation differs from most of their connected part. In a tie,
/// returns those that differ from the part's first triangle. Edges are those of `sorted_edges`.
pub(super) fn count_flipped_triangles(triangles: usize, edges: &[(u64, u32)]) -> CountAndFirst {
    let mut parents: Vec<u32> = (0..triangles as u32).collect();
    // Whether a triangle disagrees with its parent.
    let mut turns = vec![false; triangles];
    let mut path = Vec::new();
    let mut root_of = |parents: &mut [u32], turns: &mut [bool], triangle: u32| {
        let mut index = triangle;
        while parents[index as usize] != index {
            path.push(index);
            index = parents[index as usize];
        }
        let mut turn = false;
        while let Some(passed) = path.pop() {
            turn ^= turns[passed as usize];
            (parents[passed as usize], turns[passed as usize]) = (index, turn);
        }
        (index, turn)
    };
    for run in edges
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|run| run.len() == 2)
    {
        let [(a, turn_a), (b, turn_b)] =
            [run[0].1, run[1].1].map(|side| root_of(&mut parents, &mut turns, side >> 1));
        if a != b {
            let disagree = run[0].1 & 1 == run[1].1 & 1;
            parents[a.max(b) as usize] = a.min(b);
            turns[a.max(b) as usize] = turn_a ^ turn_b ^ disagree;
        }
    }
    let sides: Vec<(u32, bool)> = (0..triangles as u32)
        .map(|triangle| root_of(&mut parents, &mut turns, triangle))
        .collect();
    let mut sums = vec![[0_u32; 2]; triangles];
    for &(root, turn) in &sides {
        sums[root as usize][usize::from(turn)] += 1;
    }
    let is_turned = |&(root, turn): &(u32, bool)| {
        let [same, other] = sums[root as usize];
        turn == (other <= same) && other > 0
    };
    let turned = sides.iter().enumerate().filter(|(_, side)| is_turned(side));
    CountAndFirst::from_items(turned.map(|(triangle, _)| triangle as u32))
}
