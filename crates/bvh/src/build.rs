//! Building: sanitised boxes in, a tree of eight-wide nodes out. Our own builder splits from the top, and `obvhs` improves
//! that tree by moving its parts.

mod binned;
mod reinsertion;

use rayon::prelude::*;

use self::binned::{Manner, binned};
use self::reinsertion::reinsert;
use crate::aabb::{PaddedBox, exact_half_area};
use crate::binary::Binary;
use crate::bvh8::Bvh8;

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
    /// Least build time: split from the top, large sets by samples.
    Fast,
    /// Split from the top, and improved: most where sizes differ.
    #[default]
    Medium,
    /// Several times the build time: more is improved.
    High,
}

impl BuildQuality {
    /// Every quality, the fastest build first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Medium, Self::High];
}

/// Splits of larger sets are looked for with this many of their boxes where time is short.
const SAMPLE: usize = 4096;
/// Shares of the nodes that are moved at once in improving a tree, and how many that is at most.
const MOVED: [(f32, f32); 2] = [(0.2, 50_000.0), (1.0, 1e9)];
/// The same where boxes are alike: the largest alone. With four times as many the bunny's rays visited 3 % more nodes, and with fewer as many as
/// before. Measured: `../../../benches/runs`.
const MOVED_OF_ALIKE: (f32, f32) = (0.001, 5000.0);

/// What a build cost: what tests count where they can't measure time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildWork {
    /// Boxes looked at, at most: in splitting and in reinsertion.
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
        Self { bvh: Bvh8::flat(0, 0, places), order: None, work, spheres: 0 }
    }
}

/// What a primitive may share a leaf of the wide tree with: seven more that are tested with it in lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LeafKind {
    /// Nothing: it is tested alone.
    None,
    Triangles,
    Spheres,
}

/// Says what kind of leaf each of the boxes goes into.
pub(crate) type LeafKindOf<'a> = &'a (dyn Fn(u32) -> LeafKind + Sync);

/// Boxes that a thread looks at in one piece. Nothing depends on it.
pub(crate) const PIECE: usize = 4096;

/// Whether a build is to be given up, asked between its passes.
pub(crate) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Boxes of sizes more alike than this are alike: split from the top their tree is nearly as good as it can be.
const ALIKE: f64 = 2.0;

/// Where sizes differ more, a leaf of several triangles has a box of this many times the surface of their own boxes on average, at
/// most. What is left apart may still share a block, but what improves the tree moves it by itself, and eight large walls in one box are
/// asked about by every ray in the room. Measured: `../../../benches/runs`.
const WIDEST_LEAF: f64 = 8.0;

/// The surface of a box on average, half of it, and how much more the largest ones have: n Σa²/(Σa)² over surfaces, which is one where all are
/// alike. Measured: 1.1 to 9 on the surfaces of bodies, terrain and needles, 60 and more in rooms.
fn sizes(boxes: &[PaddedBox]) -> [f64; 2] {
    let sums =
        |boxes: &[PaddedBox]| boxes.iter().map(exact_half_area).fold([0.0, 0.0], |[sum, squares], a| [sum + a, squares + a * a]);
    let pieces: Vec<_> = boxes.par_chunks(PIECE).map(sums).collect();
    let [sum, squares] = pieces.iter().fold([0.0, 0.0], |all, one| [all[0] + one[0], all[1] + one[1]]);
    [sum / boxes.len() as f64, boxes.len() as f64 * squares / (sum * sum)]
}

/// Builds the tree over two boxes or more; none where `stop` said so.
pub(crate) fn build(boxes: &[PaddedBox], quality: BuildQuality, company: LeafKindOf<'_>, stop: Stop<'_>) -> Option<Build> {
    let mut work = BuildWork::default();
    // Improved it may be too deep, and split from the top it is not.
    for quality in [quality, BuildQuality::Fast] {
        let (binary, looks) = binary(boxes, quality, company, stop)?;
        work.looks += looks;
        if let Some((tree, order, depth)) = Bvh8::collapse(&binary, company) {
            return Some(Build { bvh: tree, order: Some(order), work: Some(BuildWork { depth, ..work }), spheres: 0 });
        }
    }
    // Were the builders wrong, queries would be slow, and right.
    Some(Build::scan(boxes.len(), Some(work)))
}

