//! Piles: sets of boxes that nearly coincide. Clustering would join the boxes of a pile one pair
//! per pass, and a tree over them would hardly save time: a ray that hits the box around some of
//! them hits most of them. So a pile is a single leaf in clustering, and is divided by median
//! splits afterwards.

use obvhs::aabb::Aabb;
use obvhs::bvh2::node::Bvh2Node;

/// Least number of boxes that form a pile.
const MIN_BOXES: usize = 16;
/// Least ratio of the mean surface area of a pile's boxes to the area of the box around them. For
/// patches of a surface the ratio is an eighth or less.
const MIN_AREA_RATIO: f64 = 0.25;

/// Replaces each pile among the leaves by one leaf. In a sequence of coincident boxes, fewer than
/// 32 at either end may stay outside piles.
pub(super) fn merge_coincident_boxes(leaves: &[Bvh2Node]) -> Vec<Bvh2Node> {
    let mut kept = Vec::with_capacity(leaves.len());
    append_merged_leaves(leaves, &mut kept);
    kept
}

/// Appends the leaves to `kept`, or a single leaf if they form a pile. Piles among parts of the
/// leaves are replaced first. Returns the box around the leaves and the sum of half their surface
/// areas.
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
