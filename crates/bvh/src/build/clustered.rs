//! The tree that `obvhs` clusters from the bottom.

use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance};
use obvhs::{Boundable, BvhBuildParams, aabb};

use super::morton::sorted;
use super::ploc_dry_run::{Passes, rehearse};
use super::reinsertion::affordable;
use super::{BuildQuality, Stop};
use crate::aabb::PaddedBox;
use crate::binary::{Binary, BinaryNode};

impl Boundable for PaddedBox {
    fn aabb(&self) -> aabb::Aabb {
        aabb::Aabb::new(self.min.into(), self.max.into())
    }
}

/// The nodes of a tree, in its order.
pub(super) fn nodes(tree: &Bvh2) -> Vec<BinaryNode> {
    let node = |n: &obvhs::bvh2::node::Bvh2Node| BinaryNode {
        bounds: PaddedBox { min: n.aabb.min.into(), max: n.aabb.max.into() },
        first: n.first_index,
        count: n.prim_count,
    };
    tree.nodes.iter().map(node).collect()
}

/// The tree by `obvhs`, unless it would be slow or is given up, and how much was or will be looked at. One pass of `obvhs`, once
/// begun, goes to its end.
pub(super) fn clustered(boxes: &[PaddedBox], quality: BuildQuality, stop: Stop<'_>) -> (Option<Binary>, u64) {
    let parameters = match quality {
        BuildQuality::Fast => BvhBuildParams::fast_build(),
        BuildQuality::Medium => BvhBuildParams::medium_build(),
        BuildQuality::High => BvhBuildParams::very_slow_build(),
    };
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
    let mut binary = Binary::sorted(&nodes(&built), order);
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
