//! The builder from the top: splits by the surface area heuristic, in parallel, down to blocks of triangles and single others. Nothing slows it
//! down: what the heuristic would make too deep is halved.
//!
//! Each set is copied to its two parts from one array into another and back, without a branch that depends on the side, and
//! small subtrees are built whole by one thread. Which thread builds what changes nothing.
//! "On fast Construction of SAH-based Bounding Volume Hierarchies" (Wald 2007) has the bins.

mod split;

use core::ops::Range;

use rayon::prelude::*;

use self::split::{Item, split};
use super::{LeafKind, LeafKindOf, Stop};
use crate::aabb::{PaddedBox, half_area};
use crate::binary::{Binary, BinaryNode};
use crate::memory::{filled, huge_page_vec};

/// Levels more than halving would take that a tree may have: 27 + 16 where there are as many boxes as can be, fewer than a
/// traversal has a stack for.
const SPARE: u32 = 16;
/// Below this a second thread is not worth its start.
const PARALLEL: usize = 8192;

/// A node that is still to be made.
const NONE: BinaryNode = BinaryNode { bounds: PaddedBox::NOTHING, first: 0, count: 0 };

/// What a tree is to be like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Manner {
    /// Most primitives of a leaf, one where all have leaves of their own.
    pub leaf: usize,
    /// Sets of more items than this are split by what this many of them say.
    pub sample: usize,
    /// Half the surface that the box of a leaf of several triangles may have.
    pub widest: f32,
}

/// Where a subtree goes: the places of its items among those of all, and how many levels it may have.
struct Room<'a> {
    order: &'a mut [u32],
    start: usize,
    levels: u32,
}

impl<'a> Room<'a> {
    fn parted(self, middle: usize) -> [Self; 2] {
        let (left, right) = self.order.split_at_mut(middle);
        let room = |order, start| Room { order, start, levels: self.levels - 1 };
        [room(left, self.start), room(right, self.start + middle)]
    }
}

/// A tree as threads hand it up.
enum Grown {
    /// Built by one thread: its nodes, the root first, that name each other.
    Whole(Vec<BinaryNode>),
    Parted(Box<[Grown; 2]>),
}

/// Builds the tree and says over how many boxes, counted anew in each level, it went; given up, it is not the whole tree.
/// `company` says which boxes may share a leaf.
pub(super) fn binned(boxes: &[PaddedBox], company: LeafKindOf<'_>, manner: Manner, stop: Stop<'_>) -> (Binary, u64) {
    let item = |at: usize| Item::new(&boxes[at], at as u32, company(at as u32));
    let mut items: Vec<Item> = huge_page_vec(boxes.len());
    items.par_extend((0..boxes.len()).into_par_iter().with_min_len(PARALLEL).map(item));
    let mut room = filled(items.len(), Item::default());
    let mut order = filled(items.len(), 0);
    let builder = Builder { manner, all: items.len(), blocks: alike(&items), stop };
    let levels = halvings(items.len()) + SPARE;
    let (grown, work) = builder.grow([&mut items, &mut room], Room { order: &mut order, start: 0, levels });
    let (nodes, parts) = flattened(grown);
    (Binary { nodes, order, parts }, work)
}

/// Whether they may share a leaf.
fn alike(items: &[Item]) -> bool {
    let first = items.first().map_or(LeafKind::None, Item::company);
    first != LeafKind::None && items.iter().all(|item| item.company() == first)
}

/// Levels that halving takes to single boxes.
fn halvings(count: usize) -> u32 {
    count.next_power_of_two().ilog2()
}

struct Builder<'a> {
    manner: Manner,
    /// How many items there are: these are no leaf, or there would be no node.
    all: usize,
    /// Whether all may share leaves, so that these can be counted in blocks.
    blocks: bool,
    stop: Stop<'a>,
}

