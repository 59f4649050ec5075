//! The kernel of every processor: two vectors of four lanes each, and exact tests one by one.

use glam::Vec4;

use super::doubles::Doubles;
use super::gathered::gathered;
use super::row::RayF64;
use super::simd::{Simd, settled};
use super::stack::{Stack, Waiting, two};
use super::traversal_ray::LeafRay;
use super::traverse::HitVisitor;
use super::triangle8::Triangle8;
use super::{Bvh8, Child, WIDTH};
use crate::shapes::PreparedRay;

/// No instruction beyond those of the platform.
#[derive(Clone, Copy)]
pub(super) struct Portable;

#[inline(always)]
fn halves(values: &[f32; WIDTH]) -> [Vec4; 2] {
    let [a, b, c, d, e, f, g, h] = *values;
    [Vec4::new(a, b, c, d), Vec4::new(e, f, g, h)]
}

/// Flips the bits of signs that are set in the other.
#[inline(always)]
fn flipped(a: Vec4, b: Vec4) -> Vec4 {
    let flip = |a: f32, b: f32| f32::from_bits(a.to_bits() ^ (b.to_bits() & 1 << 31));
    Vec4::new(flip(a.x, b.x), flip(a.y, b.y), flip(a.z, b.z), flip(a.w, b.w))
}

/// Where the platform has it, glam's maximum is one instruction that does just what is asked for: its second operand unless the first is greater.
/// Elsewhere what is not a number may win.
const SSE: bool = cfg!(target_feature = "sse2");

/// The first where it is greater, the second elsewhere.
#[inline(always)]
fn greater(a: Vec4, b: Vec4) -> Vec4 {
    if SSE { a.max(b) } else { Vec4::select(a.cmpgt(b), a, b) }
}

/// The first where it is less, the second elsewhere.
#[inline(always)]
fn less(a: Vec4, b: Vec4) -> Vec4 {
    if SSE { a.min(b) } else { Vec4::select(a.cmplt(b), a, b) }
}

impl Simd for Portable {
    type Floats = [Vec4; 2];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::Floats {
        [Vec4::splat(value); 2]
    }
    #[inline(always)]
    fn load(self, values: &[f32; WIDTH]) -> Self::Floats {
        halves(values)
    }
    #[inline(always)]
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        [a[0] + b[0], a[1] + b[1]]
    }
    #[inline(always)]
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        [a[0] - b[0], a[1] - b[1]]
    }
    #[inline(always)]
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        [a[0] * b[0], a[1] * b[1]]
    }
    #[inline(always)]
    fn mul_add(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats {
        [a[0] * b[0] + c[0], a[1] * b[1] + c[1]]
    }
    #[inline(always)]
    fn mul_sub(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats {
        [a[0] * b[0] - c[0], a[1] * b[1] - c[1]]
    }
    #[inline(always)]
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        [greater(a[0], b[0]), greater(a[1], b[1])]
    }
    #[inline(always)]
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        [less(a[0], b[0]), less(a[1], b[1])]
    }
    #[inline(always)]
    fn abs(self, a: Self::Floats) -> Self::Floats {
        [a[0].abs(), a[1].abs()]
    }
    #[inline(always)]
    fn negate(self, a: Self::Floats) -> Self::Floats {
        [-a[0], -a[1]]
    }
    #[inline(always)]
    fn signed_by(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        [flipped(a[0], b[0]), flipped(a[1], b[1])]
    }
    #[inline(always)]
    fn less(self, a: Self::Floats, b: Self::Floats) -> u32 {
        a[0].cmplt(b[0]).bitmask() | a[1].cmplt(b[1]).bitmask() << 4
    }
    #[inline(always)]
    fn at_most(self, a: Self::Floats, b: Self::Floats) -> u32 {
        a[0].cmple(b[0]).bitmask() | a[1].cmple(b[1]).bitmask() << 4
    }
    #[inline(always)]
    fn two(self, children: &[Child; WIDTH], entries: Self::Floats, mask: u32) -> [Waiting; 2] {
        let (low, high) = (entries[0].to_array(), entries[1].to_array());
        two(children, &[low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]], mask)
    }
    #[inline(always)]
    fn push(self, stack: &mut Stack, top: usize, children: &[Child; WIDTH], entries: Self::Floats, mask: u32) -> usize {
        let (low, high) = (entries[0].to_array(), entries[1].to_array());
        stack.push(top, children, &[low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]], mask)
    }
    #[inline(never)]
    fn settle<A: HitVisitor>(
        self,
        block: &Triangle8,
        at: [usize; 2],
        aim: &LeafRay,
        probe: Option<&PreparedRay>,
        answer: &mut A,
    ) -> bool {
        settled(self, block, at, aim, probe, answer)
    }
    #[inline(never)]
    fn gathered<A: HitVisitor>(
        self,
        bvh: &Bvh8,
        leaf: Child,
        aim: &LeafRay,
        probe: Option<&PreparedRay>,
        line: &mut Option<RayF64>,
        answer: &mut A,
    ) -> bool {
        gathered(self, bvh, leaf, aim, probe, line, answer)
    }
}

