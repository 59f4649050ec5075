//! Expected ray costs of eight-wide trees that can be made from a binary tree. For each binary
//! node, the costs are those of its subtree, for one to eight lanes (child positions of a wide
//! node) into which the subtree is divided ("Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs", Ylitie, Karras, Laine 2017, section 3.1).

use rayon::prelude::*;

use crate::aabb::half_area;
use crate::binary::{BinaryNode, BinaryTree};
use crate::build::{LeafKind, LeafKindLookup};
use crate::bvh8::WIDTH;
use crate::memory::filled_huge_page_vec;

/// Cost of testing a block of triangles, in units of visiting a node.
const BLOCK: f32 = 1.1;
/// Cost of testing a row of eight spheres, in units of visiting a node. Measured for random
/// spheres. A row of fewer spheres costs at most the sum of their single tests.
const ROW: f32 = 1.2;
/// Cost of testing a single primitive of another kind, and cost of testing a single sphere. The
/// unit is the cost of visiting a node.
const OTHER: f32 = 0.7;
const SPHERE: f32 = 0.5;

/// Choices for a subtree that may fill a given number of lanes (child positions): one leaf, one
/// inner node, or the choice for one lane less.
pub(super) const AS_LEAF: u8 = 0;
pub(super) const AS_INNER: u8 = 1;
pub(super) const FEWER: u8 = u8::MAX;

/// Least expected costs of a subtree, and the choices that have these costs. Index i is for a
/// subtree that may fill up to i + 1 lanes (child positions) of a wide node.
#[derive(Clone, Copy)]
pub(super) struct SubtreeCosts {
    pub cost: [f32; WIDTH],
    /// Choice for each number of lanes: `AS_LEAF`, `AS_INNER` or `FEWER`. Any other value means
    /// that the subtree's two children are in separate lanes; it is one plus the number of lanes
    /// for the left child.
    pub choices: [u8; WIDTH],
    /// Number of leaves of the subtree, limited to `WIDTH`. A subtree can't fill more lanes than it
    /// has leaves.
    pub leaves: u8,
    /// Number of primitives, if all share one leaf kind. A value above `WIDTH` means that they do
    /// not fit into one leaf. It is `u8::MAX` for mixed kinds and for primitives that are tested
    /// alone.
    pub shared_count: u8,
    pub leaf_kind: LeafKind,
}

impl SubtreeCosts {
    const NONE: Self = Self {
        cost: [0.0; WIDTH],
        choices: [AS_LEAF; WIDTH],
        leaves: 1,
        shared_count: u8::MAX,
        leaf_kind: LeafKind::None,
    };
}

/// Returns the possible numbers of lanes for the left of two subtrees that fill `lanes` lanes
/// together. Neither subtree gets more lanes than it has leaves.
pub(super) fn left_child_lane_range(
    left: &SubtreeCosts,
    right: &SubtreeCosts,
    lanes: usize,
) -> core::ops::RangeInclusive<usize> {
    lanes.saturating_sub(right.leaves.into()).max(1)..=(lanes - 1).min(left.leaves.into())
}

/// Computes the costs of one node. `below` returns the costs of the child with a given node index.
fn compute_node_costs(
    binary: &BinaryTree,
    node: &BinaryNode,
    leaf_kind: LeafKindLookup<'_>,
    below: impl Fn(usize) -> SubtreeCosts,
) -> SubtreeCosts {
    let area = half_area(&node.bounds);
    if node.count == 0 {
        return compute_inner_node_costs(
            &below(node.first as usize),
            &below(node.first as usize + 1),
            area,
        );
    }
    let leaf_kind = leaf_kind(binary.order[node.first as usize]);
    compute_leaf_costs(
        area,
        leaf_kind,
        if leaf_kind == LeafKind::None {
            u8::MAX
        } else {
            node.count as u8
        },
    )
}

