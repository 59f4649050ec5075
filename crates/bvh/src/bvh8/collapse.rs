//! Collapse of a binary tree to eight-wide nodes and leaves of up to eight primitives of a kind,
//! with least expected cost.
//!
//! A child is an inner node, a leaf of up to eight triangles or spheres, or one other primitive.

mod costs;

use arrayvec::ArrayVec;
use rayon::prelude::*;

use super::{Bvh8, Child, MAX_DEPTH, Node, WIDTH};
use crate::aabb::{PaddedBox, half_area};
use crate::binary::Binary;
use crate::build::{LeafKind, LeafKindOf};
use crate::bvh8::row::{Row, RowKind};
use crate::bvh8::triangle8::{LeafHeader, Triangle8};
use crate::memory::{filled, huge_page_vec};
use costs::{AS_INNER, AS_LEAF, Costs, FEWER, shares, solve, weight};

/// A block with fewer primitives is merged with a neighbour if both fit into one block and the
/// merged block costs rays less.
const SPARSE: usize = 5;

/// Future content of a lane.
enum LaneContent {
    Inner(u32),
    Other(u32),
    Several(LeafKind, ArrayVec<u32, WIDTH>),
}

/// A lane of a node under construction.
struct Lane {
    bounds: PaddedBox,
    content: LaneContent,
}

type NodeLanes = ArrayVec<Lane, WIDTH>;

struct Collapse<'a> {
    binary: &'a Binary,
    costs: Vec<Costs>,
}

/// A finished part of the tree with its own numbering from zero, and the subtrees still missing
/// below it.
#[derive(Default)]
struct Piece {
    nodes: Vec<Node>,
    facts: Vec<LeafHeader>,
    rows: Vec<Row>,
    order: Vec<u32>,
    deepest: u32,
    jobs: Vec<Job>,
}

/// A subtree that another piece will hold: the node and lane that refer to it, its root in the
/// binary tree, and its level.
struct Job {
    slot: usize,
    lane: usize,
    root: u32,
    depth: u32,
}

impl Collapse<'_> {
    /// The left child's share of `lanes` lanes.
    fn to_left(&self, left: u32, lanes: usize) -> usize {
        let (l, r) = (&self.costs[left as usize], &self.costs[left as usize + 1]);
        let cost = |to_left: &usize| l.cost[to_left - 1] + r.cost[lanes - to_left - 1];
        shares(l, r, lanes)
            .min_by(|a, b| cost(a).total_cmp(&cost(b)))
            .unwrap_or(1)
    }

    /// Appends the lanes of a subtree, at most `lanes`.
    fn open(&self, node: u32, mut lanes: usize, out: &mut NodeLanes) {
        let (pick, bounds) = (
            &self.costs[node as usize].pick,
            self.binary.nodes[node as usize].bounds,
        );
        while lanes > 1 && pick[lanes - 1] == FEWER {
            lanes -= 1;
        }
        match pick[lanes - 1] {
            AS_LEAF => out.push(Lane {
                bounds,
                content: self.leaf(node),
            }),
            AS_INNER if lanes == 1 => out.push(Lane {
                bounds,
                content: LaneContent::Inner(node),
            }),
            _ => self.divide(self.binary.nodes[node as usize].first, lanes, out),
        }
    }

    fn divide(&self, left: u32, lanes: usize, out: &mut NodeLanes) {
        let leaves = self.costs[left as usize].leaves + self.costs[left as usize + 1].leaves;
        let lanes = lanes.min(leaves.into());
        let to_left = self.to_left(left, lanes);
        self.open(left, to_left, out);
        self.open(left + 1, lanes - to_left, out);
    }

    fn leaf(&self, node: u32) -> LaneContent {
        let Costs { alike, company, .. } = self.costs[node as usize];
        if usize::from(alike) > WIDTH {
            return LaneContent::Other(
                self.binary.order[self.binary.nodes[node as usize].first as usize],
            );
        }
        let mut places = ArrayVec::new();
        self.places(node, &mut places);
        LaneContent::Several(company, places)
    }

    /// Appends the primitives of a small subtree.
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

    /// The tree below an inner node, without subtrees rooted at nodes from `tops` on; `None` if it
    /// is too deep.
    fn piece(&self, root: u32, depth: u32, tops: usize) -> Option<Piece> {
        let mut piece = Piece {
            nodes: vec![Node::EMPTY],
            ..Piece::default()
        };
        let mut work = vec![(0_usize, root, depth)];
        while let Some((slot, root, depth)) = work.pop() {
            if depth > MAX_DEPTH {
                return None;
            }
            piece.deepest = piece.deepest.max(depth);
            let mut lanes = NodeLanes::new();
            self.divide(self.binary.nodes[root as usize].first, WIDTH, &mut lanes);
            let first = work.len();
            join_sparse(&mut lanes);
            // Any-hit rays visit lanes from last to first, so the lanes that end them soonest come
            // last.
            let of = |lane: &Lane| {
                (
                    !matches!(lane.content, LaneContent::Inner(_)),
                    half_area(&lane.bounds),
                )
            };
            lanes.sort_by(|a, b| of(a).0.cmp(&of(b).0).then(of(a).1.total_cmp(&of(b).1)));
            for (lane, Lane { bounds, content }) in lanes.into_iter().enumerate() {
                let child = match content {
                    LaneContent::Inner(node) if node as usize >= tops => {
                        piece.jobs.push(Job {
                            slot,
                            lane,
                            root: node,
                            depth: depth + 1,
                        });
                        Child::NONE
                    }
                    LaneContent::Inner(node) => {
                        work.push((piece.nodes.len(), node, depth + 1));
                        piece.nodes.push(Node::EMPTY);
                        Child::new(Child::INNER, piece.nodes.len() - 1)
                    }
                    LaneContent::Other(place) => {
                        piece.order.push(place);
                        Child::new(Child::OTHER, piece.order.len() - 1)
                    }
                    LaneContent::Several(company, places) => piece.leaf(company, &places),
                };
                piece.nodes[slot].set(lane, &bounds, child);
            }
            work[first..].reverse();
        }
        Some(piece)
    }
}