/// The binary tree over boxes, and how many of them were looked at.
fn binary(boxes: &[PaddedBox], quality: BuildQuality, company: LeafKindOf<'_>, stop: Stop<'_>) -> Option<(Binary, u64)> {
    let improves = quality != BuildQuality::Fast;
    // In least time all are taken to be alike.
    let [mean, unevenness] = if improves { sizes(boxes) } else { [0.0, 1.0] };
    let manner = Manner {
        leaf: crate::bvh8::WIDTH,
        sample: if improves { usize::MAX } else { SAMPLE },
        widest: if unevenness > ALIKE { (WIDEST_LEAF * mean) as f32 } else { f32::INFINITY },
    };
    let (mut binary, mut looks) = binned(boxes, company, manner, stop);
    if improves {
        let moved = MOVED[usize::from(quality == BuildQuality::High)];
        let (share, most) = if unevenness > ALIKE { moved } else { MOVED_OF_ALIKE };
        let share = share.min(most / binary.nodes.len() as f32);
        looks += reinsert(&mut binary, share, stop);
    }
    (!stop()).then_some((binary, looks))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn cube(centre: Vec3, edge: f32) -> PaddedBox {
        PaddedBox { min: centre - 0.5 * edge, max: centre + 0.5 * edge }
    }

    /// Small cubes on a grid, and some of them so many times as large.
    fn mixed(every: usize, larger: f32, edge: f32) -> Vec<PaddedBox> {
        let at = |i: usize| Vec3::new((i % 20) as f32, (i / 20 % 20) as f32, (i / 400) as f32);
        (0..8000).map(|i| cube(at(i), if i % every == 0 { larger * edge } else { edge })).collect()
    }

    const TRIANGLES: LeafKindOf<'static> = &|_| LeafKind::Triangles;

    /// Protects: the measures of sizes, by hand: cubes of edge 1, half of whose surface is 3, and one of edge 3.
    #[test]
    fn sizes_are_the_mean_and_how_uneven_they_are() {
        let boxes = [1.0, 1.0, 1.0, 3.0].map(|edge| cube(Vec3::splat(7.0), edge));
        assert_eq!(sizes(&boxes), [9.0, 4.0 * (3.0 * 9.0 + 27.0 * 27.0) / (36.0 * 36.0)]);
        assert_eq!(sizes(&boxes[..3]), [3.0, 1.0]);
    }

    /// Protects: where sizes are alike, too, the tree of the default is improved, and that of least time is not.
    #[test]
    fn even_trees_are_improved_too() {
        let boxes = mixed(1, 1.0, 0.5);
        let manner = |sample: usize| Manner { leaf: crate::bvh8::WIDTH, sample, widest: f32::INFINITY };
        for (quality, sample) in [(BuildQuality::Fast, SAMPLE), (BuildQuality::Medium, usize::MAX)] {
            let split = binned(&boxes, &|_| LeafKind::None, manner(sample), &|| false).1;
            let looks = binary(&boxes, quality, &|_| LeafKind::None, &|| false).unwrap().1;
            assert_eq!(looks > split, quality != BuildQuality::Fast, "{quality:?}: {looks} of {split}");
        }
    }

    /// Protects: where sizes differ, a leaf of several triangles is not much larger than they are, when the tree is improved; in least time
    /// and where all are alike it may be of any size.
    #[test]
    fn large_triangles_are_in_leaves_of_their_own() {
        let widest = |boxes: &[PaddedBox], quality: BuildQuality| {
            let (binary, _) = binary(boxes, quality, TRIANGLES, &|| false).unwrap();
            let shared = binary.nodes.iter().filter(|node| node.count > 1);
            shared.map(|node| exact_half_area(&node.bounds)).fold(0.0, f64::max) / sizes(boxes)[0]
        };
        let [differ, alike] = [mixed(10, 4.0, 0.5), mixed(1, 1.0, 0.02)];
        let uneven = [&differ, &alike].map(|boxes| sizes(boxes)[1]);
        assert!(uneven[0] > ALIKE && uneven[1] < ALIKE, "{uneven:?}");
        let shared = widest(&differ, BuildQuality::Medium);
        assert!(shared > 0.5 * WIDEST_LEAF && shared <= WIDEST_LEAF, "{shared}");
        assert!(widest(&differ, BuildQuality::Fast) > 1.5 * WIDEST_LEAF);
        assert!(widest(&alike, BuildQuality::Medium) > 100.0 * WIDEST_LEAF);
    }
}
