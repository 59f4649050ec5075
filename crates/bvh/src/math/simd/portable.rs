//! Lanes for every processor: f32 in two four-wide vectors, f64 as scalars.

use core::array::from_fn;

use glam::Vec4;

use super::{Simd, WIDTH};

/// Lanes that use only the baseline instructions of the target.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

#[cfg(not(target_arch = "x86_64"))]
impl Portable {
    /// Returns `None`. Here the type replaces `Avx2` and `Avx512`, which the processor lacks.
    pub fn detect() -> Option<Self> {
        None
    }
}

/// Flips the sign of each component of `a` where the sign bit of `b` is set.
#[inline(always)]
fn flip_signs(a: Vec4, b: Vec4) -> Vec4 {
    let flip = |a: f32, b: f32| f32::from_bits(a.to_bits() ^ (b.to_bits() & 1 << 31));
    Vec4::new(
        flip(a.x, b.x),
        flip(a.y, b.y),
        flip(a.z, b.z),
        flip(a.w, b.w),
    )
}

/// Whether the target has SSE2. With SSE2, glam's maximum is one instruction that returns the
/// second operand unless the first is greater, as [`Simd`] requires. On other targets glam's
/// maximum may return a NaN of the first operand.
const HAS_SSE2: bool = cfg!(target_feature = "sse2");

/// Returns the first number in lanes where it is greater, otherwise the second.
#[inline(always)]
fn max_or_second(a: Vec4, b: Vec4) -> Vec4 {
    if HAS_SSE2 {
        a.max(b)
    } else {
        Vec4::select(a.cmpgt(b), a, b)
    }
}

/// Returns the first number in lanes where it is less, otherwise the second.
#[inline(always)]
fn min_or_second(a: Vec4, b: Vec4) -> Vec4 {
    if HAS_SSE2 {
        a.min(b)
    } else {
        Vec4::select(a.cmplt(b), a, b)
    }
}

/// Returns the mask of all lanes for which `is_set` returns true.
#[inline(always)]
fn build_mask(is_set: impl Fn(usize) -> bool) -> u32 {
    (0..WIDTH).fold(0, |mask, lane| mask | u32::from(is_set(lane)) << lane)
}

/// Defines operations of [`Simd`], each by an expression of its operands.
macro_rules! operations {
    ($(fn $name:ident($($argument:ident: $kind:ty),*) -> $out:ty { $body:expr })*) => { $(
        #[inline(always)]
        fn $name(self, $($argument: $kind),*) -> $out {
            $body
        }
    )* };
}

type F = [Vec4; 2];
type D = [f64; WIDTH];

impl Simd for Portable {
    type Floats = F;
    type Doubles = D;

    operations! {
        fn splat(value: f32) -> F { [Vec4::splat(value); 2] }
        fn load(v: &[f32; WIDTH]) -> F { [Vec4::new(v[0], v[1], v[2], v[3]), Vec4::new(v[4], v[5], v[6], v[7])] }
        fn add(a: F, b: F) -> F { [a[0] + b[0], a[1] + b[1]] }
        fn sub(a: F, b: F) -> F { [a[0] - b[0], a[1] - b[1]] }
        fn mul(a: F, b: F) -> F { [a[0] * b[0], a[1] * b[1]] }
        fn mul_add(a: F, b: F, c: F) -> F { [a[0] * b[0] + c[0], a[1] * b[1] + c[1]] }
        fn mul_sub(a: F, b: F, c: F) -> F { [a[0] * b[0] - c[0], a[1] * b[1] - c[1]] }
        fn div(a: F, b: F) -> F { [a[0] / b[0], a[1] / b[1]] }
        fn max(a: F, b: F) -> F { [max_or_second(a[0], b[0]), max_or_second(a[1], b[1])] }
        fn min(a: F, b: F) -> F { [min_or_second(a[0], b[0]), min_or_second(a[1], b[1])] }
        fn abs(a: F) -> F { [a[0].abs(), a[1].abs()] }
        fn negate(a: F) -> F { [-a[0], -a[1]] }
        fn flip_signs(a: F, b: F) -> F { [flip_signs(a[0], b[0]), flip_signs(a[1], b[1])] }
        fn less(a: F, b: F) -> u32 { a[0].cmplt(b[0]).bitmask() | a[1].cmplt(b[1]).bitmask() << 4 }
        fn at_most(a: F, b: F) -> u32 { a[0].cmple(b[0]).bitmask() | a[1].cmple(b[1]).bitmask() << 4 }

        fn splat_f64(value: f64) -> D { [value; WIDTH] }
        fn load_f64(values: &[f64; WIDTH]) -> D { *values }
        fn to_array_f64(a: D) -> [f64; WIDTH] { a }
        fn widen(values: &[f32; WIDTH]) -> D { from_fn(|i| values[i].into()) }
        fn add_f64(a: D, b: D) -> D { from_fn(|i| a[i] + b[i]) }
        fn sub_f64(a: D, b: D) -> D { from_fn(|i| a[i] - b[i]) }
        fn mul_f64(a: D, b: D) -> D { from_fn(|i| a[i] * b[i]) }
        fn div_f64(a: D, b: D) -> D { from_fn(|i| a[i] / b[i]) }
        fn sqrt_f64(a: D) -> D { a.map(f64::sqrt) }
        fn max_f64(a: D, b: D) -> D { from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] }) }
        fn min_f64(a: D, b: D) -> D { from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] }) }
        fn abs_f64(a: D) -> D { a.map(f64::abs) }
        fn greater_f64(a: D, b: D) -> u32 { build_mask(|i| a[i] > b[i]) }
        fn at_least_f64(a: D, b: D) -> u32 { build_mask(|i| a[i] >= b[i]) }
        fn select_at_most_f64(pair: [D; 2], yes: D, no: D) -> D { from_fn(|i| if pair[0][i] <= pair[1][i] { yes[i] } else { no[i] }) }
    }

    #[inline(always)]
    fn sqrt(self, a: F) -> F {
        self.load(&self.to_array(a).map(f32::sqrt))
    }

    #[inline(always)]
    fn trunc(self, a: F) -> F {
        self.load(&self.to_array(a).map(|x| x as i32 as f32))
    }

    #[inline(always)]
    fn select_less(self, [a, b]: [F; 2], yes: F, no: F) -> F {
        self.select(self.less(a, b), no, yes)
    }

    #[inline(always)]
    fn lookup(self, table: &[f32; WIDTH], index: F) -> F {
        let index = self.to_array(index);
        self.load(&from_fn(|i| table[index[i] as usize % WIDTH]))
    }

    #[inline(always)]
    fn to_array(self, [low, high]: F) -> [f32; WIDTH] {
        let ([a, b, c, d], [e, f, g, h]) = (low.to_array(), high.to_array());
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    fn narrow(self, a: D) -> F {
        self.load(&a.map(|x| x as f32))
    }

    #[inline(always)]
    fn select(self, mask: u32, unset: F, set: F) -> F {
        let (unset, set) = (self.to_array(unset), self.to_array(set));
        self.load(&from_fn(
            |i| if mask >> i & 1 == 0 { unset[i] } else { set[i] },
        ))
    }
}
