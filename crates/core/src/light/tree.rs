//! A tree over lights that have a place: each node knows where its lights are, which way they shine and how much, and so how much
//! of it may arrive at a point ("Importance Sampling of Many Lights with Adaptive Tree Splitting", Conty Estevez, Kulla 2018;
//! "Physically Based Rendering", 4th edition, 12.6.3).

mod build;

use core::f64::consts::PI;

use glam::DVec3;

use build::{Sum, split};

use super::{Bounds, LightId};

/// A light that has a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub light: LightId,
    pub bounds: Bounds,
    /// Above zero, finite.
    pub power: f64,
}

/// A point that is lit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    pub at: DVec3,
    /// Unit, on the side that is lit; zero where both are.
    pub normal: DVec3,
}

/// A node: a light, or two nodes that follow each other.
#[derive(Clone, Copy, Debug)]
struct Node {
    centre: DVec3,
    /// Half the diagonal of the box.
    radius: f64,
    axis: DVec3,
    /// Cosine and sine of the greatest angle between axis and normals.
    normals: [f64; 2],
    /// Cosine of the greatest angle at which light leaves.
    emission: f64,
    power: f64,
    /// The node above; [`Tree::NONE`] for the first one.
    parent: u32,
    content: Content,
}

#[derive(Clone, Copy, Debug)]
enum Content {
    /// The first of two nodes.
    Inner(u32),
    Light(LightId),
}

/// Lights by place, direction and power.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

/// cos(max(0, a − b)) of angles from 0 to π by their cosines and sines.
#[inline(always)]
fn cos_less([sin_a, cos_a]: [f64; 2], [sin_b, cos_b]: [f64; 2]) -> f64 {
    if cos_a > cos_b { 1.0 } else { cos_a * cos_b + sin_a * sin_b }
}

/// sin(max(0, a − b)).
#[inline(always)]
fn sin_less([sin_a, cos_a]: [f64; 2], [sin_b, cos_b]: [f64; 2]) -> f64 {
    if cos_a > cos_b { 0.0 } else { sin_a * cos_b - cos_a * sin_b }
}

#[inline(always)]
fn sine(cosine: f64) -> f64 {
    (1.0 - cosine * cosine).max(0.0).sqrt()
}

impl Node {
    fn new(bounds: &Bounds, power: f64, parent: u32, content: Content) -> Self {
        let widest = bounds.normals.clamp(0.0, PI);
        Self {
            centre: bounds.space.centre(),
            radius: 0.5 * bounds.space.extent().length(),
            axis: bounds.axis,
            normals: [libm::sin(widest), libm::cos(widest)],
            emission: libm::cos(bounds.emission.clamp(0.0, PI)),
            power,
            parent,
            content,
        }
    }

    /// About how much of its light arrives; zero only where none does.
    #[inline]
    fn importance(&self, receiver: &Receiver) -> f64 {
        /// What rounding may take from a cosine.
        const MARGIN: f64 = 1e-6;
        let across = receiver.at - self.centre;
        let squared = across.length_squared();
        let radius2 = self.radius * self.radius;
        // From within the ball around the box its lights may be anywhere.
        if squared <= radius2 * (1.0 + MARGIN) || squared == 0.0 {
            return self.power / radius2.max(f64::MIN_POSITIVE);
        }
        let direction = across / squared.sqrt();
        let sin_b = self.radius / squared.sqrt();
        let bound = [sin_b, (1.0 - sin_b * sin_b).max(0.0).sqrt()];
        let cosine = self.axis.dot(direction).clamp(-1.0, 1.0);
        let off = [sine(cosine), cosine];
        let beyond = [sin_less(off, self.normals), cos_less(off, self.normals)];
        let leaving = cos_less(beyond, bound);
        if leaving <= self.emission - MARGIN {
            return 0.0;
        }
        let facing = -receiver.normal.dot(direction).clamp(-1.0, 1.0);
        let arriving = if receiver.normal == DVec3::ZERO { 1.0 } else { cos_less([sine(facing), facing], bound) };
        if arriving <= -MARGIN {
            return 0.0;
        }
        self.power * leaving.max(MARGIN) * arriving.max(MARGIN) / squared
    }
}

