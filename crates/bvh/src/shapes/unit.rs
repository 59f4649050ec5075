//! Lengths brought to about one, so that the textbook formulas work alike for shapes of any size: a product of four lengths
//! leaves f32 at a size of 10⁹, one of ten at 6000.

use super::num;
use super::quadratic::Crossings;
use crate::scalar::{Precision, Real, Vector};

/// The unit in which a formula measures a shape of this size, and one over it: a power of two, so that nothing is rounded and
/// a shape twice as large is hit by the same bits. One where f64 decides, whose range is enough for every f32 length.
#[inline(always)]
pub(super) fn unit_of<P: Precision>(size: P::Core) -> (P::Core, P::Core) {
    if P::ROBUST {
        return (P::Core::ONE, P::Core::ONE);
    }
    const EXPONENT: u64 = 0x7ff << 52;
    let power = f64::from_bits(size.to_f64().to_bits() & EXPONENT);
    (num(power), num(1.0 / power))
}

/// The same for the longest component of two vectors.
#[inline(always)]
pub(super) fn unit_of_both<P: Precision>(a: <P::Core as Real>::Vec3, b: <P::Core as Real>::Vec3) -> (P::Core, P::Core) {
    if P::ROBUST { (P::Core::ONE, P::Core::ONE) } else { unit_of::<P>(a.abs().max(b.abs()).max_element()) }
}

impl<C: Real> Crossings<C> {
    /// The same crossings where distances were measured in units of that length.
    #[inline(always)]
    pub(super) fn in_units_of(self, unit: C) -> Self {
        Self { enter: self.enter * unit, leave: self.leave * unit }
    }
}
