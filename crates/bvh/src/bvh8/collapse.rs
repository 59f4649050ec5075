//! Collapse of a binary tree to eight-wide nodes, and to leaves of up to eight primitives of a
//! kind, with the least expected ray cost.
//!
//! A child is an inner node, a leaf of up to eight triangles or spheres, or one other primitive.

mod costs;
mod sparse_blocks;

use arrayvec::ArrayVec;
use rayon::prelude::*;

use super::{Bvh8, Bvh8Node, ChildRef, MAX_DEPTH, WIDTH};
use crate::aabb::{PaddedBox, half_area};
use crate::binary::BinaryTree;
use crate::build::{LeafKind, LeafKindLookup};
use crate::bvh8::row::{PrimitiveRow, RowKind};
use crate::bvh8::triangle8::LeafHeader;
use crate::memory::huge_page_vec;
use costs::{AS_INNER, AS_LEAF, FEWER, SubtreeCosts, compute_all_costs, left_child_lane_range};
use sparse_blocks::merge_sparse_blocks;

/// Planned content of a lane (one of a node's eight child positions): an inner node, a single
/// primitive, or a leaf of up to eight primitives of one kind. An inner node is given by its index
/// in the binary tree, primitives by their box indices.
enum PlannedChildRef {
    Inner(u32),
    Single(u32),
    Leaf(LeafKind, ArrayVec<u32, WIDTH>),
}

/// A lane (child position) of a node that is being built.
struct PlannedChild {
    bounds: PaddedBox,
    content: PlannedChildRef,
}

type PlannedChildren = ArrayVec<PlannedChild, WIDTH>;

/// A binary tree that is being collapsed, with the costs of its subtrees.
struct TreeCollapse<'a> {
    binary: &'a BinaryTree,
    costs: Vec<SubtreeCosts>,
}

/// A finished part of the tree, whose nodes and leaves are numbered from zero. Its jobs are the
/// subtrees below it that other threads collapse.
#[derive(Default)]
struct CollapsedSubtree {
    nodes: Vec<Bvh8Node>,
    leaf_headers: Vec<LeafHeader>,
    rows: Vec<PrimitiveRow>,
    order: Vec<u32>,
    deepest: u32,
    jobs: Vec<SubtreeJob>,
}

/// A subtree that is collapsed separately: the node and the lane (child position) that will refer
/// to it, its root in the binary tree, and its level.
struct SubtreeJob {
    node: usize,
    lane: usize,
    root: u32,
    depth: u32,
}

