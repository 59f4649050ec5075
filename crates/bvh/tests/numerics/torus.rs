//! P17, P18: the torus from far away, and tangent rays.

use glam::DVec3;
use raywright_bvh::shapes::Torus;
use raywright_bvh::{Interval, PreparedRay, Ray, Shape, Side};

use super::support::{
    Expect, UNIT_ROUNDOFF, Verdict, create_ray_towards, expect_all, expect_hard, format_ray_bits,
    judge, require, to_scalar,
};

/// Protects: thick and thin tori from 3 to 1000 radii away. The textbook loses half the rays at a
/// hundred.
#[test]
fn p17_far_torus() {
    expect_hard(&expect_all("P17", 0.9975), "P17 tube 0.1 at 1e2", 0.25);
}

/// The torus around the y axis with major radius 1.
fn build_torus(tube: f64) -> Torus<f32> {
    Torus::new(DVec3::ZERO, DVec3::Y, 1.0, tube)
}

/// Number of times that a ray enters and leaves, by chains of queries.
fn passages(torus: &Torus<f32>, ray: &Ray<f32>) -> (u32, u32) {
    let prepared_ray = PreparedRay::new(*ray);
    let count = |side: Side| {
        let (mut count, mut from) = (0, 0.0);
        while let Some(h) = torus.intersect(
            &prepared_ray,
            Interval {
                min: from,
                max: f32::INFINITY,
            },
            side,
        ) {
            (count, from) = (count + 1, h.t);
        }
        count
    };
    (count(Side::Outside), count(Side::Inside))
}

/// Protects: lines tangent to the top circle or an equator, moved in and out by eight roundings of
/// the distance: crossings come in pairs and agree with the circles of that plane.
#[test]
fn p18_tangents() {
    judge("P18", 40, 300_000, |rng| {
        let tube = f64::from(rng.choose(&[0.3_f32, 0.1, 0.01]));
        let torus = build_torus(tube);
        let far = f64::from(rng.next_uniform(3.0, 1000.0) as f32);
        let step = rng.choose(&[-8.0, 8.0, -64.0, 64.0]) * UNIT_ROUNDOFF * far;
        // The line is parallel to x, at height y and distance z from the axis.
        let (y, z) = match rng.next_bits() % 3 {
            0 => (tube + step, rng.next_uniform(0.0, 0.9)),
            1 => (0.0, 1.0 - tube + step),
            _ => (0.0, 1.0 + tube + step),
        };
        let (y, z) = (f64::from(y as f32), f64::from(z as f32));
        let half = tube * tube - y * y;
        let circles = if half > 0.0 {
            [1.0 - half.sqrt(), 1.0 + half.sqrt()]
        } else {
            [0.0, 0.0]
        };
        if circles.iter().any(|r| (r - z).abs() < 1e-12) {
            return Verdict::Undecidable;
        }
        let expected = circles.iter().filter(|r| z < **r).count() as u32;
        let expected = if half > 0.0 { expected } else { 0 };
        let ray = Ray::<f32>::new(
            to_scalar::<f32>(DVec3::new(-far, y, z)),
            to_scalar::<f32>(DVec3::X),
        );
        let (enters, leaves) = passages(&torus, &ray);
        require((enters, leaves) == (expected, expected), || {
            format!(
                "in {enters}, out {leaves}, wanted {expected}; tube {tube} y {y} z {z}{}",
                format_ray_bits(&ray)
            )
        })
    })
    .expect_right(299_000);
}

/// Protects: from outside every ray leaves as often as it enters, and a ray along the axis hits
/// nothing.
#[test]
fn p18_even_from_outside() {
    judge("P18 parity", 41, 300_000, |rng| {
        let torus = build_torus(rng.choose(&[0.3, 0.1, 0.01, 0.9]));
        let ray = create_ray_towards::<f32>(
            rng.sample_direction() * rng.next_uniform(3.0, 1000.0),
            rng.sample_point_in_cube(),
        );
        let (enters, leaves) = passages(&torus, &ray);
        require(enters == leaves && enters <= 2, || {
            format!("in {enters}, out {leaves}{}", format_ray_bits(&ray))
        })
    })
    .expect_right(300_000);
    for tube in [0.3, 0.1, 0.01, 0.99] {
        for far in [2.0, 10.0, 1e3, 1e6] {
            for sign in [-1.0, 1.0] {
                let ray = Ray::<f32>::new(
                    to_scalar::<f32>(DVec3::Y * (far * sign)),
                    to_scalar::<f32>(DVec3::Y * -sign),
                );
                assert_eq!(
                    passages(&build_torus(tube), &ray),
                    (0, 0),
                    "along the axis from {far}"
                );
            }
        }
    }
    let inside = Interval {
        min: 0.0,
        max: f32::INFINITY,
    };
    let ray = Ray::<f32>::new(to_scalar::<f32>(DVec3::X), to_scalar::<f32>(DVec3::X));
    assert!(
        build_torus(0.3)
            .intersect(&PreparedRay::new(ray), inside, Side::Inside)
            .is_some(),
        "from within the tube"
    );
}
