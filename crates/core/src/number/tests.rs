//! Operations in lanes against a single number, on special and ordinary values.

use core::fmt::Debug;

use super::{LaneMask, Lanes, Mask, Number, Vector3};
use glam::{DVec3, Vec3};

const VALUES: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -3.25,
    1e-40,
    -1e-40,
    1e30,
    -1e30,
    f32::MIN_POSITIVE,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    0.1,
    7.7,
];

fn bits(x: f32) -> u32 {
    if x.is_nan() { u32::MAX } else { x.to_bits() }
}

fn same<T: Debug>(name: &str, inputs: T, found: f32, expected: f32) {
    assert_eq!(
        bits(found),
        bits(expected),
        "{name} of {inputs:?}: {found} and {expected}"
    );
}

/// All pairs of values, in lanes.
fn pairs() -> impl Iterator<Item = [Lanes<16>; 2]> {
    (0..16).map(|turn| {
        [
            Lanes(VALUES),
            Lanes(core::array::from_fn(|i| VALUES[(i + turn) % 16])),
        ]
    })
}

/// Protects: operators, selections and functions of lanes equal the one-lane versions to the bit,
/// for zeros of either sign, subnormal numbers, infinities and NaN.
#[test]
fn operations_are_those_of_one_lane() {
    type Two<N> = fn(N, N) -> N;
    fn two<N: Number>() -> [(&'static str, Two<N>); 12] {
        [
            ("sum", |a, b| a + b),
            ("difference", |a, b| a - b),
            ("product", |a, b| a * b),
            ("quotient", |a, b| a / b),
            ("max", N::max),
            ("min", N::min),
            ("copysign", N::copysign),
            ("select", |a, b| N::select(a.greater_than(b), a, b)),
            ("negation", |a, _| -a),
            ("sqrt", |a, _| a.sqrt()),
            ("powi", |a, _| a.powi(5)),
            ("functions", |a, b| {
                let [cos, sin] = a.sin_cos_turns();
                sin + cos * b.exp()
            }),
        ]
    }
    for [a, b] in pairs() {
        for ((name, lanes), (_, alone)) in two::<Lanes<16>>().into_iter().zip(two::<f32>()) {
            let found = lanes(a, b);
            (0..16).for_each(|i| same(name, (a.0[i], b.0[i]), found.0[i], alone(a.0[i], b.0[i])));
        }
    }
}

/// Protects: vector operations of lanes equal the one-lane versions to the bit; their minimum and
/// maximum treat NaN differently from numbers.
#[test]
fn vectors_are_those_of_one_lane() {
    type Two<N> = fn(<N as Number>::Vec3, <N as Number>::Vec3) -> <N as Number>::Vec3;
    fn two<N: Number>() -> [(&'static str, Two<N>); 12] {
        [
            ("sum", |a, b| a + b),
            ("difference", |a, b| a - b),
            ("product", |a, b| a * b),
            ("scaled", |a, b| a * b.x()),
            ("divided", |a, b| a / b.y()),
            ("negation", |a, _| -a),
            ("dot", |a, b| N::Vec3::splat(a.dot(b))),
            ("cross", |a, b| a.cross(b)),
            ("normalize", |a, _| a.normalize()),
            ("min", Vector3::min),
            ("max", Vector3::max),
            ("select", |a, b| {
                N::Vec3::select(
                    a.z().greater_than(b.z()),
                    a,
                    N::Vec3::new(b.z(), b.max_element(), b.x()),
                )
            }),
        ]
    }
    for (turn, [a, b]) in pairs().enumerate() {
        // Components shifted by several lanes, so that each vector holds different values.
        let vector = |first: Lanes<16>, step: usize| {
            let turned = |by: usize| Lanes(core::array::from_fn(|i| first.0[(i + by * step) % 16]));
            <<Lanes<16> as Number>::Vec3 as Vector3<Lanes<16>>>::new(first, turned(1), turned(2))
        };
        let (a, b) = (vector(a, 3), vector(b, 1 + turn));
        for ((name, lanes), (_, alone)) in two::<Lanes<16>>().into_iter().zip(two::<f32>()) {
            let found = lanes(a, b);
            for i in 0..16 {
                let one = |v: super::Vec3Lanes<16>| Vec3::new(v.x.0[i], v.y.0[i], v.z.0[i]);
                let expected = alone(one(a), one(b));
                for k in 0..3 {
                    same(name, (one(a), one(b)), one(found)[k], expected[k]);
                }
            }
        }
    }
}

/// Protects: a mask holds the value of each lane, and lanes are read and written at their index.
#[test]
fn masks_and_lanes_keep_their_places() {
    let above = Lanes([1.0, 5.0, 2.0, f32::NAN]).greater_than(Lanes([0.0, 6.0, 1.0, 1.0]));
    let lanes = |mask: LaneMask<4>| core::array::from_fn(|i| mask.lane(i));
    assert_eq!(lanes(above), [true, false, true, false]);
    assert_eq!(lanes(!above), [false, true, false, true]);
    let mut other = LaneMask::default();
    assert!(!other.any_lane());
    other.set_lane(1);
    other.set_lane(2);
    assert!(other.any_lane());
    assert_eq!(
        (lanes(above & other), lanes(above | other)),
        ([false, false, true, false], [true, true, true, false])
    );
    let numbers = Lanes::<4>::from_lanes(|i| i as f64 + 0.5);
    assert_eq!(
        core::array::from_fn(|i| numbers.lane(i)),
        [0.5, 1.5, 2.5, 3.5]
    );
    let vectors = <super::Vec3Lanes<4> as Vector3<Lanes<4>>>::from_lanes(|i| {
        DVec3::new(1.0, 2.0, 3.0) * i as f64
    });
    assert_eq!(
        (vectors.lane(0), vectors.lane(3)),
        (DVec3::ZERO, DVec3::new(3.0, 6.0, 9.0))
    );
}
