//! Binary trees by the crate `obvhs`, in four steps. Boxes are clustered along a curve, subtrees
//! are reinserted where they cost less, small subtrees of one leaf kind are collapsed to leaves,
//! and subtrees are reinserted again. A call of `obvhs` can't be cancelled. So a large set is
//! clustered in pieces of the curve, and a further tree joins the tops of the pieces' trees.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};
use obvhs::ploc::{PlocBuilder, SortPrecision};
use rayon::prelude::*;

use super::curve::morton_grid_extent;
use super::piles::merge_coincident_boxes;
use super::reinsertion::reinsert_subtrees;
use super::{BuildQuality, StopCheck};
use crate::aabb::{PaddedBox, TASK_SIZE};
use crate::binary::BinaryNode;
use crate::memory::huge_page_vec;

/// Greatest number of boxes clustered at once. A call of `obvhs` then takes a tenth of a second.
const MAX_PIECE: usize = 1 << 18;
/// Number of top nodes that each piece's tree contributes to the tree that joins the pieces, as its
/// leaves.
const TOP_NODES: usize = 64;

/// Parameters of `obvhs` for a build quality.
#[derive(Clone, Copy)]
struct ClusteringOptions {
    /// Whether clustering examines 14 neighbours on either side, instead of 6.
    wide_search: bool,
    /// Fractions of the nodes to reinsert, before and after the collapse to leaves.
    reinserted_shares: [f32; 2],
}

impl ClusteringOptions {
    /// Returns the parameters of a build quality. Measured: `../../../../benches/runs`.
    fn new(quality: BuildQuality) -> Self {
        match quality {
            BuildQuality::Fast => Self {
                wide_search: false,
                reinserted_shares: [0.0, 0.05],
            },
            BuildQuality::Medium => Self {
                wide_search: false,
                reinserted_shares: [0.03, 0.3],
            },
            BuildQuality::High => Self {
                wide_search: true,
                reinserted_shares: [0.3, 1.0],
            },
        }
    }
}

/// A tree of `obvhs` whose leaves refer to ranges of an order of boxes, and the number of boxes
/// visited to build it.
pub(super) struct ClusteredTree {
    tree: Bvh2,
    pub boxes_visited: u64,
}

impl ClusteredTree {
    /// Converts the nodes to nodes of the binary tree, without boxes, since the boxes given to
    /// `obvhs` were scaled.
    pub fn to_binary_nodes(&self) -> Vec<BinaryNode> {
        let node = |node: &Bvh2Node| BinaryNode {
            bounds: PaddedBox::EMPTY,
            first: node.first_index,
            count: node.prim_count,
        };
        let mut nodes = huge_page_vec(self.tree.nodes.len());
        nodes.extend(self.tree.nodes.iter().map(node));
        nodes
    }
}

/// Input and parameters of a clustering.
pub(super) struct Clustering<'a> {
    boxes: &'a [PaddedBox],
    options: ClusteringOptions,
    /// Greatest number of boxes in a subtree that becomes one leaf.
    max_leaf: u32,
    /// Greatest number of boxes in a piece.
    max_piece: usize,
    /// Power of two by which boxes are scaled, so that no surface area leaves the range of f32.
    scale: f32,
    stop: StopCheck<'a>,
}

impl<'a> Clustering<'a> {
    /// Creates a clustering of `boxes` in which every subtree of at most `leaf` boxes becomes a
    /// leaf.
    pub fn new(
        boxes: &'a [PaddedBox],
        quality: BuildQuality,
        leaf: usize,
        stop: StopCheck<'a>,
    ) -> Self {
        let around = boxes
            .par_iter()
            .with_min_len(TASK_SIZE)
            .copied()
            .reduce(|| PaddedBox::EMPTY, |a, b| a.union(&b));
        let extent = (around.max.as_dvec3() - around.min.as_dvec3()).max_element();
        // With this scale the greatest surface area is slightly above 2⁶⁰. That leaves room for
        // sums of areas, and boxes 2⁻⁹⁰ times as long still have distinct areas.
        let exponent = 30 - (extent.log2() as i32).clamp(-96, 156);
        Self {
            boxes,
            options: ClusteringOptions::new(quality),
            max_leaf: leaf as u32,
            max_piece: MAX_PIECE,
            scale: 2.0_f32.powi(exponent),
            stop,
        }
    }

