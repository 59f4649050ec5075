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

use super::curve::cell_extent;
use super::piles::piled;
use super::reinsertion::reinsert;
use super::{BuildQuality, StopCheck};
use crate::aabb::{PIECE, PaddedBox};
use crate::binary::BinaryNode;

/// Greatest number of boxes clustered at once. A call of `obvhs` then takes a tenth of a second.
const MOST: usize = 1 << 18;
/// Number of nodes of each piece's tree that the joining tree has as leaves.
const TOPS: usize = 64;

/// Parameters of `obvhs` for a build quality.
#[derive(Clone, Copy)]
struct ClusteringOptions {
    /// Whether clustering examines 14 neighbours on either side, instead of 6.
    far: bool,
    /// Fractions of the nodes to reinsert, before and after the collapse to leaves.
    moved: [f32; 2],
}

impl ClusteringOptions {
    /// Returns the parameters of a build quality. Measured: `../../../../benches/runs`.
    fn new(quality: BuildQuality) -> Self {
        match quality {
            BuildQuality::Fast => Self {
                far: false,
                moved: [0.0, 0.05],
            },
            BuildQuality::Medium => Self {
                far: false,
                moved: [0.03, 0.3],
            },
            BuildQuality::High => Self {
                far: true,
                moved: [0.3, 1.0],
            },
        }
    }
}

/// A tree of `obvhs` whose leaves refer to ranges of an order of boxes, and the number of boxes
/// visited to build it.
pub(super) struct Clusters {
    tree: Bvh2,
    pub looks: u64,
}

impl Clusters {
    /// Converts the nodes, without their boxes, which `obvhs` has scaled.
    pub fn nodes(&self) -> Vec<BinaryNode> {
        let node = |node: &Bvh2Node| BinaryNode {
            bounds: PaddedBox::NOTHING,
            first: node.first_index,
            count: node.prim_count,
        };
        self.tree.nodes.iter().map(node).collect()
    }
}

/// Input and parameters of a clustering.
pub(super) struct Clustering<'a> {
    boxes: &'a [PaddedBox],
    means: ClusteringOptions,
    /// Greatest number of boxes in a subtree that becomes one leaf.
    leaf: u32,
    /// Greatest number of boxes in a piece.
    most: usize,
    /// Power of two by which boxes are scaled, so that no surface area leaves the range of f32.
    scale: f32,
    stop: StopCheck<'a>,
}

impl<'a> Clustering<'a> {
    /// Creates a clustering in which every subtree of at most `leaf` boxes becomes a leaf.
    pub fn new(
        boxes: &'a [PaddedBox],
        quality: BuildQuality,
        leaf: usize,
        stop: StopCheck<'a>,
    ) -> Self {
        let around = boxes
            .par_iter()
            .with_min_len(PIECE)
            .copied()
            .reduce(|| PaddedBox::NOTHING, |a, b| a.union(&b));
        let extent = (around.max.as_dvec3() - around.min.as_dvec3()).max_element();
        // With this scale the greatest surface area is slightly above 2⁶⁰. That leaves room for
        // sums of areas, and boxes 2⁻⁹⁰ times as long still have distinct areas.
        let exponent = 30 - (extent.log2() as i32).clamp(-96, 156);
        Self {
            boxes,
            means: ClusteringOptions::new(quality),
            leaf: leaf as u32,
            most: MOST,
            scale: 2.0_f32.powi(exponent),
            stop,
        }
    }

    /// Builds the tree over boxes in the order of a curve, and permutes that order; `None` if
    /// cancelled.
    pub fn run(&self, order: &mut [u32]) -> Option<Clusters> {
        let size = order.len().div_ceil(order.len().div_ceil(self.most));
        let pieces: Vec<_> = order
            .par_chunks_mut(size)
            .map(|order| self.piece(order))
            .collect();
        let mut pieces = pieces.into_iter().collect::<Option<Vec<_>>>()?;
        if pieces.len() == 1 {
            return pieces.pop();
        }
        self.joined(pieces, size)
    }

