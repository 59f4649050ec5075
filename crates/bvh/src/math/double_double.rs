//! Numbers of twice the precision of f64, for what is decided or summed where f64 alone would lose
//! the answer.

use core::ops::{Add, Mul};

/// An unrounded sum of two numbers of f64, of which the second is what rounding took from the
/// first. Operations are right to a few times 2⁻¹⁰⁶ of the sizes of what goes in ("Accurate Sum and
/// Dot Product", Ogita, Rump, Oishi 2005), as long as nothing overflows or underflows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DoubleDouble {
    most: f64,
    rest: f64,
}

impl DoubleDouble {
    /// a·b, exactly.
    #[inline(always)]
    pub fn product(a: f64, b: f64) -> Self {
        let most = a * b;
        Self {
            most,
            rest: a.mul_add(b, -most),
        }
    }

    /// To f64.
    #[inline(always)]
    pub fn rounded(self) -> f64 {
        self.most
    }
}

impl From<f64> for DoubleDouble {
    #[inline(always)]
    fn from(most: f64) -> Self {
        Self { most, rest: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let total = self.most + other.most;
        let part = total - self.most;
        let rest = (self.most - (total - part)) + (other.most - part) + (self.rest + other.rest);
        let most = total + rest;
        Self {
            most,
            rest: rest - (most - total),
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
