//! Building: sanitised boxes in, a wide tree out. `obvhs` builds the binary tree; a median split takes over where its
//! clustering degenerates.

use glam::Vec3;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams, aabb};

use crate::aabb::PaddedBox;
use crate::tree::{MAX_LEAF, Tree};

/// How long a build may take for how good a tree: the presets of `obvhs`, by its names. Pictures do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// Least build time.
    Fastest,
    /// Twice the build time of the fastest, roughly.
    VeryFast,
    /// About all that a wide traversal needs.
    #[default]
    Fast,
    /// With more reinsertion.
    Medium,
    /// Several times the build time.
    Slow,
    /// Best tree, ten times the build time and more.
    VerySlow,
}

impl BuildQuality {
    /// Every preset, fastest build first.
    pub const ALL: [Self; 6] = [Self::Fastest, Self::VeryFast, Self::Fast, Self::Medium, Self::Slow, Self::VerySlow];

    fn parameters(self) -> BvhBuildParams {
        match self {
            Self::Fastest => BvhBuildParams::fastest_build(),
            Self::VeryFast => BvhBuildParams::very_fast_build(),
            Self::Fast => BvhBuildParams::fast_build(),
            Self::Medium => BvhBuildParams::medium_build(),
            Self::Slow => BvhBuildParams::slow_build(),
            Self::VerySlow => BvhBuildParams::very_slow_build(),
        }
    }
}

impl Boundable for PaddedBox {
    fn aabb(&self) -> aabb::Aabb {
        aabb::Aabb::new(self.min.into(), self.max.into())
    }
}

/// A binary tree as its builders leave it: children adjacent, leaves naming a range of `order`.
pub(crate) struct Binary {
    /// Root first.
    pub nodes: Vec<BinaryNode>,
    /// Positions in the input, leaf by leaf.
    pub order: Vec<u32>,
}

/// Inner: `count` 0 and the children at `first` and `first + 1`. Leaf: `count` entries of the order from `first`.
#[derive(Clone, Copy)]
pub(crate) struct BinaryNode {
    pub bounds: PaddedBox,
    pub first: u32,
    pub count: u32,
}

/// Builds the tree over `boxes`, and the order in which its leaves name them. Up to `few` boxes are a single leaf.
pub(crate) fn build(boxes: &[PaddedBox], quality: BuildQuality, few: usize) -> (Tree, Vec<u32>) {
    if boxes.len() <= few {
        return (Tree::leaf(boxes.len()), (0..boxes.len() as u32).collect());
    }
    if !crowded(boxes) {
        let binary = clustered(boxes, quality);
        if let Some(tree) = Tree::collapse(&binary) {
            return (tree, binary.order);
        }
    }
    let binary = median_split(boxes);
    (Tree::collapse(&binary).unwrap_or_default(), binary.order)
}

fn clustered(boxes: &[PaddedBox], quality: BuildQuality) -> Binary {
    let mut parameters = quality.parameters();
    // Measured: the four boxes of a node are tested in the time of two triangles, so that a box of its own for each
    // primitive is worth its place, and finding that out by the surface area heuristic is not worth its time.
    parameters.max_prims_per_leaf = 1;
    let built = build_bvh2(boxes, parameters, &mut core::time::Duration::ZERO.clone());
    let nodes = built.nodes.iter().map(|n| BinaryNode {
        bounds: PaddedBox { min: n.aabb.min.into(), max: n.aabb.max.into() },
        first: n.first_index,
        count: n.prim_count,
    });
    Binary { nodes: nodes.collect(), order: built.primitive_indices }
}

/// Whether so many boxes coincide that locally ordered clustering would chain them one by one, in quadratic time.
fn crowded(boxes: &[PaddedBox]) -> bool {
    const SAMPLES: usize = 512;
    let step = (boxes.len() / SAMPLES).max(1);
    let mut keys: Vec<[u32; 6]> = boxes
        .iter()
        .step_by(step)
        .map(|b| {
            let (min, max) = (b.min.to_array().map(f32::to_bits), b.max.to_array().map(f32::to_bits));
            [min[0], min[1], min[2], max[0], max[1], max[2]]
        })
        .collect();
    let sampled = keys.len();
    keys.sort_unstable();
    keys.dedup();
    sampled >= 64 && keys.len() < sampled * 3 / 4
}

/// Halves the boxes at the median centre of the widest axis: depth log₂ n whatever the boxes are.
fn median_split(boxes: &[PaddedBox]) -> Binary {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let empty = BinaryNode { bounds: PaddedBox { min: Vec3::ZERO, max: Vec3::ZERO }, first: 0, count: 0 };
    let mut nodes = vec![empty];
    let mut work = vec![(0_usize, 0_usize, boxes.len())];
    while let Some((node, start, end)) = work.pop() {
        let range = &mut order[start..end];
        let (min, max) = range.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &i| {
            let b = &boxes[i as usize];
            (lo.min(b.min), hi.max(b.max))
        });
        let bounds = PaddedBox { min, max };
        if range.len() <= MAX_LEAF as usize {
            nodes[node] = BinaryNode { bounds, first: start as u32, count: range.len() as u32 };
            continue;
        }
        let axis = (max - min).max_position();
        let centre = |i: &u32| boxes[*i as usize].min[axis] + boxes[*i as usize].max[axis];
        let middle = range.len() / 2;
        range.select_nth_unstable_by(middle, |a, b| centre(a).total_cmp(&centre(b)).then(a.cmp(b)));
        let first = nodes.len();
        nodes.extend([empty; 2]);
        nodes[node] = BinaryNode { bounds, first: first as u32, count: 0 };
        work.push((first, start, start + middle));
        work.push((first + 1, start + middle, end));
    }
    Binary { nodes, order }
}
