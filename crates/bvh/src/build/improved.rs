//! A tree made better by moving its parts to where they cost less: the reinsertion of `obvhs`.

use obvhs::Boundable;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};

use super::Stop;
use super::clustered::nodes;
use super::reinsertion::affordable;
use crate::aabb::half_area;
use crate::binary::Binary;

/// Moves this share of the nodes, and ever fewer after them, from the top on. Returns how many nodes were looked at.
pub(super) fn improved(binary: &mut Binary, share: f32, stop: Stop<'_>) -> u64 {
    // Where surfaces leave the range of f32, `obvhs` can't tell what is better.
    if stop() || binary.nodes.len() < 3 || !half_area(&binary.nodes[0].bounds).is_finite() {
        return 0;
    }
    // What is looked for first are the first nodes: those near the root.
    let level = binary.by_level();
    let mut tree = Bvh2 { max_depth: DEFAULT_MAX_STACK_DEPTH, ..Bvh2::default() };
    tree.nodes = level.iter().map(|node| Bvh2Node::new(node.bounds.aabb(), node.count, node.first)).collect();
    tree.init_parents_if_uninit();
    let (share, steps) = affordable(&tree, share);
    ReinsertionOptimizer::default().run(&mut tree, share, None);
    let order = core::mem::take(&mut binary.order);
    *binary = Binary::sorted(&nodes(&tree), order);
    steps
}