/// Returns the costs of a leaf. `area` is half the surface area of its box. `alike` is its number
/// of primitives, or `u8::MAX` if its primitive is tested alone.
fn compute_leaf_costs(area: f32, leaf_kind: LeafKind, alike: u8) -> SubtreeCosts {
    let mut pick = [FEWER; WIDTH];
    pick[0] = AS_LEAF;
    SubtreeCosts {
        cost: [area * leaf_test_cost(leaf_kind, alike); WIDTH],
        choices: pick,
        leaves: 1,
        shared_count: alike,
        leaf_kind,
    }
}

/// Cost of testing a leaf of `count` primitives, in units of visiting a node.
pub(super) fn leaf_test_cost(leaf_kind: LeafKind, count: u8) -> f32 {
    match leaf_kind {
        LeafKind::Triangles => BLOCK,
        LeafKind::Spheres => ROW.min(SPHERE * f32::from(count)),
        LeafKind::None => OTHER,
    }
}

/// Computes the costs of an inner node from the costs of its left and right child. `area` is half
/// the surface area of its box.
fn compute_inner_node_costs(l: &SubtreeCosts, r: &SubtreeCosts, area: f32) -> SubtreeCosts {
    let alike = if l.leaf_kind == r.leaf_kind {
        l.shared_count.saturating_add(r.shared_count)
    } else {
        u8::MAX
    };
    if usize::from(alike) <= l.leaf_kind.max_shared_leaf_size() {
        return compute_leaf_costs(area, l.leaf_kind, alike);
    }
    // Least total cost of the two children for each number of lanes, and the number of lanes for
    // the left child.
    let mut both = [(f32::INFINITY, 1_u8); WIDTH + 1];
    let leaves = (l.leaves + r.leaves).min(WIDTH as u8);
    for (lanes, best) in both
        .iter_mut()
        .enumerate()
        .take(usize::from(leaves) + 1)
        .skip(2)
    {
        for to_left in left_child_lane_range(l, r, lanes) {
            let cost = l.cost[to_left - 1] + r.cost[lanes - to_left - 1];
            if cost < best.0 {
                *best = (cost, to_left as u8);
            }
        }
    }
    let (leaf, inner) = (
        area * leaf_test_cost(l.leaf_kind, alike),
        area + both[usize::from(leaves)].0,
    );
    let (mut cost, mut pick) = ([inner; WIDTH], [AS_INNER; WIDTH]);
    // Up to a block of primitives can be one leaf in a lane. A node above that leaf would be
    // visited as often.
    if usize::from(alike) <= WIDTH {
        (cost[0], pick[0]) = (leaf, AS_LEAF);
    }
    for lanes in 1..WIDTH {
        let (divided, to_left) = both[lanes + 1];
        (cost[lanes], pick[lanes]) = if divided < cost[lanes - 1] {
            (divided, to_left + 1)
        } else {
            (cost[lanes - 1], FEWER)
        };
    }
    SubtreeCosts {
        cost,
        choices: pick,
        leaves,
        shared_count: alike,
        leaf_kind: l.leaf_kind,
    }
}

/// Computes the costs of all nodes, children before parents. Each part of the tree
/// ([`BinaryTree::parts`]) is one parallel task. The nodes above the parts come last.
pub(super) fn compute_all_costs(
    binary: &BinaryTree,
    leaf_kind: LeafKindLookup<'_>,
) -> Vec<SubtreeCosts> {
    let mut all = filled_huge_page_vec(binary.nodes.len(), SubtreeCosts::NONE);
    let (_, mut rest) = all.split_at_mut(binary.top_node_count());
    let mut parts = Vec::with_capacity(binary.parts.len());
    for part in &binary.parts {
        let (part_costs, after) = rest.split_at_mut(part.len());
        parts.push((part.start, part_costs));
        rest = after;
    }
    parts.into_par_iter().for_each(|(base, part_costs)| {
        for position in (0..part_costs.len()).rev() {
            part_costs[position] =
                compute_node_costs(binary, &binary.nodes[base + position], leaf_kind, |node| {
                    part_costs[node - base]
                });
        }
    });
    for position in (0..binary.top_node_count()).rev() {
        all[position] =
            compute_node_costs(binary, &binary.nodes[position], leaf_kind, |node| all[node]);
    }
    all
}
