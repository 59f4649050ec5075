//! Merging of sparse blocks: leaves of a node that hold few primitives of the same kind.

use super::costs::leaf_test_cost;
use super::{PlannedChild, PlannedChildRef, PlannedChildren, WIDTH};
use crate::aabb::half_area;
use crate::build::LeafKind;

/// Number of primitives below which a block is sparse: it is merged with a sibling if both fit into
/// one block and the merged block costs rays less.
const SPARSE_BLOCK: usize = 5;

/// Merges sparse blocks of a node where rays test the merged block at less cost than two blocks.
pub(super) fn merge_sparse_blocks(lanes: &mut PlannedChildren) {
    while let Some((into, from)) = find_mergeable_blocks(lanes) {
        let PlannedChild {
            bounds,
            content: PlannedChildRef::Leaf(_, places),
        } = lanes.remove(from)
        else {
            break;
        };
        let into = &mut lanes[into - usize::from(from < into)];
        into.bounds = into.bounds.union(&bounds);
        if let PlannedChildRef::Leaf(_, own) = &mut into.content {
            own.extend(places);
        }
    }
}

/// Finds the pair of blocks to merge: they fit into one block, the second is sparse, and their box
/// grows least.
fn find_mergeable_blocks(lanes: &[PlannedChild]) -> Option<(usize, usize)> {
    let count = |lane: usize| match &lanes[lane].content {
        PlannedChildRef::Leaf(leaf_kind, places) => Some((*leaf_kind, places.len())),
        _ => None,
    };
    let spent = |lane: usize| {
        let (leaf_kind, own) = count(lane)?;
        Some(half_area(&lanes[lane].bounds) * leaf_test_cost(leaf_kind, own as u8))
    };
    // A merged block must cost rays less. A block of two opposite walls would be tested by every
    // ray in the room.
    let pays = |a: usize, b: usize, leaf_kind: LeafKind, together: usize| {
        let area = half_area(&lanes[a].bounds.union(&lanes[b].bounds));
        spent(a)
            .zip(spent(b))
            .is_some_and(|(a, b)| area * leaf_test_cost(leaf_kind, together as u8) < a + b)
    };
    let growth = |&(a, b): &(usize, usize)| {
        let [a, b] = [&lanes[a].bounds, &lanes[b].bounds];
        half_area(&a.union(b)) - half_area(a) - half_area(b)
    };
    if !(0..lanes.len()).any(|lane| count(lane).is_some_and(|(_, own)| own < SPARSE_BLOCK)) {
        return None;
    }
    let pairs = (0..lanes.len()).flat_map(|b| (0..lanes.len()).map(move |a| (a, b)));
    let fit = pairs.filter(|&(a, b)| {
        let fits = |((own_leaf_kind, into), (other, from))| {
            own_leaf_kind == other
                && from < SPARSE_BLOCK
                && into + from <= WIDTH
                && pays(a, b, own_leaf_kind, into + from)
        };
        a != b && count(a).zip(count(b)).is_some_and(fits)
    });
    fit.min_by(|a, b| growth(a).total_cmp(&growth(b)))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::aabb::PaddedBox;
    use crate::build::{BuildQuality, build_box_tree};
    use crate::bvh8::triangle8::LeafHeader;

    /// Returns the triangles of each block of a tree over the given boxes, by box index.
    fn blocks(boxes: &[(Vec3, Vec3)]) -> Vec<Vec<u32>> {
        let boxes: Vec<_> = boxes
            .iter()
            .map(|&(min, size)| PaddedBox {
                min,
                max: min + size,
            })
            .collect();
        let built = build_box_tree(
            &boxes,
            BuildQuality::Medium,
            &|_| LeafKind::Triangles,
            &|| false,
        )
        .expect("not stopped");
        let order = built.order.expect("a tree");
        let own = |leaf_header: &LeafHeader| {
            order[leaf_header.first as usize..][..usize::from(leaf_header.count)].to_vec()
        };
        built.bvh.leaf_headers.iter().map(own).collect()
    }

    /// Protects: two opposite walls of a room share no block, since every ray in the room would
    /// test it. Two adjacent walls share a block, and so do small triangles in a corner.
    #[test]
    fn walls_share_a_block_only_where_rays_spend_less() {
        let wall = |x: f32, y: f32| (Vec3::new(x, y, 0.0), Vec3::new(0.001, 1.0, 1.0));
        let small = |i: u8| {
            (
                Vec3::new(0.5 + 0.01 * f32::from(i), 0.5, 0.5),
                Vec3::splat(0.01),
            )
        };
        let opposite: Vec<_> = [wall(0.0, 0.0), wall(1.0, 0.0)]
            .into_iter()
            .chain((0..8).map(small))
            .collect();
        let together = |blocks: &[Vec<u32>]| {
            blocks
                .iter()
                .any(|block| block.contains(&0) && block.contains(&1))
        };
        let [apart, beside] = [blocks(&opposite), blocks(&[wall(0.0, 0.0), wall(0.0, 1.0)])];
        assert!(
            !together(&apart) && apart.iter().flatten().count() == 10,
            "{apart:?}"
        );
        assert!(apart.iter().any(|block| block.len() == 8), "{apart:?}");
        assert!(together(&beside), "{beside:?}");
    }
}
