//! Time of an intersection test for each shape in each precision, and of the surface at a hit, in
//! nanoseconds.
//!
//! Rays from a surrounding sphere aim at points near the shape, so that about half of them hit. The
//! precisions of a shape run one after another, so that drift of the machine's speed appears as a
//! difference between shapes. Medians of many passes over the rays, with half the interquartile
//! range.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/random.rs"]
mod random;
#[path = "../crates/bvh/tests/split_mix.rs"]
mod split_mix;
#[path = "support/turns.rs"]
#[expect(dead_code, reason = "one shape after the other is timed here")]
mod turns;

use std::hint::black_box;
use std::time::Instant;

use glam::{DAffine3, DVec3};
use raywright::core::bench::SampleQuantiles;
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad,
    Sphere, Torus, TransformedShape, Triangle,
};
use raywright_bvh::{Interval, PreparedRay, Ray, Real, Shape, Side, Vector};

use random::SplitMix64;
use turns::measuring;

fn rays<R: Real>() -> Vec<Ray<R>> {
    let rng = &mut SplitMix64(1);
    let vector = |v: DVec3| R::Vec3::from_f64(v);
    let ray = |rng: &mut SplitMix64| {
        let origin = rng.cube().normalize() * 5.0;
        let target = rng.cube() * 1.2;
        Ray::new(vector(origin), vector((target - origin).normalize()))
    };
    (0..4096).map(|_| ray(rng)).collect()
}

/// The shapes with their names, each of about unit size.
fn shapes<R: Real>() -> Vec<(&'static str, AnyShape<R>)> {
    let v = |p: DVec3| R::Vec3::from_f64(p);
    let (zero, axis) = (DVec3::ZERO, DVec3::new(0.3, 1.0, -0.2));
    let (corner, eu, ev) = (
        DVec3::new(-1.0, -1.0, 0.2),
        DVec3::new(2.0, 0.2, 0.0),
        DVec3::new(0.1, 2.0, 0.3),
    );
    vec![
        (
            "sphere",
            Sphere {
                centre: v(zero),
                radius: R::ONE,
            }
            .into(),
        ),
        ("plane", Plane::new(v(zero), v(axis.normalize())).into()),
        (
            "triangle",
            Triangle {
                vertices: [v(corner), v(corner + eu), v(corner + ev)],
            }
            .into(),
        ),
        ("disk", Disk::new(zero, axis, 1.0).into()),
        ("quad", Quad::new(corner, eu, ev).into()),
        (
            "box",
            Cuboid::new(DVec3::NEG_ONE * 0.8, DVec3::ONE * 0.8).into(),
        ),
        (
            "infinite-cylinder",
            Cylinder::new(zero, axis, 0.8, None, false).into(),
        ),
        (
            "open-cylinder",
            Cylinder::new(-axis, axis, 0.8, Some(2.0), false).into(),
        ),
        (
            "capped-cylinder",
            Cylinder::new(-axis, axis, 0.8, Some(2.0), true).into(),
        ),
        ("cone", Cone::new(-axis, axis, 1.0, 0.0, 2.0).into()),
        (
            "truncated-cone",
            Cone::new(-axis, axis, 1.0, 0.5, 2.0).into(),
        ),
        (
            "ellipsoid",
            Ellipsoid::new(zero, DVec3::new(1.0, 0.6, 0.8)).into(),
        ),
        ("hyperboloid", Hyperboloid::new(zero, 0.5, 0.7, 1.0).into()),
        ("paraboloid", Paraboloid::new(-DVec3::Y, 1.0, 2.0).into()),
        ("torus", Torus::new(zero, axis, 0.8, 0.3).into()),
    ]
}

/// Number of timed passes, after one warm-up pass.
const PASSES: usize = 101;

/// Times repeated passes of `test` over the inputs, and prints the time per test.
fn run<P, T>(group: &str, id: &str, probes: &[P], mut test: impl FnMut(&P) -> T) {
    let mut pass = || {
        let start = Instant::now();
        for prepared in probes {
            black_box(test(black_box(prepared)));
        }
        start.elapsed().as_secs_f64() * 1e9 / probes.len() as f64
    };
    pass();
    let spread = SampleQuantiles::from_samples(&(0..PASSES).map(|_| pass()).collect::<Vec<_>>());
    println!(
        "{:40}{:>10.2} ns ±{:4.1} %",
        format!("{group} {id}"),
        spread.median,
        spread.relative_half_spread() * 100.0
    );
}

fn precision<R: Real>(name: &str) {
    let rays = rays::<R>();
    let probes: Vec<_> = rays.iter().map(|&ray| PreparedRay::new(ray)).collect();
    for (shape_name, shape) in shapes::<R>() {
        let id = format!("{shape_name}/{name}");
        let range = Interval::<R>::positive();
        // Each shape's own test, as a tree calls it for that kind; black boxes prevent constant
        // propagation of the shape into the loop.
        macro_rules! each {
            ($($variant:ident),*) => {
                match shape {
                    $(AnyShape::$variant(shape) => run("test", &id, &probes, |prepared| {
                        let hit = black_box(&shape).intersect(prepared, range, Side::Both);
                        hit.map_or(0.0, |h| h.t.to_f64())
                    }),)*
                }
            };
        }
        each!(
            Sphere,
            Plane,
            Disk,
            Quad,
            Cuboid,
            Cylinder,
            Cone,
            Ellipsoid,
            Hyperboloid,
            Paraboloid,
            Torus,
            Triangle
        );
        let hit: Vec<_> = probes
            .iter()
            .filter(|p| shape.intersect(p, range, Side::Both).is_some())
            .copied()
            .collect();
        run("test-and-surface", &id, &hit, |prepared| {
            let shape = black_box(&shape);
            let hit = shape.intersect(prepared, range, Side::Both);
            hit.map_or(0.0, |h| shape.surface(prepared, h).error.to_f64())
        });
    }
    let map =
        DAffine3::from_axis_angle(DVec3::Z, 0.3) * DAffine3::from_scale(DVec3::new(1.0, 0.7, 1.2));
    let sphere = Sphere {
        centre: R::Vec3::ZERO,
        radius: R::ONE,
    };
    if let Some(transformed_shape) = TransformedShape::<R>::new(sphere.into(), map) {
        run(
            "test",
            &format!("placed-sphere/{name}"),
            &probes,
            |prepared| {
                black_box(&transformed_shape)
                    .intersect(prepared, Interval::positive(), Side::Both)
                    .map_or(0.0, |h| h.t.to_f64())
            },
        );
    }
    let sphere = Sphere {
        centre: R::Vec3::ZERO,
        radius: R::ONE,
    };
    let surfaces: Vec<_> = probes
        .iter()
        .filter_map(|p| {
            sphere
                .intersect(p, Interval::positive(), Side::Both)
                .map(|h| sphere.surface(p, h))
        })
        .collect();
    run("ray", &format!("probe/{name}"), &rays, |&ray| {
        PreparedRay::new(ray)
    });
    run("ray", &format!("spawn/{name}"), &surfaces, |s| {
        s.spawn_ray_origin(s.normal)
    });
}

fn main() {
    if measuring() {
        precision::<f32>("robust");
        precision::<f64>("reference");
    }
}
