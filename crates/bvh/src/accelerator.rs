//! The structures that choose which primitives a query tests. They know boxes and places, and have nothing to do with hits.

use core::ops::{ControlFlow, Range};

use crate::aabb::PaddedBox;
use crate::boxes::BoxList;
use crate::build::{Build, BuildQuality, BuildWork, Collapsed, Stop, Triangles, build};
use crate::ray::{Interval, Ray};
use crate::scalar::Real;
use crate::tally::Tally;
use crate::tree::Tree;
use crate::wide::{Shares, Wide};

/// Which structure answers queries. Hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcceleratorKind {
    /// Every primitive is tested: the oracle, and the O(N) side of the benchmark.
    Linear,
    /// Every primitive's box is tested, four at a time in SIMD registers, and the primitives whose boxes are entered: what a
    /// scan can become without a hierarchy. For benchmarks.
    LinearBoxes,
    /// A bounding-volume hierarchy.
    Tree(BuildQuality),
}

impl Default for AcceleratorKind {
    fn default() -> Self {
        Self::Tree(BuildQuality::default())
    }
}

/// A structure over the places 0, 1, 2 … of a list of primitives.
#[derive(Clone, Debug)]
pub(crate) enum Accelerator {
    /// Walked in the ray's own scalar.
    Walked(Walked),
    /// Asked in f32.
    Wide(Wide, BuildWork),
}

/// Those that know places alone.
#[derive(Clone, Debug)]
pub(crate) enum Walked {
    Linear(usize),
    LinearBoxes(BoxList),
    Tree(Tree, BuildWork),
}

impl Accelerator {
    /// Builds over `boxes`. Returns the order in too, where that is not the order of the boxes, in which the list must be for
    /// the places to be right. Up to `few` boxes are not worth a tree. None where `stop` gave the build up.
    pub fn new(
        kind: AcceleratorKind,
        boxes: &[PaddedBox],
        few: usize,
        triangles: Option<Triangles<'_>>,
        stop: Stop<'_>,
    ) -> Option<(Self, Option<Vec<u32>>)> {
        Some(match kind {
            AcceleratorKind::Linear => (Self::Walked(Walked::Linear(boxes.len())), None),
            AcceleratorKind::LinearBoxes => (Self::Walked(Walked::LinearBoxes(BoxList::new(boxes))), None),
            AcceleratorKind::Tree(quality) => {
                let Build { tree, order, work } = build(boxes, quality, few, triangles, stop)?;
                let tree = match tree {
                    Collapsed::Narrow(tree) => Self::Walked(Walked::Tree(tree, work)),
                    Collapsed::Wide(wide) => Self::Wide(wide, work),
                };
                (tree, Some(order))
            }
        })
    }

    /// What building it took; none where nothing was built.
    pub fn work(&self) -> Option<BuildWork> {
        match self {
            Self::Walked(Walked::Linear(_) | Walked::LinearBoxes(_)) => None,
            Self::Walked(Walked::Tree(_, work)) | Self::Wide(_, work) => Some(*work),
        }
    }

    /// Bytes of the structure.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Walked(Walked::Linear(_)) => 0,
            Self::Walked(Walked::LinearBoxes(list)) => list.bytes(),
            Self::Walked(Walked::Tree(tree, _)) => tree.bytes(),
            Self::Wide(wide, _) => wide.bytes(),
        }
    }

    /// The most bytes that the structure over so many boxes takes; of these kinds where the tree is wide.
    pub fn most_bytes(kind: AcceleratorKind, boxes: u64, few: u64, wide: Option<Shares>) -> u64 {
        match kind {
            AcceleratorKind::Linear => 0,
            AcceleratorKind::LinearBoxes => BoxList::bytes_of(boxes),
            AcceleratorKind::Tree(_) if boxes <= few => 0,
            AcceleratorKind::Tree(quality) => match wide {
                Some(shares) => {
                    let triangles = quality.most_references(shares.triangles);
                    let others = boxes.saturating_sub(shares.triangles);
                    let names = if quality.splits() { triangles.saturating_add(others).saturating_mul(4) } else { 0 };
                    Wide::most_bytes(Shares { triangles, ..shares }, quality.packs()).saturating_add(names)
                }
                None => Tree::most_bytes(boxes),
            },
        }
    }
}

impl Walked {
    /// Calls `visit` with the places of all primitives that the ray may meet below the current far end, some at a time. The
    /// closure returns the new far end, or breaks.
    #[inline(always)]
    pub fn walk<R: Real, T: Tally>(
        &self,
        ray: &Ray<R>,
        range: Interval<R>,
        tally: &mut T,
        mut visit: impl FnMut(Range<usize>, R, &mut T) -> ControlFlow<(), R>,
    ) {
        match self {
            Self::Linear(count) => {
                let _ = visit(0..*count, range.max, tally);
            }
            Self::LinearBoxes(list) => list.walk(ray, range, tally, visit),
            Self::Tree(tree, _) => tree.walk(ray, range, tally, visit),
        }
    }
}