impl TreeCollapse<'_> {
    /// Returns how many of `lanes` lanes (child positions) the left child gets for the least cost.
    fn left_child_lane_count(&self, left: u32, lanes: usize) -> usize {
        let (l, r) = (&self.costs[left as usize], &self.costs[left as usize + 1]);
        let cost = |to_left: &usize| l.cost[to_left - 1] + r.cost[lanes - to_left - 1];
        left_child_lane_range(l, r, lanes)
            .min_by(|a, b| cost(a).total_cmp(&cost(b)))
            .unwrap_or(1)
    }

    /// Appends at most `lanes` lanes (child positions) that together hold a subtree, by the choices
    /// of its costs.
    fn append_planned_children(&self, node: u32, mut lanes: usize, out: &mut PlannedChildren) {
        let (pick, bounds) = (
            &self.costs[node as usize].choices,
            self.binary.nodes[node as usize].bounds,
        );
        while lanes > 1 && pick[lanes - 1] == FEWER {
            lanes -= 1;
        }
        match pick[lanes - 1] {
            AS_LEAF => out.push(PlannedChild {
                bounds,
                content: self.make_leaf_ref(node),
            }),
            AS_INNER if lanes == 1 => out.push(PlannedChild {
                bounds,
                content: PlannedChildRef::Inner(node),
            }),
            _ => {
                self.append_children_of_siblings(self.binary.nodes[node as usize].first, lanes, out)
            }
        }
    }

    /// Appends the lanes of two siblings, `left` and the node after it.
    fn append_children_of_siblings(&self, left: u32, lanes: usize, out: &mut PlannedChildren) {
        let leaves = self.costs[left as usize].leaves + self.costs[left as usize + 1].leaves;
        let lanes = lanes.min(leaves.into());
        let to_left = self.left_child_lane_count(left, lanes);
        self.append_planned_children(left, to_left, out);
        self.append_planned_children(left + 1, lanes - to_left, out);
    }

    /// Returns the content of a lane that holds the subtree as a leaf.
    fn make_leaf_ref(&self, node: u32) -> PlannedChildRef {
        let SubtreeCosts {
            shared_count: alike,
            leaf_kind,
            ..
        } = self.costs[node as usize];
        if usize::from(alike) > WIDTH {
            return PlannedChildRef::Single(
                self.binary.order[self.binary.nodes[node as usize].first as usize],
            );
        }
        let mut places = ArrayVec::new();
        self.collect_primitives(node, &mut places);
        PlannedChildRef::Leaf(leaf_kind, places)
    }

    /// Appends the box indices of a small subtree's primitives.
    fn collect_primitives(&self, node: u32, out: &mut ArrayVec<u32, WIDTH>) {
        let source = &self.binary.nodes[node as usize];
        if source.count > 0 {
            let range = source.first as usize..(source.first + source.count) as usize;
            out.extend(self.binary.order[range].iter().copied());
        } else {
            self.collect_primitives(source.first, out);
            self.collect_primitives(source.first + 1, out);
        }
    }

    /// Collapses the tree below an inner node, at level `depth`. Subtrees whose root has at least
    /// the index `tops` become jobs. `None` if the tree is too deep.
    fn collapse_subtree(&self, root: u32, depth: u32, tops: usize) -> Option<CollapsedSubtree> {
        let mut piece = CollapsedSubtree {
            nodes: vec![Bvh8Node::EMPTY],
            ..CollapsedSubtree::default()
        };
        let mut work = vec![(0_usize, root, depth)];
        while let Some((slot, root, depth)) = work.pop() {
            if depth > MAX_DEPTH {
                return None;
            }
            piece.deepest = piece.deepest.max(depth);
            let mut lanes = PlannedChildren::new();
            self.append_children_of_siblings(
                self.binary.nodes[root as usize].first,
                WIDTH,
                &mut lanes,
            );
            let first = work.len();
            merge_sparse_blocks(&mut lanes);
            // Any-hit rays visit lanes from last to first. So the lanes most likely to end them
            // come last: leaves, and large boxes.
            let value_of = |lane: &PlannedChild| {
                (
                    !matches!(lane.content, PlannedChildRef::Inner(_)),
                    half_area(&lane.bounds),
                )
            };
            lanes.sort_by(|a, b| {
                value_of(a)
                    .0
                    .cmp(&value_of(b).0)
                    .then(value_of(a).1.total_cmp(&value_of(b).1))
            });
            for (lane, PlannedChild { bounds, content }) in lanes.into_iter().enumerate() {
                let child = match content {
                    PlannedChildRef::Inner(node) if node as usize >= tops => {
                        piece.jobs.push(SubtreeJob {
                            node: slot,
                            lane,
                            root: node,
                            depth: depth + 1,
                        });
                        ChildRef::NONE
                    }
                    PlannedChildRef::Inner(node) => {
                        work.push((piece.nodes.len(), node, depth + 1));
                        piece.nodes.push(Bvh8Node::EMPTY);
                        ChildRef::new(ChildRef::INNER, piece.nodes.len() - 1)
                    }
                    PlannedChildRef::Single(index) => {
                        piece.order.push(index);
                        ChildRef::new(ChildRef::OTHER, piece.order.len() - 1)
                    }
                    PlannedChildRef::Leaf(leaf_kind, places) => piece.push_leaf(leaf_kind, &places),
                };
                piece.nodes[slot].set_child(lane, &bounds, child);
            }
            work[first..].reverse();
        }
        Some(piece)
    }
}

