//! FLIP against its authors' implementation, and its defining properties.
//!
//! The expected numbers were computed on 2026-11-21 by `flip_evaluator` 1.7 from PyPI (single
//! precision, by the paper's authors), with `evaluate(reference, test, "LDR", applyMagma=False)` on
//! the pictures that [`pair`] returns.

use super::*;
use crate::metrics::mean_and_quantiles;

fn from_codes(width: u32, height: u32, code: impl Fn(i32, i32) -> [i32; 3]) -> Picture {
    let mut picture = Picture::new(width, height);
    for (i, rgb) in picture.rgb.iter_mut().enumerate() {
        let (x, y) = (i as i32 % width as i32, i as i32 / width as i32);
        *rgb = code(x, y).map(|c| c.clamp(0, 255) as f32 / 255.0);
    }
    picture
}

/// A reference of ramps and checks, and a picture with noise on the right, exchanged channels
/// below, and an inverted block.
fn pair(width: u32, height: u32) -> [Picture; 2] {
    let (w, h) = (width as i32, height as i32);
    let reference = |x: i32, y: i32| {
        let check = ((x / 7 + y / 5) % 2) * 90;
        [0, 1, 2].map(|c| (x * (3 - c) + y * (c + 1) + check) % 256)
    };
    let picture = |x: i32, y: i32| {
        let mut code = reference(x, y);
        let noise = (x * 7_919 + y * 104_729 + x * y * 31) % 23;
        if x > w / 2 {
            code = [code[0] + noise, code[1], code[2] - noise];
        }
        if y > h / 2 {
            code = [code[1], code[2], code[0]];
        }
        if (x - w / 4).abs() < 4 && (y - h / 4).abs() < 4 {
            code = code.map(|c| 255 - c);
        }
        code
    };
    [
        from_codes(width, height, picture),
        from_codes(width, height, reference),
    ]
}

fn plain(code: [i32; 3]) -> Picture {
    from_codes(1, 1, |_, _| code)
}

/// Protects: FLIP maps agree with the authors' in mean, quartiles, maximum and single pixels, in
/// the middle, at the border and in the corner.
#[test]
fn flip_agrees_with_its_authors() {
    let [picture, reference] = pair(96, 64);
    let places = [(0, 0), (24, 16), (70, 10), (20, 50), (95, 63), (48, 32)];
    for (pixels_per_degree, mean, quartiles, maximum, expected) in [
        (
            DEFAULT_PIXELS_PER_DEGREE,
            0.386_942_0,
            [0.145_564_2, 0.253_942_5, 0.667_513_4],
            0.988_485_1,
            [
                0.0,
                0.777_153_2,
                0.208_498_1,
                0.759_526_9,
                0.821_115_3,
                0.541_843_4,
            ],
        ),
        (
            20.0,
            0.393_695_2,
            [0.086_143_8, 0.260_652_9, 0.709_723_8],
            0.998_496_1,
            [
                0.0,
                0.807_112_3,
                0.263_714_8,
                0.696_743_1,
                0.827_219_8,
                0.192_514_5,
            ],
        ),
    ] {
        let map = flip(&picture, &reference, pixels_per_degree).unwrap();
        let s = mean_and_quantiles(&map);
        let found = [
            s.mean,
            s.first_quartile,
            s.median,
            s.third_quartile,
            s.maximum,
        ];
        let wanted_value = [mean, quartiles[0], quartiles[1], quartiles[2], maximum];
        for (found, wanted_value) in found.into_iter().zip(wanted_value) {
            assert!(
                (found - wanted_value).abs() < 2e-5,
                "{pixels_per_degree}: {found} for {wanted_value}"
            );
        }
        for ((x, y), wanted_value) in places.into_iter().zip(expected) {
            let found = f64::from(map[y * 96 + x]);
            assert!(
                (found - wanted_value).abs() < 1e-4,
                "{pixels_per_degree} ({x}, {y}): {found} for {wanted_value}"
            );
        }
    }
}

/// Protects: FLIP also agrees for a picture smaller than the filters, and for single colours: black
/// and white, the largest distance, one code.
#[test]
fn small_pictures_agree_too() {
    let [picture, reference] = pair(37, 5);
    let map = flip(&picture, &reference, DEFAULT_PIXELS_PER_DEGREE).unwrap();
    assert!((mean_and_quantiles(&map).mean - 0.412_871_8).abs() < 2e-5);
    for (a, b, expected) in [
        ([0, 0, 0], [255, 255, 255], 0.967_388_3),
        ([0, 255, 0], [0, 0, 255], 1.0),
        ([100, 100, 100], [101, 101, 101], 0.030_794_0),
    ] {
        let found = flip(&plain(a), &plain(b), DEFAULT_PIXELS_PER_DEGREE).unwrap()[0];
        assert!(
            (found - expected).abs() < 1e-5,
            "{a:?} {b:?}: {found} for {expected}"
        );
    }
}

/// Protects: FLIP of equal pictures is zero, FLIP is symmetric, and its values lie in 0..1.
#[test]
fn flip_is_a_symmetric_difference() {
    let [picture, reference] = pair(40, 30);
    assert!(
        flip(&picture, &picture, DEFAULT_PIXELS_PER_DEGREE)
            .unwrap()
            .iter()
            .all(|&x| x == 0.0)
    );
    let map = flip(&picture, &reference, DEFAULT_PIXELS_PER_DEGREE).unwrap();
    assert_eq!(
        map,
        flip(&reference, &picture, DEFAULT_PIXELS_PER_DEGREE).unwrap()
    );
    assert!(map.iter().all(|x| (0.0..=1.0).contains(x)));
}

/// Protects: a NaN is as visible as its marker, and numbers out of range are clipped, so that the
/// map contains neither.
#[test]
fn odd_numbers_are_visible() {
    let [picture, reference] = pair(20, 20);
    let mut broken = reference.clone();
    broken.rgb[210] = [f32::NAN, 0.0, 0.0];
    broken.rgb[0] = [f32::INFINITY, -1.0, f32::NEG_INFINITY];
    let map = flip(&broken, &reference, DEFAULT_PIXELS_PER_DEGREE).unwrap();
    assert!(map.iter().all(|x| (0.0..=1.0).contains(x)));
    assert!(map[210] > 0.1 && map[0] > 0.1);
    let error = flip(&picture, &reference, 0.5).unwrap_err();
    assert_eq!(error, MetricsError::PixelsPerDegree(0.5));
    assert!(flip(&picture, &reference, f64::NAN).is_err());
}
