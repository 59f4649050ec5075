//! Tree over lights with a position, for sampling lights by their estimated contribution
//! ("Importance Sampling of Many Lights with Adaptive Tree Splitting", Conty Estevez, Kulla 2018;
//! "Physically Based Rendering", 4th edition, 12.6.3). Each node bounds positions, directions and
//! intensity of its lights, and so the light that may arrive at a point.
//!
//! A node has up to eight children. A binary tree would have three times as many levels, and each
//! level costs a memory latency and a mispredicted branch.

mod build;
mod node;

use core::array::from_fn;

use glam::DVec3;
use raywright_bvh::{LaneFloats, LaneTask, LaneVector, Real, Simd, SimdFloats, run_in_lanes};

use build::{LeafGroup, partition_children};
pub(super) use node::LightNode;
use node::{WIDTH, cumulative_sums};

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

    /// Returns the only node of the tree with the light of each child; without a node, a single light.
    /// `None` for other trees.
    pub fn single_node(&self) -> Option<(Option<&LightNode>, [Option<LightId>; WIDTH])> {
        let mut lights = [None; WIDTH];
        match self.top? {
            LightTreeChild::Light(light) => {
                lights[0] = Some(light);
                Some((None, lights))
            }
            LightTreeChild::Inner(_) => {
                let [node] = self.nodes.as_slice() else {
                    return None;
                };
                for (light, child) in lights.iter_mut().zip(node.children) {
                    if let LightTreeChild::Light(found) = child {
                        *light = Some(found);
                    }
                }
                Some((Some(node), lights))
            }
        }
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
                // Unused lanes repeat the points.
                let chosen = run_in_lanes(LightTreeTask {
                    tree: self,
                    is_used: &from_fn(|i| i < N && is_used[i]),
                    u: &from_fn(|i| u[i % N]),
                    points: &from_fn(|i| receiver(i % N)),
                });
                LightChoices {
                    lights: from_fn(|i| chosen.lights[i]),
                    probabilities: from_fn(|i| chosen.probabilities[i]),
                }
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

    /// Traverses the tree level by level from the nodes or lights in `content`, each step for all
    /// receiving points side by side. The latencies for one point (square roots, divisions, loads of
    /// nodes) then overlap with those for other points. `probability` are the probabilities of
    /// `content`.
    #[inline(always)]
    fn traverse(
        &self,
        mut content: [LightTreeChild; WIDTH],
        mut u: [f64; WIDTH],
        mut probability: [f64; WIDTH],
        points: &[ReceivingPoint; WIDTH],
    ) -> LightChoices<WIDTH> {
        let nothing = LightTreeChild::Inner(Self::NONE);
        let mut importances = [[0.0; WIDTH]; WIDTH];
        loop {
            let mut some = false;
            for i in 0..WIDTH {
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
            for i in 0..WIDTH {
                let Some(node) = self.node_at(content[i]) else {
                    continue;
                };
                let sums = cumulative_sums(0.0, &importances[i]);
                let total = sums[WIDTH];
                // True for NaN too.
                if !(total > 0.0 && total.is_finite()) {
                    content[i] = nothing;
                    continue;
                }
                let at = u[i] * total;
                let lane = child_at(&sums, at);
                let importance = importances[i][lane];
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
        let total = cumulative_sums(0.0, &importances)[WIDTH];
        if !(total > 0.0 && total.is_finite()) {
            return 0.0;
        }
        self.probability(node.parent, receiver) * (importances[index as usize % WIDTH] / total)
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

/// Greatest `f64` below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Task of [`run_in_lanes`]: samples lights for the points of all lanes.
struct LightTreeTask<'a> {
    tree: &'a LightTree,
    is_used: &'a [bool; WIDTH],
    u: &'a [f64; WIDTH],
    points: &'a [ReceivingPoint; WIDTH],
}

impl LaneTask for LightTreeTask<'_> {
    type Output = LightChoices<WIDTH>;
    #[inline(always)]
    fn run<S: Simd>(self, zero: SimdFloats<S>) -> Self::Output {
        let nothing = LightTreeChild::Inner(LightTree::NONE);
        let mut content = [nothing; WIDTH];
        let (mut u, mut probability) = (*self.u, [1.0; WIDTH]);
        // All points descend from the same root, whose child is chosen for all points at once.
        if let Some(root) = self.tree.top.and_then(|top| self.tree.node_at(top)) {
            let (mut point, mut normal) = ([[0.0; WIDTH]; 3], [[0.0; WIDTH]; 3]);
            for (i, receiver) in self.points.iter().enumerate() {
                (point[0][i], point[1][i], point[2][i]) = receiver.point.into();
                (normal[0][i], normal[1][i], normal[2][i]) = receiver.normal.as_vec3().into();
            }
            let receiver = root.local_receiver(
                [
                    zero.load_doubles_like(&point[0]),
                    zero.load_doubles_like(&point[1]),
                    zero.load_doubles_like(&point[2]),
                ],
                LaneVector::load_like(zero, &normal),
            );
            let chosen = root.choose_child(&receiver, zero.load_doubles_like(self.u));
            type Floats<S> = SimdFloats<S>;
            let index = Floats::<S>::doubles_to_array(chosen.index);
            let total = Floats::<S>::doubles_to_array(chosen.total);
            u = Floats::<S>::doubles_to_array((chosen.at - chosen.before) / chosen.importance);
            probability = Floats::<S>::doubles_to_array(chosen.importance / chosen.total);
            for i in 0..WIDTH {
                u[i] = Real::clamp(u[i], 0.0, BELOW_ONE);
                if self.is_used[i] && total[i] > 0.0 && total[i] < f64::INFINITY {
                    content[i] = root.children[index[i] as usize % WIDTH];
                }
            }
        }
        self.tree.traverse(content, u, probability, self.points)
    }
}

#[cfg(test)]
mod tests;
