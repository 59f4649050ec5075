//! How lights are divided among the groups of a node: in two by what asking each of them would
//! cost, and the dearest of those again ("Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", Conty Estevez, Kulla 2018).

use core::f64::consts::PI;
use core::ops::Range;

use glam::DVec3;

use super::{Leaf, WIDTH};
use crate::light::{LightBounds, LightId};

/// Lights taken together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cluster {
    pub bounds: LightBounds,
    pub power: f64,
}

/// Leaves that follow each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    start: usize,
    end: usize,
    /// How often all leaves were divided to get here.
    depth: u32,
    pub sum: Cluster,
}

impl Group {
    /// None where there is no leaf.
    pub fn of_all(leaves: &[Leaf]) -> Option<Self> {
        (!leaves.is_empty()).then(|| Self::of(leaves, 0..leaves.len(), 0))
    }

    fn of(leaves: &[Leaf], range: Range<usize>, depth: u32) -> Self {
        Self {
            start: range.start,
            end: range.end,
            depth,
            sum: Cluster::of(&leaves[range]),
        }
    }

    pub fn range(&self) -> Range<usize> {
        self.start..self.end
    }
}

/// The groups of a node over two leaves or more: up to [`WIDTH`], those of one leaf among them.
/// Group after group is divided, the one that costs most first, but for those that are so small in
/// the node that it would not tell their halves' places apart.
pub(super) fn divide(leaves: &mut [Leaf], whole: Group) -> Vec<Group> {
    /// Size of a group that is divided, in the node: some hundreds of times what its places are
    /// rounded to.
    const SMALLEST: f64 = 1e-4;
    let size = |group: &Group| group.sum.bounds.space.extent().length();
    let smallest = SMALLEST * size(&whole);
    let mut groups = Vec::with_capacity(WIDTH);
    groups.push(whole);
    while groups.len() < WIDTH {
        // The first one always, also where its size is no number.
        let whole = groups.len() == 1;
        let open = groups
            .iter()
            .enumerate()
            .filter(|(_, group)| group.range().len() > 1 && (whole || size(group) >= smallest));
        let dearest = open.max_by(|(_, a), (_, b)| {
            a.sum
                .cost()
                .total_cmp(&b.sum.cost())
                .then(a.range().len().cmp(&b.range().len()))
        });
        let Some((index, &group)) = dearest else {
            break;
        };
        let middle =
            group.start + split(&mut leaves[group.range()], &group.sum.bounds, group.depth);
        groups[index] = Group::of(leaves, group.start..middle, group.depth + 1);
        groups.push(Group::of(leaves, middle..group.end, group.depth + 1));
    }
    groups
}

impl Cluster {
    fn of(leaves: &[Leaf]) -> Self {
        let first = Self {
            bounds: leaves[0].bounds,
            power: leaves[0].power,
        };
        leaves[1..].iter().fold(first, |sum, leaf| {
            sum.and(&Self {
                bounds: leaf.bounds,
                power: leaf.power,
            })
        })
    }

    fn and(&self, other: &Self) -> Self {
        let (axis, normals) = around([&self.bounds, &other.bounds]);
        let bounds = LightBounds {
            space: self.bounds.space.union(other.bounds.space),
            axis,
            normals,
            emission: self.bounds.emission.max(other.bounds.emission),
        };
        Self {
            bounds,
            power: self.power + other.power,
        }
    }

    /// What a node of these costs: power · solid angle into which it shines · surface of its box
    /// (there, equation 1).
    fn cost(&self) -> f64 {
        let LightBounds {
            space,
            normals,
            emission,
            ..
        } = self.bounds;
        let widest = (normals + emission).min(PI);
        let beyond = widest - normals;
        let (sin_n, cos_n) = (libm::sin(normals), libm::cos(normals));
        let cap = 2.0 * PI * (1.0 - cos_n);
        let rim = 0.5
            * PI
            * (2.0 * widest * sin_n - libm::cos(normals - 2.0 * widest) - 2.0 * beyond * sin_n
                + cos_n);
        let e = space.extent();
        // A scale of lengths keeps points apart, whose boxes have no surface.
        let surface = e.x * e.y + e.y * e.z + e.z * e.x + e.length_squared() * 1e-3;
        self.power * (cap + rim) * surface
    }
}

