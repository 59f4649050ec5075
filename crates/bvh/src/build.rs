//! Building: sanitised boxes in, a tree of eight-wide nodes out. `obvhs` clusters the boxes and
//! moves parts of the tree to where they cost less. Ours is what guards it, and the way from its
//! binary tree to eight-wide nodes.

mod clusters;
mod curve;
mod halves;
mod piles;
mod reinsertion;

use self::clusters::Clustering;
use self::halves::Halves;
use crate::aabb::PaddedBox;
use crate::binary::{Binary, BinaryNode};
use crate::bvh8::{Bvh8, WIDTH};

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

/// How long a build may take for how good a tree. Pictures do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// Least build time: clustered, and its greatest parts moved.
    Fast,
    /// More is moved.
    #[default]
    Medium,
    /// Twice the build time: clustered among more neighbours, and everything is moved.
    High,
}

impl BuildQuality {
    /// Every quality, the fastest build first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Medium, Self::High];
}

/// What a build cost: what tests count where they can't measure time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildWork {
    /// Boxes looked at: in sorting, clustering, moving and halving. In clustering it is the least
    /// that its tree may have taken.
    pub looks: u64,
    /// Nodes from the root to the deepest, the root included.
    pub depth: u32,
}

/// A structure over boxes, whose leaves are still to be filled.
pub(crate) struct Build {
    pub bvh: Bvh8,
    /// The order in which its places name the boxes, where that is not their own.
    pub order: Option<Vec<u32>>,
    /// What building it took; none for a scan.
    pub work: Option<BuildWork>,
    /// The first places, whose spheres every query tests in rows.
    pub spheres: usize,
}

impl Build {
    /// So many places that are tested one after the other.
    pub fn scan(places: usize, work: Option<BuildWork>) -> Self {
        Self {
            bvh: Bvh8::flat(0, 0, places),
            order: None,
            work,
            spheres: 0,
        }
    }
}

/// What a primitive may share a leaf of the wide tree with: seven more that are tested with it in
/// lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LeafKind {
    /// Nothing: it is tested alone.
    None,
    Triangles,
    Spheres,
}

impl LeafKind {
    /// So many are one leaf wherever they are a subtree: with smaller leaves a tree takes more room
    /// than its rays win.
    pub fn shared(self) -> usize {
        match self {
            Self::None => 1,
            Self::Triangles => 6,
            Self::Spheres => WIDTH,
        }
    }

    /// So many are a leaf of the binary tree wherever they are a subtree, where all primitives are
    /// of this kind. Spheres are then halved, to full leaves: it is memory that these save.
    fn collapsed(self) -> usize {
        if self == Self::Spheres {
            4 * WIDTH
        } else {
            self.shared()
        }
    }
}

/// Says what kind of leaf each of the boxes goes into.
pub(crate) type LeafKindOf<'a> = &'a (dyn Fn(u32) -> LeafKind + Sync);

/// Whether a build is to be given up, asked between its passes.
pub(crate) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Builds the tree over two boxes or more; none where `stop` said so.
pub(crate) fn build(
    boxes: &[PaddedBox],
    quality: BuildQuality,
    kind: LeafKindOf<'_>,
    stop: Stop<'_>,
) -> Option<Build> {
    let mut work = BuildWork::default();
    // Clustered it may be too deep, and halved it is not.
    for quality in [Some(quality), None] {
        let (binary, looks) = binary(boxes, quality, kind, stop)?;
        work.looks += looks;
        if let Some((tree, order, depth)) = Bvh8::collapse(&binary, kind) {
            return Some(Build {
                bvh: tree,
                order: Some(order),
                work: Some(BuildWork { depth, ..work }),
                spheres: 0,
            });
        }
    }
    // Were the builders wrong, queries would be slow, and right.
    Some(Build::scan(boxes.len(), Some(work)))
}

/// The binary tree over boxes, and how many of them were looked at; halved alone where no quality
/// is asked for.
fn binary(
    boxes: &[PaddedBox],
    quality: Option<BuildQuality>,
    kind: LeafKindOf<'_>,
    stop: Stop<'_>,
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
    let is_alike = (1..boxes.len() as u32).all(|place| kind(place) == kind(0));
    if let Some(quality) = quality {
        (order, looks) = curve::order(boxes);
        // `obvhs` knows of no kinds. Leaves of several are made where nodes become wide.
        let leaf = if is_alike { kind(0).collapsed() } else { 1 };
        let clusters = Clustering::new(boxes, quality, leaf, stop).run(&mut order)?;
        looks += clusters.looks;
        nodes = clusters.nodes();
    }
    let halves = Halves {
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
