//! Four scalars side by side, in which the boxes of a node are tested at once and formulas are computed: the vector registers
//! of the platform where glam has them for the scalar, the same operations one by one elsewhere.

use core::ops::{Add, Div, Mul, Sub};

use glam::{DVec4, Vec4};

/// A scalar that comes four at a time too.
pub trait Laned: Sized {
    /// Four of them.
    type Four: Four<Self>;
}

/// What box tests and formulas need of four scalars. The names of the platform differ in what they do with NaN, so nothing
/// here is a minimum or a maximum: each choice is a comparison, which NaN fails.
pub trait Four<R>:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Mul<R, Output = Self>
    + Div<R, Output = Self>
{
    /// From their numbers.
    fn from_row(row: [R; 4]) -> Self;
    /// Their numbers.
    fn row(self) -> [R; 4];
    /// The same number four times.
    fn splat(value: R) -> Self;
    /// From f32, exactly.
    fn from_f32(values: &[f32; 4]) -> Self;
    /// `self` where it is greater, `other` elsewhere.
    fn or_greater(self, other: Self) -> Self;
    /// `self` where it is less, `other` elsewhere.
    fn or_less(self, other: Self) -> Self;
    /// Bit i is set where lane i is not above that of `other`.
    fn at_most(self, other: Self) -> u32;
    /// The greatest f32 numbers not above, or one step below; zero where the lane is zero.
    fn below(self) -> [f32; 4];
}

impl Laned for f32 {
    type Four = Vec4;
}

impl Laned for f64 {
    type Four = DVec4;
}

/// There glam's maximum is one instruction that does just this: its second operand unless the first is greater. Elsewhere
/// NaN may win.
const SSE: bool = cfg!(target_feature = "sse2");

impl Four<f32> for Vec4 {
    #[inline(always)]
    fn from_row(row: [f32; 4]) -> Self {
        Self::from_array(row)
    }
    #[inline(always)]
    fn row(self) -> [f32; 4] {
        self.to_array()
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self::splat(value)
    }
    #[inline(always)]
    fn from_f32(values: &[f32; 4]) -> Self {
        Self::from_array(*values)
    }
    #[inline(always)]
    fn or_greater(self, other: Self) -> Self {
        if SSE { Self::max(self, other) } else { Self::select(self.cmpgt(other), self, other) }
    }
    #[inline(always)]
    fn or_less(self, other: Self) -> Self {
        if SSE { Self::min(self, other) } else { Self::select(self.cmplt(other), self, other) }
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        self.cmple(other).bitmask()
    }
    #[inline(always)]
    fn below(self) -> [f32; 4] {
        self.to_array()
    }
}

impl Four<f64> for DVec4 {
    #[inline(always)]
    fn from_row(row: [f64; 4]) -> Self {
        Self::from_array(row)
    }
    #[inline(always)]
    fn row(self) -> [f64; 4] {
        self.to_array()
    }
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self::splat(value)
    }
    #[inline(always)]
    fn from_f32(values: &[f32; 4]) -> Self {
        Self::from_array(values.map(f64::from))
    }
    #[inline(always)]
    fn or_greater(self, other: Self) -> Self {
        Self::select(self.cmpgt(other), self, other)
    }
    #[inline(always)]
    fn or_less(self, other: Self) -> Self {
        Self::select(self.cmplt(other), self, other)
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        self.cmple(other).bitmask()
    }
    /// Towards zero by a step of f32, which is more than the conversion may have gone away from it.
    #[inline(always)]
    fn below(self) -> [f32; 4] {
        self.to_array().map(|x| f32::from_bits((x as f32).to_bits().saturating_sub(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lanes<R: Laned>(values: [f32; 4]) -> R::Four {
        R::Four::from_f32(&values)
    }

    /// Protects: NaN never replaces a bound, whatever the platform's own minimum does with it, and a lane that is NaN is
    /// not at most anything.
    #[test]
    fn not_a_number_keeps_the_other_bound() {
        fn check<R: Laned + Copy>() {
            let (new, bound) = (lanes::<R>([f32::NAN, 1.0, 3.0, f32::INFINITY]), lanes::<R>([2.0; 4]));
            assert_eq!(new.or_greater(bound).below().map(|x| x.min(9.0).round()), [2.0, 2.0, 3.0, 9.0]);
            assert_eq!(new.or_less(bound).below().map(f32::round), [2.0, 1.0, 2.0, 2.0]);
            assert_eq!((new.at_most(bound), bound.at_most(new)), (0b0010, 0b1100));
            assert_eq!(bound.at_most(bound), 0b1111);
        }
        check::<f32>();
        check::<f64>();
    }

    /// Protects: a distance on the stack is never greater than the one that it stands for.
    #[test]
    fn below_does_not_exceed() {
        let values = [0.0, 1.0 + 1e-9, 1e-300, 1e300];
        let below = Four::<f64>::below(DVec4::from_array(values));
        assert!((0..4).all(|i| f64::from(below[i]) <= values[i]), "{below:?}");
        assert_eq!(below, [0.0, f32::from_bits(1.0_f32.to_bits() - 1), 0.0, f32::MAX]);
    }
}
