//! The tree that rays walk: four-wide nodes in f32, walked in the ray's own scalar.
//!
//! It knows boxes and ids; what a primitive is belongs to whoever is called at a leaf. Box tests are conservative (padded
//! boxes, exit scaled as in "Robust BVH Ray Traversal", Ize 2013), so the tree decides which primitives are tested and
//! never which one is hit.

use core::ops::ControlFlow;

use arrayvec::ArrayVec;

use crate::build::Binary;
use crate::ray::{Interval, Ray};
use crate::scalar::{Real, Vector};

/// Children of a node.
const WIDTH: usize = 4;
/// Deepest tree that a traversal has a stack for; the builder falls back to a balanced split beyond it.
const MAX_DEPTH: usize = 64;
/// Each level leaves at most three siblings behind.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH + 1;
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

/// An inner child names a node, a leaf a range of the item list, both packed in 32 bits.
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

    fn range(self) -> Option<core::ops::Range<usize>> {
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

/// A bounding-volume hierarchy over ids.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    /// Root first; empty when everything fits one leaf.
    nodes: Vec<Node>,
    /// Ids in leaf order.
    items: Vec<u32>,
}

/// The most primitives that one tree can address.
pub const MAX_PRIMITIVES: usize = Child::FIRST_MASK as usize;

impl Tree {
    /// Collapses a binary tree into wide nodes by opening the child of largest surface, over and over. None when the
    /// result is deeper than a traversal's stack allows.
    pub(crate) fn collapse(binary: &Binary, ids: &[u32]) -> Option<Self> {
        let items: Vec<u32> = binary.order.iter().map(|&i| ids[i as usize]).collect();
        if items.len() <= MAX_LEAF as usize || binary.nodes.first().is_none_or(|root| root.count > 0) {
            return (items.len() <= MAX_LEAF as usize).then_some(Self { nodes: Vec::new(), items });
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
        Some(Self { nodes, items })
    }

    /// Bytes of nodes and items.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.items.len() * size_of::<u32>()
    }

    /// Calls `visit` with the ids of each leaf that the ray may enter below the current far end, nearest first where
    /// `ORDERED`. The closure returns the new far end, or breaks.
    #[inline(always)]
    pub(crate) fn walk<R: Real, T: Tally, const ORDERED: bool>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        tally: &mut T,
        mut visit: impl FnMut(&[u32], R, &mut T) -> ControlFlow<(), R>,
    ) {
        if self.nodes.is_empty() {
            let _ = visit(&self.items, range.max, tally);
            return;
        }
        let slabs = Slabs::new(ray);
        let mut far = range.max;
        let mut stack: ArrayVec<(Child, R), STACK> = ArrayVec::new();
        let mut current = Child(0);
        loop {
            if let Some(leaf) = current.range() {
                match visit(&self.items[leaf], far, tally) {
                    ControlFlow::Continue(nearer) => far = nearer,
                    ControlFlow::Break(()) => return,
                }
            } else {
                let node = &self.nodes[current.0 as usize];
                tally.node();
                let entries = slabs.enter::<ORDERED>(node, range.min, far);
                if let Some((&nearest, rest)) = entries.split_first() {
                    // Farther ones wait; their number is bounded by the depth that the builder guarantees.
                    stack.extend(rest.iter().rev().copied());
                    current = nearest.0;
                    continue;
                }
            }
            loop {
                let Some((child, entry)) = stack.pop() else { return };
                if entry <= far * Slabs::<R>::widen() {
                    current = child;
                    break;
                }
            }
        }
    }
}

/// What the box tests of a ray share.
struct Slabs<R: Real> {
    origin: [R; 3],
    inverse: [R; 3],
    /// 0 where the ray enters through the minimum plane: from the sign of the reciprocal actually used, so that −0 is
    /// treated as what it does.
    entry_side: [usize; 3],
}

impl<R: Real> Slabs<R> {
    fn new(ray: &Ray<R>) -> Self {
        let origin = [ray.origin.x(), ray.origin.y(), ray.origin.z()];
        let inverse = [ray.direction.x(), ray.direction.y(), ray.direction.z()].map(|d| R::ONE / d);
        Self { origin, inverse, entry_side: inverse.map(|i| usize::from(i < R::ZERO)) }
    }

    /// 1 + 2γ(3): the three roundings of a slab distance on either side.
    #[inline(always)]
    fn widen() -> R {
        R::ONE + R::ROUNDOFF * R::from_f64(8.0)
    }

    /// The children that the ray enters before `far`, with their entry distances; nearest first where `ORDERED`.
    ///
    /// A ray in a slab's plane gives 0·∞ = NaN there: the comparisons are written so that NaN keeps the other bound.
    #[inline(always)]
    fn enter<const ORDERED: bool>(&self, node: &Node, near: R, far: R) -> ArrayVec<(Child, R), WIDTH> {
        let (mut entry, mut exit) = ([near; WIDTH], [far; WIDTH]);
        for axis in 0..3 {
            let (o, inverse, side) = (self.origin[axis], self.inverse[axis], self.entry_side[axis]);
            let (first, second) = (&node.planes[side][axis], &node.planes[1 - side][axis]);
            for lane in 0..WIDTH {
                let a = (R::from_f32(first[lane]) - o) * inverse;
                let b = (R::from_f32(second[lane]) - o) * inverse;
                entry[lane] = if a > entry[lane] { a } else { entry[lane] };
                exit[lane] = if b < exit[lane] { b } else { exit[lane] };
            }
        }
        let mut entered: ArrayVec<(Child, R), WIDTH> = ArrayVec::new();
        for lane in 0..WIDTH {
            if entry[lane] <= exit[lane] * Self::widen() {
                entered.push((node.children[lane], entry[lane]));
                if ORDERED {
                    let mut k = entered.len() - 1;
                    while k > 0 && entered[k - 1].1 > entered[k].1 {
                        entered.swap(k - 1, k);
                        k -= 1;
                    }
                }
            }
        }
        entered
    }
}