impl CollapsedSubtree {
    /// Adds a leaf of primitives of one kind, given by box indices, and returns the reference to
    /// it.
    fn push_leaf(&mut self, leaf_kind: LeafKind, places: &[u32]) -> ChildRef {
        let (first, count) = (self.order.len(), places.len());
        self.order.extend_from_slice(places);
        match leaf_kind {
            LeafKind::Spheres if count > 1 => {
                self.rows.push(PrimitiveRow::with_primitive_count(
                    RowKind::Spheres,
                    first,
                    count,
                ));
                ChildRef::new(ChildRef::ROW, self.rows.len() - 1)
            }
            LeafKind::Triangles => {
                self.leaf_headers.push(LeafHeader::new(first, count));
                ChildRef::new(ChildRef::BLOCK, self.leaf_headers.len() - 1)
            }
            _ => ChildRef::new(ChildRef::OTHER, first),
        }
    }
}

impl Bvh8 {
    /// Collapses a binary tree. Each of its leaves must hold one primitive, or primitives of one
    /// kind that fit into one leaf of the eight-wide tree. Returns the tree, the box index for each
    /// position of its leaves, and its depth. `None` if the depth exceeds the traversal stack, or
    /// if the binary tree has no inner node.
    pub(crate) fn collapse(
        binary: &BinaryTree,
        leaf_kind: LeafKindLookup<'_>,
    ) -> Option<(Self, Vec<u32>, u32)> {
        if binary.nodes.first().is_none_or(|root| root.count > 0) {
            return None;
        }
        let collapse = TreeCollapse {
            binary,
            costs: compute_all_costs(binary, leaf_kind),
        };
        let top = collapse.collapse_subtree(0, 1, binary.top_node_count())?;
        let pieces: Vec<_> = top
            .jobs
            .par_iter()
            .map(|job| collapse.collapse_subtree(job.root, job.depth, usize::MAX))
            .collect();
        let pieces = pieces.into_iter().collect::<Option<Vec<_>>>()?;
        drop(collapse);
        let total = |count: fn(&CollapsedSubtree) -> usize| {
            count(&top) + pieces.iter().map(count).sum::<usize>()
        };
        let [nodes, blocks] = [
            total(|piece| piece.nodes.len()),
            total(|piece| piece.leaf_headers.len()),
        ];
        let mut bvh = Self {
            nodes: huge_page_vec(nodes),
            leaf_headers: huge_page_vec(blocks),
            rows: top.rows,
            ..Self::default()
        };
        bvh.nodes.extend(top.nodes);
        bvh.leaf_headers.extend(top.leaf_headers);
        let (mut order, mut deepest) = (huge_page_vec(binary.order.len()), top.deepest);
        order.extend(top.order);
        for (job, piece) in top.jobs.iter().zip(pieces) {
            let bases = [
                bvh.nodes.len(),
                bvh.leaf_headers.len(),
                order.len(),
                bvh.rows.len(),
            ];
            let bases @ [_, _, index, ..] = bases.map(|base| base as u32);
            bvh.nodes[job.node].children[job.lane] =
                ChildRef::new(ChildRef::INNER, bvh.nodes.len());
            let moved = |mut source: Bvh8Node| {
                source.children = source.children.map(|child| child.offset_index_by(bases));
                source
            };
            bvh.nodes.extend(piece.nodes.into_iter().map(moved));
            bvh.leaf_headers.extend(
                piece
                    .leaf_headers
                    .into_iter()
                    .map(|leaf_header| LeafHeader {
                        first: leaf_header.first + index,
                        ..leaf_header
                    }),
            );
            bvh.rows.extend(piece.rows);
            bvh.rows[bases[3] as usize..]
                .iter_mut()
                .for_each(|row| row.leaf_header.first += index);
            order.extend(piece.order);
            deepest = deepest.max(piece.deepest);
        }
        Some((bvh, order, deepest))
    }
}
