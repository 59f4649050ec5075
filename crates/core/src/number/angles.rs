//! Arc tangents, sines and cosines of `f64` without branches: the compiler can vectorise loops over
//! them. The formulas are those of libm (FreeBSD's msun), with selections in place of branches. The
//! bits are the same.

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// π minus the `f64` nearest to π.
const PI_LOW: f64 = 1.224_646_799_147_353_2e-16;
/// Arc tangents of 1/2, 1, 3/2 and infinity, each with its rounding error.
const ARCS: [[f64; 2]; 4] = [
    [4.636_476_090_008_061e-1, 2.269_877_745_296_168_7e-17],
    [FRAC_PI_4, 3.061_616_997_868_383e-17],
    [9.827_937_232_473_29e-1, 1.390_331_103_123_099_8e-17],
    [FRAC_PI_2, 6.123_233_995_736_766e-17],
];
/// π/2 as the sum of two numbers, the first with 33 bits.
const HALF_PI: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
/// Coefficients of the polynomial for the sine.
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
/// Coefficients of the polynomial for the cosine.
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Returns the `f64` with the given upper 32 bits, and zeros as the lower 32 bits.
const fn from_upper_bits(bits: u64) -> f64 {
    f64::from_bits(bits << 32)
}

/// Returns the angle in radians, 0 to π, between the positive x axis and the direction to the point
/// (`x`, |`y`|). Neither coordinate may exceed 10¹⁵ times the other, except for `x` = 0.
#[inline(always)]
pub(crate) fn angle_above_axis(y: f64, x: f64) -> f64 {
    let angle = arc_tangent((y / x).abs());
    if x < 0.0 {
        PI - (angle - PI_LOW)
    } else {
        angle
    }
}

/// Returns the arc tangent of a non-negative number.
#[inline(always)]
fn arc_tangent(x: f64) -> f64 {
    const EVEN: [f64; 6] = [
        3.333_333_333_333_293e-1,
        1.428_571_427_250_346_6e-1,
        9.090_887_133_436_507e-2,
        6.661_073_137_387_531e-2,
        4.976_877_994_615_932_4e-2,
        1.628_582_011_536_578_2e-2,
    ];
    const ODD: [f64; 5] = [
        -1.999_999_999_987_648_3e-1,
        -1.111_111_040_546_235_6e-1,
        -7.691_876_205_044_83e-2,
        -5.833_570_133_790_573_5e-2,
        -3.653_157_274_421_691_6e-2,
    ];
    let mut part = [x, 1.0, 0.0, 0.0];
    let [half, one, more, all] = ARCS;
    let or = |from: u64, now: [f64; 4], before: [f64; 4]| {
        if x < from_upper_bits(from) {
            before
        } else {
            now
        }
    };
    part = or(
        0x3fdc_0000,
        [2.0 * x - 1.0, 2.0 + x, half[0], half[1]],
        part,
    );
    part = or(0x3fe6_0000, [x - 1.0, x + 1.0, one[0], one[1]], part);
    part = or(
        0x3ff3_0000,
        [x - 1.5, 1.0 + 1.5 * x, more[0], more[1]],
        part,
    );
    part = or(0x4003_8000, [-1.0, x, all[0], all[1]], part);
    let [over, under, arc, rest] = part;
    let x = over / under;
    let z = x * x;
    let w = z * z;
    let even =
        z * (EVEN[0] + w * (EVEN[1] + w * (EVEN[2] + w * (EVEN[3] + w * (EVEN[4] + w * EVEN[5])))));
    let odd = w * (ODD[0] + w * (ODD[1] + w * (ODD[2] + w * (ODD[3] + w * ODD[4]))));
    arc - (x * (even + odd) - rest - x)
}

/// Returns the sines and the cosines of angles in radians, from 0 to 9/4 π.
#[inline(always)]
pub(crate) fn sines_and_cosines<const N: usize>(angles: [f64; N]) -> [[f64; N]; 2] {
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    for i in 0..N {
        [sines[i], cosines[i]] = sine_and_cosine(angles[i]);
    }
    if angles
        .iter()
        .fold(false, |near, &angle| near | is_near_an_axis(angle))
    {
        for i in 0..N {
            if is_near_an_axis(angles[i]) {
                (sines[i], cosines[i]) = libm::sincos(angles[i]);
            }
        }
    }
    [sines, cosines]
}

/// Whether an angle is so close to a multiple of π/2 that [`HALF_PI`] has too few digits for its
/// reduction.
#[inline(always)]
fn is_near_an_axis(angle: f64) -> bool {
    let bits = angle.to_bits() >> 32;
    [0x3ff9_21fb, 0x4009_21fb, 0x4012_d97c, 0x4019_21fb]
        .iter()
        .fold(false, |near, &axis| near | (bits == axis))
}

