//! What a test of each shape costs in each precision, and what the surface at a hit costs: nanoseconds per test.
//!
//! Rays from a sphere around aim at points near the shape, so that about half of them hit; each iteration is one test. The
//! precisions of a shape run one after another, so that drift of the machine shows as a difference between shapes.

#[path = "support/random.rs"]
mod random;
#[path = "../crates/bvh/tests/split_mix.rs"]
mod split_mix;

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Hyperboloid, Paraboloid, Plane, Quad, Sphere, Torus, TransformedShape,
    Triangle,
};
use raywright_bvh::{Interval, PreparedRay, Ray, Real, Shape, Side, Vector};

use random::Random;

fn rays<R: Real>() -> Vec<Ray<R>> {
    let random = &mut Random(1);
    let vector = |v: DVec3| R::Vec3::from_f64(v);
    let ray = |random: &mut Random| {
        let origin = random.cube().normalize() * 5.0;
        let target = random.cube() * 1.2;
        Ray::new(vector(origin), vector((target - origin).normalize()))
    };
    (0..4096).map(|_| ray(random)).collect()
}

/// The shapes with their names; each of a size around one.
fn shapes<R: Real>() -> Vec<(&'static str, AnyShape<R>)> {
    let v = |p: DVec3| R::Vec3::from_f64(p);
    let (zero, axis) = (DVec3::ZERO, DVec3::new(0.3, 1.0, -0.2));
    let (corner, eu, ev) = (DVec3::new(-1.0, -1.0, 0.2), DVec3::new(2.0, 0.2, 0.0), DVec3::new(0.1, 2.0, 0.3));
    vec![
        ("sphere", Sphere { centre: v(zero), radius: R::ONE }.into()),
        ("plane", Plane::new(v(zero), v(axis.normalize())).into()),
        ("triangle", Triangle { vertices: [v(corner), v(corner + eu), v(corner + ev)] }.into()),
        ("disk", Disk::new(zero, axis, 1.0).into()),
        ("quad", Quad::new(corner, eu, ev).into()),
        ("box", Cuboid::new(DVec3::NEG_ONE * 0.8, DVec3::ONE * 0.8).into()),
        ("infinite-cylinder", Cylinder::new(zero, axis, 0.8, None, false).into()),
        ("open-cylinder", Cylinder::new(-axis, axis, 0.8, Some(2.0), false).into()),
        ("capped-cylinder", Cylinder::new(-axis, axis, 0.8, Some(2.0), true).into()),
        ("cone", Cone::new(-axis, axis, 1.0, 0.0, 2.0).into()),
        ("truncated-cone", Cone::new(-axis, axis, 1.0, 0.5, 2.0).into()),
        ("ellipsoid", Ellipsoid::new(zero, DVec3::new(1.0, 0.6, 0.8)).into()),
        ("hyperboloid", Hyperboloid::new(zero, 0.5, 0.7, 1.0).into()),
        ("paraboloid", Paraboloid::new(-DVec3::Y, 1.0, 2.0).into()),
        ("torus", Torus::new(zero, axis, 0.8, 0.3).into()),
    ]
}

/// Runs `test` over the probes again and again, one probe an iteration.
fn run(c: &mut Criterion, group: &str, id: String, probes: &[PreparedRay], mut test: impl FnMut(&PreparedRay) -> f64) {
    let mut group = c.benchmark_group(group);
    group.sample_size(30).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(600));
    group.bench_function(id, |bencher| {
        let mut next = probes.iter().cycle();
        bencher.iter(|| next.next().map(&mut test));
    });
    group.finish();
}

fn precision<R: Real>(c: &mut Criterion, name: &str) {
    let rays = rays::<R>();
    let probes: Vec<_> = rays.iter().map(|&ray| PreparedRay::new(ray)).collect();
    for (shape_name, shape) in shapes::<R>() {
        let id = format!("{shape_name}/{name}");
        let range = Interval::<R>::positive();
        // Each shape's own test, as a tree calls it for its kind; black boxes keep the shape out of the loop's constants.
        macro_rules! each {
            ($($variant:ident),*) => {
                match shape {
                    $(AnyShape::$variant(shape) => run(c, "test", id.clone(), &probes, |probe| {
                        let hit = black_box(&shape).intersect(probe, range, Side::Both);
                        hit.map_or(0.0, |h| h.t.to_f64())
                    }),)*
                }
            };
        }
        each!(Sphere, Plane, Disk, Quad, Cuboid, Cylinder, Cone, Ellipsoid, Hyperboloid, Paraboloid, Torus, Triangle);
        let hit: Vec<_> = probes.iter().filter(|p| shape.intersect(p, range, Side::Both).is_some()).copied().collect();
        run(c, "test-and-surface", id, &hit, |probe| {
            let shape = black_box(&shape);
            let hit = shape.intersect(probe, range, Side::Both);
            hit.map_or(0.0, |h| shape.surface(probe, h).error.to_f64())
        });
    }
    let map = DAffine3::from_axis_angle(DVec3::Z, 0.3) * DAffine3::from_scale(DVec3::new(1.0, 0.7, 1.2));
    let sphere = Sphere { centre: R::Vec3::ZERO, radius: R::ONE };
    if let Some(placed) = TransformedShape::<R>::new(sphere.into(), map) {
        run(c, "test", format!("placed-sphere/{name}"), &probes, |probe| {
            black_box(&placed).intersect(probe, Interval::positive(), Side::Both).map_or(0.0, |h| h.t.to_f64())
        });
    }
    let sphere = Sphere { centre: R::Vec3::ZERO, radius: R::ONE };
    let surfaces: Vec<_> = probes
        .iter()
        .filter_map(|p| sphere.intersect(p, Interval::positive(), Side::Both).map(|h| sphere.surface(p, h)))
        .collect();
    let mut group = c.benchmark_group("ray");
    group.sample_size(30).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(600));
    group.bench_function(format!("probe/{name}"), |bencher| {
        let mut next = rays.iter().cycle();
        bencher.iter(|| next.next().copied().map(PreparedRay::new));
    });
    group.bench_function(format!("spawn/{name}"), |bencher| {
        let mut next = surfaces.iter().cycle();
        bencher.iter(|| next.next().map(|s| s.spawn(s.normal)));
    });
    group.finish();
}

fn all(c: &mut Criterion) {
    precision::<f32>(c, "robust");
    precision::<f64>(c, "reference");
}

criterion_group!(benches, all);
criterion_main!(benches);
