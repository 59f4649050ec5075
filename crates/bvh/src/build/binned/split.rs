//! One split: where it costs least, and the items of either side put apart.

use core::array;

use glam::{Mat4, Vec3A, Vec4, Vec4Swizzles};

use super::Manner;
use crate::aabb::PaddedBox;
use crate::build::LeafKind;
use crate::bvh8::WIDTH;

/// Most bins an axis.
const BINS: usize = 16;
/// Below this many items fewer bins will do.
const FEW: usize = 48;
/// Bins of these.
const FEW_BINS: usize = 8;
/// Added to a number below 2²², it leaves the nearest whole one in the last bits.
const WHOLE: f32 = 12_582_912.0;

/// A box with its place in the fourth number of its least corner, and what it may share a leaf with in that of the greatest.
#[derive(Clone, Copy, Default)]
pub(super) struct Item {
    low: Vec4,
    high: Vec4,
}

impl Item {
    /// Makes a place a number that arithmetic in all lanes is not slowed down by.
    const NORMAL: u32 = 1 << 30;

    pub fn new(bounds: &PaddedBox, place: u32, company: LeafKind) -> Self {
        let kind = f32::from(company as u8);
        Self { low: bounds.min.extend(f32::from_bits(Self::NORMAL | place)), high: bounds.max.extend(kind) }
    }

    pub fn place(&self) -> u32 {
        self.low.w.to_bits() & !Self::NORMAL
    }

    pub fn company(&self) -> LeafKind {
        [LeafKind::None, LeafKind::Triangles, LeafKind::Spheres][self.high.w as usize]
    }

    pub fn bounds(&self) -> PaddedBox {
        PaddedBox { min: self.low.xyz(), max: self.high.xyz() }
    }

    /// The centre, scaled so that it does not overflow; the fourth number is of no use.
    #[inline(always)]
    fn centre(&self) -> Vec4 {
        self.low * 0.5 + self.high * 0.5
    }

    /// The centre and a measure of size.
    fn keys(&self) -> Vec4 {
        self.centre().xyz().extend((self.high * 0.125 - self.low * 0.125).xyz().element_sum())
    }
}

/// Splits two items or more, so that neither part is empty; in half where told so. Returns how many items are the left part, and whether they
/// were moved into the other array.
pub(super) fn split(items: &mut [Item], other: &mut [Item], manner: Manner, blocks: bool, halve: bool) -> (usize, bool) {
    if !halve && items.len() > 2 {
        let best = if items.len() <= manner.sample {
            cheapest(|| items.iter(), items.len(), blocks)
        } else {
            let step = items.len() / manner.sample;
            // Anywhere in each step, since what a file lists repeats.
            let of = |i: usize| &items[i * step + ((i as u32).wrapping_mul(0x9e37_79b1) >> 7) as usize % step];
            cheapest(|| (0..manner.sample).map(of), manner.sample, blocks)
        };
        if let Some(best) = best {
            let middle = best.part(items, other);
            if 0 < middle && middle < items.len() {
                return (middle, true);
            }
        }
    }
    (halved(items), false)
}

/// Halves the items along the longest of the three axes and size: boxes inside one another differ in nothing else.
fn halved(items: &mut [Item]) -> usize {
    let (mut least, mut most) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
    for item in items.iter() {
        let keys = item.keys();
        (least, most) = (least.min(keys), most.max(keys));
    }
    let middle = items.len() / 2;
    let (key, extent) = (0..4).map(|k| (k, most[k] - least[k])).fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
    if extent > 0.0 {
        items.select_nth_unstable_by(middle, |a, b| a.keys()[key].total_cmp(&b.keys()[key]).then(a.place().cmp(&b.place())));
    }
    middle
}

/// Left are the items of this bin of an axis and of those before it.
struct SplitPlane {
    scale: Scale,
    axis: usize,
    bin: usize,
}

/// From centres to bins: the number nearest to (c − least)·factor, within 0 and the last bin.
#[derive(Clone, Copy)]
struct Scale {
    least: Vec4,
    factor: Vec4,
    last: f32,
}

impl Scale {
    fn new(low: Vec4, high: Vec4, bins: usize) -> Self {
        let extent = high - low;
        let factor = Vec4::splat(bins as f32) / extent;
        // What has no extent, or too large a one, is all in one bin.
        let factor = Vec4::select(factor.is_finite_mask() & extent.is_finite_mask(), factor, Vec4::ZERO).with_w(0.0);
        Self { least: (low + extent * (0.5 / bins as f32)).with_w(0.0), factor, last: (bins - 1) as f32 }
    }

    #[inline(always)]
    fn bins(&self, centre: Vec4) -> [usize; 3] {
        let at = ((centre - self.least) * self.factor).min(Vec4::splat(self.last)).max(Vec4::ZERO) + Vec4::splat(WHOLE);
        let [x, y, z, _] = at.to_array().map(|b| b.to_bits() as usize % BINS);
        [x, y, z]
    }
}

