//! Cases P01 and P02: distant spheres, and the surface points on them.

use crate::shapes::Sphere;
use crate::{PreparedRay, Ray, Real, Shape, Surface, Vector};
use glam::DVec3;

use super::IntersectFunction;
use super::verdicts::{
    CaseOutcome, RayCount, Verdict, create_ray_towards, format_ray_bits, judge_rays, nearest_hit,
    round_to_f32, to_scalar, ulp,
};

/// Surface function under test: returns the surface where a ray hits a sphere; `None` for a miss.
pub type SurfaceFunction<R> = fn(&Sphere<R>, &Ray<R>) -> Option<Surface<R>>;

/// Returns the surface where a ray hits a sphere, computed by the library; `None` for a miss. It is
/// the [`SurfaceFunction`] that is compared with the textbook formula.
pub fn eval_library_surface<R: Real>(sphere: &Sphere<R>, ray: &Ray<R>) -> Option<Surface<R>> {
    nearest_hit::<R>(sphere, ray).map(|hit| sphere.surface(&PreparedRay::new(*ray), hit))
}

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

/// Judges the hits and misses of a distant unit sphere, as `intersect` returns them. The rays start
/// `ratio` radii away and aim at a disc of 1.05 radii around the centre. A result is wrong in two
/// cases:
///
/// - It contradicts the oracle by more than the oracle's margin.
/// - The hit point is off the surface by more than `bound` · u · (D + C).
///
/// Here u is the roundoff of the stored scalar, D the distance of the ray's origin from the centre,
/// and C the greatest coordinate.
pub fn judge_far_sphere<R: Real>(
    ratio: f64,
    bound: f64,
    rays: RayCount,
    intersect: IntersectFunction<R>,
) -> CaseOutcome {
    judge_rays(
        &format!("P01 {ratio:e}"),
        1 + ratio as u64,
        200_000,
        rays,
        |rng| {
            let out = rng.sample_direction();
            let ray = create_ray_towards::<R>(out * ratio, rng.sample_offset_in_disc(out, 1.05));
            let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
            let expected = find_closest_approach(o, d, DVec3::ZERO, 1.0);
            // The specification of the case allows 8·u·(D + C), which far away is the whole sphere.
            // The margin here is stricter: for f32 storage the error of b² − c in f64 arithmetic,
            // and for f64 storage some roundings of the oracle itself.
            let roundoff = R::ROUNDOFF.to_f64();
            let margin = if roundoff < 1e-10 {
                16.0 * roundoff * ratio
            } else {
                (ratio * ratio * f64::EPSILON).max(1e-12)
            };
            if (expected.distance - 1.0).abs() <= margin {
                return Verdict::Undecidable;
            }
            match intersect(&build_sphere::<R>(DVec3::ZERO, 1.0).into(), &ray) {
                None => Verdict::from_condition(expected.roots.is_none(), || {
                    format!(
                        "no hit is found, although the ray passes the centre of the unit sphere at distance {}{}",
                        expected.distance,
                        format_ray_bits::<R>(&ray)
                    )
                }),
                Some(_) if expected.roots.is_none() => Verdict::Wrong(format!(
                    "a hit is found, although the ray passes the centre of the unit sphere at distance {}{}",
                    expected.distance,
                    format_ray_bits::<R>(&ray)
                )),
                Some(t) => {
                    let p = o + d * t.to_f64();
                    let scale = o.length() + o.abs().max_element().max(p.abs().max_element());
                    Verdict::from_error((p.length() - 1.0).abs(), bound * roundoff * scale, || {
                        format!(
                            "distance of the hit point from the sphere's surface{}",
                            format_ray_bits::<R>(&ray)
                        )
                    })
                }
            }
        },
    )
}

/// Judges the surface points of a unit sphere whose centre is at distance `offset` from the origin.
/// The rays start `ratio` radii away. A point is right if it is off the sphere by at most four ulps
/// of the coordinates, and within the error bound that the surface states.
pub fn judge_surface_point<R: Real>(
    offset: f64,
    ratio: f64,
    rays: RayCount,
    surface: SurfaceFunction<R>,
) -> CaseOutcome {
    judge_rays(
        &format!("P02 at {offset:e}, {ratio:e} away"),
        2 + ratio as u64,
        50_000,
        rays,
        |rng| {
            let centre = round_to_f32(rng.sample_direction() * offset);
            let out = rng.sample_direction();
            let ray = create_ray_towards::<R>(
                centre + out * ratio,
                centre + rng.sample_offset_in_disc(out, 0.98),
            );
            let Some(surface) = surface(&build_sphere::<R>(centre, 1.0), &ray) else {
                return Verdict::Skipped;
            };
            let p = surface.point.to_f64();
            let from = p - centre;
            let nearest = centre + from / from.length();
            let scale = p.abs().max_element().max(centre.abs().max_element());
            let error = (p - nearest).abs().max_element();
            Verdict::from_error(error, 4.0 * ulp(scale), || {
                format!("distance of the hit point from the sphere's surface{}", format_ray_bits::<R>(&ray))
            })
            // The stated error bound must hold: the point is off the sphere, along the normal, by
            // at most the extent of the error box.
            .and_then(|| {
                let off = (from.length() - 1.0).abs();
                let reach = surface.error.to_f64() * surface.normal.to_f64().abs().element_sum();
                Verdict::from_error(off, reach, || {
                    format!("distance of the surface point from the sphere, compared with the point's own error bound{}", format_ray_bits::<R>(&ray))
                })
            })
        },
    )
}