impl Builder<'_> {
    fn is_leaf(&self, items: &[Item]) -> bool {
        let few = items.len() <= self.manner.leaf && items.len() < self.all;
        items.len() < 2 || few && (self.blocks || alike(items)) && !self.is_wide(items)
    }

    /// Whether the box around some triangles is too large for a leaf.
    fn is_wide(&self, items: &[Item]) -> bool {
        // Most trees have no such bound, and then no box is made for it.
        let around = || items.iter().fold(PaddedBox::NOTHING, |all, item| all.union(&item.bounds()));
        let bounded = self.manner.widest < f32::INFINITY && items[0].company() == LeafKind::Triangles;
        bounded && half_area(&around()) > self.manner.widest
    }

    /// The tree over the first of the two arrays; the second one is room to work in.
    fn grow(&self, [items, other]: [&mut [Item]; 2], room: Room<'_>) -> (Grown, u64) {
        if items.len() < PARALLEL || (self.stop)() {
            let mut nodes = Vec::with_capacity(items.len() / 2 + 1);
            nodes.push(NONE);
            let work = self.subtree(&mut nodes, 0, [items, other], room);
            return (Grown::Whole(nodes), work);
        }
        let count = items.len() as u64;
        let ([left, right], rooms) = self.parted([items, other], room);
        let [left_room, right_room] = rooms;
        let ((left, a), (right, b)) = rayon::join(|| self.grow(left, left_room), || self.grow(right, right_room));
        (Grown::Parted(Box::new([left, right])), a + b + count)
    }

    /// The same by one thread, appended to `nodes`, with its root at `slot`.
    fn subtree(&self, nodes: &mut Vec<BinaryNode>, slot: usize, [items, other]: [&mut [Item]; 2], room: Room<'_>) -> u64 {
        // Given up above: whatever this is, it is thrown away.
        if self.is_leaf(items) || items.len() >= PARALLEL {
            let bounds = items.iter().fold(PaddedBox::NOTHING, |all, item| all.union(&item.bounds()));
            room.order.iter_mut().zip(&*items).for_each(|(place, item)| *place = item.place());
            nodes[slot] = BinaryNode { bounds, first: room.start as u32, count: items.len() as u32 };
            return 0;
        }
        let count = items.len() as u64;
        let ([left, right], [left_room, right_room]) = self.parted([items, other], room);
        let pair = nodes.len();
        nodes.extend([NONE; 2]);
        let work = self.subtree(nodes, pair, left, left_room) + self.subtree(nodes, pair + 1, right, right_room);
        let bounds = nodes[pair].bounds.union(&nodes[pair + 1].bounds);
        nodes[slot] = BinaryNode { bounds, first: pair as u32, count: 0 };
        work + count
    }

    /// Two parts of the items, each with room, neither empty.
    fn parted<'i, 'r>(&self, [items, other]: [&'i mut [Item]; 2], room: Room<'r>) -> ([[&'i mut [Item]; 2]; 2], [Room<'r>; 2]) {
        let halve = halvings(items.len()) >= room.levels;
        let (middle, moved) = split(items, other, self.manner, self.blocks, halve);
        let (from, to) = if moved { (other, items) } else { (items, other) };
        let ((a, b), (c, d)) = (from.split_at_mut(middle), to.split_at_mut(middle));
        ([[a, c], [b, d]], room.parted(middle))
    }
}

/// A node of a tree whose nodes but for the root begin at `base`.
fn moved(node: &BinaryNode, base: u32) -> BinaryNode {
    let first = if node.count == 0 { node.first - 1 + base } else { node.first };
    BinaryNode { first, ..*node }
}

/// Puts the nodes above those of each thread into a list, of which `slot` is the tree's own, and those of threads aside. Returns the tree's box.
fn place(grown: Grown, slot: usize, nodes: &mut Vec<BinaryNode>, wholes: &mut Vec<(usize, Vec<BinaryNode>)>) -> PaddedBox {
    match grown {
        Grown::Whole(own) => {
            wholes.push((slot, own));
            wholes[wholes.len() - 1].1[0].bounds
        }
        Grown::Parted(parts) => {
            let ([left, right], pair) = (*parts, nodes.len());
            nodes.extend([NONE; 2]);
            let bounds = place(left, pair, nodes, wholes).union(&place(right, pair + 1, nodes, wholes));
            nodes[slot] = BinaryNode { bounds, first: pair as u32, count: 0 };
            bounds
        }
    }
}

/// The nodes in one list, each before its children, and those of each thread in a range.
fn flattened(grown: Grown) -> (Vec<BinaryNode>, Vec<Range<usize>>) {
    let (mut tops, mut wholes) = (vec![NONE], Vec::new());
    place(grown, 0, &mut tops, &mut wholes);
    let mut nodes = huge_page_vec(tops.len() + wholes.iter().map(|(_, own)| own.len() - 1).sum::<usize>());
    nodes.append(&mut tops);
    let mut parts = Vec::with_capacity(wholes.len());
    for (slot, own) in wholes {
        let base = nodes.len();
        nodes[slot] = moved(&own[0], base as u32);
        nodes.par_extend(own[1..].par_iter().with_min_len(PARALLEL).map(|node| moved(node, base as u32)));
        parts.push(base..nodes.len());
    }
    (nodes, parts)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// Boxes at scattered places, a thousand of them in one.
    fn boxes(count: usize) -> Vec<PaddedBox> {
        let at = |i: usize| if i.is_multiple_of(50) { 7 } else { i };
        let place = |i: usize, stride: usize| (at(i) * stride % 20_011) as f32 / 20_011.0;
        let centre = |i: usize| Vec3::new(place(i, 3137), place(i, 6197), place(i, 8117));
        (0..count).map(|i| PaddedBox { min: centre(i) - 0.01, max: centre(i) + 0.01 + place(i, 977) * 0.05 }).collect()
    }

    /// Protects: the tree is the same for any number of threads, by samples and without; each box is in one leaf, leaves of triangles
    /// hold eight at most, with no larger a box than they may have, and other primitives are alone in theirs, and each node has the box of
    /// its children.
    #[test]
    fn trees_are_the_same_for_any_number_of_threads() {
        let boxes = boxes(50_000);
        let any = f32::INFINITY;
        for (leaf, sample, kind, widest) in [(8, 4096, 1, any), (8, usize::MAX, 3, any), (1, 4096, 1, any), (8, 4096, 1, 0.02)] {
            let build = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let company = |place: u32| if place.is_multiple_of(kind) { LeafKind::Triangles } else { LeafKind::None };
                let manner = Manner { leaf, sample, widest };
                let (binary, work) = pool.install(|| binned(&boxes, &company, manner, &|| false));
                let nodes: Vec<_> = binary.nodes.iter().map(|n| (n.bounds.min, n.bounds.max, n.first, n.count)).collect();
                (nodes, binary.order, binary.parts, work)
            };
            let one = build(1);
            assert!(one == build(4), "leaves of {leaf}, {sample} samples");
            let (nodes, mut order, ..) = one;
            let mut within = 0;
            for &(min, max, first, count) in &nodes {
                let first = first as usize;
                if count == 0 {
                    let [a, b] = [nodes[first], nodes[first + 1]];
                    assert_eq!((min, max), (a.0.min(b.0), a.1.max(b.1)));
                    continue;
                }
                let own = &order[first..first + count as usize];
                assert!(own.len() == 1 || own.len() <= leaf && own.iter().all(|place| place.is_multiple_of(kind)), "{own:?}");
                let around = own.iter().fold(PaddedBox::NOTHING, |all, &place| all.union(&boxes[place as usize]));
                assert_eq!((min, max), (around.min, around.max));
                assert!(own.len() == 1 || half_area(&around) <= widest, "{around:?}");
                within += own.len();
            }
            order.sort_unstable();
            assert!(within == boxes.len() && order.into_iter().eq(0..boxes.len() as u32));
        }
    }

    /// Protects: how large the box of a leaf may be is asked of triangles alone, and leaves of few small ones stay together: what a row of
    /// spheres takes is less than what each does.
    #[test]
    fn only_triangles_are_kept_from_wide_leaves() {
        let boxes = boxes(1000);
        let leaves = |company: LeafKind, widest: f32| {
            let manner = Manner { leaf: 8, sample: usize::MAX, widest };
            let (binary, _) = binned(&boxes, &|_| company, manner, &|| false);
            binary.nodes.iter().filter(|node| node.count > 0).count()
        };
        let [shared, spheres] = [leaves(LeafKind::Triangles, f32::INFINITY), leaves(LeafKind::Spheres, 0.0)];
        assert!(shared < 400 && spheres == shared, "{shared}, {spheres}");
        let some = leaves(LeafKind::Triangles, 0.02);
        assert!(shared < some && some < 1000, "{some}");
        assert_eq!(leaves(LeafKind::Triangles, 0.0), 1000);
    }
}
