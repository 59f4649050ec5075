//! From a binary tree to eight-wide nodes and blocks of triangles, by least expected cost.
//!
//! For each binary node: what its subtree costs a ray that meets it as a child of one wide node, and as two children to eight of
//! them side by side ("Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", Ylitie, Karras, Laine 2017,
//! section 3.1). A child is an inner node, a block of up to eight triangles, or one other primitive.

use arrayvec::ArrayVec;

use super::{Child, MAX_DEPTH, Node, WIDTH, Wide};
use crate::binary::Binary;
use crate::wide::block::{Block, Facts};

/// What a block's test costs, that of a node being 1. Measured: `../../../../benches/README.md`.
const BLOCK: f32 = 1.1;
/// What the test of another primitive costs.
const OTHER: f32 = 0.7;
/// A block of fewer triangles takes in another one beside it where both fit into one.
const SPARSE: usize = 3;

/// What a subtree becomes when it is given so many lanes of a node.
const AS_LEAF: u8 = 0;
const AS_INNER: u8 = 1;
const FEWER: u8 = u8::MAX;

/// The least costs of a subtree in one lane to eight.
#[derive(Clone, Copy)]
struct Costs {
    cost: [f32; WIDTH],
    /// One of the above, or two more than the lanes that the left child gets less one.
    pick: [u8; WIDTH],
    /// How many leaves it has, up to `WIDTH`: it fills no more lanes than that.
    leaves: u8,
    /// How many triangles it is, up to `WIDTH`; more where there are more or others among them.
    triangles: u8,
}

/// What the left one of two subtrees may get of so many lanes, where neither gets more than it has leaves.
fn shares(left: &Costs, right: &Costs, lanes: usize) -> core::ops::RangeInclusive<usize> {
    lanes.saturating_sub(right.leaves.into()).max(1)..=(lanes - 1).min(left.leaves.into())
}

/// A lane of a node to be.
#[derive(Clone, Copy)]
struct Lane {
    node: u32,
    leaf: bool,
}

type Lanes = ArrayVec<Lane, WIDTH>;

struct Collapse<'a> {
    binary: &'a Binary,
    costs: Vec<Costs>,
}

impl Collapse<'_> {
    fn area(&self, node: u32) -> f32 {
        let e = self.binary.nodes[node as usize].bounds.max - self.binary.nodes[node as usize].bounds.min;
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// Costs from the leaves up. `above` has each node before its children.
    fn solve(&mut self, above: &[u32], is_triangle: &dyn Fn(u32) -> bool) {
        for &node in above.iter().rev() {
            let source = &self.binary.nodes[node as usize];
            let area = self.area(node);
            self.costs[node as usize] = if source.count > 0 {
                let triangle = source.count == 1 && is_triangle(self.binary.order[source.first as usize]);
                let (cost, triangles) = if triangle { (BLOCK, 1) } else { (OTHER * source.count as f32, u8::MAX) };
                let mut pick = [FEWER; WIDTH];
                pick[0] = AS_LEAF;
                Costs { cost: [area * cost; WIDTH], pick, leaves: 1, triangles }
            } else {
                self.inner(source.first as usize, area)
            };
        }
    }

    fn inner(&self, left: usize, area: f32) -> Costs {
        let (l, r) = (&self.costs[left], &self.costs[left + 1]);
        let triangles = l.triangles.saturating_add(r.triangles);
        // The least cost of both children in so many lanes, and how many of these the left one gets.
        let mut both = [(f32::INFINITY, 1_u8); WIDTH + 1];
        let leaves = (l.leaves + r.leaves).min(WIDTH as u8);
        for (lanes, best) in both.iter_mut().enumerate().take(usize::from(leaves) + 1).skip(2) {
            for to_left in shares(l, r, lanes) {
                let cost = l.cost[to_left - 1] + r.cost[lanes - to_left - 1];
                if cost < best.0 {
                    *best = (cost, to_left as u8);
                }
            }
        }
        let (leaf, inner) = (area * BLOCK, area + both[usize::from(leaves)].0);
        let (mut cost, mut pick) = ([inner; WIDTH], [AS_INNER; WIDTH]);
        // As many triangles as a block takes are one, in a lane alone: a node above it would be met as often.
        if usize::from(triangles) <= WIDTH {
            (cost[0], pick[0]) = (leaf, AS_LEAF);
        }
        for lanes in 1..WIDTH {
            let (divided, to_left) = both[lanes + 1];
            (cost[lanes], pick[lanes]) =
                if divided < cost[lanes - 1] { (divided, to_left + 1) } else { (cost[lanes - 1], FEWER) };
        }
        Costs { cost, pick, leaves, triangles }
    }

    /// How many of so many lanes the left child of a node gets.
    fn to_left(&self, left: u32, lanes: usize) -> usize {
        let (l, r) = (&self.costs[left as usize], &self.costs[left as usize + 1]);
        let cost = |to_left: &usize| l.cost[to_left - 1] + r.cost[lanes - to_left - 1];
        shares(l, r, lanes).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(1)
    }

    /// Appends what a subtree becomes in up to so many lanes.
    fn open(&self, node: u32, mut lanes: usize, out: &mut Lanes) {
        let pick = &self.costs[node as usize].pick;
        while lanes > 1 && pick[lanes - 1] == FEWER {
            lanes -= 1;
        }
        match pick[lanes - 1] {
            AS_LEAF => out.push(Lane { node, leaf: true }),
            AS_INNER if lanes == 1 => out.push(Lane { node, leaf: false }),
            _ => self.divide(self.binary.nodes[node as usize].first, lanes, out),
        }
    }

    fn divide(&self, left: u32, lanes: usize, out: &mut Lanes) {
        let leaves = self.costs[left as usize].leaves + self.costs[left as usize + 1].leaves;
        let lanes = lanes.min(leaves.into());
        let to_left = self.to_left(left, lanes);
        self.open(left, to_left, out);
        self.open(left + 1, lanes - to_left, out);
    }

    /// Appends the places of a subtree of few leaves.
    fn places(&self, node: u32, out: &mut ArrayVec<u32, WIDTH>) {
        let source = &self.binary.nodes[node as usize];
        if source.count > 0 {
            let range = source.first as usize..(source.first + source.count) as usize;
            out.extend(self.binary.order[range].iter().copied());
        } else {
            self.places(source.first, out);
            self.places(source.first + 1, out);
        }
    }
}

