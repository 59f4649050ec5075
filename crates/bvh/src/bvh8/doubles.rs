//! Eight numbers of f64 side by side: what tests of whole shapes compute in, where a filter in f32 would cost as much.

use super::WIDTH;
use super::simd::Simd;

/// Eight lanes of f64. Each operation rounds by itself, as that of one number does, so that tests in lanes have the bits of those
/// one by one.
pub(super) trait Doubles: Simd {
    type Doubles: Copy;
    fn spread(self, value: f64) -> Self::Doubles;
    /// From f32, exactly.
    fn widen(self, values: &[f32; WIDTH]) -> Self::Doubles;
    fn take(self, values: &[f64; WIDTH]) -> Self::Doubles;
    /// Each without its sign.
    fn size(self, a: Self::Doubles) -> Self::Doubles;
    /// Of numbers, the greater one and the lesser one.
    fn greatest(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn least(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn plus(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn minus(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn times(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn over(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn root(self, a: Self::Doubles) -> Self::Doubles;
    /// A bit a lane where the first is greater; never where one is not a number.
    fn above(self, a: Self::Doubles, b: Self::Doubles) -> u32;
    /// A bit a lane where the first is not less; never where one is not a number.
    fn at_least(self, a: Self::Doubles, b: Self::Doubles) -> u32;
    /// Rounded to f32.
    fn narrow(self, a: Self::Doubles) -> Self::Floats;
    /// Of the second where the bit of a lane is set, of the first elsewhere.
    fn chosen(self, mask: u32, unset: Self::Floats, set: Self::Floats) -> Self::Floats;
    /// Eight numbers from a place on; zeros where there are not so many.
    #[inline(always)]
    fn load_from(self, values: &[f32], first: usize) -> Self::Floats {
        self.load(values[first..].first_chunk().unwrap_or(&[0.0; WIDTH]))
    }
    /// The numbers of all lanes.
    fn row(self, a: Self::Floats) -> [f32; WIDTH];
}

/// x·a + y·b + z·c in the order of the scalar product.
#[inline(always)]
pub(super) fn dot<S: Doubles>(s: S, a: [S::Doubles; 3], b: [S::Doubles; 3]) -> S::Doubles {
    s.plus(s.plus(s.times(a[0], b[0]), s.times(a[1], b[1])), s.times(a[2], b[2]))
}