/// The least cone around the cones of two lights' normals, near enough.
fn around([a, b]: [&LightBounds; 2]) -> (DVec3, f64) {
    let (wide, narrow) = if a.normals >= b.normals {
        (a, b)
    } else {
        (b, a)
    };
    let between = libm::acos(wide.axis.dot(narrow.axis).clamp(-1.0, 1.0));
    if (between + narrow.normals).min(PI) <= wide.normals {
        return (wide.axis, wide.normals);
    }
    let half = 0.5 * (wide.normals + between + narrow.normals);
    let across = (narrow.axis - wide.axis * wide.axis.dot(narrow.axis)).normalize_or_zero();
    if half >= PI || across == DVec3::ZERO {
        return (wide.axis, PI);
    }
    let turn = half - wide.normals;
    (
        (wide.axis * libm::cos(turn) + across * libm::sin(turn)).normalize(),
        half,
    )
}

/// Boxes along an axis by which a split is looked for.
const BINS: usize = 12;

/// Depth from which lights are divided in the middle: however they lie, a tree is not deeper than
/// 64 levels.
const DEEP: u32 = 32;

/// Brings the leaves of the first of two groups to the front and says how many they are: at least
/// one, and one is left.
fn split(leaves: &mut [Leaf], whole: &LightBounds, depth: u32) -> usize {
    let middle = leaves.len() / 2;
    let centres = leaves.iter().map(|leaf| leaf.bounds.space.centre());
    let (least, most) = centres.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), c| {
        (a.min(c), b.max(c))
    });
    let extent = most - least;
    let longest = extent.max_element();
    let along = (0..3)
        .max_by(|&a, &b| extent[a].total_cmp(&extent[b]))
        .unwrap_or(0);
    let by_place = |leaves: &mut [Leaf]| {
        leaves.select_nth_unstable_by(middle, |a, b| {
            let at = |leaf: &Leaf| leaf.bounds.space.centre()[along];
            at(a)
                .total_cmp(&at(b))
                .then(order(a.light).cmp(&order(b.light)))
        });
        middle
    };
    // Also for what is no number.
    if !(longest > 0.0 && longest.is_finite()) || depth >= DEEP || leaves.len() == 2 {
        return by_place(leaves);
    }
    let bin = |leaf: &Leaf, axis: usize| {
        let share = (leaf.bounds.space.centre()[axis] - least[axis]) / extent[axis];
        ((share * BINS as f64) as usize).min(BINS - 1)
    };
    let span = whole.space.extent();
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| extent[axis] > 0.0) {
        let mut bins: [Option<Cluster>; BINS] = [None; BINS];
        for leaf in leaves.iter() {
            let one = Cluster {
                bounds: leaf.bounds,
                power: leaf.power,
            };
            let slot = &mut bins[bin(leaf, axis)];
            *slot = Some(slot.map_or(one, |sum| sum.and(&one)));
        }
        // Long boxes are divided along their length (there, the regulariser of equation 1).
        let slender = span.max_element() / span[axis].max(f64::MIN_POSITIVE);
        for (k, cost) in costs(&bins).into_iter().enumerate() {
            let cost = cost.map(|cost| cost * slender);
            if let Some(cost) = cost.filter(|&cost| best.is_none_or(|(least, ..)| cost < least)) {
                best = Some((cost, axis, k));
            }
        }
    }
    let Some((_, axis, k)) = best else {
        return by_place(leaves);
    };
    let mut front = 0;
    for i in 0..leaves.len() {
        if bin(&leaves[i], axis) <= k {
            leaves.swap(i, front);
            front += 1;
        }
    }
    if front == 0 || front == leaves.len() {
        by_place(leaves)
    } else {
        front
    }
}

/// For each place between two bins what both sides cost; none where one is empty.
fn costs(bins: &[Option<Cluster>; BINS]) -> [Option<f64>; BINS - 1] {
    let join = |a: Option<Cluster>, b: &Option<Cluster>| match (a, b) {
        (Some(a), Some(b)) => Some(a.and(b)),
        (a, b) => a.or(*b),
    };
    let mut after = [None; BINS];
    let mut sum = None;
    for k in (1..BINS).rev() {
        sum = join(sum, &bins[k]);
        after[k] = sum;
    }
    let mut before = None;
    core::array::from_fn(|k| {
        before = join(before, &bins[k]);
        Some(before?.cost() + after[k + 1]?.cost())
    })
}

/// Any order of lights, so that equal places are divided the same way everywhere.
fn order(light: LightId) -> (u8, u32) {
    match light {
        LightId::Delta(i) => (0, i),
        LightId::Emitter(i) => (1, i),
        LightId::Sky => (2, 0),
    }
}
