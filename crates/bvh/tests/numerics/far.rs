//! P01 and P02 at greater distances, for every curved shape: rays that f32 holds exactly, from up
//! to 10⁹ sizes away.
//!
//! The oracle is the same ray started nearby. Its origin is the far origin plus the direction times
//! a number of 24 bits. The product is exact in f64 and the sum cancels, so it is exact too, or
//! nearly. From there the shape is intersected in f64.

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Sphere, Torus};
use raywright_bvh::{Interval, PreparedRay, Ray, Real, Shape, Side, Vector};

use super::stated::shapes;
use super::support::{
    CaseOutcome, CaseRng, Expect, UNIT_ROUNDOFF, Verdict, create_ray_towards, format_ray_bits,
    judge, round_to_f32, to_scalar, ulp, within,
};

/// The shapes whose tests solve an equation; flat shapes have other tests.
const CURVED: [&str; 10] = [
    "sphere",
    "tube",
    "open cylinder",
    "cylinder",
    "cone",
    "truncated cone",
    "ellipsoid",
    "hyperboloid",
    "paraboloid",
    "torus",
];

/// Every shape lies around this point, within [`REACH`].
const MIDDLE: DVec3 = DVec3::new(0.25, 0.0, 0.0);
const REACH: f64 = 2.0;

/// Kind of exactness of a distant ray: along an axis its offset is free; in a plane of two axes the
/// offset across the plane is free; any other ray is rounded before it is intersected, and mostly
/// misses.
#[derive(Clone, Copy, Debug)]
enum RayExactness {
    Axis,
    Plane,
    Any,
}

fn from_afar<R: Real>(rng: &mut CaseRng, exactness: RayExactness, far: f64) -> Ray<R> {
    let target = MIDDLE + rng.sample_point_in_cube() * REACH;
    let mut d = DVec3::ZERO;
    let axis = (rng.next_bits() % 3) as usize;
    match exactness {
        RayExactness::Any => {
            return create_ray_towards::<R>(target + rng.sample_direction() * far, target);
        }
        RayExactness::Axis => d[axis] = rng.next_sign(),
        RayExactness::Plane => {
            // Few bits, so that the product that leads back to the axis is exact.
            let (x, y) = (rng.next_uniform(-1.0, 1.0), rng.next_sign());
            (d[axis], d[(axis + 1) % 3]) = ((x * 64.0).round() / 64.0, y);
            d = round_to_f32(d);
        }
    }
    let steps = far.log2().round().exp2();
    let mut origin = -d * steps;
    for i in 0..3 {
        if d[i] == 0.0 {
            origin[i] = f64::from(target[i] as f32);
        }
    }
    Ray::new(to_scalar::<R>(origin), to_scalar::<R>(d))
}

/// The origin of the same ray a few sizes before the shapes, exactly.
fn near(o: DVec3, d: DVec3) -> DVec3 {
    let middle = (MIDDLE - o).dot(d) / d.length_squared();
    let rounded = (middle - 2.0 * REACH) as f32;
    let ahead = f64::from(if f64::from(rounded) > middle - 2.0 * REACH {
        rounded.next_down()
    } else {
        rounded
    });
    let (direction, start) = (d * ahead, o + d * ahead);
    // The rounding error of a sum, exactly ("Accurate Sum and Dot Product", Ogita, Rump, Oishi
    // 2005).
    let back = start - o;
    let lost = (o - (start - back)) + (direction - back);
    assert!(
        lost.abs().max_element() <= 1e-14,
        "the judge's ray is not the same: {lost}"
    );
    start
}

/// Point and outward normal of the first hit of an exact ray, in f64.
fn judged(shape: &AnyShape<f64>, start: DVec3, d: DVec3) -> Option<(DVec3, DVec3)> {
    let prepared_ray = PreparedRay::new(Ray::<f64>::new(start, d));
    let hit = shape.intersect(
        &prepared_ray,
        Interval {
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
        },
        Side::Both,
    )?;
    let surface_point = shape.locate_surface_point(&prepared_ray, hit);
    Some((surface_point.point, surface_point.normal))
}

