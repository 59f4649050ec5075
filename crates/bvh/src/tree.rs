//! The tree that rays walk: four-wide nodes in f32, walked in the ray's own scalar, without a branch that depends on which
//! boxes a ray enters: their number decides a step, never their order.
//!
//! It knows boxes and places; what a primitive is belongs to whoever is called at a leaf.

use core::ops::{ControlFlow, Range};

use arrayvec::ArrayVec;

use crate::binary::Binary;
use crate::lanes::Four;
use crate::ray::{Interval, Ray};
use crate::scalar::Real;
use crate::slabs::{FourBoxes, Slabs, WIDTH};
use crate::tally::Tally;

/// Deepest tree that a traversal has a stack for; the builder falls back to a balanced split beyond it.
const MAX_DEPTH: u32 = 64;
/// Each level leaves at most three siblings behind, and a node's four children are written at once.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH as usize + WIDTH;
/// Most primitives a leaf may hold.
pub(crate) const MAX_LEAF: u32 = 8;

/// An inner child names a node, a leaf a range of places, both packed in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const COUNT_SHIFT: u32 = 27;
    const FIRST_MASK: u32 = (1 << Self::COUNT_SHIFT) - 1;

    fn leaf(first: u32, count: u32) -> Self {
        debug_assert!(first <= Self::FIRST_MASK && count <= MAX_LEAF);
        Self(Self::LEAF | count << Self::COUNT_SHIFT | first)
    }

    fn range(self) -> Option<Range<usize>> {
        let first = (self.0 & Self::FIRST_MASK) as usize;
        (self.0 & Self::LEAF != 0).then(|| first..first + (self.0 >> Self::COUNT_SHIFT & 15) as usize)
    }
}

/// Up to four children with their boxes. An absent one is an empty leaf, which costs nothing to visit.
#[repr(align(64))]
#[derive(Clone, Debug)]
struct Node {
    boxes: FourBoxes,
    children: [Child; WIDTH],
}

impl Node {
    const EMPTY: Self = Self { boxes: FourBoxes::EMPTY, children: [Child(Child::LEAF); WIDTH] };

    /// How many children the ray enters before `far`, and these, farthest first.
    #[inline(always)]
    fn enter<R: Real>(&self, slabs: &Slabs<R>, far: R) -> ([Waiting; WIDTH], usize) {
        let (entered, entry) = slabs.enter(&self.boxes, far);
        let distances = entry.below();
        let waiting = |lane: usize| {
            let waiting = Waiting::new(self.children[lane], distances[lane]);
            if entered >> lane & 1 == 0 { Waiting(0) } else { waiting }
        };
        // Written out and sorted without a branch: which children a ray enters, and in which order, no predictor can guess.
        let mut four = [waiting(0), waiting(1), waiting(2), waiting(3)];
        for (a, b) in [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)] {
            let (x, y) = (four[a], four[b]);
            let ordered = x.0 > y.0;
            four[a] = if ordered { x } else { y };
            four[b] = if ordered { y } else { x };
        }
        (four, entered.count_ones() as usize)
    }
}

/// A bounding-volume hierarchy over places in an order that its build returned.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    /// Root first; empty when everything fits one leaf.
    nodes: Vec<Node>,
    /// How many there are in its leaves together.
    count: usize,
}

/// The most primitives that one tree can address.
pub const MAX_PRIMITIVES: usize = Child::FIRST_MASK as usize;

impl Tree {
    /// A single leaf: everything is visited.
    pub(crate) fn leaf(count: usize) -> Self {
        Self { nodes: Vec::new(), count }
    }

    /// Collapses a binary tree into wide nodes by opening the child of largest surface, over and over. Returns its
    /// depth too; none when that is more than a traversal's stack allows.
    pub(crate) fn collapse(binary: &Binary) -> Option<(Self, u32)> {
        let count = binary.order.len();
        if binary.nodes.first().is_none_or(|root| root.count > 0) {
            return (count <= MAX_LEAF as usize).then_some((Self::leaf(count), 0));
        }
        let area = |i: u32| {
            let e = binary.nodes[i as usize].bounds.max - binary.nodes[i as usize].bounds.min;
            e.x * e.y + e.y * e.z + e.z * e.x
        };
        let mut nodes = vec![Node::EMPTY];
        let mut deepest = 0;
        let mut work = vec![(0_usize, 0_u32, 1_u32)];
        while let Some((slot, root, depth)) = work.pop() {
            if depth > MAX_DEPTH {
                return None;
            }
            deepest = deepest.max(depth);
            let mut open: ArrayVec<u32, WIDTH> = ArrayVec::new();
            open.push(root);
            while open.len() < WIDTH {
                let inner = (0..open.len()).filter(|&k| binary.nodes[open[k] as usize].count == 0);
                let Some(widest) = inner.max_by(|&a, &b| area(open[a]).total_cmp(&area(open[b]))) else { break };
                let first = binary.nodes[open[widest] as usize].first;
                open[widest] = first;
                open.push(first + 1);
            }
            for (lane, &child) in open.iter().enumerate() {
                let source = &binary.nodes[child as usize];
                nodes[slot].boxes.set(lane, &source.bounds);
                nodes[slot].children[lane] = if source.count > 0 {
                    Child::leaf(source.first, source.count)
                } else {
                    work.push((nodes.len(), child, depth + 1));
                    nodes.push(Node::EMPTY);
                    Child(nodes.len() as u32 - 1)
                };
            }
        }
        Some((Self { nodes, count }, deepest))
    }