    /// Builds the tree over boxes in the order of a curve, and permutes that order; `None` if
    /// cancelled.
    pub fn build_tree(&self, order: &mut [u32]) -> Option<ClusteredTree> {
        let size = order.len().div_ceil(order.len().div_ceil(self.max_piece));
        let pieces: Vec<_> = order
            .par_chunks_mut(size)
            .map(|order| self.cluster_curve_piece(order))
            .collect();
        let mut pieces = pieces.into_iter().collect::<Option<Vec<_>>>()?;
        if pieces.len() == 1 {
            return pieces.pop();
        }
        self.join_piece_trees(pieces, size)
    }

    /// Returns the scaled box with the given index, as a box of `obvhs`.
    fn scaled_aabb(&self, index: u32) -> Aabb {
        let PaddedBox { min, max } = self.boxes[index as usize];
        Aabb::new((min * self.scale).into(), (max * self.scale).into())
    }

    /// Builds the tree over the boxes of one piece of the curve, by all four steps named at the top
    /// of this file; `None` if cancelled.
    fn cluster_curve_piece(&self, order: &mut [u32]) -> Option<ClusteredTree> {
        let leaf = |(position, &index): (usize, &u32)| {
            Bvh2Node::new(self.scaled_aabb(index), 1, position as u32)
        };
        let leaves =
            merge_coincident_boxes(&order.iter().enumerate().map(leaf).collect::<Vec<_>>());
        let ClusteredTree {
            mut tree,
            boxes_visited: mut looks,
        } = self.cluster_leaves(leaves)?;
        let [before, after] = self.options.reinserted_shares;
        looks += self.reinsert_while_running(&mut tree, before)?;
        tree.primitive_indices = order.to_vec();
        // With this cost of a node, every small subtree becomes a leaf. The collapse to eight-wide
        // nodes decides by ray cost which leaves share a block.
        collapse(&mut tree, self.max_leaf, self.max_leaf as f32);
        order.copy_from_slice(&tree.primitive_indices);
        looks += self.reinsert_while_running(&mut tree, after)?;
        // Only the nodes are needed from here on.
        let tree = Bvh2 {
            nodes: tree.nodes,
            ..Bvh2::default()
        };
        Some(ClusteredTree {
            tree,
            boxes_visited: looks,
        })
    }

    /// Clusters leaves, given in the order of the curve, to a tree; `None` if cancelled.
    fn cluster_leaves(&self, leaves: Vec<Bvh2Node>) -> Option<ClusteredTree> {
        if (self.stop)() {
            return None;
        }
        let around = leaves
            .iter()
            .fold(Aabb::INVALID, |all, leaf| all.union(leaf.aabb()));
        // A centre at the upper end would wrap around to the Morton code of the lower end.
        let extent = morton_grid_extent(around.diagonal().as_dvec3()).as_vec3a() * (1.0 + 1e-6)
            + Vec3A::splat(f32::MIN_POSITIVE);
        let around = Aabb::new(around.min, around.min + extent);
        let mut builder = PlocBuilder::new();
        let mut tree = Bvh2::default();
        builder.current_nodes = leaves;
        let neighbours = if self.options.wide_search {
            builder.build_ploc_from_leaves::<14, false>(&mut tree, around, SortPrecision::U64, 0);
            2 * 14
        } else {
            builder.build_ploc_from_leaves::<6, false>(&mut tree, around, SortPrecision::U64, 0);
            2 * 6
        };
        // The reinsertion search has a stack of twice this depth. In a deeper tree the search drops
        // some candidates, which does no harm. With the tree's true depth, the search would fail if
        // the tree grew deeper.
        tree.max_depth = DEFAULT_MAX_STACK_DEPTH / 2;
        let looks = neighbours * count_waiting_passes(&tree);
        Some(ClusteredTree {
            tree,
            boxes_visited: looks,
        })
    }

