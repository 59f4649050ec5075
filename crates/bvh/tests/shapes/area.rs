//! Areas and densities: what sampling says of a surface against what random lines find of it.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{Placed, Probe, SampleArea, Shape, ShapeHit, Sphere};
use raywright_bvh::{Interval, Ray, Reference, Robust, Side, Vector};

use super::gallery::{Random, gallery};

/// A quantity that tells parts and normals of a surface apart, so that a density that is wrong in one place shows.
fn measured(p: DVec3, n: DVec3) -> f64 {
    1.0 + (2.0 * p.x + p.y).sin() * 0.5 + n.z * 0.4 + n.y * p.z * 0.2
}

/// The integral of `measured` over the surface by evenly distributed lines: each piece of area is met twice as often as its
/// share of the sphere the lines go through (Crofton's formula).
fn by_lines(all_hits: impl Fn(&Probe<Reference>, f64) -> Option<(DVec3, DVec3, f64)>) -> f64 {
    const RADIUS: f64 = 4.0;
    const LINES: u32 = 300_000;
    let random = &mut Random(77);
    let mut sum = 0.0;
    for _ in 0..LINES {
        let d = random.direction();
        let across = d.any_orthonormal_pair();
        let (r, a) = (RADIUS * random.unit().sqrt(), random.unit() * core::f64::consts::TAU);
        let origin = across.0 * (r * a.cos()) + across.1 * (r * a.sin()) - d * (2.0 * RADIUS);
        let probe = Probe::<Reference>::new(Ray::new(origin, d));
        let mut from = 0.0;
        while let Some((p, n, t)) = all_hits(&probe, from) {
            sum += measured(p, n);
            from = t;
        }
    }
    sum / f64::from(LINES) * (2.0 * core::f64::consts::PI * RADIUS * RADIUS)
}

fn by_samples(sample: impl Fn(f64, f64) -> (DVec3, DVec3, f64)) -> f64 {
    const STEPS: u32 = 400;
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
    let pairs = (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (at(i), at(j))));
    pairs.map(|(u, v)| sample(u, v)).map(|(p, n, density)| measured(p, n) / density).sum::<f64>() / f64::from(STEPS * STEPS)
}

/// Protects `sample_area` and its density: the mean of a quantity over samples, weighed by the density, is its integral.
#[test]
fn samples_agree_with_lines() {
    let map =
        DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0) * DAffine3::from_scale(DVec3::new(-0.8, 1.3, 0.6));
    for (name, shape, _) in gallery::<Reference>() {
        if shape.area().is_none() {
            assert!(name == "plane" || name == "infinite cylinder");
            continue;
        }
        let range = |from| Interval { min: from, max: f64::INFINITY };
        let lines = by_lines(|probe, from| {
            let hit = shape.intersect(probe, range(from), Side::Both)?;
            let s = shape.locate(probe, hit);
            Some((s.point, s.normal, hit.t))
        });
        let samples = by_samples(|u, v| {
            let (s, density) = shape.sample_area::<Reference>(u, v).unwrap();
            let again = shape.density::<Reference>(&s).unwrap();
            assert!((density / again - 1.0).abs() < 1e-9, "{name}: densities {density} and {again}");
            (s.point, s.normal, density)
        });
        assert!((samples / lines - 1.0).abs() < 0.025, "{name}: samples say {samples}, lines {lines}");
        let placed = Placed::<Reference>::new(shape, map).unwrap();
        let lines = by_lines(|probe, from| {
            let hit = placed.intersect(probe, range(from), Side::Both)?;
            let s = placed.locate(probe, hit);
            let density = placed.density(probe, hit).unwrap();
            assert!(density.is_finite() && density > 0.0, "{name}: density {density}");
            Some((s.point, s.normal, hit.t))
        });
        let samples = by_samples(|u, v| placed.sample_area(u, v).map(|(s, d)| (s.point, s.normal, d)).unwrap());
        assert!((samples / lines - 1.0).abs() < 0.025, "{name}, placed: samples say {samples}, lines {lines}");
    }
}

/// Protects `area`: the mean of one over the density.
#[test]
fn area_is_the_mean_of_one_over_density() {
    for (name, shape, _) in gallery::<Reference>() {
        let Some(area) = shape.area() else { continue };
        const STEPS: u32 = 300;
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
        let pairs = (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (at(i), at(j))));
        let sum: f64 = pairs.map(|(u, v)| 1.0 / shape.sample_area::<Reference>(u, v).unwrap().1).sum();
        let mean = sum / f64::from(STEPS * STEPS);
        assert!((mean / area - 1.0).abs() < 1e-3, "{name}: area {area}, mean {mean}");
    }
}

/// Protects the areas of mapped shapes: an evenly scaled sphere has a sphere's area.
#[test]
fn a_scaled_sphere_has_its_area() {
    let shape = Sphere { centre: DVec3::new(1.0, 2.0, 3.0), radius: 0.5 };
    let placed = Placed::<Reference>::new(shape.into(), DAffine3::from_scale(DVec3::splat(3.0))).unwrap();
    assert!((placed.area().unwrap() / (9.0 * shape.area()) - 1.0).abs() < 1e-9);
}

/// Protects the error bounds of drawn points: a ray that leaves one does not meet the convex surface again.
#[test]
fn rays_leave_drawn_points() {
    let random = &mut Random(5);
    for (name, shape, _) in gallery::<Robust>() {
        if matches!(name, "torus" | "hyperboloid" | "paraboloid" | "open cylinder") || shape.area().is_none() {
            continue;
        }
        for _ in 0..2000 {
            let (u, v) = (random.unit() as f32, random.unit() as f32);
            let (located, _) = shape.sample_area::<Robust>(u.min(0.999_999_9), v.min(0.999_999_9)).unwrap();
            let s = located.stored::<Robust>();
            let d = random.direction().as_vec3();
            let d = if d.dot(s.normal) < 0.0 { -d } else { d };
            let probe = Probe::<Robust>::new(Ray::new(s.spawn(d), d));
            let again: Option<ShapeHit<f32>> = shape.intersect(&probe, Interval::positive(), Side::Both);
            assert!(again.is_none(), "{name}: {s:?} direction {:?} hits again: {again:?}", d.to_f64());
        }
    }
}