    /// Bytes of nodes.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>()
    }

    /// The most bytes that the nodes over so many leaves of one primitive take.
    ///
    /// A node with room left has leaves alone, two at least, or it would have opened a child; so the inner children of t nodes, t − 1,
    /// are children of full ones. With f full nodes there are n ≥ 2(t − f) + 4f − (t − 1) leaves and t − 1 ≤ 4f, so t ≤ (2n − 1)/3.
    pub(crate) fn most_bytes(leaves: u64) -> u64 {
        (leaves.saturating_mul(2).saturating_sub(1) / 3).saturating_mul(size_of::<Node>() as u64)
    }

    /// Calls `visit` with the places of each leaf that the ray may enter below the current far end, nearest first. The
    /// closure returns the new far end, or breaks.
    #[inline(always)]
    pub(crate) fn walk<R: Real, T: Tally>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        tally: &mut T,
        mut visit: impl FnMut(Range<usize>, R, &mut T) -> ControlFlow<(), R>,
    ) {
        if self.nodes.is_empty() {
            let _ = visit(0..self.count, range.max, tally);
            return;
        }
        let slabs = Slabs::new(ray, range.min);
        let mut far = range.max;
        let mut stack: ArrayVec<Waiting, STACK> = ArrayVec::new();
        let mut current = Child(0);
        loop {
            if let Some(leaf) = current.range() {
                match visit(leaf, far, tally) {
                    ControlFlow::Continue(nearer) => far = nearer,
                    ControlFlow::Break(()) => return,
                }
            } else {
                let node = &self.nodes[current.0 as usize];
                tally.node();
                let (entered, count) = node.enter(&slabs, far);
                if let Some(farther) = count.checked_sub(1) {
                    let kept = stack.len() + farther;
                    let room = stack.try_extend_from_slice(&entered);
                    debug_assert!(room.is_ok(), "the builder guarantees the depth");
                    stack.truncate(kept);
                    current = entered[farther].child();
                    continue;
                }
            }
            loop {
                let Some(waiting) = stack.pop() else { return };
                if R::from_f32(waiting.entry()) <= far * Slabs::<R>::widen() {
                    current = waiting.child();
                    break;
                }
            }
        }
    }
}

/// A child with the distance at which the ray enters it, that one in the upper half: where no distance is below zero, whole
/// numbers have the order of the distances. Zero is nothing, since no child is the root.
#[derive(Clone, Copy)]
struct Waiting(u64);

impl Waiting {
    #[inline(always)]
    fn new(child: Child, entry: f32) -> Self {
        Self(u64::from(entry.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child(self.0 as u32)
    }

    #[inline(always)]
    fn entry(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::aabb::PaddedBox;
    use crate::binary::BinaryNode;

    /// Each inner node holds a leaf and the next inner node: as deep as a tree can be.
    fn list(inner: usize) -> Binary {
        let bounds = |i: usize| PaddedBox { min: Vec3::ZERO, max: Vec3::splat((2 * inner - i) as f32) };
        // The root and the second child of each are inner, but for the last: it and the first children are leaves.
        let node = |i: usize| {
            let (first, count) = if i.is_multiple_of(2) && i < 2 * inner { (i + 1, 0) } else { (i / 2, 1) };
            BinaryNode { bounds: bounds(i), first: first as u32, count }
        };
        let nodes = (0..=2 * inner).map(node);
        Binary { nodes: nodes.collect(), order: (0..=inner as u32).collect(), parts: Vec::new() }
    }

    /// Protects: a tree is refused when it is one level deeper than a traversal's stack, and walked to its last leaf when it
    /// is not.
    #[test]
    fn depth_is_what_the_stack_holds() {
        // A wide node takes three inner nodes of a list into itself.
        let deepest = (WIDTH - 1) * MAX_DEPTH as usize;
        assert!(Tree::collapse(&list(deepest + 1)).is_none());
        let (tree, depth) = Tree::collapse(&list(deepest)).unwrap();
        assert_eq!(depth, MAX_DEPTH);
        // Every box lies before the ray, and the walk must come back to each that it leaves behind.
        let ray = Ray::<f32>::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let mut visited = vec![0; deepest + 1];
        tree.walk(&ray, Interval::positive(), &mut (), |places, far, ()| {
            places.for_each(|place| visited[place] += 1);
            ControlFlow::Continue(far)
        });
        assert!(visited.iter().all(|&times| times == 1), "{visited:?}");
    }
}
