//! Cases P13 and P15: rays for which the leading coefficient of a quadric vanishes, and ellipsoids
//! of extreme shape.

use crate::shapes::{Cone, Ellipsoid, Hyperboloid};
use crate::{Real, Vector};
use glam::DVec3;

use super::IntersectFunction;
use super::verdicts::{
    CaseOutcome, RayCount, Verdict, format_ray_bits, judge_rays, round_to_f32, to_scalar,
    unnormalised_ray,
};

/// Judges the near root of a quadric whose leading coefficient nearly vanishes, by its relative
/// error, which may be at most `bound`. `case` is `cone` or `hyperboloid`. The rays are parallel to
/// a generator of the cone or an asymptote of the hyperboloid, except that two components of the
/// direction are changed by `deviation`.
pub fn judge_near_root_of_quadric<R: Real>(
    case: &str,
    deviation: f64,
    bound: f64,
    rays: RayCount,
    intersect: IntersectFunction<R>,
) -> CaseOutcome {
    judge_rays(
        &format!("P13 {case} {deviation:e}"),
        23,
        200_000,
        rays,
        |rng| {
            let cone = case == "cone";
            // The generator of a cone with radius 3 and height 4, and an asymptote of the
            // hyperboloid a = c = 1. Both directions are exact in f32, also with a changed
            // component.
            let generator = if cone {
                DVec3::new(3.0, 4.0, 0.0)
            } else {
                DVec3::new(1.0, 1.0, 0.0)
            };
            let (d, tip) = (
                round_to_f32(generator + DVec3::new(-deviation, deviation, 0.0) * rng.next_sign()),
                DVec3::new(0.0, 4.0, 0.0),
            );
            let target = if cone {
                let (low, angle) = (rng.next_uniform(0.05, 0.95), rng.next_uniform(1.0, 5.3));
                tip - DVec3::Y * (4.0 * low)
                    + DVec3::new(angle.cos(), 0.0, angle.sin()) * (3.0 * low)
            } else {
                let (y, angle) = (rng.next_uniform(-1.4, 1.4), rng.next_uniform(1.0, 5.3));
                DVec3::new(angle.cos(), 0.0, angle.sin()) * (1.0 + y * y).sqrt() + DVec3::Y * y
            };
            let origin = round_to_f32(target - d * rng.next_uniform(0.5, 3.0));
            let ray = unnormalised_ray::<R>(origin, d);
            let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
            // The quadratic form of the shape, in f64; negative inside.
            let form = |a: DVec3, b: DVec3| {
                if cone {
                    16.0 * (a.x * b.x + a.z * b.z) - 9.0 * a.y * b.y
                } else {
                    a.x * b.x + a.z * b.z - a.y * b.y
                }
            };
            let f = if cone { o - tip } else { o };
            let (a, b, c) = (
                form(d, d),
                form(d, f),
                form(f, f) - if cone { 0.0 } else { 1.0 },
            );
            let discriminant = b * b - a * c;
            if discriminant < 1e-3 * b * b {
                return Verdict::Skipped;
            }
            let q = -(b + discriminant.sqrt().copysign(b));
            let near = if (c / q).abs() < (q / a).abs() || a == 0.0 {
                c / q
            } else {
                q / a
            };
            let y = f.y + d.y * near;
            let clip = if cone { -3.9..=-0.1 } else { -1.45..=1.45 };
            if near < 0.1 || !clip.contains(&y) {
                return Verdict::Skipped;
            }
            // An earlier root or a cap would be another hit.
            let far = if a == 0.0 {
                f64::INFINITY
            } else if (c / q).abs() < (q / a).abs() {
                q / a
            } else {
                c / q
            };
            let cap = if cone { (-4.0 - f.y) / d.y } else { -1.0 };
            if (far > 0.0 && far < near) || (cap > 0.0 && cap < near) {
                return Verdict::Skipped;
            }
            let got = if cone {
                let tip_cone = Cone::<R> {
                    base: to_scalar::<R>(DVec3::ZERO),
                    axis: to_scalar::<R>(tip),
                    radius: R::from_f64(3.0),
                    top_radius: R::ZERO,
                };
                intersect(&tip_cone.into(), &ray)
            } else {
                let one = R::ONE;
                let sheet = Hyperboloid::<R> {
                    centre: to_scalar::<R>(DVec3::ZERO),
                    waist: one,
                    slope: one,
                    half_height: R::from_f64(1.5),
                };
                intersect(&sheet.into(), &ray)
            };
            match got {
                None => Verdict::Wrong(format!(
                    "the ray misses the shape, which it hits at distance {near}{}",
                    format_ray_bits::<R>(&ray)
                )),
                Some(t) => {
                    let error = (t.to_f64() - near).abs() / near;
                    Verdict::from_error(error, bound, || {
                        format!(
                            "hit distance {t:?} instead of {near}{}",
                            format_ray_bits::<R>(&ray)
                        )
                    })
                }
            }
        },
    )
}

