//! A tree made better by moving its parts to where they cost less: the reinsertion of `obvhs`, as
//! much of it as is worth its time. For each node it looks through the tree for a better parent and
//! leaves out what can't be one. Among long crossing boxes hardly anything is left out, and with
//! many nodes to place that is quadratic. So the search is tried with a few of them first.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

/// Nodes that the search is tried with.
const TRIED: usize = 64;
/// Steps of a search that are in order. Measured: 31 to 76 among random balls and on grids, 59 to
/// 121 among sticks along the axes, 200 to 2500 and more among crossing ones.
const STEPS: u64 = 150;

/// Shares of what is to be moved, one round each: the last rounds, of the greatest boxes alone, put
/// right what the first ones made uneven.
const ROUNDS: [f32; 6] = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125];

/// Moves this share of the nodes, and ever fewer after them, from the top on. Returns how many
/// nodes were looked at.
pub(super) fn reinsert(tree: &mut Bvh2, share: f32) -> u64 {
    if tree.nodes.len() < 3 || share <= 0.0 {
        return 0;
    }
    tree.init_parents_if_uninit();
    let (share, steps) = affordable(tree, share);
    ReinsertionOptimizer::default().run(tree, share, Some(ROUNDS.to_vec()));
    steps
}

/// The share of nodes to reinsert, of a tree that knows parents, and what that costs: for searches
/// that are not too long the share that is asked for, for others less by as much as they are too
/// long.
fn affordable(tree: &Bvh2, share: f32) -> (f32, u64) {
    let nodes = tree.nodes.len();
    // The candidates are the largest of those that come first, twice as many as are wanted.
    let candidates = ((nodes as f32 * share * 2.0) as usize).clamp(1, nodes) - 1;
    let tried = TRIED.min(candidates / 16);
    if tried == 0 {
        return (share, 0);
    }
    let steps = (0..tried)
        .map(|i| steps(tree, 1 + i * (candidates - 1) / tried))
        .sum::<u64>();
    let mean = (steps / tried as u64).max(1);
    let searches = |share: f32| (nodes as f32 * share * ROUNDS.iter().sum::<f32>()) as u64;
    let affordable = if mean <= STEPS {
        share
    } else {
        share * STEPS as f32 / mean as f32
    };
    (affordable, steps + searches(affordable) * mean)
}

/// Steps that the search for a better place of this node takes, by the rules of `obvhs`; so many as
/// are too long at most.
fn steps(tree: &Bvh2, node: usize) -> u64 {
    const MOST: u64 = 4096;
    let area = |aabb: &Aabb| aabb.half_area();
    let own = *tree.nodes[node].aabb();
    let parent = tree.parents[node] as usize;
    let (mut best, mut steps, mut won) = (0.0, 0, area(tree.nodes[parent].aabb()));
    let mut sibling = Bvh2Node::get_sibling_id(node);
    let mut around = *tree.nodes[sibling].aabb();
    let mut pivot = parent;
    let mut waiting = Vec::new();
    loop {
        waiting.push((won, sibling));
        while let Some((won, place)) = waiting.pop() {
            steps += 1;
            if steps >= MOST {
                return steps;
            }
            if won - area(&own) <= best {
                continue;
            }
            let there = &tree.nodes[place];
            let left = won - area(&there.aabb().union(&own));
            best = left.max(best);
            if !there.is_leaf() {
                let (below, first) = (left + area(there.aabb()), there.first_index as usize);
                waiting.extend([(below, first), (below, first + 1)]);
            }
        }
        if pivot != parent {
            around = around.union(tree.nodes[sibling].aabb());
            won += area(tree.nodes[pivot].aabb()) - area(&around);
        }
        if pivot == 0 {
            return steps;
        }
        sibling = Bvh2Node::get_sibling_id(pivot);
        pivot = tree.parents[pivot] as usize;
    }
}