    /// Returns the scaled box with the given index, as a box of `obvhs`.
    fn aabb(&self, index: u32) -> Aabb {
        let PaddedBox { min, max } = self.boxes[index as usize];
        Aabb::new((min * self.scale).into(), (max * self.scale).into())
    }

    /// Builds the tree of one piece of the curve, by all four steps.
    fn piece(&self, order: &mut [u32]) -> Option<Clusters> {
        let leaf =
            |(position, &index): (usize, &u32)| Bvh2Node::new(self.aabb(index), 1, position as u32);
        let leaves = piled(&order.iter().enumerate().map(leaf).collect::<Vec<_>>());
        let Clusters {
            mut tree,
            mut looks,
        } = self.clustered(leaves)?;
        let [before, after] = self.means.moved;
        looks += self.moved(&mut tree, before)?;
        tree.primitive_indices = order.to_vec();
        // With this cost of a node, every small subtree becomes a leaf. The collapse to eight-wide
        // nodes decides by ray cost which leaves share a block.
        collapse(&mut tree, self.leaf, self.leaf as f32);
        order.copy_from_slice(&tree.primitive_indices);
        looks += self.moved(&mut tree, after)?;
        Some(Clusters { tree, looks })
    }

    /// Clusters leaves, given in the order of the curve, to a tree; `None` if cancelled.
    fn clustered(&self, leaves: Vec<Bvh2Node>) -> Option<Clusters> {
        if (self.stop)() {
            return None;
        }
        let around = leaves
            .iter()
            .fold(Aabb::INVALID, |all, leaf| all.union(leaf.aabb()));
        // A centre at the upper end would wrap around to the Morton code of the lower end.
        let extent = cell_extent(around.diagonal().as_dvec3()).as_vec3a() * (1.0 + 1e-6)
            + Vec3A::splat(f32::MIN_POSITIVE);
        let around = Aabb::new(around.min, around.min + extent);
        let mut builder = PlocBuilder::new();
        let mut tree = Bvh2::default();
        builder.current_nodes = leaves;
        let neighbours = if self.means.far {
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
        let looks = neighbours * waits(&tree);
        Some(Clusters { tree, looks })
    }

    /// Reinserts a fraction of the nodes, and returns the number of nodes visited; `None` if
    /// cancelled.
    fn moved(&self, tree: &mut Bvh2, share: f32) -> Option<u64> {
        (!(self.stop)()).then(|| reinsert(tree, share))
    }

    /// Joins the trees of pieces of `size` boxes into one tree; `None` if cancelled.
    fn joined(&self, pieces: Vec<Clusters>, size: usize) -> Option<Clusters> {
        let tops: Vec<_> = pieces.iter().map(|piece| tops(&piece.tree)).collect();
        let all = pieces
            .iter()
            .zip(&tops)
            .enumerate()
            .flat_map(|(number, (piece, tops))| {
                tops.iter().map(move |&top| {
                    Bvh2Node::new(*piece.tree.nodes[top].aabb(), number as u32 + 1, top as u32)
                })
            });
        let Clusters {
            mut tree,
            mut looks,
        } = self.clustered(all.collect())?;
        looks += self.moved(&mut tree, 1.0)?;
        let mut bases = Vec::with_capacity(pieces.len());
        let joined = tree.nodes.len();
        for (number, piece) in pieces.into_iter().enumerate() {
            let base = tree.nodes.len() as u32;
            bases.push(base);
            looks += piece.looks;
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
        Some(Clusters { tree, looks })
    }
}

/// Lower bound of the number of clustering passes that nodes waited for their siblings, summed over
/// all nodes. Children come after their parents.
fn waits(tree: &Bvh2) -> u64 {
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

/// Selects the nodes below which the tree of a piece stays unchanged when pieces are joined. From
/// the root on, the largest selected node is replaced by its children until enough nodes are
/// selected.
fn tops(tree: &Bvh2) -> Vec<usize> {
    let mut tops = vec![0];
    let area = |&top: &usize| {
        if tree.nodes[top].is_leaf() {
            -1.0
        } else {
            tree.nodes[top].aabb().half_area()
        }
    };
    while tops.len() < TOPS {
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
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::build::curve;

    /// Creates boxes at scattered positions, a fiftieth of them at a single position.
    fn boxes(count: usize) -> Vec<PaddedBox> {
        let at = |i: usize| if i.is_multiple_of(50) { 7 } else { i };
        let place = |i: usize, stride: usize| (at(i) * stride % 20_011) as f32 / 20_011.0;
        let centre = |i: usize| Vec3::new(place(i, 3137), place(i, 6197), place(i, 8117));
        (0..count)
            .map(|i| PaddedBox {
                min: centre(i) - 0.01,
                max: centre(i) + 0.01 + place(i, 977) * 0.05,
            })
            .collect()
    }

    /// The order of boxes and the nodes of a tree, in a form that can be compared.
    type TreeSignature = (Vec<(u32, u32)>, Vec<u32>, u64);

    fn run(
        boxes: &[PaddedBox],
        quality: BuildQuality,
        shared: usize,
        maximum: usize,
        threads: usize,
    ) -> TreeSignature {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let (mut order, _) = curve::order(boxes);
            let clusters = Clustering {
                most: maximum,
                ..Clustering::new(boxes, quality, shared, &|| false)
            }
            .run(&mut order)
            .unwrap();
            (
                clusters
                    .nodes()
                    .iter()
                    .map(|node| (node.first, node.count))
                    .collect(),
                order,
                clusters.looks,
            )
        })
    }

    /// Protects: the tree is the same for any number of threads, built from one piece or from many.
    /// Each box is in one leaf, and leaves other than piles respect their size limit.
    #[test]
    fn trees_are_the_same_for_any_number_of_threads() {
        let boxes = boxes(30_000);
        for (quality, shared, maximum) in [
            (BuildQuality::High, 4, MOST),
            (BuildQuality::Medium, 1, 4096),
            (BuildQuality::Fast, 8, 500),
        ] {
            let one = run(&boxes, quality, shared, maximum, 1);
            assert!(
                one == run(&boxes, quality, shared, maximum, 4),
                "{quality:?}"
            );
            let (nodes, order, _) = one;
            let (mut hit_primitives, mut waiting) = (Vec::new(), vec![0]);
            while let Some(index) = waiting.pop() {
                let (first, count) = nodes[index as usize];
                if count == 0 {
                    waiting.extend([first, first + 1]);
                    continue;
                }
                let own = &order[first as usize..(first + count) as usize];
                assert!(
                    own.len() <= shared || own.len() >= 16,
                    "{quality:?}: {own:?}"
                );
                hit_primitives.extend_from_slice(own);
            }
            hit_primitives.sort_unstable();
            assert!(
                hit_primitives.into_iter().eq(0..boxes.len() as u32),
                "{quality:?}"
            );
        }
    }

    /// Protects: a tree joined from many pieces costs rays hardly more than a tree of a single
    /// piece, measured by the surface areas of its nodes.
    #[test]
    fn pieces_are_joined_well() {
        let boxes: Vec<_> = boxes(20_000)
            .into_iter()
            .enumerate()
            .filter(|(i, _)| !i.is_multiple_of(50))
            .map(|(_, own)| own)
            .collect();
        let cost = |maximum: usize| {
            let (mut order, _) = curve::order(&boxes);
            let clustering = Clustering {
                most: maximum,
                ..Clustering::new(&boxes, BuildQuality::Medium, 1, &|| false)
            };
            let tree = clustering.run(&mut order).unwrap().tree;
            let (mut cost, mut waiting) = (0.0, vec![0]);
            while let Some(node) = waiting.pop().map(|index: u32| tree.nodes[index as usize]) {
                cost += f64::from(node.aabb().half_area())
                    / f64::from(tree.nodes[0].aabb().half_area());
                waiting.extend(
                    (!node.is_leaf())
                        .then_some([node.first_index, node.first_index + 1])
                        .into_iter()
                        .flatten(),
                );
            }
            cost
        };
        let [whole, pieces] = [cost(MOST), cost(2000)];
        assert!(pieces < 1.03 * whole, "{pieces} against {whole}");
    }
}
