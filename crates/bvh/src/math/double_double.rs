//! Double-double arithmetic, for sums and for signs that the rounding error of f64 could falsify.

use core::ops::{Add, Mul};

/// An unevaluated sum of two f64 numbers. The second is the rounding error of the first. Operations
/// have errors of a few times 2⁻¹⁰⁶ relative to the operands, unless a number overflows or
/// underflows ("Accurate Sum and Dot Product", Ogita, Rump, Oishi 2005).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    /// Creates the exact product a·b.
    #[inline(always)]
    pub fn from_product(a: f64, b: f64) -> Self {
        let maximum = a * b;
        Self {
            high: maximum,
            low: a.mul_add(b, -maximum),
        }
    }

    /// Rounds to the nearest f64.
    #[inline(always)]
    pub fn to_f64(self) -> f64 {
        self.high
    }
}

impl From<f64> for DoubleDouble {
    #[inline(always)]
    fn from(maximum: f64) -> Self {
        Self {
            high: maximum,
            low: 0.0,
        }
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let total = self.high + other.high;
        let part = total - self.high;
        let rest = (self.high - (total - part)) + (other.high - part) + (self.low + other.low);
        let maximum = total + rest;
        Self {
            high: maximum,
            low: rest - (maximum - total),
        }
    }
}

impl Mul<f64> for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self::from_product(self.high, factor) + Self::from(self.low * factor)
    }
}
