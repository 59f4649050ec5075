//! Partition of lights among the children of a node. Groups of lights are split in two at the least
//! expected cost, the costliest group first ("Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", Conty Estevez, Kulla 2018).

use core::cmp::Ordering;
use core::f64::consts::PI;
use core::ops::Range;

use glam::DVec3;

use super::{LightLeaf, WIDTH};
use crate::light::{LightBounds, LightId};

/// Greatest relative difference of two costs or lengths that count as equal. Lights in a regular
/// arrangement have groups of equal cost up to rounding. If rounding decided between these, lights
/// stored in another precision would form another tree, and pictures would differ in their noise.
const ROUNDING: f64 = 1e-5;

/// Compares two costs or lengths; they are equal if they differ by rounding.
fn compare_up_to_rounding(a: f64, b: f64) -> Ordering {
    if (a - b).abs() <= ROUNDING * a.abs().max(b.abs()) {
        Ordering::Equal
    } else {
        a.total_cmp(&b)
    }
}

/// Summed bounds and intensity of a group of lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightCluster {
    pub bounds: LightBounds,
    pub intensity: f64,
}

/// A group of lights: a range of leaves, with its bounds and intensity.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafGroup {
    start: usize,
    end: usize,
    /// Number of splits that led from all leaves to this group.
    depth: u32,
    pub sum: LightCluster,
}

impl LeafGroup {
    /// Returns the group of all leaves; `None` without leaves.
    pub fn from_all_leaves(leaves: &[LightLeaf]) -> Option<Self> {
        (!leaves.is_empty()).then(|| Self::from_range(leaves, 0..leaves.len(), 0))
    }

    fn from_range(leaves: &[LightLeaf], range: Range<usize>, depth: u32) -> Self {
        Self {
            start: range.start,
            end: range.end,
            depth,
            sum: LightCluster::from_leaves(&leaves[range]),
        }
    }

    pub fn range(&self) -> Range<usize> {
        self.start..self.end
    }
}

/// Divides a group of two or more leaves among the children of a node: into at most [`WIDTH`]
/// groups. The costliest group is split first. A group too small for the rounding of positions in
/// the node is not split.
pub(super) fn partition_children(leaves: &mut [LightLeaf], whole: LeafGroup) -> Vec<LeafGroup> {
    /// Least size of a group that is split, relative to the node's size: some hundreds of times the
    /// rounding error of positions.
    const SMALLEST: f64 = 1e-4;
    let size = |group: &LeafGroup| group.sum.bounds.bounding_box.extent().length();
    let smallest = SMALLEST * size(&whole);
    let mut groups = Vec::with_capacity(WIDTH);
    groups.push(whole);
    while groups.len() < WIDTH {
        // The first group is always split, even if its size is NaN.
        let whole = groups.len() == 1;
        let open = groups
            .iter()
            .enumerate()
            .filter(|(_, group)| group.range().len() > 1 && (whole || size(group) >= smallest));
        let dearest = open.max_by(|(_, a), (_, b)| {
            compare_up_to_rounding(a.sum.cost(), b.sum.cost())
                .then(a.range().len().cmp(&b.range().len()))
        });
        let Some((index, &group)) = dearest else {
            break;
        };
        let middle =
            group.start + split_group(&mut leaves[group.range()], &group.sum.bounds, group.depth);
        groups[index] = LeafGroup::from_range(leaves, group.start..middle, group.depth + 1);
        groups.push(LeafGroup::from_range(
            leaves,
            middle..group.end,
            group.depth + 1,
        ));
    }
    groups
}

impl LightCluster {
    fn from_leaves(leaves: &[LightLeaf]) -> Self {
        let first = Self {
            bounds: leaves[0].bounds,
            intensity: leaves[0].intensity,
        };
        leaves[1..].iter().fold(first, |sum, leaf| {
            sum.union(&Self {
                bounds: leaf.bounds,
                intensity: leaf.intensity,
            })
        })
    }

    fn union(&self, other: &Self) -> Self {
        let (axis, normals) = enclosing_normal_cone([&self.bounds, &other.bounds]);
        let bounds = LightBounds {
            bounding_box: self.bounds.bounding_box.union(other.bounds.bounding_box),
            axis,
            normal_angle: normals,
            emission_angle: self.bounds.emission_angle.max(other.bounds.emission_angle),
        };
        Self {
            bounds,
            intensity: self.intensity + other.intensity,
        }
    }

