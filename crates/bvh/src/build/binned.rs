//! A builder that nothing slows down: splits from the top by the surface area heuristic, over boxes that clustering would
//! take quadratic time for.
//!
//! Besides the three axes of the centres it splits by size, since boxes inside one another differ in nothing else. Where the
//! heuristic would make the tree too deep, it halves.
//! "On fast Construction of SAH-based Bounding Volume Hierarchies" (Wald 2007) has the bins.

use glam::{Vec3A, Vec4};

use super::Stop;
use crate::aabb::PaddedBox;
use crate::binary::{Binary, BinaryNode};

/// Most bins an axis.
const BINS: usize = 16;
/// Three axes and size.
const KEYS: usize = 4;
/// Levels more than halving would take that a tree may have: 27 + 8 where there are as many boxes as can be, far fewer than
/// a traversal has a stack for.
const SPARE: u32 = 8;
/// Below this a second thread is not worth its start.
const PARALLEL: usize = 8192;

#[derive(Clone, Copy)]
struct Item {
    bounds: PaddedBox,
    place: u32,
}

impl Item {
    /// The centre and a measure of size, scaled so that none overflows.
    fn keys(&self) -> Vec4 {
        let (min, max) = (self.bounds.min, self.bounds.max);
        (min * 0.5 + max * 0.5).extend((max * 0.125 - min * 0.125).element_sum())
    }
}

/// Boxes of a bin together, in registers, and how many they are.
#[derive(Clone, Copy)]
struct Bin {
    min: Vec3A,
    max: Vec3A,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY, count: 0 };

    fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max), count: self.count + other.count }
    }

    /// What a ray that meets the whole is expected to spend here, but for a factor.
    fn cost(&self) -> f64 {
        if self.count == 0 { 0.0 } else { self.area() * f64::from(self.count) }
    }

    /// Half the surface, in f64: neither the largest nor the smallest boxes leave its range.
    fn area(&self) -> f64 {
        let e = self.max.as_dvec3() - self.min.as_dvec3();
        e.x * e.y + e.y * e.z + e.z * e.x
    }
}

/// Builds the tree and says over how many boxes, counted anew in each level, it went; given up, it is not the whole tree.
pub(super) fn binned(boxes: &[PaddedBox], stop: Stop<'_>) -> (Binary, u64) {
    let mut items: Vec<Item> = (0..).zip(boxes).map(|(place, &bounds)| Item { bounds, place }).collect();
    let mut nodes = vec![BinaryNode { bounds: PaddedBox::NOTHING, first: 0, count: 0 }; (2 * boxes.len()).saturating_sub(1)];
    let mut work = 0;
    if let Some((root, below)) = nodes.split_first_mut() {
        (*root, work) = subtree(&mut items, below, [1, 0], halvings(boxes.len()) + SPARE, stop);
    }
    (Binary { nodes, order: items.iter().map(|item| item.place).collect() }, work)
}

/// Levels that halving takes to single boxes.
fn halvings(count: usize) -> u32 {
    count.next_power_of_two().ilog2()
}

/// The root of the tree over `items`, which start at `start` of all; below it, its nodes, which start at `base` of all: the
/// two children, all below the left one, all below the right one.
fn subtree(
    items: &mut [Item],
    below: &mut [BinaryNode],
    [base, start]: [usize; 2],
    levels: u32,
    stop: Stop<'_>,
) -> (BinaryNode, u64) {
    let count = items.len();
    if let [item] = items {
        return (BinaryNode { bounds: item.bounds, first: start as u32, count: 1 }, 0);
    }
    if count >= PARALLEL && stop() {
        return (BinaryNode { bounds: PaddedBox::NOTHING, first: start as u32, count: count as u32 }, 0);
    }
    let middle = split(items, levels);
    let (left, right) = items.split_at_mut(middle);
    let (children, rest) = below.split_at_mut(2);
    let (below_left, below_right) = rest.split_at_mut(2 * middle - 2);
    let after = base + 2 * middle;
    let mut build_left = || subtree(left, below_left, [base + 2, start], levels - 1, stop);
    let mut build_right = || subtree(right, below_right, [after, start + middle], levels - 1, stop);
    let ((left, left_work), (right, right_work)) =
        if count < PARALLEL { (build_left(), build_right()) } else { rayon::join(build_left, build_right) };
    children.copy_from_slice(&[left, right]);
    let bounds = left.bounds.union(&right.bounds);
    (BinaryNode { bounds, first: base as u32, count: 0 }, left_work + right_work + count as u64)
}

