//! Noise against the values of the reference shader, and against the definition.

use std::path::PathBuf;

use glam::{DVec3, Vec3};
use serde_json::Value;

use super::*;

/// Reads a JSON file of the shared reference set; returns `None`, with a message on stderr, where
/// the set is absent.
fn reference(name: &str) -> Option<Value> {
    let path = PathBuf::from(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/reference/noise"
    ))
    .join(name);
    match std::fs::read_to_string(&path) {
        Ok(text) => Some(serde_json::from_str(&text).expect("the reference is JSON")),
        Err(_) => {
            #[expect(clippy::print_stderr, reason = "a skipped test says so")]
            {
                eprintln!("skipped: shared data not found ({})", path.display());
            }
            None
        }
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(|x| x.as_f64().expect("a number"))
        .collect()
}

/// Protects: the gradients equal the frozen table to the bit, including all 42 that rounding
/// decides.
#[test]
fn gradients_are_those_of_single_precision() {
    let Some(table) = reference("gradient_table.json") else {
        return;
    };
    let rows = table["gradients"].as_array().expect("gradients");
    assert_eq!(rows.len(), PERIOD);
    for (hash, row) in rows.iter().enumerate() {
        let row: Vec<f32> = numbers(row).into_iter().map(|x| x as f32).collect();
        assert_eq!(octahedron_point(hash).as_slice(), row, "hash {hash}");
    }
}

/// Protects: noise and its sums are within 1e-6 of the reference, in both precisions.
#[test]
fn values_are_those_of_the_reference() {
    let Some(table) = reference("noise_table.json") else {
        return;
    };
    let mut worst = [0.0_f64; 2];
    let mut check = |point: &Value, ours: [[f64; 3]; 2]| {
        let expected =
            ["cnoise", "sumNoise", "sumAbsNoise"].map(|key| point[key].as_f64().expect("a number"));
        for (precision, values) in ours.iter().enumerate() {
            for (value, expected) in values.iter().zip(expected) {
                worst[precision] = worst[precision].max((value - expected).abs());
            }
        }
    };
    for point in table["points3"].as_array().expect("points") {
        let p = DVec3::from_slice(&numbers(&point["p"]));
        let q: Vec3 = p.as_vec3();
        let single = [
            noise3::<f32>(q),
            fbm3::<f32>(q, 8),
            turbulence3::<f32>(q, 8),
        ]
        .map(f64::from);
        check(
            point,
            [
                single,
                [
                    noise3::<f64>(p),
                    fbm3::<f64>(p, 8),
                    turbulence3::<f64>(p, 8),
                ],
            ],
        );
    }
    for point in table["points2"].as_array().expect("points") {
        let p = numbers(&point["p"]);
        let q = [p[0] as f32, p[1] as f32];
        let single = [
            noise2(q[0], q[1]),
            fbm2(q[0], q[1], 8),
            turbulence2(q[0], q[1], 8),
        ]
        .map(f64::from);
        check(
            point,
            [
                single,
                [
                    noise2(p[0], p[1]),
                    fbm2(p[0], p[1], 8),
                    turbulence2(p[0], p[1], 8),
                ],
            ],
        );
    }
    assert!(
        worst[0] <= 1e-6 && worst[1] <= 1e-6,
        "worst differences in f32 and f64: {worst:?}"
    );
}

/// Points with their expected values in f64: noise, sum and absolute sum of eight octaves in space,
/// then the same for x and y in the plane.
const VALUES: [([f64; 3], [f64; 6]); 5] = [
    (
        [0.5, 0.5, 0.5],
        [
            -0.3962285615000053,
            -0.3962285615000053,
            0.3962285615000053,
            -0.4915326233733916,
            -0.4915326233733916,
            0.4915326233733916,
        ],
    ),
    (
        [-1.75, 2.5, -3.25],
        [
            0.2968797830358526,
            0.14815161824130177,
            0.4456079478304035,
            -0.39731326037971904,
            -0.16951435786948058,
            0.6251121628899575,
        ],
    ),
    (
        [12.3, -45.6, 78.9],
        [
            0.1887988597494265,
            0.3201107720551869,
            0.4266600107997268,
            -0.13239163084028427,
            0.15608031940314054,
            0.5772438909747761,
        ],
    ),
    (
        [0.1, 288.9, -289.3],
        [
            -0.20791454055819827,
            -0.24565408504238037,
            0.4335232878073806,
            -0.18673567389634366,
            -0.45208552456394413,
            0.5295594632260354,
        ],
    ),
    (
        [1000.25, -2000.5, 0.125],
        [
            -0.2140427369061289,
            -0.1881623659885517,
            0.3475917790598151,
            -0.04633244606030663,
            -0.0660467645880316,
            0.0660467645880316,
        ],
    ),
];

