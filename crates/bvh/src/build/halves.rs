//! What clustering can't take is halved: by the median of centres, or near it, along the axis on
//! which they differ most.

use super::{LeafKind, LeafKindOf, Stop};
use crate::aabb::{PIECE, PaddedBox};
use crate::binary::BinaryNode;
use crate::bvh8::WIDTH;

/// Boxes that are halved, and what may share a leaf.
pub(super) struct Halves<'a> {
    pub boxes: &'a [PaddedBox],
    pub kind: LeafKindOf<'a>,
    /// Whether all are of one kind.
    pub is_alike: bool,
    pub stop: Stop<'a>,
}

impl Halves<'_> {
    /// Makes a node the root of a tree over some boxes, whose nodes are appended; these begin at
    /// `first` in the order of the whole tree. Returns how many boxes were looked at; given up, it
    /// is not the whole tree.
    pub fn halve(
        &self,
        nodes: &mut Vec<BinaryNode>,
        slot: usize,
        order: &mut [u32],
        first: usize,
    ) -> u64 {
        if self.is_leaf(order) || order.len() >= PIECE && (self.stop)() {
            let bounds = order.iter().fold(PaddedBox::NOTHING, |all, &place| {
                all.union(&self.boxes[place as usize])
            });
            nodes[slot] = BinaryNode {
                bounds,
                first: first as u32,
                count: order.len() as u32,
            };
            return 0;
        }
        let half = order.len() / 2;
        // Leaves of one kind are full, all but one.
        let middle = if self.is_alike && order.len() > WIDTH {
            (half + WIDTH / 2) / WIDTH * WIDTH
        } else {
            half
        };
        let pair = nodes.len();
        self.part(order, middle);
        nodes.extend(
            [BinaryNode {
                bounds: PaddedBox::NOTHING,
                first: 0,
                count: 0,
            }; 2],
        );
        let (left, right) = order.split_at_mut(middle);
        let looks = self.halve(nodes, pair, left, first)
            + self.halve(nodes, pair + 1, right, first + middle);
        let bounds = nodes[pair].bounds.union(&nodes[pair + 1].bounds);
        nodes[slot] = BinaryNode {
            bounds,
            first: pair as u32,
            count: 0,
        };
        looks + order.len() as u64
    }

    /// Whether it is one box or few that may share a leaf.
    fn is_leaf(&self, order: &[u32]) -> bool {
        let kind = || (self.kind)(order[0]);
        let is_alike = || self.is_alike || order.iter().all(|&place| (self.kind)(place) == kind());
        order.len() == 1 || order.len() <= WIDTH && kind() != LeafKind::None && is_alike()
    }

    /// Puts the lesser centres first, so many; equal ones stay where they are.
    fn part(&self, order: &mut [u32], middle: usize) {
        // Half of it each, since the sum may leave the range of f32.
        let centre = |place: u32| {
            self.boxes[place as usize].min * 0.5 + self.boxes[place as usize].max * 0.5
        };
        let point = |place: u32| PaddedBox {
            min: centre(place),
            max: centre(place),
        };
        let around = order
            .iter()
            .fold(PaddedBox::NOTHING, |all, &place| all.union(&point(place)));
        let extent = around.max * 0.5 - around.min * 0.5;
        let axis = extent.max_position();
        if extent[axis] > 0.0 {
            order.select_nth_unstable_by(middle, |&a, &b| {
                centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b))
            });
        }
    }
}
