//! The structures that choose which primitives a query tests. Hits do not depend on them.

use crate::build::BuildQuality;
use crate::bvh8::{Bvh8, PrimitiveCounts};

/// Which structure answers queries. Hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcceleratorKind {
    /// Every primitive is tested: the oracle, and the O(N) side of the benchmark.
    Linear,
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
    /// None: so many places are tested one after the other.
    Linear(usize),
    Bvh8(Bvh8),
}

impl Accelerator {
    /// Bytes of the structure.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Linear(_) => 0,
            Self::Bvh8(bvh) => bvh.bytes(),
        }
    }

    /// The most bytes that the structure over so many boxes takes, of these kinds.
    pub fn most_bytes(kind: AcceleratorKind, boxes: u64, few: u64, shares: PrimitiveCounts) -> u64 {
        match kind {
            AcceleratorKind::Linear => 0,
            AcceleratorKind::Tree(_) if boxes <= few => 0,
            AcceleratorKind::Tree(_) => Bvh8::most_bytes(shares),
        }
    }
}
