//! Optimisation of a tree by reinsertion with `obvhs`, in limited time. For each node, reinsertion
//! searches the tree for a better parent, and prunes the search by cost. Among long crossing boxes
//! hardly any subtree is pruned, so the time is quadratic in the number of nodes. Therefore the
//! number of nodes that a search visits is first measured on a sample of nodes.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

/// Greatest number of sample nodes on which the search length is measured.
const TRIAL_NODES: usize = 64;
/// Greatest mean number of nodes that a search visits, for reinsertion of the full requested
/// fraction of nodes. Longer searches reduce the fraction. Measured means:
///
/// - random spheres and grids: 31 to 76,
/// - axis-aligned sticks: 59 to 121,
/// - crossing sticks: 200 to 2500 and more.
const MAX_MEAN_STEPS: u64 = 150;

/// Fractions of the requested number of nodes, one for each round of reinsertion. Each round takes
/// the nodes with the largest boxes. The later rounds therefore repeat the largest boxes, since
/// earlier rounds left some of these at costly positions.
const ROUND_SHARES: [f32; 6] = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125];

/// Reinserts the fraction `share` of the nodes, or a smaller fraction if the searches are long.
/// Nodes with large boxes come first. Returns the estimated number of nodes that all searches
/// visit; zero for a tree too small for an estimate.
pub(super) fn reinsert_subtrees(tree: &mut Bvh2, share: f32) -> u64 {
    if tree.nodes.len() < 3 || share <= 0.0 {
        return 0;
    }
    tree.init_parents_if_uninit();
    let (share, steps) = limit_reinserted_fraction(tree, share);
    ReinsertionOptimizer::default().run(tree, share, Some(ROUND_SHARES.to_vec()));
    steps
}

/// Returns the fraction of the nodes to reinsert, and the estimated number of nodes that all
/// searches visit. `tree.parents` must be initialised. Let m be the mean number of nodes that a
/// search visits. The fraction is:
///
/// - `share`, if m is at most [`MAX_MEAN_STEPS`];
/// - `share` · `MAX_MEAN_STEPS` / m, if m is greater;
/// - `share` with an estimate of zero, if the tree is too small to measure m.
fn limit_reinserted_fraction(tree: &Bvh2, share: f32) -> (f32, u64) {
    let nodes = tree.nodes.len();
    // `obvhs` takes its candidates from the start of the node list, twice as many as it reinserts,
    // and reinserts the largest of them.
    let candidates = ((nodes as f32 * share * 2.0) as usize).clamp(1, nodes) - 1;
    let tried = TRIAL_NODES.min(candidates / 16);
    if tried == 0 {
        return (share, 0);
    }
    let steps = (0..tried)
        .map(|i| count_search_steps(tree, 1 + i * (candidates - 1) / tried))
        .sum::<u64>();
    let mean = (steps / tried as u64).max(1);
    let searches = |share: f32| (nodes as f32 * share * ROUND_SHARES.iter().sum::<f32>()) as u64;
    let affordable = if mean <= MAX_MEAN_STEPS {
        share
    } else {
        share * MAX_MEAN_STEPS as f32 / mean as f32
    };
    (affordable, steps + searches(affordable) * mean)
}

/// Returns the number of nodes that `obvhs` visits in its search for a better parent of `node`.
/// Counting stops at `MOST`.
fn count_search_steps(tree: &Bvh2, node: usize) -> u64 {
    const MOST: u64 = 4096;
    let area = |aabb: &Aabb| aabb.half_area();
    let bounds = *tree.nodes[node].aabb();
    let parent = tree.parents[node] as usize;
    let (mut best, mut steps, mut saved_area) = (0.0, 0, area(tree.nodes[parent].aabb()));
    let mut sibling = Bvh2Node::get_sibling_id(node);
    let mut around = *tree.nodes[sibling].aabb();
    let mut pivot = parent;
    let mut pending_nodes = Vec::new();
    loop {
        pending_nodes.push((saved_area, sibling));
        while let Some((saved_area, index)) = pending_nodes.pop() {
            steps += 1;
            if steps >= MOST {
                return steps;
            }
            if saved_area - area(&bounds) <= best {
                continue;
            }
            let candidate = &tree.nodes[index];
            let left = saved_area - area(&candidate.aabb().union(&bounds));
            best = left.max(best);
            if !candidate.is_leaf() {
                let (below, first) = (
                    left + area(candidate.aabb()),
                    candidate.first_index as usize,
                );
                pending_nodes.extend([(below, first), (below, first + 1)]);
            }
        }
        if pivot != parent {
            around = around.union(tree.nodes[sibling].aabb());
            saved_area += area(tree.nodes[pivot].aabb()) - area(&around);
        }
        if pivot == 0 {
            return steps;
        }
        sibling = Bvh2Node::get_sibling_id(pivot);
        pivot = tree.parents[pivot] as usize;
    }
}