/// Judges false hits, misses, and points and normals with errors above those of the distance in
/// f64: its roundings across the ray, magnified by a slanted surface.
fn far<R: Real>(
    name: &str,
    shape: &AnyShape<R>,
    best: &AnyShape<f64>,
    exactness: RayExactness,
    far: f64,
) -> CaseOutcome {
    let case = format!(
        "P01 {name}, {exactness:?}, {far:e} away in {}",
        std::any::type_name::<R>()
    );
    judge(&case, 200 + far.log10() as u64, 4000, |rng| {
        let ray = from_afar::<R>(rng, exactness, far);
        let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
        let start = near(o, d);
        let margin = 32.0 * f64::EPSILON * far + 1e-12;
        let (a, b) = d.any_orthogonal_vector().normalize().any_orthonormal_pair();
        let expected = judged(best, start, d);
        // Where the surface ends, folds or occludes itself within the margin, f64 can't decide
        // either.
        let beside = [a, -a, b, -b].map(|across| judged(best, start + across * margin, d));
        let continued = beside.iter().all(|other| match (&expected, other) {
            (None, None) => true,
            (Some((p, n)), Some((q, m))) => p.distance(*q) < 0.01 && n.distance(*m) < 0.01,
            _ => false,
        });
        if !continued {
            return Verdict::Undecidable;
        }
        let prepared_ray = PreparedRay::new(ray);
        let got = shape.intersect(&prepared_ray, Interval::positive(), Side::Both);
        match (got, expected) {
            (None, None) => Verdict::Right(0.0),
            (None, Some((p, _))) => {
                Verdict::Wrong(format!("missed at {p}{}", format_ray_bits::<R>(&ray)))
            }
            (Some(_), None) => Verdict::Wrong(format!("false hit{}", format_ray_bits::<R>(&ray))),
            (Some(hit), Some((p, n))) => {
                let surface = shape.surface(&prepared_ray, hit);
                let slant = n.dot(d.normalize()).abs();
                // Up to 2¹⁰ sizes away, the point of a sphere or torus is computed from the stored
                // distance.
                let distance = if far <= 1e3 && R::ROUNDOFF.to_f64() > 1e-10 {
                    UNIT_ROUNDOFF * hit.t.to_f64() * d.length()
                } else {
                    0.0
                };
                let bound = 4.0 * ulp(p.abs().max_element()) + margin / slant.max(1e-2) + distance;
                let (off, turned) = (
                    surface.point.to_f64().distance(p),
                    surface.normal.to_f64().distance(n),
                );
                within(off, bound, || {
                    format!(
                        "{:?} instead of {p}{}",
                        surface.point,
                        format_ray_bits::<R>(&ray)
                    )
                })
                // No surface here has a radius of curvature below a fifth of its size, except at a
                // cone's apex.
 & {
                    let curved = if name == "cone" { 1e-2 } else { 5.0 * bound };
                    within(turned, curved, || {
                        format!("normal{}", format_ray_bits::<R>(&ray))
                    })
                }
            }
        }
    })
}

/// Protects: hits, misses, points and normals of every curved shape from 10² to 10⁹ sizes away;
/// from 3·10⁷ on they were once noise.
#[test]
fn p01_far_curved_shapes() {
    for ((name, robust), (_, best)) in shapes::<f32>().into_iter().zip(shapes::<f64>()) {
        if !CURVED.contains(&name) {
            continue;
        }
        for exponent in 2..=9 {
            let distance = 10_f64.powi(exponent);
            for exactness in [RayExactness::Axis, RayExactness::Plane, RayExactness::Any] {
                far::<f32>(name, &robust, &best, exactness, distance).expect_right(3900);
                far::<f64>(name, &best, &best, exactness, distance).expect_right(3900);
            }
        }
    }
}

/// Protects: the error bounds of a sphere and a torus far from the origin, where their points are
/// rounded by more than their size suggests; judged before storage, whose own rounding would hide
/// it.
#[test]
fn stated_bounds_hold_far_from_the_origin() {
    for exponent in 1..=9 {
        let place = 10_f64.powi(exponent);
        judge(&format!("stated bounds at {place:e}"), 190, 20_000, |rng| {
            let centre = rng.sample_direction() * place;
            let prepared_ray = PreparedRay::new(Ray::<f64>::new(
                centre + rng.sample_direction() * 5.0,
                rng.sample_direction(),
            ));
            let target = (centre + rng.sample_point_in_cube() - prepared_ray.origin).normalize();
            let prepared_ray = PreparedRay::new(Ray::<f64>::new(prepared_ray.origin, target));
            let ball = Sphere {
                centre,
                radius: 1.0,
            };
            let torus = Torus {
                centre,
                axis: DVec3::Y,
                major_radius: 0.75,
                minor_radius: 0.25,
            };
            // The difference of nearby numbers is exact.
            let from_ball = |p: DVec3| (p - centre).length() - 1.0;
            let from_ring = |p: DVec3| {
                let f = p - centre;
                let out = (f.x * f.x + f.z * f.z).sqrt() - 0.75;
                (out * out + f.y * f.y).sqrt() - 0.25
            };
            let off = |shape: &AnyShape<f64>, height: &dyn Fn(DVec3) -> f64| {
                let Some(hit) = shape.intersect(&prepared_ray, Interval::positive(), Side::Both)
                else {
                    return Verdict::Skipped;
                };
                let surface_point = shape.locate_surface_point(&prepared_ray, hit);
                let reach = surface_point.error * surface_point.normal.abs().element_sum();
                within(height(surface_point.point).abs(), reach, || {
                    format!("{shape:?} {prepared_ray:?}")
                })
            };
            match off(&ball.into(), &from_ball) {
                Verdict::Right(a) => match off(&torus.into(), &from_ring) {
                    Verdict::Skipped => Verdict::Right(a),
                    verdict => verdict,
                },
                verdict => verdict,
            }
        })
        .expect_right(5_000);
    }
}