impl Tree {
    /// No node.
    pub const NONE: u32 = u32::MAX;

    /// Over lights that have power; `place` hears which node each one is.
    pub fn new(mut leaves: Vec<Leaf>, mut place: impl FnMut(LightId, u32)) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity((2 * leaves.len()).saturating_sub(1)) };
        if leaves.is_empty() {
            return tree;
        }
        // What is still to be made: a range of the leaves, where it goes and how deep that is.
        let mut open = vec![(0, leaves.len(), 0_usize, Self::NONE, 0_u32)];
        tree.nodes.push(Node::new(&leaves[0].bounds, 0.0, Self::NONE, Content::Light(leaves[0].light)));
        while let Some((start, end, slot, parent, depth)) = open.pop() {
            let these = &mut leaves[start..end];
            if let [leaf] = these {
                tree.nodes[slot] = Node::new(&leaf.bounds, leaf.power, parent, Content::Light(leaf.light));
                place(leaf.light, slot as u32);
                continue;
            }
            let sum = Sum::of(these);
            let middle = start + split(these, &sum.bounds, depth);
            let first = tree.nodes.len() as u32;
            tree.nodes[slot] = Node::new(&sum.bounds, sum.power, parent, Content::Inner(first));
            let blank = tree.nodes[slot];
            tree.nodes.extend([blank, blank]);
            open.push((start, middle, first as usize, slot as u32, depth + 1));
            open.push((middle, end, first as usize + 1, slot as u32, depth + 1));
        }
        tree
    }

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Levels below the first node.
    #[cfg(test)]
    pub fn depth(&self) -> usize {
        let mut depths = vec![0; self.nodes.len()];
        for (i, node) in self.nodes.iter().enumerate().skip(1) {
            depths[i] = depths[node.parent as usize] + 1;
        }
        depths.into_iter().max().unwrap_or(0)
    }

    /// Bytes of the nodes.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.nodes.as_slice()) as u64
    }

    /// Bytes of the nodes over so many lights.
    pub fn bytes_of(lights: u64) -> u64 {
        lights.saturating_mul(2).saturating_sub(1).saturating_mul(size_of::<Node>() as u64)
    }

    /// Importances of the two nodes from `first` on.
    #[inline(always)]
    fn both(&self, first: u32, receiver: &Receiver) -> [f64; 2] {
        [0, 1].map(|k| self.nodes[first as usize + k].importance(receiver))
    }

    /// A light for a number in [0, 1), and its probability; none where none sends anything.
    pub fn draw(&self, receiver: &Receiver, mut u: f64) -> Option<(LightId, f64)> {
        let (mut node, mut probability) = (self.nodes.first()?, 1.0);
        loop {
            let first = match node.content {
                Content::Light(light) => return Some((light, probability)),
                Content::Inner(first) => first,
            };
            let [one, other] = self.both(first, receiver);
            let sum = one + other;
            // Also for what is no number.
            if !(sum > 0.0 && sum.is_finite()) {
                return None;
            }
            let share = one / sum;
            let below = u < share;
            let (taken, next) = if below { (share, first) } else { (1.0 - share, first + 1) };
            u = if below { u / share } else { (u - share) / (1.0 - share) };
            u = u.clamp(0.0, 1.0_f64.next_down());
            probability *= taken;
            node = &self.nodes[next as usize];
        }
    }

    /// The probability of drawing the light of a node.
    pub fn probability(&self, leaf: u32, receiver: &Receiver) -> f64 {
        let Some(mut node) = self.nodes.get(leaf as usize) else { return 0.0 };
        let (mut at, mut probability) = (leaf, 1.0);
        while node.parent != Self::NONE {
            let above = &self.nodes[node.parent as usize];
            let Content::Inner(first) = above.content else { return 0.0 };
            let [one, other] = self.both(first, receiver);
            let sum = one + other;
            if !(sum > 0.0 && sum.is_finite()) {
                return 0.0;
            }
            let share = one / sum;
            probability *= if at == first { share } else { 1.0 - share };
            (at, node) = (node.parent, above);
        }
        probability
    }
}
