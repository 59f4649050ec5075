//! Cases P07 and P08: planes at grazing angles, and hit points far from the origin.

use glam::DVec3;

use super::verdicts::{
    CaseOutcome, RayCount, UNIT_ROUNDOFF, Verdict, create_unnormalised_ray, format_ray_bits,
    judge_rays, nearest_hit, round_to_f32, to_scalar, ulp,
};
use super::{Measurement, create_treeless_measurement};
use crate::shapes::Plane;
use crate::{PreparedRay, Real, Shape, Vector};

/// Measures case P07: the hit distance of a plane, for rays whose slopes against the plane are from
/// 1e-2 down to 1e-7.
pub fn measure_grazing_planes<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let slopes = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
    let outcome = judge_rays("P07", 7, 400_000, rays, |rng| {
        let level = rng.next_sign() > 0.0;
        let n = if level {
            DVec3::Y
        } else {
            round_to_f32(rng.sample_direction())
        };
        let point = if level {
            DVec3::ZERO
        } else {
            round_to_f32(rng.sample_point_in_cube())
        };
        let slope = rng.choose(&slopes) * rng.next_uniform(0.5, 2.0);
        let d =
            round_to_f32((rng.sample_offset_in_disc(n, 1.0).normalize() - n * slope).normalize());
        let origin = round_to_f32(point + n);
        let plane = Plane::new(to_scalar::<R>(point), to_scalar::<R>(n));
        let ray = create_unnormalised_ray::<R>(origin, d);
        let (height, fall) = (n.dot(origin - point), -n.dot(d));
        let expected = height / fall;
        match nearest_hit::<R>(&plane, &ray) {
            None => Verdict::from_condition(fall <= 0.0, || {
                format!(
                    "no hit is found, although the ray reaches the plane{}",
                    format_ray_bits(&ray)
                )
            }),
            Some(_) if fall <= 0.0 => Verdict::Wrong(format!(
                "a hit is found, although the plane lies behind the ray's origin{}",
                format_ray_bits(&ray)
            )),
            Some(h) => {
                let error = (h.t.to_f64() - expected).abs() / expected;
                let finite = plane.surface(&PreparedRay::new(ray), h).point.is_finite();
                Verdict::from_error(error, 4.0 * UNIT_ROUNDOFF / fall, || {
                    format!(
                        "relative error of the hit distance at slope {fall:e}{}",
                        format_ray_bits(&ray)
                    )
                })
                .and_then(|| {
                    Verdict::from_condition(finite, || {
                        format!(
                            "the surface point at the hit is not finite{}",
                            format_ray_bits(&ray)
                        )
                    })
                })
            }
        }
    });
    vec![create_treeless_measurement::<R>(outcome)]
}

/// Measures case P08: the cell of a checkerboard plane in which a hit point lies, at distances from
/// 10³ to 10⁷ metres.
pub fn measure_distant_checkerboard<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let plane = Plane::new(to_scalar::<R>(DVec3::ZERO), to_scalar::<R>(DVec3::Y));
    let at = |far: f64| {
        // The cell size, for which about one ray in a thousand hits close to the border of a cell.
        let cell = 2_f64.powf((far / 128.0).log2().ceil());
        judge_rays(
            &format!("P08 {far:e}"),
            8 + far as u64,
            100_000,
            rays,
            |rng| {
                let target = DVec3::new(
                    rng.next_uniform(-far, far),
                    0.0,
                    rng.next_uniform(-far, far),
                );
                let origin = round_to_f32(
                    target + rng.sample_point_in_cube() * (0.3 * far) + DVec3::Y * (0.31 * far),
                );
                let ray = create_unnormalised_ray::<R>(
                    origin,
                    round_to_f32((target - origin).normalize()),
                );
                let d = ray.direction.to_f64();
                let expected = origin - d * (origin.y / d.y);
                let Some(h) = nearest_hit::<R>(&plane, &ray) else {
                    return Verdict::Wrong(format!(
                        "no hit is found, although the ray reaches the plane{}",
                        format_ray_bits(&ray)
                    ));
                };
                let point = plane.surface(&PreparedRay::new(ray), h).point.to_f64();
                let scale = point
                    .abs()
                    .max(expected.abs())
                    .max(origin.abs())
                    .max_element();
                let border =
                    |x: f64| ((x / cell - (x / cell).round()) * cell).abs() <= 4.0 * ulp(scale);
                if border(expected.x) || border(expected.z) {
                    return Verdict::Undecidable;
                }
                let parity =
                    |p: DVec3| ((p.x / cell).floor() + (p.z / cell).floor()).rem_euclid(2.0);
                Verdict::from_condition(parity(point) == parity(expected), || {
                    format!(
                        "the hit point {point:?} lies in the wrong cell of the checkerboard{}",
                        format_ray_bits(&ray)
                    )
                })
            },
        )
    };
    let outcome = [1e3, 1e4, 1e5, 1e6, 1e7]
        .map(at)
        .into_iter()
        .reduce(CaseOutcome::merge)
        .expect("the list of distances is not empty");
    vec![create_treeless_measurement::<R>(outcome)]
}
