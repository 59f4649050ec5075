//! Angles and rotations for [`crate::scalar::Real`]. The f32 functions use arithmetic only, without
//! library calls. So the compiler vectorises loops over them; they are also written for SIMD lanes.

use super::lanes::LaneFloats;

/// Angles of numbers in lanes.
pub trait LaneAngles: LaneFloats {
    /// Angle of the point (x, self) in radians in (−π, π], with an error of at most three units of
    /// rounding; 0 if both are zero.
    #[inline(always)]
    fn angle_from(self, x: Self) -> Self {
        angle(self, x)
    }

    /// Cosine and sine of a fraction of a full turn, in [0, 1], with an error of at most 1.5e-7.
    #[inline(always)]
    fn cos_sin_turns(self) -> [Self; 2] {
        sin_cos_turns(self)
    }
}

impl<F: LaneFloats> LaneAngles for F {}

/// Computes the angle of the point (x, y) around the origin, in radians from the +x axis.
/// Reflections about axes and diagonals bring the point into a sixteenth of a turn. There a
/// polynomial of the Cephes library gives the angle (Moshier, "Methods and Programs for
/// Mathematical Functions", 1989).
#[inline(always)]
pub(crate) fn angle<F: LaneFloats>(y: F, x: F) -> F {
    use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    const TAN_EIGHTH: f32 = 0.414_213_56;
    let zero = x.like(0.0);
    let (across, along) = (x.abs(), y.abs());
    let low = across.select_less(along, across, along);
    let high = across.select_less(along, along, across);
    let limit = high * x.like(TAN_EIGHTH);
    let over = limit.select_less(low, low - high, low);
    let under = limit.select_less(low, low + high, high);
    let q = over / zero.select_less(under, under, x.like(1.0));
    let z = q * q;
    let p = ((z * x.like(8.053_744_5e-2) - x.like(0.138_776_86)) * z + x.like(0.199_777_1)) * z
        - x.like(0.333_329_5);
    let small = p * z * q + q;
    let angle = limit.select_less(low, x.like(FRAC_PI_4) + small, small);
    let angle = across.select_less(along, x.like(FRAC_PI_2) - angle, angle);
    let angle = x.select_less(zero, x.like(PI) - angle, angle);
    angle.abs().flip_sign(y)
}

/// Computes the cosine and the sine, in this order, of an angle in turns from 0 to 1. The nearest
/// quarter turn is subtracted exactly. The polynomials of the Cephes library then evaluate the
/// remainder.
#[inline(always)]
pub(crate) fn sin_cos_turns<F: LaneFloats>(share: F) -> [F; 2] {
    let (half, one) = (share.like(0.5), share.like(1.0));
    let quarters = (share.like(4.0) * share + half).trunc();
    let rest = (share - quarters * share.like(0.25)) * share.like(core::f32::consts::TAU);
    let z = rest * rest;
    let sin = ((z * share.like(-1.951_529_6e-4) + share.like(8.332_161e-3)) * z
        - share.like(0.166_666_55))
        * z
        * rest
        + rest;
    let cos = ((z * share.like(2.443_315_7e-5) - share.like(1.388_731_6e-3)) * z
        + share.like(4.166_664_6e-2))
        * z
        * z
        - half * z
        + one;
    // With each quarter of a turn, sine and cosine swap, and one changes its sign.
    let odd = quarters - (quarters * half).trunc() * share.like(2.0);
    let (over, up) = (
        odd.select_less(half, cos, sin),
        odd.select_less(half, sin, cos),
    );
    let is_left = (quarters - share.like(1.5)).abs();
    let is_below = (quarters - share.like(2.5)).abs();
    [
        is_left.select_less(one, -over, over),
        is_below.select_less(one, -up, up),
    ]
}

/// Computes the cosine and the sine, in this order, of an angle in turns, in f64.
#[inline]
pub(crate) fn sin_cos_turns_f64(share: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(core::f64::consts::TAU * share);
    [cos, sin]
}
