//! Cases P01 and P02: distant spheres, and the surface points on them.

use super::prelude::*;

/// Distances of the spheres from the rays' origins, in radii.
const RATIOS: [f64; 6] = [2.0, 1e2, 1e3, 1e4, 1e5, 1e6];

/// Distance of a ray's line from the centre of a sphere, and the distances along the ray at which
/// the line crosses the sphere. Both are computed in f64.
#[derive(Clone, Copy, Debug)]
pub struct ClosestApproach {
    /// Distance of the line from the centre.
    pub distance: f64,
    /// Distances along the ray at which the line enters and leaves the sphere; `None` for a miss.
    pub roots: Option<[f64; 2]>,
}

/// Computes the position of the line with origin `o` and direction `d` relative to a sphere.
pub fn find_closest_approach(o: DVec3, d: DVec3, centre: DVec3, radius: f64) -> ClosestApproach {
    let f = o - centre;
    let length = d.length();
    let middle = -f.dot(d) / d.length_squared();
    let distance = (f + d * middle).length();
    let half = ((radius - distance) * (radius + distance)).sqrt();
    ClosestApproach {
        distance,
        roots: (distance <= radius).then_some([middle * length - half, middle * length + half]),
    }
}

/// Creates a sphere whose centre and radius are rounded to the stored scalar.
pub fn build_sphere<R: Real>(centre: DVec3, radius: f64) -> Sphere<R> {
    Sphere {
        centre: to_scalar::<R>(centre),
        radius: R::from_f64(radius),
    }
}

/// Judges case P01: hits and misses of a unit sphere 2 to 10⁶ radii away, by rays that aim at a disc
/// of 1.05 radii around the centre. A result is wrong in two cases:
///
/// - It contradicts the oracle by more than the oracle's margin.
/// - The hit point is off the surface by more than 2u(D + C) in f32, 16u(D + C) in f64, and
///   8u(D + C) for the textbook.
///
/// Here u is the roundoff of the stored scalar, D the distance of the ray's origin from the centre,
/// and C the greatest coordinate.
pub(super) fn far_spheres<R: Real>(trial: &mut Trial<R>) {
    let roundoff = R::ROUNDOFF.to_f64();
    for ratio in RATIOS {
        // The specification of the case allows 8·u·(D + C), which far away is the whole sphere. The
        // margin here is stricter: for f32 storage the error of b² − c in f64 arithmetic, and for
        // f64 storage some roundings of the oracle itself.
        let margin = if R::IS_SINGLE {
            (ratio * ratio * f64::EPSILON).max(1e-12)
        } else {
            16.0 * roundoff * ratio
        };
        let part = format!("{ratio:e}");
        trial.judge_shapes(&part, (1 + ratio as u64, 200_000), true, |rng| {
            let out = rng.sample_direction();
            let target = rng.sample_offset_in_disc(out, 1.05);
            let ray = create_ray_towards::<R>(out * ratio, target);
            let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
            let ClosestApproach { distance, roots } = find_closest_approach(o, d, DVec3::ZERO, 1.0);
            if (distance - 1.0).abs() <= margin {
                return Err(Verdict::Undecidable);
            }
            let judge = move |hit: Option<FormulaHit>| {
                let Some(hit) = hit.filter(|_| roots.is_some()) else {
                    return Verdict::from_condition(hit.is_some() == roots.is_some(), || {
                        format!("the ray passes the centre of the unit sphere at distance {distance}, but finds {hit:?}")
                    });
                };
                let p = o + d * hit.t;
                let scale = o.length() + o.abs().max(p.abs()).max_element();
                let bound = match () {
                    () if hit.is_textbook() => 8.0,
                    () if R::IS_SINGLE => 2.0,
                    () => 16.0,
                };
                Verdict::from_error((p.length() - 1.0).abs(), bound * roundoff * scale, || {
                    "distance of the hit point from the sphere's surface"
                })
            };
            Ok((build_sphere(DVec3::ZERO, 1.0).into(), ray, judge))
        });
    }
}

/// Judges case P02: the surface points of unit spheres up to 10⁵ from the origin, by rays from 2 to
/// 10⁶ radii away. A point is right if it is off the sphere by at most four ulps of the coordinates,
/// and within the error bound that the surface states.
pub(super) fn surface_points<R: Real>(trial: &mut Trial<R>) {
    for (offset, ratio) in [0.0, 1e3, 1e5]
        .into_iter()
        .flat_map(|offset| RATIOS.map(|ratio| (offset, ratio)))
    {
        let part = format!("at {offset:e}, {ratio:e} away");
        trial.judge_shapes(&part, (2 + ratio as u64, 50_000), true, |rng| {
            let centre = round_to_f32(rng.sample_direction() * offset);
            let out = rng.sample_direction();
            let target = centre + rng.sample_offset_in_disc(out, 0.98);
            let ray = create_ray_towards::<R>(centre + out * ratio, target);
            let judge = move |hit: Option<FormulaHit>| {
                let Some(FormulaHit { point: p, normal, error, .. }) = hit else {
                    return Verdict::Skipped;
                };
                let from = p - centre;
                let off = (p - centre - from / from.length()).abs().max_element();
                let scale = p.abs().max(centre.abs()).max_element();
                Verdict::from_error(off, 4.0 * ulp(scale), || {
                    "distance of the surface point from the sphere along an axis"
                })
                // The stated error bound must hold: the point is off the sphere, along the normal,
                // by at most the extent of the error box.
                .and_then(|| {
                    let (off, reach) = ((from.length() - 1.0).abs(), normal.abs().element_sum());
                    Verdict::from_error(off, error * reach, || {
                        "distance of the surface point from the sphere, compared with the point's own error bound"
                    })
                })
            };
            Ok((build_sphere(centre, 1.0).into(), ray, judge))
        });
    }
}
