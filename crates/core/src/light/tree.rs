//! Tree over lights with a position, for sampling lights by their estimated contribution
//! ("Importance Sampling of Many Lights with Adaptive Tree Splitting", Conty Estevez, Kulla 2018;
//! "Physically Based Rendering", 4th edition, 12.6.3). Each node bounds positions, directions and
//! intensity of its lights, and so the light that may arrive at a point.
//!
//! A node has up to eight children. A binary tree would have three times as many levels, and each
//! level costs a memory latency and a mispredicted branch.

mod build;
mod node;

use glam::DVec3;
use raywright_bvh::{Real, SimdTask, run_widest};

use build::{LeafGroup, partition_children};
use node::{LightNode, WIDTH, cumulative_sums};

use super::lanes::LightChoices;
use super::{LightBounds, LightId};

/// A light with a position, as a leaf of the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightLeaf {
    pub light: LightId,
    pub bounds: LightBounds,
    /// Greatest intensity times π, summed over the three channels. Intensity and not power: of two
    /// lights of one power, a spot is brighter in its cone than a point. Positive and finite.
    pub intensity: f64,
}

/// A receiving point: a surface point for which a light is sampled.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReceivingPoint {
    pub point: DVec3,
    /// Unit normal of the side that receives light; zero if both sides receive light.
    pub normal: DVec3,
}

/// Content of a slot of the tree: a node or a light. A slot is a place for a child: the tree has a
/// root slot, and each node has [`WIDTH`] slots.
#[derive(Clone, Copy, Debug)]
enum LightTreeChild {
    Inner(u32),
    Light(LightId),
}

/// Tree of lights by position, direction and intensity.
#[derive(Clone, Debug, Default)]
pub(super) struct LightTree {
    top: Option<LightTreeChild>,
    nodes: Vec<LightNode>,
}

impl LightTree {
    /// Slot of a light that is not in the tree.
    pub const NONE: u32 = u32::MAX;
    /// The root slot. The slot of any other child is `WIDTH` times its parent's index, plus the
    /// index of the child within the parent.
    const TOP: u32 = u32::MAX - 1;

    /// Builds the tree over lights of positive intensity. Calls `place` with each light and its slot.
    pub fn new(mut leaves: Vec<LightLeaf>, mut place: impl FnMut(LightId, u32)) -> Self {
        let mut tree = Self::default();
        // Groups of lights whose nodes are not built yet, with their slots.
        let mut open: Vec<(LeafGroup, u32)> = LeafGroup::from_all_leaves(&leaves)
            .map(|all| (all, Self::TOP))
            .into_iter()
            .collect();
        while let Some((group, position)) = open.pop() {
            let content = if let [leaf] = leaves[group.range()] {
                place(leaf.light, position);
                LightTreeChild::Light(leaf.light)
            } else {
                let (index, mut node) = (tree.nodes.len(), LightNode::new(&group.sum, position));
                for (lane, part) in partition_children(&mut leaves, group)
                    .into_iter()
                    .enumerate()
                {
                    node.set_child(lane, &part.sum, &group.sum);
                    open.push((part, (WIDTH * index + lane) as u32));
                }
                tree.nodes.push(node);
                LightTreeChild::Inner(index as u32)
            };
            match position {
                Self::TOP => tree.top = Some(content),
                _ => {
                    tree.nodes[position as usize / WIDTH].children[position as usize % WIDTH] =
                        content
                }
            }
        }
        tree
    }

    pub fn is_empty(&self) -> bool {
        self.top.is_none()
    }

    /// Returns the number of levels of nodes.
    #[cfg(test)]
    pub fn depth(&self) -> usize {
        let mut depths = vec![1; self.nodes.len()];
        for (i, node) in self.nodes.iter().enumerate().skip(1) {
            depths[i] = depths[node.parent as usize / WIDTH] + 1;
        }
        depths.into_iter().max().unwrap_or(0)
    }

