//! Median splits of sets that clustering can't handle. Each split is near the median of the box
//! centres, along the axis on which these centres extend most.

use super::{LeafKind, LeafKindLookup, StopCheck};
use crate::aabb::{PaddedBox, TASK_SIZE};
use crate::binary::BinaryNode;
use crate::bvh8::WIDTH;

/// Boxes to be divided by median splits, and their leaf kinds.
pub(super) struct MedianSplit<'a> {
    pub boxes: &'a [PaddedBox],
    pub kind: LeafKindLookup<'a>,
    /// Whether all boxes have one leaf kind.
    pub is_alike: bool,
    pub stop: StopCheck<'a>,
}

impl MedianSplit<'_> {
    /// Builds a tree over the box indices `order` by median splits. The root replaces the node at
    /// index `slot`; all other nodes are appended to `nodes`. `first` is the position of `order[0]`
    /// in the leaf order of the whole tree. Returns the number of boxes visited. If `stop` cancels
    /// the build, the tree is incomplete.
    pub fn build_subtree(
        &self,
        nodes: &mut Vec<BinaryNode>,
        slot: usize,
        order: &mut [u32],
        first: usize,
    ) -> u64 {
        if self.is_leaf(order) || order.len() >= TASK_SIZE && (self.stop)() {
            let bounds = order.iter().fold(PaddedBox::EMPTY, |all, &index| {
                all.union(&self.boxes[index as usize])
            });
            nodes[slot] = BinaryNode {
                bounds,
                first: first as u32,
                count: order.len() as u32,
            };
            return 0;
        }
        let half = order.len() / 2;
        // With one leaf kind the split is at a multiple of eight, so that all leaves but one are
        // full.
        let middle = if self.is_alike && order.len() > WIDTH {
            (half + WIDTH / 2) / WIDTH * WIDTH
        } else {
            half
        };
        let pair = nodes.len();
        self.partition_by_centre(order, middle);
        nodes.extend(
            [BinaryNode {
                bounds: PaddedBox::EMPTY,
                first: 0,
                count: 0,
            }; 2],
        );
        let (left, right) = order.split_at_mut(middle);
        let looks = self.build_subtree(nodes, pair, left, first)
            + self.build_subtree(nodes, pair + 1, right, first + middle);
        let bounds = nodes[pair].bounds.union(&nodes[pair + 1].bounds);
        nodes[slot] = BinaryNode {
            bounds,
            first: pair as u32,
            count: 0,
        };
        looks + order.len() as u64
    }

    /// Whether the boxes form a leaf: a single box, or at most eight of one shared leaf kind.
    fn is_leaf(&self, order: &[u32]) -> bool {
        let kind = || (self.kind)(order[0]);
        let is_alike = || self.is_alike || order.iter().all(|&index| (self.kind)(index) == kind());
        order.len() == 1 || order.len() <= WIDTH && kind() != LeafKind::None && is_alike()
    }

    /// Moves `middle` boxes to the front of `order`: those with the least centres, along the axis
    /// on which the centres extend most. If all centres are equal, the order does not change.
    fn partition_by_centre(&self, order: &mut [u32], middle: usize) {
        // The centre is the sum of half of each bound, since the sum of the bounds may overflow
        // f32.
        let centre = |index: u32| {
            self.boxes[index as usize].min * 0.5 + self.boxes[index as usize].max * 0.5
        };
        let point = |index: u32| PaddedBox {
            min: centre(index),
            max: centre(index),
        };
        let around = order
            .iter()
            .fold(PaddedBox::EMPTY, |all, &index| all.union(&point(index)));
        let extent = around.max * 0.5 - around.min * 0.5;
        let axis = extent.max_position();
        if extent[axis] > 0.0 {
            order.select_nth_unstable_by(middle, |&a, &b| {
                centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b))
            });
        }
    }
}