impl Wide {
    /// Collapses a binary tree. Returns the order in which its leaves name the boxes, and its depth; none where that is more than a
    /// traversal's stack allows, where there is no inner node, or a leaf of several primitives.
    pub(crate) fn collapse(binary: &Binary, is_triangle: &dyn Fn(u32) -> bool) -> Option<(Self, Vec<u32>, u32)> {
        if binary.nodes.first().is_none_or(|root| root.count > 0) || binary.nodes.iter().any(|node| node.count > 1) {
            return None;
        }
        let none = Costs { cost: [0.0; WIDTH], pick: [AS_LEAF; WIDTH], leaves: 1, triangles: u8::MAX };
        let mut collapse = Collapse { binary, costs: vec![none; binary.nodes.len()] };
        collapse.solve(&binary.above(), is_triangle);
        let (mut wide, mut order, mut deepest) = (Self::default(), Vec::with_capacity(binary.order.len()), 0);
        wide.nodes.push(Node::EMPTY);
        let mut work = vec![(0_usize, 0_u32, 1_u32)];
        while let Some((slot, root, depth)) = work.pop() {
            if depth > MAX_DEPTH {
                return None;
            }
            deepest = deepest.max(depth);
            let mut lanes = Lanes::new();
            collapse.divide(binary.nodes[root as usize].first, WIDTH, &mut lanes);
            let first = work.len();
            for lane in collapse.filled(&lanes) {
                let child = match lane.kind {
                    Kind::Inner(node) => {
                        work.push((wide.nodes.len(), node, depth + 1));
                        wide.nodes.push(Node::EMPTY);
                        Child::inner(wide.nodes.len() - 1)
                    }
                    Kind::Other(place) => {
                        order.push(place);
                        Child::other(order.len() - 1)
                    }
                    Kind::Block(places) => {
                        wide.facts.push(Facts { first: order.len() as u32, count: places.len() as u8, ..Facts::default() });
                        order.extend(places);
                        Child::block(wide.facts.len() - 1)
                    }
                };
                let free = wide.nodes[slot].count();
                wide.nodes[slot].set(free, &lane.bounds, child);
            }
            work[first..].reverse();
        }
        wide.blocks = vec![Block::EMPTY; wide.facts.len()];
        Some((wide, order, deepest))
    }
}

/// What a lane will hold.
enum Kind {
    Inner(u32),
    Other(u32),
    Block(ArrayVec<u32, WIDTH>),
}

struct Filled {
    bounds: crate::aabb::PaddedBox,
    kind: Kind,
}

impl Collapse<'_> {
    /// The lanes of a node with what is in them. Sparse blocks are put together: a node has at most one, or those beside it are
    /// so full that they would not fit.
    fn filled(&self, lanes: &Lanes) -> ArrayVec<Filled, WIDTH> {
        let mut filled: ArrayVec<Filled, WIDTH> = ArrayVec::new();
        for &Lane { node, leaf } in lanes {
            let bounds = self.binary.nodes[node as usize].bounds;
            let kind = if !leaf {
                Kind::Inner(node)
            } else if usize::from(self.costs[node as usize].triangles) > WIDTH {
                Kind::Other(self.binary.order[self.binary.nodes[node as usize].first as usize])
            } else {
                let mut places = ArrayVec::new();
                self.places(node, &mut places);
                Kind::Block(places)
            };
            filled.push(Filled { bounds, kind });
        }
        while let Some((into, from)) = pair(&filled) {
            let Filled { bounds, kind: Kind::Block(places) } = filled.remove(from) else { break };
            let into = into - usize::from(from < into);
            filled[into].bounds = filled[into].bounds.union(&bounds);
            if let Kind::Block(own) = &mut filled[into].kind {
                own.extend(places);
            }
        }
        filled
    }
}

/// Two blocks that fit into one, the latter one sparse: of those the pair that grows least.
fn pair(filled: &[Filled]) -> Option<(usize, usize)> {
    let count = |lane: usize| match &filled[lane].kind {
        Kind::Block(places) => Some(places.len()),
        _ => None,
    };
    let growth = |&(a, b): &(usize, usize)| {
        let area = |bounds: &crate::aabb::PaddedBox| {
            let e = bounds.max - bounds.min;
            e.x * e.y + e.y * e.z + e.z * e.x
        };
        area(&filled[a].bounds.union(&filled[b].bounds)) - area(&filled[a].bounds) - area(&filled[b].bounds)
    };
    if !(0..filled.len()).any(|lane| count(lane).is_some_and(|own| own < SPARSE)) {
        return None;
    }
    let pairs = (0..filled.len()).flat_map(|b| (0..filled.len()).map(move |a| (a, b)));
    let fit = pairs
        .filter(|&(a, b)| a != b && count(a).zip(count(b)).is_some_and(|(into, from)| from < SPARSE && into + from <= WIDTH));
    fit.min_by(|a, b| growth(a).total_cmp(&growth(b)))
}
