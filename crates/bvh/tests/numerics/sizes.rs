//! Shapes of every size from a picometre to a terametre have the same hits: a formula whose terms
//! leave the range of its scalar would hit nothing, or everything.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad,
    Sphere, Torus, TransformedShape, Triangle,
};
use raywright_bvh::{Interval, PreparedRay, Ray, Real, Shape, Side, Vector};

use super::stated::shapes;
use super::support::{
    CaseRng, Expect, Verdict, create_ray_towards, format_ray_bits, judge, round_to_f32, to_scalar,
};

/// The shape with all lengths multiplied by a power of two, which is exact.
fn times<R: Real>(shape: &AnyShape<R>, by: f64) -> AnyShape<R> {
    let k = R::from_f64(by);
    match *shape {
        AnyShape::Sphere(s) => Sphere {
            centre: s.centre * k,
            radius: s.radius * k,
        }
        .into(),
        AnyShape::Plane(p) => Plane {
            point: p.point * k,
            ..p
        }
        .into(),
        AnyShape::Disk(d) => Disk {
            centre: d.centre * k,
            radius: d.radius * k,
            ..d
        }
        .into(),
        AnyShape::Quad(q) => Quad {
            corners: q.corners.map(|c| c * k),
        }
        .into(),
        AnyShape::Cuboid(c) => Cuboid {
            min: c.min * k,
            max: c.max * k,
        }
        .into(),
        AnyShape::Cylinder(c) => Cylinder {
            base: c.base * k,
            axis: c.axis * k,
            radius: c.radius * k,
            ..c
        }
        .into(),
        AnyShape::Cone(c) => Cone {
            base: c.base * k,
            axis: c.axis * k,
            radius: c.radius * k,
            top_radius: c.top_radius * k,
        }
        .into(),
        AnyShape::Ellipsoid(e) => Ellipsoid {
            centre: e.centre * k,
            semi_axes: e.semi_axes * k,
        }
        .into(),
        AnyShape::Hyperboloid(h) => {
            let half_height = h.half_height * k;
            Hyperboloid {
                centre: h.centre * k,
                waist: h.waist * k,
                slope: h.slope * k,
                half_height,
            }
            .into()
        }
        AnyShape::Paraboloid(p) => Paraboloid {
            apex: p.apex * k,
            radius: p.radius * k,
            height: p.height * k,
        }
        .into(),
        AnyShape::Torus(t) => {
            let (major_radius, minor_radius) = (t.major_radius * k, t.minor_radius * k);
            Torus {
                centre: t.centre * k,
                major_radius,
                minor_radius,
                ..t
            }
            .into()
        }
        AnyShape::Triangle(t) => Triangle {
            vertices: t.vertices.map(|v| v * k),
        }
        .into(),
    }
}

/// A ray at a shape of unit size at the origin, and the same ray in a scaled world.
fn rays<R: Real>(rng: &mut CaseRng, by: f64) -> (Ray<R>, Ray<R>) {
    let origin = rng.sample_direction() * rng.choose(&[3.0, 10.0, 100.0]);
    let ray = create_ray_towards::<R>(origin, rng.sample_point_in_cube() * 1.2);
    (ray, Ray::new(ray.origin * R::from_f64(by), ray.direction))
}