    /// Bytes of the nodes.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.nodes.as_slice()) as u64
    }

    /// Estimates the bytes of the nodes for a number of lights.
    ///
    /// A node has eight children, or fewer if it has fewer lights. Nodes are most numerous if
    /// lights end up in pairs: half as many nodes as lights, and a seventh of that number above
    /// them. More nodes are needed only for nested groups that are each far smaller than their
    /// distances, see [`partition_children`].
    pub fn estimate_bytes(lights: u64) -> u64 {
        let nodes = if lights > 1 {
            lights.saturating_mul(4) / 7 + 1
        } else {
            0
        };
        nodes.saturating_mul(size_of::<LightNode>() as u64)
    }

    /// Samples a light for each point whose `is_used` is set, by the point's uniform number `u` in
    /// [0, 1). `receiver` returns the point by its index.
    #[inline(always)]
    pub fn sample_lights<const N: usize>(
        &self,
        is_used: &[bool; N],
        u: &[f64; N],
        receiver: impl Fn(usize) -> ReceivingPoint,
    ) -> LightChoices<N> {
        match self.top {
            Some(LightTreeChild::Inner(_)) if is_used.contains(&true) => {
                run_widest(LightTreeTask {
                    tree: self,
                    is_used,
                    u,
                    points: &core::array::from_fn(receiver),
                })
            }
            Some(LightTreeChild::Light(light)) => LightChoices {
                lights: is_used.map(|is_used| is_used.then_some(light)),
                probabilities: [1.0; N],
            },
            _ => LightChoices::NONE,
        }
    }

    /// Returns the node in a slot; `None` for a light or an empty slot.
    #[inline(always)]
    fn node_at(&self, content: LightTreeChild) -> Option<&LightNode> {
        match content {
            LightTreeChild::Inner(index) => self.nodes.get(index as usize),
            LightTreeChild::Light(_) => None,
        }
    }

    /// Traverses the tree level by level, each step for all receiving points side by side. The
    /// latencies for one point (square roots, divisions, loads of nodes) then overlap with those
    /// for other points.
    #[inline(always)]
    fn traverse_lanes<const N: usize>(
        &self,
        is_used: &[bool; N],
        mut u: [f64; N],
        points: &[ReceivingPoint; N],
    ) -> LightChoices<N> {
        let nothing = LightTreeChild::Inner(Self::NONE);
        let top = self.top.unwrap_or(nothing);
        let mut content = is_used.map(|is_used| if is_used { top } else { nothing });
        let mut probability = [1.0; N];
        // All points descend from the same root: its children are weighed for all points at once.
        if N > 1
            && let Some(root) = self.node_at(top)
        {
            let chosen = root.choose_children(points, &u);
            for i in 0..N {
                content[i] = if is_used[i] && chosen.is_lit[i] {
                    root.children[chosen.children[i]]
                } else {
                    nothing
                };
            }
            (u, probability) = (chosen.u, chosen.probabilities);
        }
        let mut importances = [[0.0; WIDTH]; N];
        loop {
            let mut some = false;
            for i in 0..N {
                if let Some(node) = self.node_at(content[i]) {
                    importances[i] = node.child_importances(&points[i]);
                    some = true;
                }
            }
            if !some {
                return LightChoices {
                    lights: content.map(|content| match content {
                        LightTreeChild::Light(light) => Some(light),
                        LightTreeChild::Inner(_) => None,
                    }),
                    probabilities: probability,
                };
            }
            for i in 0..N {
                let Some(node) = self.node_at(content[i]) else {
                    continue;
                };
                let sums = cumulative_sums(&importances[i]);
                let total = sums[WIDTH];
                // True for NaN too.
                if !(total > 0.0 && total.is_finite()) {
                    content[i] = nothing;
                    continue;
                }
                let at = u[i] * total;
                let lane = child_at(&sums, at);
                let importance = f64::from(importances[i][lane]);
                u[i] = Real::clamp((at - sums[lane]) / importance, 0.0, BELOW_ONE);
                probability[i] *= importance / total;
                content[i] = node.children[lane];
            }
        }
    }

    /// Returns the probability with which [`LightTree::sample_lights`] samples the light in the
    /// slot `index`. Probabilities are multiplied from the root down as in sampling: the bits are
    /// equal.
    pub fn probability(&self, index: u32, receiver: &ReceivingPoint) -> f64 {
        if index == Self::TOP {
            return 1.0;
        }
        let Some(node) = self.nodes.get(index as usize / WIDTH) else {
            return 0.0;
        };
        let importances = node.child_importances(receiver);
        let total = cumulative_sums(&importances)[WIDTH];
        if !(total > 0.0 && total.is_finite()) {
            return 0.0;
        }
        self.probability(node.parent, receiver)
            * (f64::from(importances[index as usize % WIDTH]) / total)
    }
}

