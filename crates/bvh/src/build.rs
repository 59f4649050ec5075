//! Building: boxes in, a tree of eight-wide nodes out. The crate `obvhs` clusters the boxes and
//! reinserts subtrees where they cost less. This module adds the guards against bad trees and the
//! collapse from binary to eight-wide nodes.

mod clusters;
mod curve;
mod median_split;
mod piles;
mod reinsertion;

use self::clusters::Clustering;
use self::median_split::MedianSplit;
use crate::aabb::PaddedBox;
use crate::binary::{Binary, BinaryNode};
use crate::bvh8::{Bvh8, WIDTH};

/// The acceleration structure of a geometry. Hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcceleratorKind {
    /// A linear scan over every primitive: the test oracle, and the O(N) side of the benchmark.
    Linear,
    /// A bounding-volume hierarchy.
    Tree(BuildQuality),
}

impl Default for AcceleratorKind {
    fn default() -> Self {
        Self::Tree(BuildQuality::default())
    }
}

/// Trade-off between build time and tree quality. Pictures do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[doc(alias = "RTCBuildQuality")]
pub enum BuildQuality {
    /// Least build time: clustering, then reinsertion of the largest subtrees.
    Fast,
    /// Reinsertion of more subtrees.
    #[default]
    Medium,
    /// Twice the build time: clustering among more neighbours, then reinsertion of every subtree.
    High,
}

impl BuildQuality {
    /// Every quality, the fastest build first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Medium, Self::High];
}

/// Deterministic measure of build cost, for tests that can't measure time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildWork {
    /// Boxes visited by sorting, clustering, reinsertion and halving. For clustering the count is a
    /// lower bound of the work.
    pub looks: u64,
    /// Number of levels, the root included.
    pub depth: u32,
}

/// An accelerator over boxes, whose leaves are still to be filled.
pub(crate) struct BoxTree {
    pub bvh: Bvh8,
    /// Box index for each position of the accelerator; `None` if both orders agree.
    pub order: Option<Vec<u32>>,
    /// Cost of the build; `None` for a scan.
    pub work: Option<BuildWork>,
    /// Number of spheres at the first positions, which every query tests in rows.
    pub spheres: usize,
}

impl BoxTree {
    /// A linear scan over `places` primitives.
    pub fn scan(places: usize, work: Option<BuildWork>) -> Self {
        Self {
            bvh: Bvh8::flat(0, 0, places),
            order: None,
            work,
            spheres: 0,
        }
    }
}

/// The kind of wide leaf that a primitive may share: such a leaf tests up to eight primitives in
/// SIMD lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LeafKind {
    /// No shared leaf: the primitive is tested alone.
    None,
    Triangles,
    Spheres,
}

impl LeafKind {
    /// Greatest size of a subtree that always becomes one leaf. Smaller leaves would cost more
    /// memory than their rays save time.
    pub fn shared(self) -> usize {
        match self {
            Self::None => 1,
            Self::Triangles => 6,
            Self::Spheres => WIDTH,
        }
    }

    /// Greatest size of a subtree that becomes one leaf of the binary tree, if all primitives are
    /// of this kind. Spheres are then halved into full leaves. These larger leaves save memory.
    fn collapsed(self) -> usize {
        if self == Self::Spheres {
            4 * WIDTH
        } else {
            self.shared()
        }
    }
}

/// The leaf kind of the box with the given index.
pub(crate) type LeafKindOf<'a> = &'a (dyn Fn(u32) -> LeafKind + Sync);

/// Whether to cancel the build; polled between its passes.
pub(crate) type StopCheck<'a> = &'a (dyn Fn() -> bool + Sync);

/// Builds the tree over at least two boxes. Returns `None` if `stop` cancelled the build.
pub(crate) fn build(
    boxes: &[PaddedBox],
    quality: BuildQuality,
    kind: LeafKindOf<'_>,
    stop: StopCheck<'_>,
) -> Option<BoxTree> {
    let mut work = BuildWork::default();
    // The clustered tree may be too deep; the halved tree is not.
    for quality in [Some(quality), None] {
        let (binary, looks) = binary(boxes, quality, kind, stop)?;
        work.looks += looks;
        if let Some((tree, order, depth)) = Bvh8::collapse(&binary, kind) {
            return Some(BoxTree {
                bvh: tree,
                order: Some(order),
                work: Some(BuildWork { depth, ..work }),
                spheres: 0,
            });
        }
    }
    // Fallback: queries by scan are slow but correct.
    Some(BoxTree::scan(boxes.len(), Some(work)))
}

/// The binary tree over the boxes, and the number of boxes visited. Without a quality the tree is
/// built by halving alone.
fn binary(
    boxes: &[PaddedBox],
    quality: Option<BuildQuality>,
    kind: LeafKindOf<'_>,
    stop: StopCheck<'_>,
) -> Option<(Binary, u64)> {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let (mut nodes, mut looks) = (
        vec![BinaryNode {
            bounds: PaddedBox::NOTHING,
            first: 0,
            count: boxes.len() as u32,
        }],
        0,
    );
    let is_alike = (1..boxes.len() as u32).all(|index| kind(index) == kind(0));
    if let Some(quality) = quality {
        (order, looks) = curve::order(boxes);
        // `obvhs` knows no leaf kinds. With several kinds, leaves are made in the collapse to wide
        // nodes.
        let leaf = if is_alike { kind(0).collapsed() } else { 1 };
        let clusters = Clustering::new(boxes, quality, leaf, stop).run(&mut order)?;
        looks += clusters.looks;
        nodes = clusters.nodes();
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
            looks += halves.halve(&mut nodes, slot, &mut order[range], first as usize);
        }
    }
    let binary = Binary::sorted(&nodes, order);
    (!stop()).then_some((binary, looks))
}
