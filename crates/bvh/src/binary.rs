//! A binary tree between its builders and what rays walk.

use crate::aabb::PaddedBox;

/// A binary tree as its builders leave it: children adjacent, leaves naming a range of `order`.
pub(crate) struct Binary {
    /// Root first.
    pub nodes: Vec<BinaryNode>,
    /// Positions in the input, leaf by leaf.
    pub order: Vec<u32>,
}

impl Binary {
    /// The nodes, each before its children.
    pub fn above(&self) -> Vec<u32> {
        let mut down = Vec::with_capacity(self.nodes.len());
        down.push(0);
        let mut i = 0;
        while let Some(&node) = down.get(i) {
            let BinaryNode { first, count, .. } = self.nodes[node as usize];
            if count == 0 {
                down.extend([first, first + 1]);
            }
            i += 1;
        }
        down
    }

    /// Gives the nodes the boxes of what is in them.
    pub fn refit(&mut self, boxes: &[PaddedBox]) {
        for node in self.above().into_iter().rev() {
            let BinaryNode { first, count, .. } = self.nodes[node as usize];
            let first = first as usize;
            self.nodes[node as usize].bounds = if count == 0 {
                self.nodes[first].bounds.union(&self.nodes[first + 1].bounds)
            } else {
                let own = self.order[first..first + count as usize].iter().map(|&place| boxes[place as usize]);
                own.fold(PaddedBox::NOTHING, |all, one| all.union(&one))
            };
        }
    }
}

/// Inner: `count` 0 and the children at `first` and `first + 1`. Leaf: `count` entries of the order from `first`.
#[derive(Clone, Copy)]
pub(crate) struct BinaryNode {
    pub bounds: PaddedBox,
    pub first: u32,
    pub count: u32,
}