/// Protects: noise values stay those that were verified against the reference, also in a clone
/// without the reference files.
#[test]
fn s20_values_stay_what_they_were() {
    for ([x, y, z], expected) in VALUES {
        let p = DVec3::new(x, y, z);
        let space = [
            noise3::<f64>(p),
            fbm3::<f64>(p, 8),
            turbulence3::<f64>(p, 8),
        ];
        let plane = [noise2(x, y), fbm2(x, y, 8), turbulence2(x, y, 8)];
        for (value, expected) in space.iter().chain(&plane).zip(expected) {
            assert!(
                (value - expected).abs() < 1e-14,
                "{p}: {value}, not {expected}"
            );
        }
    }
}

/// Protects: of the 42 hash values on the octahedron's fold, rounding folds all but one.
#[test]
fn rounding_folds_all_edge_points_but_one() {
    let on_edge = |hash: &usize| 2 * (hash % 7) + (2 * (hash / 7 % 7)).abs_diff(7) == 7;
    let edge: Vec<usize> = (0..PERIOD).filter(on_edge).collect();
    assert_eq!(edge.len(), 42);
    let unfolded: Vec<usize> = edge
        .into_iter()
        .filter(|hash| octahedron_point(*hash)[2] > 0.0)
        .collect();
    assert_eq!(unfolded, [147]);
}

/// Protects: both precisions agree within the reference's bound for arguments that both represent
/// exactly.
#[test]
fn precisions_agree() {
    for i in 0..1000_i16 {
        let q = Vec3::new(
            f32::from(i) * 0.37 - 100.0,
            f32::from(i % 31) * 1.91 - 20.0,
            f32::from(i % 77) * -0.713,
        );
        let difference = f64::from(noise3::<f32>(q)) - noise3::<f64>(q.as_dvec3());
        assert!(difference.abs() < 1e-6, "{q}: {difference}");
        let difference = f64::from(noise2(q.x, q.y)) - noise2(f64::from(q.x), f64::from(q.y));
        assert!(difference.abs() < 1e-6, "{q}: {difference}");
    }
}

/// Protects: noise is zero on the lattice, continuous across it, and repeats after 289 units, on
/// both sides of the origin.
#[test]
fn the_lattice_is_seamless() {
    for i in -300..300_i32 {
        let whole = f64::from(i);
        assert_eq!(noise3::<f64>(DVec3::new(whole, 2.0, -7.0)), 0.0);
        let at = |x: f64| noise3::<f64>(DVec3::new(x, 0.3, -0.4));
        assert!(
            (at(whole - 1e-9) - at(whole + 1e-9)).abs() < 1e-7,
            "a step at {i}"
        );
        let (x, period) = (whole + 0.625, PERIOD as f64);
        assert_eq!(noise2(x, 0.25), noise2(x + period, 0.25 - period));
    }
}

/// Protects: arguments beyond the lattice's range give a finite number and no panic; NaN stays NaN.
#[test]
fn s20_extreme_arguments_are_survived() {
    for x in [
        1e10,
        -1e10,
        1e30,
        -1e30,
        f64::MAX,
        f64::MIN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        -1e-300,
    ] {
        assert!(fbm3::<f64>(DVec3::new(x, 0.5, 0.5), 1).is_finite(), "{x}");
        assert!(
            fbm3::<f32>(Vec3::new(x as f32, 0.5, 0.5), 1).is_finite(),
            "{x}"
        );
        assert!(
            noise2(0.5, x).is_finite() && noise2(0.5_f32, x as f32).is_finite(),
            "{x}"
        );
    }
    assert!(noise3::<f64>(DVec3::new(f64::NAN, 0.0, 0.0)).is_nan());
    assert!(noise2(f32::NAN, 0.5).is_nan());
}
