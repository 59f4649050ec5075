//! Construction of the tree: boxes in, eight-wide nodes out. The crate `obvhs` clusters the boxes
//! into a binary tree and reinserts subtrees at cheaper positions. This module adds safeguards
//! against bad trees, and the collapse from binary to eight-wide nodes.

mod clusters;
mod curve;
mod median_split;
mod piles;
mod reinsertion;

use self::clusters::Clustering;
use self::median_split::MedianSplit;
use crate::aabb::PaddedBox;
use crate::binary::{BinaryNode, BinaryTree};
use crate::bvh8::{Bvh8, WIDTH};

/// Kind of acceleration structure: linear scan or tree. Hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcceleratorKind {
    /// A linear scan over all primitives: the oracle of tests, and the O(N) side of the benchmark.
    Linear,
    /// A bounding-volume hierarchy of the given build quality.
    Tree(BuildQuality),
}

impl Default for AcceleratorKind {
    fn default() -> Self {
        Self::Tree(BuildQuality::default())
    }
}

/// Trade-off between the time of building a tree and the time of its queries. Pictures do not
/// depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[doc(alias = "RTCBuildQuality")]
pub enum BuildQuality {
    /// Least build time: clustering, then reinsertion of the largest subtrees only.
    Fast,
    /// Clustering, then reinsertion of more subtrees.
    #[default]
    Medium,
    /// Twice the build time of `Medium`: clustering among more neighbours, then reinsertion of
    /// every subtree.
    High,
}

impl BuildQuality {
    /// All qualities, the fastest build first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Medium, Self::High];
}

/// Cost of a tree build in counted steps, for tests. Unlike a time, the counts are the same in
/// every run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildWork {
    /// Number of boxes visited by sorting, clustering, reinsertion and median splits, a box once
    /// for each visit. Clustering contributes a lower bound.
    pub boxes_visited: u64,
    /// Number of levels of the tree, including the root.
    pub depth: u32,
}

/// An accelerator over boxes, before the primitives are stored in its leaves.
pub(crate) struct BoxTree {
    pub bvh: Bvh8,
    /// Index of the input box at each position in leaf order; `None` if both orders are equal.
    pub order: Option<Vec<u32>>,
    /// Cost of the build; `None` for a linear scan.
    pub work: Option<BuildWork>,
    /// Number of spheres that are outside the tree, at the first positions. Every query tests these
    /// spheres, in rows of eight, before it visits nodes.
    pub spheres: usize,
}

impl BoxTree {
    /// Creates a linear scan over `places` primitives, in the order of their boxes.
    pub fn new_linear_scan(places: usize, work: Option<BuildWork>) -> Self {
        Self {
            bvh: Bvh8::new_without_nodes(0, 0, places),
            order: None,
            work,
            spheres: 0,
        }
    }
}

/// Kind of leaf that a primitive can share with up to seven others of its kind. A shared leaf is
/// tested in SIMD lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LeafKind {
    /// No shared leaf: the primitive is tested alone.
    None,
    Triangles,
    Spheres,
}

impl LeafKind {
    /// Returns the number of primitives of this kind up to which a subtree always becomes a single
    /// leaf. Smaller leaves would cost memory and save hardly any time.
    pub fn max_shared_leaf_size(self) -> usize {
        match self {
            Self::None => 1,
            Self::Triangles => 6,
            Self::Spheres => WIDTH,
        }
    }

    /// Returns the greatest number of primitives in a leaf from clustering, for a set whose
    /// primitives are all of this kind. Leaves of more than eight spheres are then split at
    /// multiples of eight. This gives full rows of eight, which saves memory.
    fn max_collapsed_leaf_size(self) -> usize {
        if self == Self::Spheres {
            4 * WIDTH
        } else {
            self.max_shared_leaf_size()
        }
    }
}

/// Function that returns the leaf kind of a primitive, given the index of its box.
pub(crate) type LeafKindLookup<'a> = &'a (dyn Fn(u32) -> LeafKind + Sync);

/// Function that returns whether the build is to be cancelled. The builder calls it between passes.
pub(crate) type StopCheck<'a> = &'a (dyn Fn() -> bool + Sync);

/// Builds the tree over at least two boxes. `kind` returns the leaf kind of a box index. Returns
/// `None` if `stop` cancelled the build.
pub(crate) fn build_box_tree(
    boxes: &[PaddedBox],
    quality: BuildQuality,
    kind: LeafKindLookup<'_>,
    stop: StopCheck<'_>,
) -> Option<BoxTree> {
    let mut work = BuildWork::default();
    // The clustered tree may be too deep for the traversal stack. The tree of median splits never
    // is.
    for quality in [Some(quality), None] {
        let (binary, looks) = build_binary_tree(boxes, quality, kind, stop)?;
        work.boxes_visited += looks;
        if let Some((tree, order, depth)) = Bvh8::collapse(&binary, kind) {
            return Some(BoxTree {
                bvh: tree,
                order: Some(order),
                work: Some(BuildWork { depth, ..work }),
                spheres: 0,
            });
        }
    }
    // Fallback: a linear scan is slow but correct.
    Some(BoxTree::new_linear_scan(boxes.len(), Some(work)))
}

/// Builds the binary tree over the boxes: by clustering, or by median splits alone if `quality` is
/// `None`. Returns the tree and the number of visited boxes; `None` if `stop` cancelled the build.
fn build_binary_tree(
    boxes: &[PaddedBox],
    quality: Option<BuildQuality>,
    kind: LeafKindLookup<'_>,
    stop: StopCheck<'_>,
) -> Option<(BinaryTree, u64)> {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let (mut nodes, mut looks) = (
        vec![BinaryNode {
            bounds: PaddedBox::EMPTY,
            first: 0,
            count: boxes.len() as u32,
        }],
        0,
    );
    let is_alike = (1..boxes.len() as u32).all(|index| kind(index) == kind(0));
    if let Some(quality) = quality {
        (order, looks) = curve::order_along_morton_curve(boxes);
        // `obvhs` knows no leaf kinds. In a set of several kinds, leaves are therefore made in the
        // collapse to eight-wide nodes.
        let leaf = if is_alike {
            kind(0).max_collapsed_leaf_size()
        } else {
            1
        };
        let clusters = Clustering::new(boxes, quality, leaf, stop).build_tree(&mut order)?;
        looks += clusters.boxes_visited;
        nodes = clusters.to_binary_nodes();
    }
    let halves = MedianSplit {
        boxes,
        kind,
        is_alike,
        stop,
    };
    for slot in 0..nodes.len() {
        let BinaryNode { first, count, .. } = nodes[slot];
        if count > 0 {
            let range = first as usize..(first + count) as usize;
            looks += halves.build_subtree(&mut nodes, slot, &mut order[range], first as usize);
        }
    }
    let binary = BinaryTree::from_unsorted(&nodes, order);
    (!stop()).then_some((binary, looks))
}
