//! P06–P08: directions of any length, and planes at grazing angles and far from the origin.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{Plane, TransformedShape};
use raywright_bvh::{Interval, PreparedRay, Ray, Shape, Side};

use super::stated::shapes;
use super::support::{
    Expect, Verdict, create_unnormalised_ray, expect_all, format_ray_bits, judge, nearest_hit,
    round_to_f32, to_scalar, ulp,
};

/// Protects: hits do not depend on the length of the direction, for every shape, with and without a
/// transform. The oracle uses the unit direction in f64; a ray whose hit changes when moved by a
/// billionth is not judged.
#[test]
fn p06_any_length_of_direction() {
    let map = DAffine3::from_rotation_x(0.7) * DAffine3::from_scale(DVec3::new(0.5, -1.5, 1.25));
    for ((name, shape), (_, best)) in shapes::<f32>().into_iter().zip(shapes::<f64>()) {
        let transformed_shape = TransformedShape::<f32>::new(shape, map).unwrap();
        let best_placed = TransformedShape::<f64>::new(best, map).unwrap();
        judge(&format!("P06 {name}"), 6, 60_000, |rng| {
            let length = rng.choose(&[1e-20, 1e-8, 1e-3, 1.0, 1e3, 1e8]);
            let origin = round_to_f32(rng.sample_direction() * 4.0);
            let d = round_to_f32((rng.sample_point_in_cube() - origin).normalize() * length);
            let world = rng.next_sign() > 0.0;
            let ray = create_unnormalised_ray::<f32>(origin, d);
            let robust = PreparedRay::new(ray);
            let got = if world {
                shape.intersect(&robust, Interval::positive(), Side::Both)
            } else {
                transformed_shape.intersect(&robust, Interval::positive(), Side::Both)
            };
            let expect = |o: DVec3| {
                let prepared_ray = PreparedRay::new(Ray::<f64>::new(o, d.normalize()));
                let range = Interval::positive();
                let hit = if world {
                    best.intersect(&prepared_ray, range, Side::Both)
                } else {
                    best_placed.intersect(&prepared_ray, range, Side::Both)
                };
                hit.map_or(f64::INFINITY, |h| h.t)
            };
            let t = got.map_or(f64::INFINITY, |h| f64::from(h.t) * d.length());
            let expected = expect(origin);
            if (t - expected).abs() <= 4.0 * ulp(expected) || t == expected {
                return Verdict::Right(0.0);
            }
            let (a, b) = d.normalize().any_orthonormal_pair();
            let moved = [a, -a, b, -b].map(|direction| expect(origin + direction * 1e-9));
            let sure = moved
                .iter()
                .all(|&m| (m - expected).abs() < 1e-6 || m == expected);
            if sure {
                Verdict::Wrong(format!(
                    "{t} instead of {expected}{}",
                    format_ray_bits(&ray)
                ))
            } else {
                Verdict::Undecidable
            }
        })
        .expect_right(59_000);
    }
}

/// Protects: the distance to a plane at slopes down to 1e-7, and no hit by a ray in the plane.
#[test]
fn p07_grazing_plane() {
    expect_all("P07", 1.0);
    for zero in [0.0, -0.0] {
        for height in [1.0, 0.0] {
            let ray = create_unnormalised_ray::<f32>(DVec3::Y * height, DVec3::new(1.0, zero, 0.0));
            let plane = Plane::new(to_scalar::<f32>(DVec3::ZERO), to_scalar::<f32>(DVec3::Y));
            assert!(
                nearest_hit::<f32>(&plane, &ray).is_none(),
                "hit along the plane at height {height}"
            );
        }
    }
}

/// Protects: cells of a distant checkerboard are wrong only within four units in the last place of
/// a border.
#[test]
fn p08_checker_far_out() {
    expect_all("P08", 0.99);
}