impl Piece {
    /// Makes a leaf of primitives of one kind.
    fn leaf(&mut self, company: LeafKind, places: &[u32]) -> Child {
        let (first, count) = (self.order.len(), places.len());
        self.order.extend_from_slice(places);
        match company {
            LeafKind::Spheres if count > 1 => {
                self.rows.push(Row::room(RowKind::Spheres, first, count));
                Child::new(Child::ROW, self.rows.len() - 1)
            }
            LeafKind::Triangles => {
                self.facts.push(LeafHeader::new(first, count));
                Child::new(Child::BLOCK, self.facts.len() - 1)
            }
            _ => Child::new(Child::OTHER, first),
        }
    }
}

impl Bvh8 {
    /// Collapses a binary tree. Each of its leaves holds one primitive, or as many primitives of
    /// one leaf kind as a wide leaf. Returns the tree, the order in which its leaves refer to the
    /// boxes, and its depth. `None` if the depth exceeds the traversal stack, or if the tree has no
    /// inner node.
    pub(crate) fn collapse(
        binary: &Binary,
        company: LeafKindOf<'_>,
    ) -> Option<(Self, Vec<u32>, u32)> {
        if binary.nodes.first().is_none_or(|root| root.count > 0) {
            return None;
        }
        let collapse = Collapse {
            binary,
            costs: solve(binary, company),
        };
        let top = collapse.piece(0, 1, binary.tops())?;
        let pieces: Vec<_> = top
            .jobs
            .par_iter()
            .map(|job| collapse.piece(job.root, job.depth, usize::MAX))
            .collect();
        let pieces = pieces.into_iter().collect::<Option<Vec<_>>>()?;
        drop(collapse);
        let total =
            |count: fn(&Piece) -> usize| count(&top) + pieces.iter().map(count).sum::<usize>();
        let [nodes, blocks] = [
            total(|piece| piece.nodes.len()),
            total(|piece| piece.facts.len()),
        ];
        let mut bvh = Self {
            nodes: huge_page_vec(nodes),
            facts: huge_page_vec(blocks),
            rows: top.rows,
            ..Self::default()
        };
        bvh.nodes.extend(top.nodes);
        bvh.facts.extend(top.facts);
        let (mut order, mut deepest) = (huge_page_vec(binary.order.len()), top.deepest);
        order.extend(top.order);
        for (job, piece) in top.jobs.iter().zip(pieces) {
            let bases = [
                bvh.nodes.len(),
                bvh.facts.len(),
                order.len(),
                bvh.rows.len(),
            ];
            let bases @ [_, _, place, ..] = bases.map(|base| base as u32);
            bvh.nodes[job.slot].children[job.lane] = Child::new(Child::INNER, bvh.nodes.len());
            let moved = |mut source: Node| {
                source.children = source.children.map(|child| child.moved(bases));
                source
            };
            bvh.nodes.extend(piece.nodes.into_iter().map(moved));
            bvh.facts
                .extend(piece.facts.into_iter().map(|facts| LeafHeader {
                    first: facts.first + place,
                    ..facts
                }));
            bvh.rows.extend(piece.rows);
            bvh.rows[bases[3] as usize..]
                .iter_mut()
                .for_each(|row| row.facts.first += place);
            order.extend(piece.order);
            deepest = deepest.max(piece.deepest);
        }
        bvh.blocks = filled(bvh.facts.len(), Triangle8::EMPTY);
        Some((bvh, order, deepest))
    }
}

