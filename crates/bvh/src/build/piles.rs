//! Piles: sets of boxes that nearly coincide. Clustering would join only one pair of such boxes per
//! pass. A tree over a pile would hardly save time: a ray that hits the box around some of its
//! boxes hits most of them. So clustering handles a pile as a single leaf. Median splits divide
//! that leaf afterwards.

use obvhs::aabb::Aabb;
use obvhs::bvh2::node::Bvh2Node;

/// Least number of boxes that form a pile.
const MIN_BOXES: usize = 16;
/// Least ratio of two surface areas in a pile: the mean area of its boxes to the area of the box
/// around them. For patches of a surface this ratio is at most an eighth.
const MIN_AREA_RATIO: f64 = 0.25;

/// Returns the leaves with each pile replaced by one leaf. At either end of a sequence of
/// coincident boxes, up to 31 boxes may stay outside the pile.
pub(super) fn merge_coincident_boxes(leaves: &[Bvh2Node]) -> Vec<Bvh2Node> {
    let mut kept = Vec::with_capacity(leaves.len());
    append_merged_leaves(leaves, &mut kept);
    kept
}

/// Appends one leaf to `kept` if all `leaves` form a pile. Otherwise appends the leaves, with each
/// pile within a half of them replaced by one leaf. Returns the box around the leaves, and half the
/// sum of their surface areas.
fn append_merged_leaves(leaves: &[Bvh2Node], kept: &mut Vec<Bvh2Node>) -> (Aabb, f64) {
    let start = kept.len();
    let join = |(a, sum): (Aabb, f64), (b, more): (Aabb, f64)| (a.union(&b), sum + more);
    let (bounds, sum) = if leaves.len() < 2 * MIN_BOXES {
        kept.extend_from_slice(leaves);
        leaves
            .iter()
            .map(|leaf| (*leaf.aabb(), f64::from(leaf.aabb().half_area())))
            .fold((Aabb::INVALID, 0.0), join)
    } else {
        let (left, right) = leaves.split_at(leaves.len() / 2);
        let left = append_merged_leaves(left, kept);
        join(left, append_merged_leaves(right, kept))
    };
    if leaves.len() >= MIN_BOXES
        && sum >= MIN_AREA_RATIO * leaves.len() as f64 * f64::from(bounds.half_area())
    {
        kept.truncate(start);
        kept.push(Bvh2Node::new(
            bounds,
            leaves.len() as u32,
            leaves[0].first_index,
        ));
    }
    (bounds, sum)
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::*;

    fn leaves(count: usize, at: impl Fn(usize) -> f32) -> Vec<Bvh2Node> {
        let aabb = |i: usize| Aabb::new(Vec3A::splat(at(i)), Vec3A::splat(at(i) + 1.0));
        (0..count)
            .map(|i| Bvh2Node::new(aabb(i), 1, i as u32))
            .collect()
    }

    /// Protects: equal or nearly equal boxes become one leaf that refers to all of them. Boxes side
    /// by side stay separate, even beside a pile.
    #[test]
    fn what_lies_on_one_another_is_one_leaf() {
        for step in [0.0, 1e-3] {
            let piled = merge_coincident_boxes(&leaves(100, |i| i as f32 * step));
            assert!(
                piled.len() == 1 && (piled[0].prim_count, piled[0].first_index) == (100, 0),
                "{piled:?}"
            );
        }
        assert_eq!(
            merge_coincident_boxes(&leaves(MIN_BOXES - 1, |_| 0.0)).len(),
            MIN_BOXES - 1
        );
        assert_eq!(
            merge_coincident_boxes(&leaves(100, |i| i as f32)).len(),
            100
        );
        let some = merge_coincident_boxes(&leaves(128, |i| if i < 64 { 0.0 } else { i as f32 }));
        assert_eq!(
            (some.len(), some[0].prim_count, some[1].first_index),
            (65, 64, 64)
        );
    }
}
