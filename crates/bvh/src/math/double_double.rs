//! Double-double arithmetic, for decisions and sums whose rounding error in f64 would be too large.

use core::ops::{Add, Mul};

/// An unevaluated sum of two f64 numbers, of which the second is the rounding error of the first.
/// Operations have errors of a few times 2⁻¹⁰⁶ relative to the operands ("Accurate Sum and Dot
/// Product", Ogita, Rump, Oishi 2005), unless a number overflows or underflows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DoubleDouble {
    most: f64,
    rest: f64,
}

impl DoubleDouble {
    /// Creates the exact product a·b.
    #[inline(always)]
    pub fn product(a: f64, b: f64) -> Self {
        let maximum = a * b;
        Self {
            most: maximum,
            rest: a.mul_add(b, -maximum),
        }
    }

    /// Rounds to the nearest f64.
    #[inline(always)]
    pub fn rounded(self) -> f64 {
        self.most
    }
}

impl From<f64> for DoubleDouble {
    #[inline(always)]
    fn from(maximum: f64) -> Self {
        Self {
            most: maximum,
            rest: 0.0,
        }
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let total = self.most + other.most;
        let part = total - self.most;
        let rest = (self.most - (total - part)) + (other.most - part) + (self.rest + other.rest);
        let maximum = total + rest;
        Self {
            most: maximum,
            rest: rest - (maximum - total),
        }
    }
}

impl Mul<f64> for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self::product(self.most, factor) + Self::from(self.rest * factor)
    }
}