/// Computes the distance and the point of the hit of an ellipsoid around the origin, in f64, in the
/// space where the ellipsoid is the unit sphere. `s` holds the semi-axes, `o` and `d` the ray.
pub fn intersect_ellipsoid_in_f64(o: DVec3, d: DVec3, s: DVec3) -> Option<(f64, DVec3)> {
    let (f, e) = (o / s, d / s);
    let middle = -f.dot(e) / e.length_squared();
    let l = f + e * middle;
    let half = (1.0 - l.length_squared()) / e.length_squared();
    (half >= 0.0).then(|| (middle - half.sqrt(), o + d * (middle - half.sqrt())))
}

/// Judges rays at an ellipsoid with the semi-axes 1, 1 and `k`, from a distance of ten times the
/// greatest semi-axis. The rays are aimed at random points within the ellipsoid's outline, scaled
/// by `share`. `f` judges a ray from the semi-axes, the shape, the origin and the direction.
pub fn judge_extreme_ellipsoid<R: Real>(
    k: f64,
    share: f64,
    rays: RayCount,
    f: impl Fn(DVec3, &Ellipsoid<R>, DVec3, DVec3) -> Verdict + Sync,
) -> CaseOutcome {
    let semi = round_to_f32(DVec3::new(1.0, 1.0, k));
    let shape = Ellipsoid::<R> {
        centre: to_scalar::<R>(DVec3::ZERO),
        semi_axes: to_scalar::<R>(semi),
    };
    judge_rays(
        &format!("k = {k:e}"),
        25 + k.to_bits() % 97,
        200_000,
        rays,
        |rng| {
            let out = rng.sample_direction();
            let origin = round_to_f32(out * (10.0 * semi.max_element()));
            // The outline is the unit disc perpendicular to the ray, in the space where the
            // ellipsoid is the unit sphere.
            let across = rng.sample_disc((origin / semi).normalize(), share) * semi;
            let d = round_to_f32((across - origin).normalize());
            f(semi, &shape, origin, d)
        },
    )
}

/// Judges hit distances for the rays of [`judge_extreme_ellipsoid`]. Wrong are misses, and errors
/// above the fraction `bound` of the least semi-axis.
pub fn judge_extreme_distance<R: Real>(
    k: f64,
    bound: f64,
    rays: RayCount,
    intersect: IntersectFunction<R>,
) -> CaseOutcome {
    judge_extreme_ellipsoid::<R>(k, 0.98, rays, |semi, shape, o, d| {
        let ray = unnormalised_ray::<R>(o, d);
        let Some((t, _)) = intersect_ellipsoid_in_f64(o, d, semi) else {
            return Verdict::Skipped;
        };
        match intersect(&(*shape).into(), &ray) {
            None => Verdict::Wrong(format!(
                "the ray misses the ellipsoid, which it hits{}",
                format_ray_bits::<R>(&ray)
            )),
            Some(found) => {
                let error = (found.to_f64() - t).abs() / semi.min_element();
                Verdict::from_error(error, bound, || {
                    format!(
                        "hit distance {found:?} instead of {t}{}",
                        format_ray_bits::<R>(&ray)
                    )
                })
            }
        }
    })
}
