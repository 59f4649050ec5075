//! P01, P02: distant spheres, and their surface points.

use crate::shapes::Sphere;
use crate::{PreparedRay, Ray, Real, Shape, Surface, Vector};
use glam::DVec3;

use super::Intersect;
use super::judge::{
    Outcome, RayCount, Verdict, exact, hex, hit, judge, ray_towards, to_scalar, ulp,
};

/// The surface where a ray hits a sphere, by some arithmetic.
pub type Surfaces<R> = fn(&Sphere<R>, &Ray<R>) -> Option<Surface<R>>;

/// The library's surface.
pub fn surface<R: Real>(sphere: &Sphere<R>, ray: &Ray<R>) -> Option<Surface<R>> {
    hit::<R>(sphere, ray).map(|hit| sphere.surface(&PreparedRay::new(*ray), hit))
}

/// Relation of an exact ray's line to a sphere, computed in f64 from the perpendicular.
#[derive(Clone, Copy, Debug)]
pub struct ClosestApproach {
    /// Distance of the line from the centre.
    pub distance: f64,
    /// True distances along the ray of both crossings; `None` for a miss.
    pub roots: Option<[f64; 2]>,
}

/// Relation of an exact ray's line to a sphere.
pub fn pass(o: DVec3, d: DVec3, centre: DVec3, radius: f64) -> ClosestApproach {
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

/// A sphere rounded to the stored scalar.
pub fn sphere<R: Real>(centre: DVec3, radius: f64) -> Sphere<R> {
    Sphere {
        centre: to_scalar::<R>(centre),
        radius: R::from_f64(radius),
    }
}

/// Rays over a disc of 1.05 radii from `ratio` radii away. Wrong are points off the surface by more
/// than `bound` of u·(D + C), with u the roundoff of the stored scalar, and hits or misses that
/// contradict the oracle beyond its margin.
pub fn far_sphere<R: Real>(
    ratio: f64,
    bound: f64,
    rays: RayCount,
    intersect: Intersect<R>,
) -> Outcome {
    judge(
        &format!("P01 {ratio:e}"),
        1 + ratio as u64,
        200_000,
        rays,
        |rng| {
            let out = rng.direction();
            let ray = ray_towards::<R>(out * ratio, rng.in_disc(out, 1.05));
            let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
            let expected = pass(o, d, DVec3::ZERO, 1.0);
            // The specification allows 8·u·(D + C), which far away is the whole sphere. The margin
            // here is stricter: the error of b² − c in an f64 core, or for f64 storage some
            // roundings of the oracle itself.
            let roundoff = R::ROUNDOFF.to_f64();
            let margin = if roundoff < 1e-10 {
                16.0 * roundoff * ratio
            } else {
                (ratio * ratio * f64::EPSILON).max(1e-12)
            };
            if (expected.distance - 1.0).abs() <= margin {
                return Verdict::Band;
            }
            match intersect(&sphere::<R>(DVec3::ZERO, 1.0).into(), &ray) {
                None => Verdict::holds(expected.roots.is_none(), || {
                    format!("missed at {}{}", expected.distance, hex::<R>(&ray))
                }),
                Some(_) if expected.roots.is_none() => Verdict::Wrong(format!(
                    "false hit at {}{}",
                    expected.distance,
                    hex::<R>(&ray)
                )),
                Some(t) => {
                    let p = o + d * t.to_f64();
                    let scale = o.length() + o.abs().max_element().max(p.abs().max_element());
                    Verdict::within_bound(
                        (p.length() - 1.0).abs(),
                        bound * roundoff * scale,
                        || format!("off the surface{}", hex::<R>(&ray)),
                    )
                }
            }
        },
    )
}

/// Surface points from 2 to 1e6 radii away, around the origin and far from it.
pub fn drift<R: Real>(offset: f64, ratio: f64, rays: RayCount, surface: Surfaces<R>) -> Outcome {
    judge(
        &format!("P02 at {offset:e}, {ratio:e} away"),
        2 + ratio as u64,
        50_000,
        rays,
        |rng| {
            let centre = exact(rng.direction() * offset);
            let out = rng.direction();
            let ray = ray_towards::<R>(centre + out * ratio, centre + rng.in_disc(out, 0.98));
            let Some(surface) = surface(&sphere::<R>(centre, 1.0), &ray) else {
                return Verdict::Skip;
            };
            let p = surface.point.to_f64();
            let from = p - centre;
            let nearest = centre + from / from.length();
            let scale = p.abs().max_element().max(centre.abs().max_element());
            let error = (p - nearest).abs().max_element();
            Verdict::within_bound(error, 4.0 * ulp(scale), || {
                format!("off the surface{}", hex::<R>(&ray))
            })
            // The stated error bound holds: the point is off along the normal by at most the reach
            // of the error box.
            .and(|| {
                let off = (from.length() - 1.0).abs();
                let reach = surface.error.to_f64() * surface.normal.to_f64().abs().element_sum();
                Verdict::within_bound(off, reach, || {
                    format!("beyond the stated bound{}", hex::<R>(&ray))
                })
            })
        },
    )
}
