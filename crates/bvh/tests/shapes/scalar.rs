//! Functions of a scalar.

use raywright_bvh::Real;

/// Protects: `floor` without the processor's instruction rounds down, and never to −0.
#[test]
fn floors_are_those_of_the_standard_library() {
    let magnitudes = [
        0.0,
        1e-40,
        0.3,
        0.5,
        1.0,
        1.5,
        2.0,
        8_388_606.5,
        8_388_607.5,
        8_388_608.0,
        1e20,
        f32::INFINITY,
    ];
    for x in magnitudes
        .into_iter()
        .flat_map(|x| [x, x.next_up(), x.next_down(), -x, -x.next_down()])
    {
        assert_eq!(Real::floor(x).to_bits(), (x.floor() + 0.0).to_bits(), "{x}");
    }
    for x in [
        -0.0,
        0.3,
        -0.3,
        -1.0,
        4_503_599_627_370_495.5,
        -4_503_599_627_370_495.5,
        1e300,
        f64::NEG_INFINITY,
    ] {
        assert_eq!(Real::floor(x).to_bits(), (x.floor() + 0.0).to_bits(), "{x}");
    }
    assert!(Real::floor(f32::NAN).is_nan());
}

/// Protects: angles of points agree with the f64 library within three units of rounding, for a
/// whole turn, close to axes and diagonals, and near and far; the origin has angle zero, and the
/// sign of zero decides the side.
#[test]
fn angles_are_those_of_the_library() {
    let mut worst = 0.0_f64;
    for step in 0..100_000_u32 {
        let turn = core::f64::consts::TAU * (f64::from(step) / 100_000.0);
        for (length, off) in [
            (1.0, 0.0),
            (1e-20, 0.0),
            (1e20, 0.0),
            (1.0, 1e-6),
            (3.7, -1e-4),
        ] {
            let [x, y] = [
                libm::cos(turn) * length + off,
                libm::sin(turn) * length - off,
            ]
            .map(|v| v as f32);
            let expected = libm::atan2(f64::from(y), f64::from(x));
            let unit =
                f64::from((expected.abs() as f32).next_up()) - f64::from(expected.abs() as f32);
            worst = worst.max((f64::from(Real::angle(y, x)) - expected).abs() / unit);
        }
    }
    assert!(worst <= 3.0, "{worst} units");
    use core::f32::consts::{FRAC_PI_2, PI};
    let ends = [
        (0.0, 1.0, 0.0),
        (1.0, 0.0, FRAC_PI_2),
        (-1.0, 0.0, -FRAC_PI_2),
        (0.0, -1.0, PI),
        (-0.0, -1.0, -PI),
        (0.0, 0.0, 0.0),
    ];
    for (y, x, angle) in ends {
        assert_eq!(
            f32::to_bits(Real::angle(y, x)),
            f32::to_bits(angle),
            "({x}, {y})"
        );
    }
    assert_eq!(Real::angle(-3.0, -4.0_f64), libm::atan2(-3.0, -4.0));
}

/// Protects: cosines and sines of fractions of a turn from 0 to 1, within 1.5e-7, and exact at its
/// quarters.
#[test]
fn turns_are_cosines_and_sines() {
    let mut worst = 0.0_f64;
    for step in 0..=100_000_u32 {
        let share = step as f32 / 100_000.0;
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * f64::from(share));
        let [c, s] = Real::sin_cos_turns(share).map(f64::from);
        worst = worst.max((c - cos).abs()).max((s - sin).abs());
        let [c, s] = Real::sin_cos_turns(f64::from(share));
        assert!((c - cos).abs() < 1e-15 && (s - sin).abs() < 1e-15);
    }
    assert!(worst <= 1.5e-7, "{worst}");
    for (quarters, expected) in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]]
        .into_iter()
        .enumerate()
    {
        assert_eq!(Real::sin_cos_turns(quarters as f32 * 0.25), expected);
    }
}

/// Protects: `next_towards` returns the adjacent number, also from zero and at the ends, and the
/// number itself without a direction.
#[test]
fn next_numbers_on_a_side() {
    for x in [0.0_f32, 1.0, 1.5e-45, 1e-40, 0.1, 16_777_216.0, f32::MAX] {
        for x in [x, -x] {
            for side in [1e-30, 7.0] {
                assert_eq!(
                    x.next_towards(side).to_bits(),
                    f32::next_up(x).to_bits(),
                    "above {x:e}"
                );
                assert_eq!(
                    x.next_towards(-side).to_bits(),
                    f32::next_down(x).to_bits(),
                    "below {x:e}"
                );
                let (wide, side) = (f64::from(x), f64::from(side));
                assert_eq!(
                    wide.next_towards(side).to_bits(),
                    f64::next_up(wide).to_bits(),
                    "above {x:e}"
                );
            }
            assert_eq!(x.next_towards(0.0).to_bits(), x.to_bits());
            assert_eq!(x.next_towards(f32::NAN).to_bits(), x.to_bits());
        }
    }
    assert_eq!(f32::INFINITY.next_towards(-1.0), f32::INFINITY);
}