/// Merges sparse blocks of a node if the merged block costs rays less than both.
fn join_sparse(lanes: &mut NodeLanes) {
    while let Some((into, from)) = pair(lanes) {
        let Lane {
            bounds,
            content: LaneContent::Several(_, places),
        } = lanes.remove(from)
        else {
            break;
        };
        let into = &mut lanes[into - usize::from(from < into)];
        into.bounds = into.bounds.union(&bounds);
        if let LaneContent::Several(_, own) = &mut into.content {
            own.extend(places);
        }
    }
}

/// Two blocks that fit into one, the second being sparse: the pair whose box grows least.
fn pair(lanes: &[Lane]) -> Option<(usize, usize)> {
    let count = |lane: usize| match &lanes[lane].content {
        LaneContent::Several(company, places) => Some((*company, places.len())),
        _ => None,
    };
    let spent = |lane: usize| {
        let (company, own) = count(lane)?;
        Some(half_area(&lanes[lane].bounds) * weight(company, own as u8))
    };
    // Only if it costs rays less: a block of two opposite walls would be tested by every ray in the
    // room.
    let pays = |a: usize, b: usize, company: LeafKind, together: usize| {
        let area = half_area(&lanes[a].bounds.union(&lanes[b].bounds));
        spent(a)
            .zip(spent(b))
            .is_some_and(|(a, b)| area * weight(company, together as u8) < a + b)
    };
    let growth = |&(a, b): &(usize, usize)| {
        let [a, b] = [&lanes[a].bounds, &lanes[b].bounds];
        half_area(&a.union(b)) - half_area(a) - half_area(b)
    };
    if !(0..lanes.len()).any(|lane| count(lane).is_some_and(|(_, own)| own < SPARSE)) {
        return None;
    }
    let pairs = (0..lanes.len()).flat_map(|b| (0..lanes.len()).map(move |a| (a, b)));
    let fit = pairs.filter(|&(a, b)| {
        let fits = |((own, into), (other, from))| {
            own == other && from < SPARSE && into + from <= WIDTH && pays(a, b, own, into + from)
        };
        a != b && count(a).zip(count(b)).is_some_and(fits)
    });
    fit.min_by(|a, b| growth(a).total_cmp(&growth(b)))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::build::{BuildQuality, build};

    /// The triangles of each block of a tree over the given boxes, by box index.
    fn blocks(boxes: &[(Vec3, Vec3)]) -> Vec<Vec<u32>> {
        let boxes: Vec<_> = boxes
            .iter()
            .map(|&(min, size)| PaddedBox {
                min,
                max: min + size,
            })
            .collect();
        let built = build(
            &boxes,
            BuildQuality::Medium,
            &|_| LeafKind::Triangles,
            &|| false,
        )
        .expect("not stopped");
        let order = built.order.expect("a tree");
        let own =
            |facts: &LeafHeader| order[facts.first as usize..][..usize::from(facts.count)].to_vec();
        built.bvh.facts.iter().map(own).collect()
    }

    /// Protects: two opposite walls of a room share no block, which every ray in the room would
    /// test; two adjacent walls share one, and so do small triangles in a corner.
    #[test]
    fn walls_share_a_block_only_where_rays_spend_less() {
        let wall = |x: f32, y: f32| (Vec3::new(x, y, 0.0), Vec3::new(0.001, 1.0, 1.0));
        let small = |i: u8| {
            (
                Vec3::new(0.5 + 0.01 * f32::from(i), 0.5, 0.5),
                Vec3::splat(0.01),
            )
        };
        let opposite: Vec<_> = [wall(0.0, 0.0), wall(1.0, 0.0)]
            .into_iter()
            .chain((0..8).map(small))
            .collect();
        let together = |blocks: &[Vec<u32>]| {
            blocks
                .iter()
                .any(|block| block.contains(&0) && block.contains(&1))
        };
        let [apart, beside] = [blocks(&opposite), blocks(&[wall(0.0, 0.0), wall(0.0, 1.0)])];
        assert!(
            !together(&apart) && apart.iter().flatten().count() == 10,
            "{apart:?}"
        );
        assert!(apart.iter().any(|block| block.len() == 8), "{apart:?}");
        assert!(together(&beside), "{beside:?}");
    }
}