    /// Reinserts a fraction of the nodes, and returns the number of nodes visited; `None` if
    /// cancelled.
    fn reinsert_while_running(&self, tree: &mut Bvh2, share: f32) -> Option<u64> {
        (!(self.stop)()).then(|| reinsert_subtrees(tree, share))
    }

    /// Joins the trees of pieces of `size` boxes into one tree; `None` if cancelled.
    fn join_piece_trees(&self, pieces: Vec<ClusteredTree>, size: usize) -> Option<ClusteredTree> {
        let tops: Vec<_> = pieces
            .iter()
            .map(|piece| select_top_nodes(&piece.tree))
            .collect();
        let all = pieces
            .iter()
            .zip(&tops)
            .enumerate()
            .flat_map(|(number, (piece, tops))| {
                tops.iter().map(move |&top| {
                    Bvh2Node::new(*piece.tree.nodes[top].aabb(), number as u32 + 1, top as u32)
                })
            });
        let ClusteredTree {
            mut tree,
            boxes_visited: mut looks,
        } = self.cluster_leaves(all.collect())?;
        looks += self.reinsert_while_running(&mut tree, 1.0)?;
        let mut bases = Vec::with_capacity(pieces.len());
        let joined = tree.nodes.len();
        let all = joined
            + pieces
                .iter()
                .map(|piece| piece.tree.nodes.len())
                .sum::<usize>();
        let mut nodes = huge_page_vec(all);
        nodes.append(&mut tree.nodes);
        tree.nodes = nodes;
        for (number, piece) in pieces.into_iter().enumerate() {
            let base = tree.nodes.len() as u32;
            bases.push(base);
            looks += piece.boxes_visited;
            tree.nodes.extend(piece.tree.nodes.into_iter().map(|node| {
                let by = if node.is_leaf() {
                    (number * size) as u32
                } else {
                    base
                };
                Bvh2Node::new(*node.aabb(), node.prim_count, node.first_index + by)
            }));
        }
        for position in 0..joined {
            let node = tree.nodes[position];
            if node.is_leaf() {
                tree.nodes[position] =
                    tree.nodes[(bases[node.prim_count as usize - 1] + node.first_index) as usize];
            }
        }
        Some(ClusteredTree {
            tree,
            boxes_visited: looks,
        })
    }
}

/// Returns a lower bound of the work of clustering. A node is joined with its sibling in the pass
/// after both exist, so the earlier node waits some passes. The bound is the sum of these passes
/// over all nodes. Children must come after their parents.
fn count_waiting_passes(tree: &Bvh2) -> u64 {
    let (mut passes, mut waits) = (vec![0_u32; tree.nodes.len()], 0);
    for (position, node) in tree
        .nodes
        .iter()
        .enumerate()
        .rev()
        .filter(|(_, node)| !node.is_leaf())
    {
        let [left, right] = [0, 1].map(|side| passes[node.first_index as usize + side]);
        passes[position] = left.max(right) + 1;
        waits += u64::from(2 * passes[position] - left - right);
    }
    waits
}

/// Selects the top nodes of a piece's tree, below which it stays unchanged when pieces are joined.
/// The selection starts with the root. The largest selected node is replaced by its children until
/// [`TOP_NODES`] nodes are selected.
fn select_top_nodes(tree: &Bvh2) -> Vec<usize> {
    let mut tops = vec![0];
    let area = |&top: &usize| {
        if tree.nodes[top].is_leaf() {
            -1.0
        } else {
            tree.nodes[top].aabb().half_area()
        }
    };
    while tops.len() < TOP_NODES {
        let greatest = (0..tops.len())
            .max_by(|&a, &b| area(&tops[a]).total_cmp(&area(&tops[b])))
            .unwrap_or(0);
        let node = tree.nodes[tops[greatest]];
        if node.is_leaf() {
            break;
        }
        tops[greatest] = node.first_index as usize;
        tops.push(node.first_index as usize + 1);
    }
    tops
}

#[cfg(test)]
mod tests;