/// Returns the child that a number below the last of the cumulative sums selects.
///
/// A number below one times the sum is below the sum, so the selected child has a positive
/// importance. The child is found by counting, not by a search, because the end of a search is
/// mispredicted.
#[inline(always)]
fn child_at(sums: &[f64; WIDTH + 1], at: f64) -> usize {
    let mut lane = 0;
    for &sum in &sums[1..WIDTH] {
        lane += usize::from(sum <= at);
    }
    lane
}

/// Children of a node chosen for several points side by side.
struct ChosenChildren<const N: usize> {
    /// Whether any light of the node arrives at each point. If not, the other fields are
    /// meaningless.
    is_lit: [bool; N],
    children: [usize; N],
    /// Uniform numbers for the choice within each child.
    u: [f64; N],
    probabilities: [f64; N],
}

impl LightNode {
    /// Chooses a child for each point by the point's number `u` in [0, 1).
    #[inline(always)]
    fn choose_children<const N: usize>(
        &self,
        points: &[ReceivingPoint; N],
        u: &[f64; N],
    ) -> ChosenChildren<N> {
        let importances = self.importances_at(points);
        let mut sums = [[0.0; N]; WIDTH + 1];
        let (mut at, mut counts) = ([0.0; N], [0_u64; N]);
        for i in 0..N {
            let mut of_point = [0.0; WIDTH];
            for (of_point, column) in of_point.iter_mut().zip(&importances) {
                *of_point = column[i];
            }
            for (column, sum) in sums.iter_mut().zip(cumulative_sums(&of_point)) {
                column[i] = sum;
            }
        }
        for i in 0..N {
            at[i] = u[i] * sums[WIDTH][i];
        }
        for column in &sums[1..WIDTH] {
            for i in 0..N {
                counts[i] += u64::from(column[i] <= at[i]);
            }
        }
        let mut chosen = ChosenChildren {
            is_lit: [false; N],
            children: [0; N],
            u: [0.0; N],
            probabilities: [1.0; N],
        };
        for i in 0..N {
            let (child, total) = (counts[i] as usize, sums[WIDTH][i]);
            let importance = f64::from(importances[child][i]);
            chosen.is_lit[i] = total > 0.0 && total.is_finite();
            chosen.children[i] = child;
            chosen.u[i] = Real::clamp((at[i] - sums[child][i]) / importance, 0.0, BELOW_ONE);
            chosen.probabilities[i] = importance / total;
        }
        chosen
    }
}

/// Greatest `f64` below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// SIMD task: the traversal of [`LightTree::sample_lights`].
struct LightTreeTask<'a, const N: usize> {
    tree: &'a LightTree,
    is_used: &'a [bool; N],
    u: &'a [f64; N],
    points: &'a [ReceivingPoint; N],
}

impl<const N: usize> SimdTask for LightTreeTask<'_, N> {
    type Output = LightChoices<N>;
    #[inline(always)]
    fn run(self) -> Self::Output {
        self.tree.traverse_lanes(self.is_used, *self.u, self.points)
    }
}

#[cfg(test)]
mod tests;
