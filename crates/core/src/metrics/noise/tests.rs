//! Noise and difference of pictures whose noise and difference are known.

use super::*;
use crate::hash::splitmix64;

fn unit(seed: [u32; 3]) -> f64 {
    let bits = seed.iter().fold(1, |state, &part| {
        splitmix64(state ^ u64::from(part).wrapping_mul(0x9E37_79B9_7F4A_7C15))
    });
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

/// A colour of each pixel.
type Colours = Vec<[f32; 3]>;

/// Two pictures of even noise with four replicates each; the first is brighter by a factor
/// within a square.
fn pair(seed: u32, edge: u32, factor: f64) -> [(Colours, Colours); 2] {
    [0, 1].map(|side| {
        let pixel = |i: u32| {
            let inside = side == 0 && i % SIZE < edge && i / SIZE < edge;
            let replicate = |r: u32| {
                let u: f64 = (0..6)
                    .map(|k| unit([seed, i * 8 + side * 4 + r, k]))
                    .sum::<f64>()
                    - 3.0;
                (1.0 + 0.1 * u) * if inside { factor } else { 1.0 }
            };
            let values = [0, 1, 2, 3].map(replicate);
            let mean = values.iter().sum::<f64>() / 4.0;
            let variance = values
                .iter()
                .map(|value| (value - mean).powi(2))
                .sum::<f64>()
                / 12.0;
            ([mean as f32; 3], [variance.sqrt() as f32; 3])
        };
        (0..SIZE * SIZE).map(pixel).unzip()
    })
}

const SIZE: u32 = 96;

fn judged(seed: u32, edge: u32, factor: f64) -> NoiseTestResult {
    let sides = pair(seed, edge, factor);
    let [a, b] = sides.each_ref().map(|(rgb, errors)| PictureWithErrors {
        width: SIZE,
        height: SIZE,
        rgb,
        standard_errors: Some(errors.clone()),
        freedom: 3.0,
    });
    test_against_noise(&a, &b, 0.05).expect("one size")
}

/// Protects: Student's distribution agrees with numbers of 60 digits (the incomplete beta
/// function of mpmath 1.3; from 1e9 degrees of freedom on the normal distribution with its
/// first correction), from the middle far into the tails, and at its limits.
#[test]
fn students_tails_are_exact() {
    let known = [
        (0.5, 1.0, 0.70483276469913),
        (3.182, 3.0, 0.050017136543314),
        (12.924, 3.0, 0.00099999511109003),
        (2.086, 20.0, 0.04999635445744),
        (63.657, 1.0, 0.0099999593454681),
        (1.0, 2.5, 0.40406102727827),
        (4.417, 1e9, 1.0008024070545e-5),
        (30.0, 7.25, 7.1642625360361e-9),
        (1e-6, 12.0, 0.99999921854739),
        (6.0, 3e4, 1.9957666621554e-9),
        (8.0, 1e12, 1.2441921161679e-15),
        (8.0, f64::INFINITY, 1.2441921161679e-15),
        (1e8, 1.5, 7.5417048640325e-13),
    ];
    for (t, freedom, expected) in known {
        // More degrees of freedom bring the argument nearer to one, where the fraction loses
        // digits.
        let (found, bound) = (
            student_two_sided_tail(t, freedom),
            1e-12 + 1e-17 * freedom.min(1e12),
        );
        assert!(
            (found / expected - 1.0_f64).abs() < bound,
            "{t}, {freedom}: {found}"
        );
    }
    assert_eq!(
        [
            student_two_sided_tail(0.0, 3.0),
            student_two_sided_tail(f64::INFINITY, 3.0)
        ],
        [1.0, 0.0]
    );
}

/// Protects: noise alone causes no more alarms than stated, for a hundred pairs at 5 in 100; a
/// bias in a tenth of the picture is found at its place.
#[test]
fn alarms_are_as_rare_as_stated() {
    let alarms = (0..100)
        .filter(|&seed| judged(seed, 0, 1.0).beyond > 0)
        .count();
    assert!(alarms <= 11, "{alarms}");
    let found = judged(7, 32, 1.02);
    assert!(found.beyond > 0, "{found:?}");
    let clearest = found.clearest.expect("blocks");
    assert!(
        clearest.x < 32 && clearest.y < 32 && clearest.share.is_some_and(|share| share > 0.0),
        "{clearest:?}"
    );
}

/// Protects: pictures without noise differ exactly where their numbers differ by more than
/// rounding; pixels that are not finite are left out and counted.
#[test]
fn exact_pictures_differ_by_their_numbers() {
    let exact = |rgb: &[[f32; 3]], other: &[[f32; 3]]| {
        let side = |rgb| PictureWithErrors {
            width: 20,
            height: 20,
            rgb,
            standard_errors: None,
            freedom: 1.0,
        };
        test_against_noise(&side(rgb), &side(other), 0.01).expect("one size")
    };
    let grey = vec![[0.3_f32; 3]; 400];
    let mut other = grey.clone();
    other[399] = [f32::from_bits(0.3_f32.to_bits() + 1); 3];
    assert_eq!(exact(&grey, &other).beyond, 0);
    other[399] = [0.31; 3];
    let verdict = exact(&grey, &other);
    assert!(
        verdict.beyond > 0
            && verdict
                .clearest
                .is_some_and(|block| block.deviation.is_infinite()),
        "{verdict:?}"
    );
    other[399] = [f32::NAN; 3];
    assert_eq!(
        (exact(&grey, &other).beyond, exact(&grey, &other).untested),
        (0, 1)
    );
}