impl Doubles for Portable {
    type Doubles = [f64; WIDTH];

    #[inline(always)]
    fn spread(self, value: f64) -> Self::Doubles {
        [value; WIDTH]
    }
    #[inline(always)]
    fn widen(self, values: &[f32; WIDTH]) -> Self::Doubles {
        core::array::from_fn(|i| values[i].into())
    }
    #[inline(always)]
    fn take(self, values: &[f64; WIDTH]) -> Self::Doubles {
        *values
    }
    #[inline(always)]
    fn size(self, a: Self::Doubles) -> Self::Doubles {
        a.map(f64::abs)
    }
    #[inline(always)]
    fn greatest(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        core::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn least(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        core::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn plus(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        core::array::from_fn(|i| a[i] + b[i])
    }
    #[inline(always)]
    fn minus(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        core::array::from_fn(|i| a[i] - b[i])
    }
    #[inline(always)]
    fn times(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        core::array::from_fn(|i| a[i] * b[i])
    }
    #[inline(always)]
    fn over(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        core::array::from_fn(|i| a[i] / b[i])
    }
    #[inline(always)]
    fn root(self, a: Self::Doubles) -> Self::Doubles {
        a.map(f64::sqrt)
    }
    #[inline(always)]
    fn above(self, a: Self::Doubles, b: Self::Doubles) -> u32 {
        (0..WIDTH).fold(0, |mask, i| mask | u32::from(a[i] > b[i]) << i)
    }
    #[inline(always)]
    fn at_least(self, a: Self::Doubles, b: Self::Doubles) -> u32 {
        (0..WIDTH).fold(0, |mask, i| mask | u32::from(a[i] >= b[i]) << i)
    }
    #[inline(always)]
    fn narrow(self, a: Self::Doubles) -> Self::Floats {
        halves(&a.map(|x| x as f32))
    }
    #[inline(always)]
    fn chosen(self, mask: u32, unset: Self::Floats, set: Self::Floats) -> Self::Floats {
        let (unset, set) = (self.row(unset), self.row(set));
        halves(&core::array::from_fn(|i| if mask >> i & 1 == 0 { unset[i] } else { set[i] }))
    }
    #[inline(always)]
    fn row(self, a: Self::Floats) -> [f32; WIDTH] {
        let (low, high) = (a[0].to_array(), a[1].to_array());
        [low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: what is not a number never replaces a bound, whatever the platform's own minimum does with it, and is at most nothing.
    #[test]
    fn not_a_number_keeps_the_other_bound() {
        let new = Portable.load(&[f32::NAN, 1.0, 3.0, f32::INFINITY, f32::NAN, 2.0, -1.0, f32::NEG_INFINITY]);
        let bound = Portable.splat(2.0);
        assert_eq!(Portable.row(Portable.max(new, bound)), [2.0, 2.0, 3.0, f32::INFINITY, 2.0, 2.0, 2.0, 2.0]);
        assert_eq!(Portable.row(Portable.min(new, bound)), [2.0, 1.0, 2.0, 2.0, 2.0, 2.0, -1.0, f32::NEG_INFINITY]);
        assert_eq!((Portable.at_most(new, bound), Portable.at_most(bound, new)), (0b1110_0010, 0b0010_1100));
        assert_eq!((Portable.less(new, bound), Portable.less(bound, new)), (0b1100_0010, 0b0000_1100));
    }
}
