//! Numeric functions of the language that are not a single processor instruction. They are defined
//! for every scalar type.

use raywright_bvh::scalar::Real;

/// Converts a truth value to a number: 1 or 0.
#[inline(always)]
pub(super) fn truth_to_number<R: Real>(value: bool) -> R {
    if value { R::ONE } else { R::ZERO }
}

/// Converts a number to a truth value: every number but zero and NaN is true.
#[inline(always)]
pub(super) fn is_true<R: Real>(value: R) -> bool {
    value.abs() > R::ZERO
}

/// Returns the smaller of two numbers. If one is NaN, the other is returned; of two zeros, the
/// first. [`f32::min`] does not specify the sign of the zero, which could change a bit of the
/// picture.
#[inline(always)]
pub(super) fn min<R: Real>(a: R, b: R) -> R {
    if b < a || a.is_nan() { b } else { a }
}

/// Returns the larger of two numbers. If one is NaN, the other is returned; of two zeros, the
/// first.
#[inline(always)]
pub(super) fn max<R: Real>(a: R, b: R) -> R {
    if b > a || a.is_nan() { b } else { a }
}

/// Returns −1 or 1, the sign of x. Zero and NaN are returned unchanged.
#[inline(always)]
pub(super) fn sign<R: Real>(x: R) -> R {
    if x > R::ZERO {
        R::ONE
    } else if x < R::ZERO {
        -R::ONE
    } else {
        x
    }
}

/// Returns x − ⌊x⌋, always below 1. A difference that rounds to 1 becomes the next smaller number.
#[inline(always)]
pub(super) fn fraction<R: Real>(x: R) -> R {
    let below_one = R::ONE - R::ROUNDOFF;
    let fraction = x - x.floor();
    if fraction > below_one {
        below_one
    } else {
        fraction
    }
}

/// Returns a − b ⌊a/b⌋, from zero to b, excluding b. Two rounding errors are corrected. The
/// quotient may round up to a whole number, so that the remainder has the wrong sign. The
/// difference may round to b.
#[inline(always)]
pub(super) fn modulo_with_sign_of_divisor<R: Real>(a: R, b: R) -> R {
    let rest = a - b * (a / b).floor();
    let (low, high) = if b > R::ZERO {
        (R::ZERO, b.next_down())
    } else {
        (b.next_up(), R::ZERO)
    };
    let wrong_side = if b > R::ZERO {
        rest < R::ZERO
    } else {
        rest > R::ZERO
    };
    let rest = if wrong_side { rest + b } else { rest };
    // Written so that NaN stays NaN.
    if rest < low {
        low
    } else if rest > high {
        high
    } else {
        rest
    }
}

/// Whether ⌊x⌋ + ⌊y⌋ is odd. Infinities and NaN count as even.
#[inline(always)]
pub(super) fn is_odd_checker_cell<R: Real>(x: R, y: R) -> bool {
    let half = (x.floor() + y.floor()) * R::from_f32(0.5);
    // Infinities and NaN count as even.
    half - half.floor() > R::ZERO
}

/// Returns the same bits as [`Real::powi`]. The last squaring of that function is omitted, because
/// its result is unused and may be a slow subnormal. `limit` is the [`underflow_limit_of_power`] of the
/// exponent; an `f32` of a smaller magnitude gives zero.
#[inline(always)]
pub(super) fn integer_power<R: Real>(mut base: R, exponent: u32, limit: R) -> R {
    if size_of::<R>() == size_of::<f32>() && base.abs() < limit {
        return if exponent & 1 == 1 {
            base * R::ZERO
        } else {
            R::ZERO
        };
    }
    let mut result = if exponent & 1 == 1 { base } else { R::ONE };
    let mut rest = exponent >> 1;
    while rest != 0 {
        base *= base;
        result *= core::hint::select_unpredictable(rest & 1 == 1, base, R::ONE);
        rest >>= 1;
    }
    result
}

/// Returns a magnitude below which an `f32` raised to this exponent is zero. Such powers are
/// frequent, because highlights with high exponents are zero at most hits. Computing them would be
/// slow, because their squares are subnormal.
pub(super) fn underflow_limit_of_power(exponent: u32) -> f64 {
    // Magnitudes below 2⁻¹⁵⁰ round to zero. The last factor is below 2⁻⁷⁵, and at most twice too
    // large if it is subnormal. A further factor of two exceeds all other roundings.
    libm::exp2(-152.0 / f64::from(exponent))
}

/// Interpolates from a at t = 0 to b at t = 1, exact at both ends.
#[inline(always)]
pub(super) fn mix<R: Real>(a: R, b: R, t: R) -> R {
    a * (R::ONE - t) + b * t
}

/// Returns a cubic step: 0 below `low`, 1 above `high`, with zero slope at both ends.
#[inline(always)]
pub(super) fn smoothstep<R: Real>(low: R, high: R, x: R) -> R {
    // Comparisons in this direction compile to an instruction each, without a branch. NaN becomes
    // zero.
    let t = (x - low) / (high - low);
    let t = if t > R::ZERO { t } else { R::ZERO };
    let t = if t < R::ONE { t } else { R::ONE };
    t * t * (R::from_f64(3.0) - R::from_f64(2.0) * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stay_below<R: Real>(smallest: f64) {
        for x in [
            smallest, 1e-9, 1e-3, 0.1, 0.2999, 1.0, 2.9999, 12_345.678, 1e8, 1e20,
        ] {
            for x in [
                R::from_f64(x),
                R::from_f64(-x),
                R::from_f64(x).next_down(),
                R::from_f64(-x).next_up(),
            ] {
                let f = fraction(x);
                assert!(
                    (R::ZERO..R::ONE).contains(&f),
                    "the fraction of {x:?} is {f:?}"
                );
                for divisor in [1.0, 0.1, 3.0, 7.3, 1e-3] {
                    let b = R::from_f64(divisor);
                    let (above, below) = (
                        modulo_with_sign_of_divisor(x, b),
                        modulo_with_sign_of_divisor(x, -b),
                    );
                    assert!(
                        above >= R::ZERO && above < b,
                        "{x:?} mod {b:?} is {above:?}"
                    );
                    assert!(
                        below <= R::ZERO && below > -b,
                        "{x:?} mod {:?} is {below:?}",
                        -b
                    );
                }
            }
        }
        let far = (R::ONE - R::ROUNDOFF, R::ROUNDOFF * R::from_f64(0.1));
        assert_eq!(
            (
                fraction(-far.1),
                modulo_with_sign_of_divisor(-far.1, R::ONE)
            ),
            (far.0, far.0)
        );
        assert!(
            fraction(R::INFINITY).is_nan() && modulo_with_sign_of_divisor(R::ONE, R::ZERO).is_nan()
        );
    }

    /// Protects: a fraction is below one and a remainder smaller than its divisor, also where x −
    /// ⌊x⌋ rounds to one.
    #[test]
    fn s19_fractions_are_below_one() {
        stay_below::<f32>(1e-38);
        stay_below::<f64>(1e-300);
        assert_eq!((fraction(-0.25_f32), fraction(1.75_f64)), (0.75, 0.75));
        assert_eq!(
            (
                modulo_with_sign_of_divisor(-1.0_f32, 3.0),
                modulo_with_sign_of_divisor(7.5_f64, -2.0)
            ),
            (2.0, -0.5)
        );
    }
}
