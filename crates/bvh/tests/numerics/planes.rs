//! P06–P08: directions of any length, and planes at grazing angles and far out.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{Plane, TransformedShape};
use raywright_bvh::{Interval, PreparedRay, Ray, Shape, Side};

use super::stated::shapes;
use super::support::{Expect, U, Verdict, exact, hex, hit, judge, ray, stored, ulp};

/// Protects: the same hit whatever the length of the direction, for every shape, in the world and placed. The oracle has the same direction
/// with length one, in f64; a ray that changes its mind when moved by a billionth is not judged.
#[test]
fn p06_any_length_of_direction() {
    let map = DAffine3::from_rotation_x(0.7) * DAffine3::from_scale(DVec3::new(0.5, -1.5, 1.25));
    for ((name, shape), (_, best)) in shapes::<f32>().into_iter().zip(shapes::<f64>()) {
        let placed = TransformedShape::<f32>::new(shape, map).unwrap();
        let best_placed = TransformedShape::<f64>::new(best, map).unwrap();
        judge(&format!("P06 {name}"), 6, 60_000, |random| {
            let length = random.pick(&[1e-20, 1e-8, 1e-3, 1.0, 1e3, 1e8]);
            let origin = exact(random.direction() * 4.0);
            let d = exact((random.cube() - origin).normalize() * length);
            let world = random.sign() > 0.0;
            let ray = ray::<f32>(origin, d);
            let robust = PreparedRay::new(ray);
            let got = if world {
                shape.intersect(&robust, Interval::positive(), Side::Both)
            } else {
                placed.intersect(&robust, Interval::positive(), Side::Both)
            };
            let expect = |o: DVec3| {
                let probe = PreparedRay::new(Ray::<f64>::new(o, d.normalize()));
                let range = Interval::positive();
                let hit = if world {
                    best.intersect(&probe, range, Side::Both)
                } else {
                    best_placed.intersect(&probe, range, Side::Both)
                };
                hit.map_or(f64::INFINITY, |h| h.t)
            };
            let t = got.map_or(f64::INFINITY, |h| f64::from(h.t) * d.length());
            let wanted = expect(origin);
            if (t - wanted).abs() <= 4.0 * ulp(wanted) || t == wanted {
                return Verdict::Right(0.0);
            }
            let (a, b) = d.normalize().any_orthonormal_pair();
            let moved = [a, -a, b, -b].map(|way| expect(origin + way * 1e-9));
            let sure = moved.iter().all(|&m| (m - wanted).abs() < 1e-6 || m == wanted);
            if sure { Verdict::Wrong(format!("{t} instead of {wanted}{}", hex::<f32>(&ray))) } else { Verdict::Band }
        })
        .expect_right(59_000);
    }
}

/// Protects: the distance to a plane down to a ten-millionth of a right angle, and no hit along it.
#[test]
fn p07_grazing_plane() {
    let slopes = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
    judge("P07", 7, 400_000, |random| {
        let level = random.sign() > 0.0;
        let n = if level { DVec3::Y } else { exact(random.direction()) };
        let point = if level { DVec3::ZERO } else { exact(random.cube()) };
        let slope = random.pick(&slopes) * random.between(0.5, 2.0);
        let d = exact((random.disc(n, 1.0).normalize() - n * slope).normalize());
        let origin = exact(point + n);
        let plane = Plane::new(stored::<f32>(point), stored::<f32>(n));
        let ray = ray::<f32>(origin, d);
        let (height, fall) = (n.dot(origin - point), -n.dot(d));
        let wanted = height / fall;
        match hit::<f32>(&plane, &ray) {
            None => Verdict::holds(fall <= 0.0, || format!("missed{}", hex::<f32>(&ray))),
            Some(_) if fall <= 0.0 => Verdict::Wrong(format!("hit behind{}", hex::<f32>(&ray))),
            Some(h) => {
                let error = (f64::from(h.t) - wanted).abs() / wanted;
                let finite = plane.surface(&PreparedRay::new(ray), h).point.is_finite();
                Verdict::bounded(error, 4.0 * U / fall, || format!("slope {fall:e}{}", hex::<f32>(&ray)))
                    .and(|| Verdict::holds(finite, || format!("not finite{}", hex::<f32>(&ray))))
            }
        }
    })
    .expect_right(400_000);
    for zero in [0.0, -0.0] {
        for height in [1.0, 0.0] {
            let ray = ray::<f32>(DVec3::Y * height, DVec3::new(1.0, zero, 0.0));
            let plane = Plane::new(stored::<f32>(DVec3::ZERO), stored::<f32>(DVec3::Y));
            assert!(hit::<f32>(&plane, &ray).is_none(), "hit along the plane at height {height}");
        }
    }
}

/// Protects: cells of a checker seen far out: wrong only within four units in the last place of a border.
#[test]
fn p08_checker_far_out() {
    let plane = Plane::new(stored::<f32>(DVec3::ZERO), stored::<f32>(DVec3::Y));
    for far in [1e3_f64, 1e4, 1e5, 1e6, 1e7] {
        // As many cells as leave one ray in a thousand near a border.
        let cell = 2_f64.powf((far / 128.0).log2().ceil());
        judge(&format!("P08 {far:e}"), 8 + far as u64, 100_000, |random| {
            let target = DVec3::new(random.between(-far, far), 0.0, random.between(-far, far));
            let origin = exact(target + random.cube() * (0.3 * far) + DVec3::Y * (0.31 * far));
            let ray = ray::<f32>(origin, exact((target - origin).normalize()));
            let d = ray.direction.as_dvec3();
            let wanted = origin - d * (origin.y / d.y);
            let Some(h) = hit::<f32>(&plane, &ray) else { return Verdict::Wrong(format!("missed{}", hex::<f32>(&ray))) };
            let point = plane.surface(&PreparedRay::new(ray), h).point.as_dvec3();
            let scale = point.abs().max(wanted.abs()).max(origin.abs()).max_element();
            let border = |x: f64| ((x / cell - (x / cell).round()) * cell).abs() <= 4.0 * ulp(scale);
            if border(wanted.x) || border(wanted.z) {
                return Verdict::Band;
            }
            let parity = |p: DVec3| ((p.x / cell).floor() + (p.z / cell).floor()).rem_euclid(2.0);
            Verdict::holds(parity(point) == parity(wanted), || format!("parity at {point:?}{}", hex::<f32>(&ray)))
        })
        .expect_right(99_000);
    }
}
