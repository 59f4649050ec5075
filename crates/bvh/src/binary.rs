//! The binary tree that builders make, before its collapse to eight-wide nodes.

use core::ops::Range;

use crate::aabb::PaddedBox;
use crate::memory::huge_page_vec;

/// A binary tree over boxes. The two children of a node are adjacent in `nodes` and come after it.
/// Each leaf contains a range of `order`.
pub(crate) struct BinaryTree {
    /// All nodes, the root first.
    pub nodes: Vec<BinaryNode>,
    /// Indices of the input boxes, leaf by leaf.
    pub order: Vec<u32>,
    /// Ranges of node indices, one for each parallel task. The children of each inner node in a
    /// range are in the same range. The ranges are adjacent and end at the last node. Empty for a
    /// small tree.
    pub parts: Vec<Range<usize>>,
}

impl BinaryTree {
    /// Creates the tree from nodes in any order, with the root first and the two children of a node
    /// adjacent. Leaves must have boxes. The boxes of inner nodes are computed from them.
    pub fn from_unsorted(nodes: &[BinaryNode], order: Vec<u32>) -> Self {
        /// Number of parts into which a tree of at least `MANY` nodes is divided for threads. A
        /// smaller tree has no parts.
        const PARTS: usize = 64;
        const MANY: usize = 1 << 14;
        let maximum = if nodes.len() < MANY {
            usize::MAX
        } else {
            PARTS
        };
        let (mut sorted, next) = copy_top_nodes(nodes, maximum);
        let mut parts = Vec::new();
        for root in next..sorted.len() {
            let start = sorted.len();
            let mut waiting = vec![root];
            while let Some(position) = waiting.pop() {
                let BinaryNode { first, count, .. } = sorted[position];
                if count == 0 {
                    let pair = sorted.len();
                    sorted[position].first = pair as u32;
                    sorted.extend([nodes[first as usize], nodes[first as usize + 1]]);
                    waiting.extend([pair + 1, pair]);
                }
            }
            parts.push(start..sorted.len());
        }
        for position in (0..sorted.len()).rev() {
            let BinaryNode { first, count, .. } = sorted[position];
            if count == 0 {
                sorted[position].bounds = sorted[first as usize]
                    .bounds
                    .union(&sorted[first as usize + 1].bounds);
            }
        }
        Self {
            nodes: sorted,
            order,
            parts,
        }
    }

    /// Number of nodes at the start of `nodes` that belong to no part.
    pub fn top_node_count(&self) -> usize {
        self.parts
            .first()
            .map_or(self.nodes.len(), |part| part.start)
    }
}

/// Copies the top of a tree breadth-first. Stops when the children of `maximum` copied nodes are
/// not copied yet. Returns the copies, and the index of the first copy whose children are not
/// copied.
fn copy_top_nodes(nodes: &[BinaryNode], maximum: usize) -> (Vec<BinaryNode>, usize) {
    let (mut sorted, mut next) = (huge_page_vec(nodes.len()), 0);
    sorted.extend(nodes.first());
    while next < sorted.len() && sorted.len() - next < maximum {
        let BinaryNode { first, count, .. } = sorted[next];
        if count == 0 {
            sorted[next].first = sorted.len() as u32;
            sorted.extend([nodes[first as usize], nodes[first as usize + 1]]);
        }
        next += 1;
    }
    (sorted, next)
}

/// Node of the binary tree. In an inner node `count` is 0, and the children are the nodes `first`
/// and `first + 1`. A leaf contains `count` entries of [`BinaryTree::order`], from index `first`
/// on.
#[derive(Clone, Copy)]
pub(crate) struct BinaryNode {
    pub bounds: PaddedBox,
    pub first: u32,
    pub count: u32,
}