/// Puts the items of the left child first and says how many they are: neither none nor all.
fn split(items: &mut [Item], levels: u32) -> usize {
    let (mut least, mut most) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
    for item in items.iter() {
        let keys = item.keys();
        (least, most) = (least.min(keys), most.max(keys));
    }
    if halvings(items.len()) < levels
        && items.len() > 2
        && let Some(best) = cheapest(items, &Scale::new(least, most, items.len()))
    {
        let middle = partition(items, |item| best.scale.bin(item)[best.key] <= best.bin);
        if 0 < middle && middle < items.len() {
            return middle;
        }
    }
    let middle = items.len() / 2;
    let (key, extent) = (0..KEYS).map(|k| (k, most[k] - least[k])).fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
    if extent > 0.0 {
        items.select_nth_unstable_by(middle, |a, b| a.keys()[key].total_cmp(&b.keys()[key]).then(a.place.cmp(&b.place)));
    }
    middle
}

/// From keys to bins.
#[derive(Clone, Copy)]
struct Scale {
    least: Vec4,
    factor: Vec4,
    bins: usize,
}

impl Scale {
    fn new(least: Vec4, most: Vec4, count: usize) -> Self {
        let bins = (3 + count / 4).min(BINS);
        // An extent of zero makes it infinite; then every key is the least one, and 0·∞ is bin 0.
        Self { least, factor: Vec4::splat(bins as f32) / (most - least), bins }
    }

    fn bin(&self, item: &Item) -> [usize; KEYS] {
        ((item.keys() - self.least) * self.factor).to_array().map(|b| (b as usize).min(self.bins - 1))
    }
}

/// Left of the split are the items of this bin of a key and of those before it.
struct Split {
    scale: Scale,
    key: usize,
    bin: usize,
}

/// The split of least expected cost; none where all items fall into one bin of each key.
fn cheapest(items: &[Item], scale: &Scale) -> Option<Split> {
    let mut bins = [[Bin::EMPTY; BINS]; KEYS];
    for item in items {
        let own = Bin { min: item.bounds.min.into(), max: item.bounds.max.into(), count: 1 };
        for (bins, bin) in bins.iter_mut().zip(scale.bin(item)) {
            bins[bin] = bins[bin].union(&own);
        }
    }
    let mut best: Option<(f64, Split)> = None;
    for (key, bins) in bins.iter().enumerate() {
        let bins = &bins[..scale.bins];
        if bins[0].count as usize == items.len() {
            continue;
        }
        let mut costs = [0.0; BINS];
        let mut right = Bin::EMPTY;
        for bin in (1..bins.len()).rev() {
            right = right.union(&bins[bin]);
            costs[bin - 1] = right.cost();
        }
        let mut left = Bin::EMPTY;
        for (bin, more) in bins[..bins.len() - 1].iter().enumerate() {
            left = left.union(more);
            let total = left.cost() + costs[bin];
            let both = 0 < left.count && (left.count as usize) < items.len();
            if both && best.as_ref().is_none_or(|(least, _)| total < *least) {
                best = Some((total, Split { scale: *scale, key, bin }));
            }
        }
    }
    best.map(|(_, split)| split)
}

/// Puts the items that `left` says yes to in front and counts them.
fn partition(items: &mut [Item], left: impl Fn(&Item) -> bool) -> usize {
    let (mut front, mut back) = (0, items.len());
    while front < back {
        if left(&items[front]) {
            front += 1;
        } else {
            back -= 1;
            items.swap(front, back);
        }
    }
    front
}
