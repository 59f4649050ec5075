//! Cases P07 and P08: planes at grazing angles, and hit points far from the origin.

use super::prelude::*;

/// Judges case P07: the hit distance of a plane, for rays whose slopes against the plane are from
/// 1e-2 down to 1e-7.
pub(super) fn grazing_planes<R: Real>(trial: &mut Trial<R>) {
    trial.judge_shapes("", (7, 400_000), false, |rng| {
        let (n, point) = if rng.next_sign() > 0.0 {
            (DVec3::Y, DVec3::ZERO)
        } else {
            let normal = round_to_f32(rng.sample_direction());
            (normal, round_to_f32(rng.sample_point_in_cube()))
        };
        let slope = rng.choose(&[1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7]) * rng.next_uniform(0.5, 2.0);
        let along = rng.sample_offset_in_disc(n, 1.0).normalize();
        let ray = create_unnormalised_ray::<R>(
            round_to_f32(point + n),
            round_to_f32((along - n * slope).normalize()),
        );
        let height = n.dot(ray.origin.to_f64() - point);
        let fall = -n.dot(ray.direction.to_f64());
        let judge = move |hit: Option<FormulaHit>| {
            let Some(hit) = hit.filter(|_| fall > 0.0) else {
                return Verdict::from_condition(
                    hit.is_some() == (fall > 0.0),
                    || "hit of a plane behind the ray's origin, or miss of one before it",
                );
            };
            let error = (hit.t * fall / height - 1.0).abs();
            Verdict::from_error(
                error,
                4.0 * UNIT_ROUNDOFF / fall,
                || "relative error of the hit distance",
            )
            .and_then(|| {
                Verdict::from_condition(
                    hit.point.is_finite(),
                    || "surface point that is not finite",
                )
            })
        };
        let plane = Plane::new(to_scalar::<R>(point), to_scalar::<R>(n));
        Ok((plane.into(), ray, judge))
    });
}

/// Judges case P08: the cell of a checkerboard plane in which a hit point lies, at distances from
/// 10³ to 10⁷ metres.
pub(super) fn distant_checkerboard<R: Real>(trial: &mut Trial<R>) {
    for far in [1e3, 1e4, 1e5, 1e6, 1e7] {
        // The cell size, for which about one ray in a thousand hits close to the border of a cell.
        let cell = 2_f64.powf((far / 128.0_f64).log2().ceil());
        let part = format!("{far:e}");
        trial.judge_shapes(&part, (8 + far as u64, 100_000), false, |rng| {
            let target = DVec3::new(
                rng.next_uniform(-far, far),
                0.0,
                rng.next_uniform(-far, far),
            );
            let from = rng.sample_point_in_cube() * (0.3 * far) + DVec3::Y * (0.31 * far);
            let origin = round_to_f32(target + from);
            let d = round_to_f32((target - origin).normalize());
            let expected = origin - d * (origin.y / d.y);
            let judge = move |hit: Option<FormulaHit>| {
                let Some(FormulaHit { point, .. }) = hit else {
                    return Verdict::Wrong("miss of a plane that the ray reaches".to_owned());
                };
                let greatest = point.abs().max(expected.abs()).max(origin.abs());
                let margin = 4.0 * ulp(greatest.max_element());
                let border = |x: f64| ((x / cell - (x / cell).round()) * cell).abs() <= margin;
                if border(expected.x) || border(expected.z) {
                    return Verdict::Undecidable;
                }
                let parity =
                    |p: DVec3| ((p.x / cell).floor() + (p.z / cell).floor()).rem_euclid(2.0);
                Verdict::from_condition(parity(point) == parity(expected), || {
                    format!("hit point {point:?} in a wrong cell of the checkerboard")
                })
            };
            let plane = Plane::new(to_scalar::<R>(DVec3::ZERO), to_scalar::<R>(DVec3::Y));
            Ok((plane.into(), create_unnormalised_ray::<R>(origin, d), judge))
        });
    }
}
