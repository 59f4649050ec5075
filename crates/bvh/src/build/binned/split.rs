//! One split: where it costs least, and the items of either side put apart.

use glam::{Vec3A, Vec4, Vec4Swizzles};

use super::Manner;
use crate::aabb::PaddedBox;
use crate::build::Company;
use crate::wide::WIDTH;

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

    pub fn new(bounds: &PaddedBox, place: u32, company: Company) -> Self {
        let kind = match company {
            Company::None => 0.0,
            Company::Triangles => 1.0,
            Company::Spheres => 2.0,
            Company::Quads => 3.0,
        };
        Self { low: bounds.min.extend(f32::from_bits(Self::NORMAL | place)), high: bounds.max.extend(kind) }
    }

    pub fn place(&self) -> u32 {
        self.low.w.to_bits() & !Self::NORMAL
    }

    pub fn company(&self) -> Company {
        match self.high.w {
            0.0 => Company::None,
            1.0 => Company::Triangles,
            2.0 => Company::Spheres,
            _ => Company::Quads,
        }
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

/// What a split did: the first so many items are the left part, in the other array where they were moved.
pub(super) struct Split {
    pub middle: usize,
    pub moved: bool,
}

/// Splits two items or more, so that neither part is empty; in half where told so.
pub(super) fn split(items: &mut [Item], other: &mut [Item], manner: Manner, blocks: bool, halve: bool) -> Split {
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
                return Split { middle, moved: true };
            }
        }
    }
    Split { middle: halved(items), moved: false }
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
struct Plane {
    scale: Scale,
    axis: usize,
    bin: u32,
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

    #[inline(always)]
    fn bin(&self, centre: f32, axis: usize) -> u32 {
        let at = (centre - self.least[axis]) * self.factor[axis];
        let at = if at < self.last { at } else { self.last };
        let at = if at > 0.0 { at } else { 0.0 };
        (at + WHOLE).to_bits() % BINS as u32
    }
}

impl Plane {
    /// Copies the items to either end of the other array and counts those of the front.
    fn part(&self, items: &[Item], other: &mut [Item]) -> usize {
        let (mut front, mut back) = (0, other.len());
        let (scale, axis, bin) = (self.scale, self.axis, self.bin);
        for item in items {
            let centre = item.low.to_array()[axis] * 0.5 + item.high.to_array()[axis] * 0.5;
            let left = scale.bin(centre, axis) <= bin;
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

    /// Half the surface, in numbers that neither the largest nor the smallest boxes leave; none where it is empty.
    #[inline(always)]
    fn area(&self, unit: f32) -> f32 {
        let e = Vec3A::from_vec4(self.high - self.low) * unit;
        let area = e.x * (e.y + e.z) + e.y * e.z;
        if e.x >= 0.0 { area } else { 0.0 }
    }
}

/// The split of least expected cost; none where all items fall into one bin of each axis.
fn cheapest<'a, I: Iterator<Item = &'a Item>>(items: impl Fn() -> I, count: usize, blocks: bool) -> Option<Plane> {
    let (mut low, mut high, mut all) = (Vec4::INFINITY, Vec4::NEG_INFINITY, Bin::EMPTY);
    for item in items() {
        let centre = item.centre();
        (low, high) = (low.min(centre), high.max(centre));
        all.add(item.low, item.high);
    }
    let used = if count < FEW { FEW_BINS } else { BINS };
    let scale = Scale::new(low, high, used);
    let mut bins = [[Bin::EMPTY; 3]; BINS];
    let mut counts = [[0_u32; 4]; BINS];
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
    let weigh = |count: u32| if blocks { count.div_ceil(WIDTH as u32) as f32 } else { count as f32 };
    let mut best: Option<(f32, usize, u32)> = None;
    for axis in 0..3 {
        if scale.factor[axis] == 0.0 {
            continue;
        }
        let mut costs = [0.0; BINS];
        let (mut right, mut above) = (Bin::EMPTY, 0);
        for bin in (1..used).rev() {
            right.add(bins[bin][axis].low, bins[bin][axis].high);
            above += counts[bin][axis];
            costs[bin] = right.area(unit) * weigh(above);
        }
        let (mut left, mut below) = (Bin::EMPTY, 0);
        for bin in 0..used - 1 {
            left.add(bins[bin][axis].low, bins[bin][axis].high);
            below += counts[bin][axis];
            let cost = left.area(unit) * weigh(below) + costs[bin + 1];
            let both = 0 < below && (below as usize) < count;
            if both && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, bin as u32));
            }
        }
    }
    best.map(|(_, axis, bin)| Plane { scale, axis, bin })
}