/// Compares hits, points and normals at 25 sizes from 2⁻⁴⁰ to 2⁴⁰ with those at unit size, scaled
/// by parameters and by a map.
fn alike<R: Real>() {
    for (name, shape) in shapes::<R>() {
        let transformed_shape =
            TransformedShape::<R>::new(shape, DAffine3::IDENTITY).expect("invertible");
        let larger: Vec<(f64, AnyShape<R>, TransformedShape<R>)> = (-12..=12)
            .map(|step| 2_f64.powi((f64::from(step) * 10.0 / 3.0).round() as i32))
            .map(|by| {
                (
                    by,
                    times(&shape, by),
                    TransformedShape::new(shape, DAffine3::from_scale(DVec3::splat(by)))
                        .expect("invertible"),
                )
            })
            .collect();
        judge(
            &format!("{name} of every size in {}", std::any::type_name::<R>()),
            410,
            3000,
            |rng| {
                let seed = rng.next_bits();
                let mut verdict = Verdict::Skipped;
                for (by, shape, placed_transformed_shape) in &larger {
                    let (ray, scaled) = rays::<R>(&mut CaseRng::new(seed, 0), *by);
                    let (prepared_ray, many) = (PreparedRay::new(ray), PreparedRay::new(scaled));
                    let expected = AnyShape::intersect(
                        &larger[12].1,
                        &prepared_ray,
                        Interval::positive(),
                        Side::Both,
                    );
                    let mapped = transformed_shape.intersect(
                        &prepared_ray,
                        Interval::positive(),
                        Side::Both,
                    );
                    let hit = shape.intersect(&many, Interval::positive(), Side::Both);
                    let hit_mapped =
                        placed_transformed_shape.intersect(&many, Interval::positive(), Side::Both);
                    let t = |hit: Option<raywright_bvh::ShapeHit<R>>, by: f64| {
                        hit.map(|h| h.t.to_f64() * by)
                    };
                    if t(hit, 1.0) != t(expected, *by) || t(hit_mapped, 1.0) != t(mapped, *by) {
                        return Verdict::Wrong(format!(
                            "{hit:?}, {hit_mapped:?} at {by:e}, {expected:?}, {mapped:?} at one{}",
                            format_ray_bits::<R>(&ray)
                        ));
                    }
                    let (Some(hit), Some(expected)) = (hit, expected) else {
                        continue;
                    };
                    let (there, here) = (
                        shape.surface(&many, hit),
                        larger[12].1.surface(&prepared_ray, expected),
                    );
                    let bound = here.error.to_f64().max(1e-6) * by;
                    let off = (there.point.to_f64() - here.point.to_f64() * *by).length();
                    let turned = (there.normal.to_f64() - here.normal.to_f64()).length();
                    let same = off <= 1e-3 * bound
                        && turned <= 1e-6
                        && (there.error.to_f64() / here.error.to_f64() / by - 1.0).abs() < 0.01;
                    if !same {
                        return Verdict::Wrong(format!(
                            "{there:?} at {by:e}, {here:?} at one{}",
                            format_ray_bits::<R>(&ray)
                        ));
                    }
                    verdict = Verdict::Right(0.0);
                }
                verdict
            },
        )
        .expect_right(300);
    }
}

/// Protects: the scale of the world changes no hit, in either precision.
#[test]
fn every_size_is_hit_alike() {
    alike::<f32>();
    alike::<f64>();
}

/// Number of hits of a thousand rays at a shape of decimal size, made by its constructor.
fn count_hits<R: Real>(make: impl Fn(f64) -> AnyShape<R>, size: f64) -> usize {
    let shape = make(size);
    let meets = |i: u64| {
        let rng = &mut CaseRng::new(411, i);
        let (origin, target) = (
            rng.sample_direction() * 4.0 * size,
            rng.sample_point_in_cube() * 0.9 * size,
        );
        let ray = Ray::<R>::new(
            to_scalar::<R>(round_to_f32(origin)),
            to_scalar::<R>((target - origin).normalize()),
        );
        shape
            .intersect(&PreparedRay::new(ray), Interval::positive(), Side::Both)
            .is_some()
    };
    (0..1000).filter(|&i| meets(i)).count()
}

/// Protects: an Earth in metres, and cones of sizes 1e-8 and 1e7, in either scalar: as many rays
/// hit them as the same shape of unit size.
#[test]
fn decimal_sizes_are_hit_as_often() {
    fn check<R: Real>() {
        type Make<R> = Box<dyn Fn(f64) -> AnyShape<R>>;
        let shapes: [(&str, Make<R>); 3] = [
            (
                "ellipsoid",
                Box::new(|s| Ellipsoid::new(DVec3::ZERO, DVec3::new(1.0, 0.9966, 1.0) * s).into()),
            ),
            (
                "cone",
                Box::new(|s| Cone::new(DVec3::NEG_Y * (0.5 * s), DVec3::Y, s, 0.0, 1.5 * s).into()),
            ),
            (
                "torus",
                Box::new(|s| Torus::new(DVec3::ZERO, DVec3::Y, 0.8 * s, 0.3 * s).into()),
            ),
        ];
        for (name, make) in &shapes {
            let expected = count_hits::<R>(make, 1.0);
            assert!(expected > 300, "{name}: {expected}");
            for size in [6.4e6, 1e-8, 1e7, 1e-12, 1e12] {
                let found = count_hits::<R>(make, size);
                assert!(
                    found.abs_diff(expected) <= 3,
                    "{name} of {size:e}  in {}: {found} for {expected}",
                    std::any::type_name::<R>()
                );
            }
        }
    }
    check::<f32>();
    check::<f64>();
}
