//! Cases P07 and P08: planes at grazing angles, and far from their origin.

use glam::DVec3;

use super::judge::{Outcome, RayCount, U, Verdict, exact, hex, hit, judge, ray, to_scalar, ulp};
use super::{Measurement, by_shapes};
use crate::shapes::Plane;
use crate::{PreparedRay, Real, Shape, Vector};

/// P07: the hit distance of a plane, by rays with slopes from 1e-2 down to 1e-7.
pub fn grazing<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let slopes = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
    let outcome = judge("P07", 7, 400_000, rays, |rng| {
        let level = rng.sign() > 0.0;
        let n = if level {
            DVec3::Y
        } else {
            exact(rng.direction())
        };
        let point = if level {
            DVec3::ZERO
        } else {
            exact(rng.in_cube())
        };
        let slope = rng.choose(&slopes) * rng.uniform(0.5, 2.0);
        let d = exact((rng.in_disc(n, 1.0).normalize() - n * slope).normalize());
        let origin = exact(point + n);
        let plane = Plane::new(to_scalar::<R>(point), to_scalar::<R>(n));
        let ray = ray::<R>(origin, d);
        let (height, fall) = (n.dot(origin - point), -n.dot(d));
        let requested = height / fall;
        match hit::<R>(&plane, &ray) {
            None => Verdict::holds(fall <= 0.0, || format!("missed{}", hex(&ray))),
            Some(_) if fall <= 0.0 => Verdict::Wrong(format!("hit behind{}", hex(&ray))),
            Some(h) => {
                let error = (h.t.to_f64() - requested).abs() / requested;
                let finite = plane.surface(&PreparedRay::new(ray), h).point.is_finite();
                Verdict::within_bound(error, 4.0 * U / fall, || {
                    format!("slope {fall:e}{}", hex(&ray))
                })
                .and(|| Verdict::holds(finite, || format!("not finite{}", hex(&ray))))
            }
        }
    });
    vec![by_shapes::<R>(outcome)]
}

/// P08: the cell of a checkerboard that a ray hits, at distances from a thousand to ten million
/// metres.
pub fn far_out<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let plane = Plane::new(to_scalar::<R>(DVec3::ZERO), to_scalar::<R>(DVec3::Y));
    let at = |far: f64| {
        // The cell size, for which about one ray in a thousand hits close to the border of a cell.
        let cell = 2_f64.powf((far / 128.0).log2().ceil());
        judge(
            &format!("P08 {far:e}"),
            8 + far as u64,
            100_000,
            rays,
            |rng| {
                let target = DVec3::new(rng.uniform(-far, far), 0.0, rng.uniform(-far, far));
                let origin = exact(target + rng.in_cube() * (0.3 * far) + DVec3::Y * (0.31 * far));
                let ray = ray::<R>(origin, exact((target - origin).normalize()));
                let d = ray.direction.to_f64();
                let requested = origin - d * (origin.y / d.y);
                let Some(h) = hit::<R>(&plane, &ray) else {
                    return Verdict::Wrong(format!("missed{}", hex(&ray)));
                };
                let point = plane.surface(&PreparedRay::new(ray), h).point.to_f64();
                let scale = point
                    .abs()
                    .max(requested.abs())
                    .max(origin.abs())
                    .max_element();
                let border =
                    |x: f64| ((x / cell - (x / cell).round()) * cell).abs() <= 4.0 * ulp(scale);
                if border(requested.x) || border(requested.z) {
                    return Verdict::Band;
                }
                let parity =
                    |p: DVec3| ((p.x / cell).floor() + (p.z / cell).floor()).rem_euclid(2.0);
                Verdict::holds(parity(point) == parity(requested), || {
                    format!("parity at {point:?}{}", hex(&ray))
                })
            },
        )
    };
    let outcome = [1e3, 1e4, 1e5, 1e6, 1e7]
        .map(at)
        .into_iter()
        .reduce(Outcome::plus)
        .expect("distances");
    vec![by_shapes::<R>(outcome)]
}
