//! Angles and rotations for [`crate::scalar::Real`]. The f32 functions use arithmetic only, without
//! library calls. So the compiler vectorises loops over them.

/// Computes the angle of the point (x, y) around the origin, in radians from the +x axis.
/// Reflections about axes and diagonals bring the point into a sixteenth of a turn. There a
/// polynomial of the Cephes library gives the angle (Moshier, "Methods and Programs for
/// Mathematical Functions", 1989).
#[inline(always)]
pub(crate) fn angle(y: f32, x: f32) -> f32 {
    use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    const TAN_EIGHTH: f32 = 0.414_213_56;
    let (across, along) = (x.abs(), y.abs());
    let (low, high) = if across < along {
        (across, along)
    } else {
        (along, across)
    };
    let folds = low > high * TAN_EIGHTH;
    let (over, under) = if folds {
        (low - high, low + high)
    } else {
        (low, high)
    };
    let q = over / if under == 0.0 { 1.0 } else { under };
    let z = q * q;
    let p = ((8.053_744_5e-2 * z - 0.138_776_86) * z + 0.199_777_1) * z - 0.333_329_5;
    let small = p * z * q + q;
    let angle = if folds { FRAC_PI_4 + small } else { small };
    let angle = if across < along {
        FRAC_PI_2 - angle
    } else {
        angle
    };
    let angle = if x < 0.0 { PI - angle } else { angle };
    angle.copysign(y)
}

/// Computes the cosine and the sine, in this order, of an angle in turns. The nearest quarter turn
/// is subtracted exactly. The polynomials of the Cephes library then evaluate the remainder.
#[inline(always)]
pub(crate) fn sin_cos_turns(share: f32) -> [f32; 2] {
    let quarters = (4.0 * share + 0.5) as i32;
    let rest = (share - quarters as f32 * 0.25) * core::f32::consts::TAU;
    let z = rest * rest;
    let sin = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 0.166_666_55) * z * rest + rest;
    let cos = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    let (over, up) = if quarters & 1 == 0 {
        (cos, sin)
    } else {
        (sin, cos)
    };
    let over = if quarters.wrapping_add(1) & 2 == 0 {
        over
    } else {
        -over
    };
    [over, if quarters & 2 == 0 { up } else { -up }]
}

/// Computes the cosine and the sine, in this order, of an angle in turns, in f64.
#[inline]
pub(crate) fn sin_cos_turns_f64(share: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(core::f64::consts::TAU * share);
    [cos, sin]
}
