//! Eight SIMD lanes of f32 and f64: arithmetic and masks. No other module of this crate abstracts
//! from instruction sets. [`super::lanes`] gives these numbers operators.
//!
//! Each f64 operation is rounded individually, as the scalar operation is. So a test in lanes has
//! the bits of the scalar test. The crates `fearless_simd`, `pulp` and `wide` were evaluated and
//! not used: `../../../../docs/decisions/0048-what-stays.md`.

mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

pub(crate) use self::portable::Portable;
/// Tokens of instruction sets that other processors lack. `detect` of either type returns `None`.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) use self::portable::{Portable as Avx2, Portable as Avx512};
#[cfg(target_arch = "x86_64")]
pub(crate) use self::x86::{Avx2, Avx512};

/// Number of lanes.
pub const WIDTH: usize = 8;

/// Arithmetic on eight lanes. A value of an implementing type is a token: it proves that the
/// processor has the instructions.
///
/// A comparison returns a mask with one bit per lane. The bit is zero if an operand is NaN. Minimum
/// and maximum return the second operand unless the first is less or greater, respectively. So a
/// NaN in the first operand is ignored.
pub trait Simd: Copy {
    /// Eight f32.
    type Floats: Copy;
    /// Eight f64.
    type Doubles: Copy;

    /// Broadcasts a number to all lanes.
    fn splat(self, value: f32) -> Self::Floats;
    /// Loads eight numbers.
    fn load(self, values: &[f32; WIDTH]) -> Self::Floats;
    /// Loads eight numbers from index `first` on. If fewer than eight are left, all lanes are zero.
    #[inline(always)]
    fn load_from_index(self, values: &[f32], first: usize) -> Self::Floats {
        self.load(values[first..].first_chunk().unwrap_or(&[0.0; WIDTH]))
    }
    /// Stores eight numbers.
    fn to_array(self, a: Self::Floats) -> [f32; WIDTH];
    /// Sum.
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Difference.
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Product.
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Quotient.
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Square root.
    fn sqrt(self, a: Self::Floats) -> Self::Floats;
    /// Integer part of numbers below 2³¹.
    fn trunc(self, a: Self::Floats) -> Self::Floats;
    /// Computes a·b + c, rounded once or twice depending on the instruction set. Only results with
    /// error bounds may use it.
    fn mul_add(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;
    /// Computes a·b − c, rounded once or twice depending on the instruction set.
    fn mul_sub(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;
    /// Maximum.
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Minimum.
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Absolute value.
    fn abs(self, a: Self::Floats) -> Self::Floats;
    /// Negative.
    fn negate(self, a: Self::Floats) -> Self::Floats;
    /// Flips the sign of `a` in lanes where the sign bit of `b` is set.
    fn flip_signs(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Mask of the lanes in which `a` is less than `b`.
    fn less(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// Mask of the lanes in which `a` is at most `b`.
    fn at_most(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// Selects `set` in lanes whose mask bit is set, `unset` in the others.
    fn select(self, mask: u32, unset: Self::Floats, set: Self::Floats) -> Self::Floats;
    /// Selects `yes` in lanes where the first of two numbers is less than the second, else `no`.
    fn select_less(
        self,
        pair: [Self::Floats; 2],
        yes: Self::Floats,
        no: Self::Floats,
    ) -> Self::Floats;
    /// Returns the number of a table at the integer part of each index, from 0 to 7.
    fn lookup(self, table: &[f32; WIDTH], index: Self::Floats) -> Self::Floats;

    /// Broadcasts a number to all lanes.
    fn splat_f64(self, value: f64) -> Self::Doubles;
    /// Loads eight numbers.
    fn load_f64(self, values: &[f64; WIDTH]) -> Self::Doubles;
    /// Stores eight numbers.
    fn to_array_f64(self, a: Self::Doubles) -> [f64; WIDTH];
    /// Exact conversion from f32.
    fn widen(self, values: &[f32; WIDTH]) -> Self::Doubles;
    /// Conversion to f32, rounded to nearest.
    fn narrow(self, a: Self::Doubles) -> Self::Floats;
    /// Sum.
    fn add_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// Difference.
    fn sub_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// Product.
    fn mul_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// Quotient.
    fn div_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// Square root.
    fn sqrt_f64(self, a: Self::Doubles) -> Self::Doubles;
    /// Maximum.
    fn max_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// Minimum.
    fn min_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// Absolute value.
    fn abs_f64(self, a: Self::Doubles) -> Self::Doubles;
    /// Mask of the lanes in which `a` is greater than `b`.
    fn greater_f64(self, a: Self::Doubles, b: Self::Doubles) -> u32;
    /// Mask of the lanes in which `a` is at least `b`.
    fn at_least_f64(self, a: Self::Doubles, b: Self::Doubles) -> u32;
    /// Selects `yes` in lanes where the first of two numbers is at most the second, else `no`.
    fn select_at_most_f64(
        self,
        pair: [Self::Doubles; 2],
        yes: Self::Doubles,
        no: Self::Doubles,
    ) -> Self::Doubles;
}

/// Iterator over the lanes whose mask bits are set, in ascending order.
#[derive(Clone, Copy)]
pub(crate) struct MaskLanes(pub u32);

impl Iterator for MaskLanes {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let lane = self.0.trailing_zeros() as usize & (WIDTH - 1);
        let is_left = self.0 != 0;
        self.0 &= self.0.wrapping_sub(1);
        is_left.then_some(lane)
    }
}

/// Dot product in each lane, summed in the order of a scalar dot product.
#[inline(always)]
pub(crate) fn dot_f64<S: Simd>(s: S, a: [S::Doubles; 3], b: [S::Doubles; 3]) -> S::Doubles {
    s.add_f64(
        s.add_f64(s.mul_f64(a[0], b[0]), s.mul_f64(a[1], b[1])),
        s.mul_f64(a[2], b[2]),
    )
}

/// Broadcasts a vector to all lanes.
#[inline(always)]
pub(crate) fn splat3_f64<S: Simd>(s: S, v: glam::DVec3) -> [S::Doubles; 3] {
    [s.splat_f64(v.x), s.splat_f64(v.y), s.splat_f64(v.z)]
}
