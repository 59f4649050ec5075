//! The tree that rays walk: four-wide nodes in f32, walked in the ray's own scalar, without a branch that depends on which
//! boxes a ray enters: their number decides a step, never their order.
//!
//! It knows boxes and places; what a primitive is belongs to whoever is called at a leaf. Box tests are conservative (padded
//! boxes, exit scaled as in "Robust BVH Ray Traversal", Ize 2013), so the tree decides which primitives are tested and
//! never which one is hit.

use core::ops::{ControlFlow, Range};

use arrayvec::ArrayVec;

use crate::build::Binary;
use crate::lanes::Four;
use crate::ray::{Interval, Ray};
use crate::scalar::{Real, Vector};

/// Children of a node.
const WIDTH: usize = 4;
/// Deepest tree that a traversal has a stack for; the builder falls back to a balanced split beyond it.
const MAX_DEPTH: usize = 64;
/// Each level leaves at most three siblings behind, and a node's four children are written at once.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH + WIDTH;
/// Most primitives a leaf may hold.
pub(crate) const MAX_LEAF: u32 = 8;

/// Counts what a query does; `()` counts nothing and costs nothing.
pub trait Tally {
    /// A node's boxes were tested.
    fn node(&mut self) {}
    /// A primitive was tested.
    fn primitive(&mut self) {}
}

impl Tally for () {}

/// Visits of a query or of many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Nodes whose boxes were tested.
    pub nodes: u64,
    /// Primitives tested.
    pub primitives: u64,
}

impl Tally for Visits {
    #[inline(always)]
    fn node(&mut self) {
        self.nodes += 1;
    }
    #[inline(always)]
    fn primitive(&mut self) {
        self.primitives += 1;
    }
}

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

/// Boxes of up to four children, one array a plane: `planes[side][axis][child]` with side 0 the minima. An absent child
/// has an inverted box, which no ray enters.
#[repr(align(64))]
#[derive(Clone, Debug)]
struct Node {
    planes: [[[f32; WIDTH]; 3]; 2],
    children: [Child; WIDTH],
}

impl Node {
    const EMPTY: Self =
        Self { planes: [[[f32::INFINITY; WIDTH]; 3], [[f32::NEG_INFINITY; WIDTH]; 3]], children: [Child(Child::LEAF); WIDTH] };
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

    /// Collapses a binary tree into wide nodes by opening the child of largest surface, over and over. None when the
    /// result is deeper than a traversal's stack allows.
    pub(crate) fn collapse(binary: &Binary) -> Option<Self> {
        let count = binary.order.len();
        if binary.nodes.first().is_none_or(|root| root.count > 0) {
            return (count <= MAX_LEAF as usize).then_some(Self::leaf(count));
        }
        let area = |i: u32| {
            let e = binary.nodes[i as usize].bounds.max - binary.nodes[i as usize].bounds.min;
            e.x * e.y + e.y * e.z + e.z * e.x
        };
        let mut nodes = vec![Node::EMPTY];
        let mut work = vec![(0_usize, 0_u32, 1_usize)];
        while let Some((slot, root, depth)) = work.pop() {
            if depth > MAX_DEPTH {
                return None;
            }
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
                for axis in 0..3 {
                    nodes[slot].planes[0][axis][lane] = source.bounds.min[axis];
                    nodes[slot].planes[1][axis][lane] = source.bounds.max[axis];
                }
                nodes[slot].children[lane] = if source.count > 0 {
                    Child::leaf(source.first, source.count)
                } else {
                    work.push((nodes.len(), child, depth + 1));
                    nodes.push(Node::EMPTY);
                    Child(nodes.len() as u32 - 1)
                };
            }
        }
        Some(Self { nodes, count })
    }

    /// Bytes of nodes.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>()
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
                let (entered, count) = slabs.enter(node, far);
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

/// What the box tests of a ray share.
struct Slabs<R: Real> {
    near: R::Four,
    origin: [R::Four; 3],
    inverse: [R::Four; 3],
    /// The same, widened by 1 + 2γ(3), for the planes through which the ray leaves: the three roundings of a slab distance
    /// on either side.
    widened: [R::Four; 3],
    /// 0 where the ray enters through the minimum plane: from the sign of the reciprocal actually used, so that −0 is
    /// treated as what it does.
    entry_side: [usize; 3],
}

impl<R: Real> Slabs<R> {
    #[inline(always)]
    fn new(ray: &Ray<R>, near: R) -> Self {
        let origin = [ray.origin.x(), ray.origin.y(), ray.origin.z()];
        let inverse = [ray.direction.x(), ray.direction.y(), ray.direction.z()].map(|d| R::ONE / d);
        Self {
            near: R::Four::splat(near),
            origin: origin.map(R::Four::splat),
            inverse: inverse.map(R::Four::splat),
            widened: inverse.map(|i| R::Four::splat(i * Self::widen())),
            entry_side: inverse.map(|i| usize::from(i < R::ZERO)),
        }
    }

    /// 1 + 2γ(3): the three roundings of a slab distance on either side.
    #[inline(always)]
    fn widen() -> R {
        R::ONE + R::ROUNDOFF * R::from_f64(8.0)
    }

    /// How many children the ray enters before `far`, and these, farthest first.
    ///
    /// A ray in a slab's plane gives 0·∞ = NaN there: the comparisons are written so that NaN keeps the other bound.
    #[inline(always)]
    fn enter(&self, node: &Node, far: R) -> ([Waiting; WIDTH], usize) {
        let (mut entry, mut exit) = (self.near, R::Four::splat(far * Self::widen()));
        for axis in 0..3 {
            let (o, side) = (self.origin[axis], self.entry_side[axis]);
            entry = ((R::Four::from_f32(&node.planes[side][axis]) - o) * self.inverse[axis]).or_greater(entry);
            exit = ((R::Four::from_f32(&node.planes[1 - side][axis]) - o) * self.widened[axis]).or_less(exit);
        }
        let entered = entry.at_most(exit);
        let distances = entry.below();
        let waiting = |lane: usize| {
            let waiting = Waiting::new(node.children[lane], distances[lane]);
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
