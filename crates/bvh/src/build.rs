//! Building: sanitised boxes in, a wide tree out. `obvhs` builds the binary tree; a median split takes over where its
//! clustering degenerates.

mod binned;
mod morton;
mod rehearsal;
mod reinsertion;

use obvhs::bvh2::DEFAULT_MAX_STACK_DEPTH;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance};
use obvhs::{Boundable, BvhBuildParams, aabb};

use self::binned::binned;
use self::morton::sorted;
use self::rehearsal::{Passes, rehearse};
use self::reinsertion::affordable;
use crate::aabb::PaddedBox;
use crate::binary::{Binary, BinaryNode};
use crate::tree::Tree;
use crate::wide::Wide;

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

/// Which builder made a tree, and what it cost: what tests count where they can't measure time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildWork {
    /// Whether clustering built it, as it does unless it would be slow. Otherwise it was split from the top.
    pub clustered: bool,
    /// Boxes and pairs of boxes looked at, at most: in sorting, in the rehearsal, in clustering, in reinsertion, and in the
    /// other builder.
    pub looks: u64,
    /// Nodes from the root to the deepest, the root included.
    pub depth: u32,
}

/// What rays walk.
pub(crate) enum Collapsed {
    Narrow(Tree),
    /// Its blocks are still to be filled.
    Wide(Wide),
}

/// A tree, the order in which its leaves name the boxes, and how it came about.
pub(crate) struct Build {
    pub tree: Collapsed,
    pub order: Vec<u32>,
    pub work: BuildWork,
}

/// Says which of the boxes are triangles', where the tree is to be wide.
pub(crate) type Triangles<'a> = Option<&'a dyn Fn(u32) -> bool>;

/// What rays walk from a binary tree; none where that is too deep for their stack.
fn collapse(binary: Binary, triangles: Triangles<'_>) -> Option<(Collapsed, Vec<u32>, u32)> {
    match triangles {
        Some(is_triangle) => {
            Wide::collapse(&binary, is_triangle).map(|(wide, order, depth)| (Collapsed::Wide(wide), order, depth))
        }
        None => Tree::collapse(&binary).map(|(tree, depth)| (Collapsed::Narrow(tree), binary.order, depth)),
    }
}

/// Whether a build is to be given up, asked between its passes.
pub(crate) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Builds the tree over `boxes`; none where `stop` said so. Up to `few` boxes are a single leaf.
pub(crate) fn build(
    boxes: &[PaddedBox],
    quality: BuildQuality,
    few: usize,
    triangles: Triangles<'_>,
    stop: Stop<'_>,
) -> Option<Build> {
    let leaf = || (Collapsed::Narrow(Tree::leaf(boxes.len())), (0..boxes.len() as u32).collect(), 0);
    if boxes.len() <= few {
        let (tree, order, _) = leaf();
        return Some(Build { tree, order, work: BuildWork::default() });
    }
    let (clustered, mut looks) = clustered(boxes, quality, stop);
    if stop() {
        return None;
    }
    if let Some(binary) = clustered
        && let Some((tree, order, depth)) = collapse(binary, triangles)
    {
        return Some(Build { tree, order, work: BuildWork { clustered: true, looks, depth } });
    }
    let (binary, counted) = binned(boxes, stop);
    if stop() {
        return None;
    }
    looks += counted;
    // The builder keeps to fewer levels than there is a stack for. Were it wrong in that, the tree would be slow, not empty.
    let (tree, order, depth) = collapse(binary, triangles).unwrap_or_else(leaf);
    Some(Build { tree, order, work: BuildWork { clustered: false, looks, depth } })
}

/// The tree by `obvhs`, unless it would be slow or is given up, and how much was or will be looked at. One pass of `obvhs`, once
/// begun, goes to its end.
fn clustered(boxes: &[PaddedBox], quality: BuildQuality, stop: Stop<'_>) -> (Option<Binary>, u64) {
    let parameters = quality.parameters();
    let sorted = sorted(boxes, parameters.sort_precision);
    let sorting = boxes.len() as u64 * u64::from(boxes.len().next_power_of_two().ilog2());
    let Some(sorted) = sorted else { return (None, 2 * sorting) };
    let passes = Passes { near: parameters.search_depth_threshold, distance: distance(parameters.ploc_search_distance) };
    let rehearsal = rehearse(&sorted.boxes, passes, stop);
    let mut looks = sorting + rehearsal.pairs + rehearsal.ahead;
    if !rehearsal.passed || stop() {
        return (None, looks);
    }
    let mut built = PlocBuilder::with_capacity(boxes.len()).build(
        parameters.ploc_search_distance,
        &sorted.boxes,
        (0..boxes.len() as u32).collect(),
        sorted.precision,
        parameters.search_depth_threshold,
    );
    // Reinsertion panics, or forgets what it should still look at, in trees deeper than the stack it reserves.
    if built.max_depth > DEFAULT_MAX_STACK_DEPTH {
        return (None, looks);
    }
    let mut optimizer = ReinsertionOptimizer::default();
    // Once before its leaves are collapsed to hold several primitives, once after. They are not: measured, the four boxes of
    // a node are tested in the time of two triangles, so that a box of its own for each primitive is worth its place.
    let again = parameters.reinsertion_batch_ratio * parameters.post_collapse_reinsertion_batch_ratio_multiplier;
    for share in [parameters.reinsertion_batch_ratio, again].into_iter().filter(|&share| share > 0.0) {
        if stop() {
            return (None, looks);
        }
        built.init_parents_if_uninit();
        let (share, steps) = affordable(&built, share);
        looks += steps;
        optimizer.run(&mut built, share, None);
    }
    let order = built.primitive_indices.iter().map(|&place| sorted.places[place as usize]).collect();
    let nodes = built.nodes.iter().map(|n| BinaryNode {
        bounds: PaddedBox { min: n.aabb.min.into(), max: n.aabb.max.into() },
        first: n.first_index,
        count: n.prim_count,
    });
    let mut binary = Binary { nodes: nodes.collect(), order };
    if sorted.grown {
        binary.refit(boxes);
    }
    (Some(binary), looks)
}

/// The search distances by their number.
fn distance(name: PlocSearchDistance) -> usize {
    match name {
        PlocSearchDistance::Minimum => 1,
        PlocSearchDistance::VeryLow => 2,
        PlocSearchDistance::Low => 6,
        PlocSearchDistance::Medium => 14,
        PlocSearchDistance::High => 24,
        PlocSearchDistance::VeryHigh => 32,
    }
}