impl SplitPlane {
    /// Copies the items to either end of the other array and counts those of the front.
    fn part(&self, items: &[Item], other: &mut [Item]) -> usize {
        let (mut front, mut back) = (0, other.len());
        let (scale, axis, bin) = (self.scale, self.axis, self.bin);
        for item in items {
            let left = scale.bins(item.centre())[axis] <= bin;
            other[front] = *item;
            other[back - 1] = *item;
            front += usize::from(left);
            back -= usize::from(!left);
        }
        front
    }
}

/// Boxes of a bin together.
#[derive(Clone, Copy)]
struct Bin {
    low: Vec4,
    high: Vec4,
}

impl Bin {
    const EMPTY: Self = Self { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY };

    #[inline(always)]
    fn add(&mut self, low: Vec4, high: Vec4) {
        (self.low, self.high) = (self.low.min(low), self.high.max(high));
    }
}

/// The split of least expected cost; none where all items fall into one bin of each axis.
fn cheapest<'a, I: Iterator<Item = &'a Item>>(items: impl Fn() -> I, count: usize, blocks: bool) -> Option<SplitPlane> {
    let (mut low, mut high, mut all) = (Vec4::INFINITY, Vec4::NEG_INFINITY, Bin::EMPTY);
    for item in items() {
        let centre = item.centre();
        (low, high) = (low.min(centre), high.max(centre));
        all.add(item.low, item.high);
    }
    let used = if count < FEW { FEW_BINS } else { BINS };
    let scale = Scale::new(low, high, used);
    let mut bins = [[Bin::EMPTY; 3]; BINS];
    let mut counts = [[0_i32; 4]; BINS];
    for item in items() {
        let [x, y, z] = scale.bins(item.centre());
        bins[x][0].add(item.low, item.high);
        bins[y][1].add(item.low, item.high);
        bins[z][2].add(item.low, item.high);
        counts[x][0] += 1;
        counts[y][1] += 1;
        counts[z][2] += 1;
    }
    let extent = Vec3A::from_vec4(all.high - all.low).max_element();
    let unit = 1.0 / extent;
    let unit = if unit.is_finite() { unit } else { 1.0 };
    let sweep = Sweep { bins: &bins[..used], counts: &counts[..used], unit, count: count as f32, blocks };
    sweep.cheapest().map(|(axis, bin)| SplitPlane { scale, axis, bin })
}

/// The bins of all three axes, to be asked side by side where a split costs least.
struct Sweep<'a> {
    bins: &'a [[Bin; 3]],
    counts: &'a [[i32; 4]],
    /// Areas are of boxes that are this many times as large.
    unit: f32,
    /// All items.
    count: f32,
    blocks: bool,
}

impl Sweep<'_> {
    /// Adds a bin of each axis to what is gathered of it, and gives surfaces and counts.
    #[inline(always)]
    fn gather(&self, sum: &mut ([Bin; 3], [i32; 4]), bin: usize) -> (Vec4, Vec4) {
        let (boxes, counts) = sum;
        boxes.iter_mut().zip(&self.bins[bin]).for_each(|(sum, own)| sum.add(own.low, own.high));
        *counts = array::from_fn(|axis| counts[axis] + self.counts[bin][axis]);
        let [x, y, z] = boxes.map(|own| (own.high - own.low) * self.unit);
        let across = Mat4::from_cols(x, y, z, Vec4::ZERO).transpose();
        let area = across.x_axis * (across.y_axis + across.z_axis) + across.y_axis * across.z_axis;
        // Where nothing is, nothing has a surface.
        let area = Vec4::select(across.x_axis.cmpge(Vec4::ZERO), area, Vec4::ZERO);
        (area, Vec4::from_array(counts.map(|count| count as f32)))
    }

    /// What so many items weigh, from the numbers of them.
    #[inline(always)]
    fn weigh(&self, counts: [i32; 4]) -> Vec4 {
        const LAST: i32 = WIDTH as i32 - 1;
        let blocks = |count: i32| if self.blocks { (count + LAST) / WIDTH as i32 } else { count };
        Vec4::from_array(counts.map(|count| blocks(count) as f32))
    }

    /// Axis and last bin of the left part; of equal splits the first. None where all items fall into one bin of each axis.
    fn cheapest(&self) -> Option<(usize, usize)> {
        let (empty, used) = (([Bin::EMPTY; 3], [0; 4]), self.bins.len());
        let mut costs = [Vec4::ZERO; BINS];
        let mut right = empty;
        for bin in (1..used).rev() {
            costs[bin] = self.gather(&mut right, bin).0 * self.weigh(right.1);
        }
        let (mut least, mut at) = (Vec4::INFINITY, Vec4::ZERO);
        let mut left = empty;
        for bin in 0..used - 1 {
            let (area, below) = self.gather(&mut left, bin);
            let cost = area * self.weigh(left.1) + costs[bin + 1];
            let both = below.cmpgt(Vec4::ZERO) & below.cmplt(Vec4::splat(self.count));
            let less = both & cost.cmplt(least);
            least = Vec4::select(less, cost, least);
            at = Vec4::select(less, Vec4::splat(bin as f32), at);
        }
        let axis = (1..3).fold(0, |best, axis| if least[axis] < least[best] { axis } else { best });
        (least[axis] < f32::INFINITY).then_some((axis, at[axis] as usize))
    }
}

#[cfg(test)]
mod tests;
