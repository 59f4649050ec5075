//! A binary tree between its builders and what rays walk.

use core::ops::Range;

use crate::aabb::PaddedBox;

/// A binary tree as its builders leave it: children adjacent and after their parent, leaves naming
/// a range of `order`.
pub(crate) struct Binary {
    /// Root first.
    pub nodes: Vec<BinaryNode>,
    /// Positions in the input, leaf by leaf.
    pub order: Vec<u32>,
    /// Nodes whose children lie in the same range, one range after the other at the end of all
    /// nodes: what threads can work on apart. There may be none.
    pub parts: Vec<Range<usize>>,
}

impl Binary {
    /// The tree of nodes in any order, the root first, children adjacent, whose leaves have boxes;
    /// those of the others are made.
    pub fn sorted(nodes: &[BinaryNode], order: Vec<u32>) -> Self {
        /// Parts that threads can work on, where there are so many nodes.
        const PARTS: usize = 64;
        const MANY: usize = 1 << 14;
        let most = if nodes.len() < MANY {
            usize::MAX
        } else {
            PARTS
        };
        let (mut sorted, next) = level(nodes, most);
        let mut parts = Vec::new();
        for root in next..sorted.len() {
            let start = sorted.len();
            let mut waiting = vec![root];
            while let Some(at) = waiting.pop() {
                let BinaryNode { first, count, .. } = sorted[at];
                if count == 0 {
                    let pair = sorted.len();
                    sorted[at].first = pair as u32;
                    sorted.extend([nodes[first as usize], nodes[first as usize + 1]]);
                    waiting.extend([pair + 1, pair]);
                }
            }
            parts.push(start..sorted.len());
        }
        for at in (0..sorted.len()).rev() {
            let BinaryNode { first, count, .. } = sorted[at];
            if count == 0 {
                sorted[at].bounds = sorted[first as usize]
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

    /// How many nodes are in no part: the first ones.
    pub fn tops(&self) -> usize {
        self.parts
            .first()
            .map_or(self.nodes.len(), |part| part.start)
    }
}

/// Level by level from the root until so many wait for their children to follow, and where these
/// start.
fn level(nodes: &[BinaryNode], most: usize) -> (Vec<BinaryNode>, usize) {
    let (mut sorted, mut next) = (Vec::with_capacity(nodes.len()), 0);
    sorted.extend(nodes.first());
    while next < sorted.len() && sorted.len() - next < most {
        let BinaryNode { first, count, .. } = sorted[next];
        if count == 0 {
            sorted[next].first = sorted.len() as u32;
            sorted.extend([nodes[first as usize], nodes[first as usize + 1]]);
        }
        next += 1;
    }
    (sorted, next)
}

/// Inner: `count` 0 and the children at `first` and `first + 1`. Leaf: `count` entries of the order
/// from `first`.
#[derive(Clone, Copy)]
pub(crate) struct BinaryNode {
    pub bounds: PaddedBox,
    pub first: u32,
    pub count: u32,
}
