//! `log1p`, `expm1` and `exp` of `f64` without branches: the compiler can vectorise loops over
//! them. The formulas of the first two are those of libm (FreeBSD's msun), with selections in place
//! of branches. The bits are the same.

/// ln 2 as the sum of two numbers, the first with few bits.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// 2⁵². Its sum with a smaller integer holds the integer in the mantissa.
const WHOLE: f64 = (1_u64 << 52) as f64;

/// Converts an integer below 2⁵² to `f64` by bit operations: few processors have a vector
/// instruction for this conversion.
#[inline(always)]
fn integer_to_f64(n: u64) -> f64 {
    f64::from_bits(WHOLE.to_bits() | n) - WHOLE
}

/// Returns ln(1 + x) for x in (−1, 0].
#[inline(always)]
pub(crate) fn log1p(x: f64) -> f64 {
    const EVEN: [f64; 3] = [
        3.999_999_999_940_942e-1,
        2.222_219_843_214_978_4e-1,
        1.531_383_769_920_937_3e-1,
    ];
    const ODD: [f64; 4] = [
        6.666_666_666_666_735e-1,
        2.857_142_874_366_239e-1,
        1.818_357_216_161_805e-1,
        1.479_819_860_511_658_6e-1,
    ];
    let near = -x < f64::from_bits(0x3fd2_bec5_0000_0000);
    let sum = 1.0 + x;
    // Reduces the argument to [√½, √2] by a power of two.
    let high = (sum.to_bits() >> 32) + (0x3ff0_0000 - 0x3fe6_a09e);
    let reduced =
        f64::from_bits((((high & 0xf_ffff) + 0x3fe6_a09e) << 32) | (sum.to_bits() & 0xffff_ffff));
    let f = if near { x } else { reduced - 1.0 };
    let exponent = if near {
        0.0
    } else {
        integer_to_f64(high >> 20) - 1023.0
    };
    let lost = if near { 0.0 } else { (x - (sum - 1.0)) / sum };
    let half = 0.5 * f * f;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let even = w * (EVEN[0] + w * (EVEN[1] + w * EVEN[2]));
    let odd = z * (ODD[0] + w * (ODD[1] + w * (ODD[2] + w * ODD[3])));
    let logarithm =
        s * (half + (odd + even)) + (exponent * LN_2[1] + lost) - half + f + exponent * LN_2[0];
    if -x < f64::EPSILON / 2.0 {
        x
    } else {
        logarithm
    }
}

/// Returns exp(x) − 1 for x in [−38, 0].
#[inline(always)]
pub(crate) fn expm1(x: f64) -> f64 {
    const Q: [f64; 5] = [
        -3.333_333_333_333_313e-2,
        1.587_301_587_254_814_6e-3,
        -7.936_507_578_674_88e-5,
        4.008_217_827_329_362e-6,
        -2.010_992_181_836_243_7e-7,
    ];
    const INVERSE_LN_2: f64 = core::f64::consts::LOG2_E;
    let (is_near, is_next) = (
        -x < f64::from_bits(0x3fd6_2e43_0000_0000),
        -x < f64::from_bits(0x3ff0_a2b2_0000_0000),
    );
    // Number of halvings: x is reduced by a multiple of ln 2.
    let rounded = (0.5 - INVERSE_LN_2 * x) + WHOLE;
    let rounded = if rounded - WHOLE > 0.5 - INVERSE_LN_2 * x {
        rounded - 1.0
    } else {
        rounded
    };
    let times = if is_next { 1.0 } else { rounded - WHOLE };
    let times = if is_near { 0.0 } else { times };
    let (high, low) = (x + times * LN_2[0], -(times * LN_2[1]));
    let reduced = high - low;
    let lost = (high - reduced) - low;
    let half = 0.5 * reduced;
    let square = reduced * half;
    let r =
        1.0 + square * (Q[0] + square * (Q[1] + square * (Q[2] + square * (Q[3] + square * Q[4]))));
    let t = 3.0 - r * half;
    let e = square * ((r - t) / (6.0 - reduced * t));
    let near = reduced - (reduced * e - square);
    let e = reduced * (e - lost) - lost - square;
    let next = 0.5 * (reduced - e) - 0.5;
    let power = f64::from_bits((1023 - ((times + WHOLE).to_bits() & 0xfff)) << 52);
    let far = (reduced - e + 1.0) * power - 1.0;
    let value = if is_near {
        near
    } else if is_next {
        next
    } else {
        far
    };
    if -x < f64::EPSILON / 4.0 { x } else { value }
}

/// Returns exp(x) for x ≤ 0 within two units of the last place, and zero below 10⁻³⁰⁰.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    // Inverse factorials from 1/13! on.
    const TAYLOR: [f64; 14] = {
        let (mut terms, mut k, mut factorial) = ([0.0; 14], 0, 1.0);
        while k < 14 {
            terms[13 - k] = 1.0 / factorial;
            k += 1;
            factorial *= k as f64;
        }
        terms
    };
    let halvings = WHOLE - core::f64::consts::LOG2_E * x.max(-700.0);
    let times = halvings - WHOLE;
    let reduced = (x + times * LN_2[0]) + times * LN_2[1];
    let sum = TAYLOR.iter().fold(0.0, |sum, term| sum * reduced + term);
    let power = f64::from_bits((1023 - (halvings.to_bits() & 0x7ff)) << 52);
    if x > -690.0 { sum * power } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::splitmix64;

    /// Protects: `log1p` and `expm1` have the bits of libm, over their whole range, also where the
    /// formulas change.
    #[test]
    fn bits_are_those_of_libm() {
        let number = |i: u64| (splitmix64(i) >> 11) as f64 / (1_u64 << 53) as f64;
        let edges: [u64; 6] = [
            0x3fd2_bec4,
            0x3fd2_bec5,
            0x3fd6_2e42,
            0x3fd6_2e43,
            0x3ff0_a2b2,
            0x3fe6_a09e,
        ];
        let tiny: [u64; 4] = [0x3c90_0000, 0x3ca0_0000, 0x3cb0_0000, 0x0010_0000];
        let beside = edges.into_iter().chain(tiny).flat_map(|bits| {
            (-40..40_i64).map(move |step| {
                f64::from_bits((bits << 32).wrapping_add_signed(step * (1 << (step.abs() % 31))))
            })
        });
        let halves =
            (0..53).flat_map(|i| [libm::exp2(-f64::from(i)), 1.0 - libm::exp2(-f64::from(i))]);
        let numbers = (0..400_000)
            .map(number)
            .chain((0..40_000).map(|i| libm::exp2(-number(i) * 80.0)));
        for x in numbers
            .chain(beside)
            .chain(halves)
            .chain([0.0, 1e-310, 1.0_f64.next_down()])
        {
            if x < 1.0 {
                assert_eq!(
                    log1p(-x).to_bits(),
                    libm::log1p(-x).to_bits(),
                    "logarithm at −{x:e}"
                );
            }
            for x in [x, 38.0 * x].into_iter().filter(|&x| x <= 38.0) {
                assert_eq!(
                    expm1(-x).to_bits(),
                    libm::expm1(-x).to_bits(),
                    "exponential of −{x:e}"
                );
            }
        }
    }
}