/// Returns the sine and the cosine of an angle that is not [near an axis](is_near_an_axis).
#[inline(always)]
fn sine_and_cosine(angle: f64) -> [f64; 2] {
    let from = |bits: u64| {
        if angle < from_upper_bits(bits) {
            0.0
        } else {
            1.0
        }
    };
    let quarters = from(0x3fe9_21fc) + from(0x4002_d97d) + from(0x400f_6a7b) + from(0x4015_fdbd);
    let first = angle - quarters * HALF_PI[0];
    let last = quarters * HALF_PI[1];
    let x = first - last;
    let y = (first - x) - last;
    let z = x * x;
    let w = z * z;
    let v = z * x;
    let r = SINE[1] + z * (SINE[2] + z * SINE[3]) + z * w * (SINE[4] + z * SINE[5]);
    let reduced = x - ((z * (0.5 * y - v * r) - y) - v * SINE[0]);
    let sine = if quarters == 0.0 {
        x + v * (SINE[0] + z * r)
    } else {
        reduced
    };
    let r = z * (COSINE[0] + z * (COSINE[1] + z * COSINE[2]))
        + w * w * (COSINE[3] + z * (COSINE[4] + z * COSINE[5]));
    let half = 0.5 * z;
    let maximum = 1.0 - half;
    let cosine = maximum + (((1.0 - maximum) - half) + (z * r - x * y));
    // With each quarter of a turn, sine and cosine swap, and one changes its sign.
    let (is_odd, is_behind) = (
        (quarters == 1.0) | (quarters == 3.0),
        (quarters == 2.0) | (quarters == 3.0),
    );
    let [sine, cosine] = if is_odd {
        [cosine, -sine]
    } else {
        [sine, cosine]
    };
    if is_behind {
        [-sine, -cosine]
    } else {
        [sine, cosine]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::splitmix64;

    fn number(i: u64) -> f64 {
        (splitmix64(i) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Protects: angles, sines and cosines have the bits of libm, also where the formulas change
    /// and near the axes.
    #[test]
    fn bits_are_those_of_libm() {
        let edges: [u64; 8] = [
            0x3fdc_0000,
            0x3fe6_0000,
            0x3ff3_0000,
            0x4003_8000,
            0x3fe9_21fc,
            0x4002_d97d,
            0x400f_6a7b,
            0x4015_fdbd,
        ];
        let axes: [u64; 7] = [
            0x3ff9_21fb,
            0x4009_21fb,
            0x4012_d97c,
            0x4019_21fb,
            0x3fe9_21fb,
            0x3e40_0000,
            0x3e46_a09e,
        ];
        let beside = edges.into_iter().chain(axes).flat_map(|bits| {
            (-40..40_i64).map(move |step| {
                f64::from_bits((bits << 32).wrapping_add_signed(step * (1 << (step.abs() % 31))))
            })
        });
        let exact = [0.0, 1e-300, FRAC_PI_4, FRAC_PI_2, PI, 1.5 * PI, 2.0 * PI];
        let numbers = (0..400_000)
            .map(|i| number(i) * 7.0)
            .chain((0..40_000).map(|i| libm::exp2(-number(i) * 60.0)));
        let mut count = 0;
        for angle in numbers.chain(beside).chain(exact) {
            let [[sine, _], [cosine, _]] = sines_and_cosines([angle, 1.0]);
            let (s, c) = libm::sincos(angle);
            assert_eq!(
                [sine.to_bits(), cosine.to_bits()],
                [s.to_bits(), c.to_bits()],
                "of {angle:e}"
            );
            count += 1;
        }
        for i in 0..800_000 {
            let (y, x) = (
                number(2 * i) * libm::exp2(-number(i) * 40.0),
                (number(2 * i + 1) - 0.3) * libm::exp2(-number(7 * i) * 20.0),
            );
            assert_eq!(
                angle_above_axis(y, x).to_bits(),
                libm::atan2(y, x).to_bits(),
                "of {y:e}, {x:e}"
            );
        }
        for (y, x) in [
            (1.0, 0.0),
            (0.5, 1.0),
            (1e-12, -8.0),
            (1.0, -1e-16),
            (0.4375, 1.0),
            (0.6875, 1.0),
            (1.1875, 1.0),
            (2.4375, 1.0),
        ] {
            assert_eq!(
                angle_above_axis(y, x).to_bits(),
                libm::atan2(y, x).to_bits(),
                "of {y:e}, {x:e}"
            );
        }
        assert!(count > 440_000);
    }
}