    /// Returns the cost of a group: intensity · solid angle of emission · surface area of its box
    /// (equation 1 of the source named above).
    fn cost(&self) -> f64 {
        let LightBounds {
            bounding_box: space,
            normal_angle: normals,
            emission_angle: emission,
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
        // The term of the squared length separates groups of points, whose boxes have no surface.
        let surface = e.x * e.y + e.y * e.z + e.z * e.x + e.length_squared() * 1e-3;
        self.intensity * (cap + rim) * surface
    }
}

/// Returns the axis and half-angle in radians of a cone around the normals of two groups. The cone
/// is nearly the smallest.
fn enclosing_normal_cone([a, b]: [&LightBounds; 2]) -> (DVec3, f64) {
    let (wide, narrow) = if a.normal_angle >= b.normal_angle {
        (a, b)
    } else {
        (b, a)
    };
    let between = libm::acos(wide.axis.dot(narrow.axis).clamp(-1.0, 1.0));
    if (between + narrow.normal_angle).min(PI) <= wide.normal_angle {
        return (wide.axis, wide.normal_angle);
    }
    let half = 0.5 * (wide.normal_angle + between + narrow.normal_angle);
    let across = (narrow.axis - wide.axis * wide.axis.dot(narrow.axis)).normalize_or_zero();
    if half >= PI || across == DVec3::ZERO {
        return (wide.axis, PI);
    }
    let turn = half - wide.normal_angle;
    (
        (wide.axis * libm::cos(turn) + across * libm::sin(turn)).normalize(),
        half,
    )
}

/// Number of bins along an axis in the search for the best split.
const BINS: usize = 12;

/// Number of splits after which groups are split at the median. This limits the tree to 64 levels
/// in any layout.
const DEEP: u32 = 32;

/// Splits a group in two: moves the leaves of the first part to the front, and returns their
/// number. Each part has at least one leaf.
fn split_group(leaves: &mut [LightLeaf], whole: &LightBounds, depth: u32) -> usize {
    let middle = leaves.len() / 2;
    let centres = leaves.iter().map(|leaf| leaf.bounds.bounding_box.centre());
    let (least, most) = centres.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), c| {
        (a.min(c), b.max(c))
    });
    let extent = most - least;
    let longest = extent.max_element();
    let along = (0..3)
        .max_by(|&a, &b| compare_up_to_rounding(extent[a], extent[b]))
        .unwrap_or(0);
    let by_place = |leaves: &mut [LightLeaf]| {
        leaves.select_nth_unstable_by(middle, |a, b| {
            let at = |leaf: &LightLeaf| leaf.bounds.bounding_box.centre()[along];
            at(a)
                .total_cmp(&at(b))
                .then(light_sort_key(a.light).cmp(&light_sort_key(b.light)))
        });
        middle
    };
    // True for NaN too.
    if !(longest > 0.0 && longest.is_finite()) || depth >= DEEP || leaves.len() == 2 {
        return by_place(leaves);
    }
    let bin = |leaf: &LightLeaf, axis: usize| {
        let share = (leaf.bounds.bounding_box.centre()[axis] - least[axis]) / extent[axis];
        // The centres of a regular arrangement lie on the borders of bins. Each border lies a
        // little below, so that rounding moves no centre across.
        ((share * BINS as f64 + BINS as f64 * ROUNDING) as usize).min(BINS - 1)
    };
    let span = whole.bounding_box.extent();
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| extent[axis] > 0.0) {
        let mut bins: [Option<LightCluster>; BINS] = [None; BINS];
        for leaf in leaves.iter() {
            let one = LightCluster {
                bounds: leaf.bounds,
                intensity: leaf.intensity,
            };
            let slot = &mut bins[bin(leaf, axis)];
            *slot = Some(slot.map_or(one, |sum| sum.union(&one)));
        }
        // Long boxes are split along their length (same source, the regulariser of equation 1).
        let slender = span.max_element() / span[axis].max(f64::MIN_POSITIVE);
        for (k, cost) in split_costs(&bins).into_iter().enumerate() {
            let cost = cost.map(|cost| cost * slender);
            let is_least = |cost: &f64| {
                best.is_none_or(|(least, ..)| compare_up_to_rounding(*cost, least).is_lt())
            };
            if let Some(cost) = cost.filter(is_least) {
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

/// Returns the summed cost of both sides, for each split between two bins. `None` if one side is
/// empty.
fn split_costs(bins: &[Option<LightCluster>; BINS]) -> [Option<f64>; BINS - 1] {
    let join = |a: Option<LightCluster>, b: &Option<LightCluster>| match (a, b) {
        (Some(a), Some(b)) => Some(a.union(b)),
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

/// Returns a sort key that fixes the order of lights at equal positions: such lights are always
/// split the same way.
fn light_sort_key(light: LightId) -> (u8, u32) {
    match light {
        LightId::Delta(i) => (0, i),
        LightId::Emitter(i) => (1, i),
        LightId::Sky => (2, 0),
    }
}
