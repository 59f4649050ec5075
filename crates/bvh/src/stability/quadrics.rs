//! Cases P13 and P15: rays for which the leading coefficient of a quadric vanishes, and ellipsoids
//! of extreme shape.

use crate::shapes::{AnyShape, Cone, Ellipsoid, Hyperboloid};
use crate::{Real, Vector};
use glam::DVec3;

use super::IntersectFunction;
use super::verdicts::{
    CaseOutcome, CaseRng, RayCount, Verdict, create_unnormalised_ray, format_ray_bits, judge_rays,
    round_to_f32, to_scalar,
};

/// A quadric with rays for which its leading coefficient vanishes.
#[derive(Clone, Copy, PartialEq)]
enum VanishingQuadric {
    /// The cone with radius 3 and height 4, with its tip up.
    Cone,
    /// The hyperboloid a = c = 1, from y = -1.5 to 1.5.
    Hyperboloid,
}

impl VanishingQuadric {
    /// Returns a generator of the cone, or an asymptote of the hyperboloid. The direction is exact
    /// in f32, also with a changed component.
    fn generator(self) -> DVec3 {
        match self {
            Self::Cone => DVec3::new(3.0, 4.0, 0.0),
            Self::Hyperboloid => DVec3::new(1.0, 1.0, 0.0),
        }
    }

    /// Returns the point of symmetry of the quadratic form: the tip, or the centre.
    fn symmetry_point(self) -> DVec3 {
        match self {
            Self::Cone => DVec3::new(0.0, 4.0, 0.0),
            Self::Hyperboloid => DVec3::ZERO,
        }
    }

    /// Draws a point of the surface away from the generator.
    fn sample_point(self, rng: &mut CaseRng) -> DVec3 {
        match self {
            Self::Cone => {
                let (low, angle) = (rng.next_uniform(0.05, 0.95), rng.next_uniform(1.0, 5.3));
                self.symmetry_point() - DVec3::Y * (4.0 * low)
                    + DVec3::new(angle.cos(), 0.0, angle.sin()) * (3.0 * low)
            }
            Self::Hyperboloid => {
                let (y, angle) = (rng.next_uniform(-1.4, 1.4), rng.next_uniform(1.0, 5.3));
                DVec3::new(angle.cos(), 0.0, angle.sin()) * (1.0 + y * y).sqrt() + DVec3::Y * y
            }
        }
    }

    /// Returns the quadratic form of the shape for two vectors from the point of symmetry, in f64.
    fn form(self, a: DVec3, b: DVec3) -> f64 {
        match self {
            Self::Cone => 16.0 * (a.x * b.x + a.z * b.z) - 9.0 * a.y * b.y,
            Self::Hyperboloid => a.x * b.x + a.z * b.z - a.y * b.y,
        }
    }

    /// Returns the distance of the near root along a ray, in lengths of the direction `d`, in f64.
    /// `None` for a root that is not the ray's first hit of the shape, or that is too uncertain: on
    /// a tangent, close to the rim or close to the origin `o`.
    fn near_root(self, o: DVec3, d: DVec3) -> Option<f64> {
        let f = match self {
            Self::Cone => o - self.symmetry_point(),
            Self::Hyperboloid => o,
        };
        let constant = match self {
            Self::Cone => 0.0,
            Self::Hyperboloid => 1.0,
        };
        let (a, b, c) = (self.form(d, d), self.form(d, f), self.form(f, f) - constant);
        let discriminant = b * b - a * c;
        if discriminant < 1e-3 * b * b {
            return None;
        }
        let q = -(b + discriminant.sqrt().copysign(b));
        let is_last_near = (c / q).abs() < (q / a).abs();
        let near = if is_last_near || a == 0.0 {
            c / q
        } else {
            q / a
        };
        let y = f.y + d.y * near;
        let clip = match self {
            Self::Cone => -3.9..=-0.1,
            Self::Hyperboloid => -1.45..=1.45,
        };
        if near < 0.1 || !clip.contains(&y) {
            return None;
        }
        // An earlier root or a cap would be another hit.
        let far = if a == 0.0 {
            f64::INFINITY
        } else if is_last_near {
            q / a
        } else {
            c / q
        };
        let cap = match self {
            Self::Cone => (-4.0 - f.y) / d.y,
            Self::Hyperboloid => -1.0,
        };
        let is_hidden = far > 0.0 && far < near || cap > 0.0 && cap < near;
        (!is_hidden).then_some(near)
    }

    /// Returns the shape in the stored scalar.
    fn to_shape<R: Real>(self) -> AnyShape<R> {
        match self {
            Self::Cone => Cone::<R> {
                base: to_scalar::<R>(DVec3::ZERO),
                axis: to_scalar::<R>(self.symmetry_point()),
                radius: R::from_f64(3.0),
                top_radius: R::ZERO,
            }
            .into(),
            Self::Hyperboloid => Hyperboloid::<R> {
                centre: to_scalar::<R>(DVec3::ZERO),
                waist: R::ONE,
                slope: R::ONE,
                half_height: R::from_f64(1.5),
            }
            .into(),
        }
    }
}

/// Judges the near root of a quadric whose leading coefficient nearly vanishes, by its relative
/// error, which may be at most `bound`. `case` is `cone` or `hyperboloid`. The rays are
/// nearly parallel to a generator of the cone or to an asymptote of the hyperboloid: two components
/// of the direction are changed by `deviation`.
pub fn judge_near_root_of_quadric<R: Real>(
    case: &str,
    deviation: f64,
    bound: f64,
    rays: RayCount,
    intersect: IntersectFunction<R>,
) -> CaseOutcome {
    let quadric = if case == "cone" {
        VanishingQuadric::Cone
    } else {
        VanishingQuadric::Hyperboloid
    };
    judge_rays(
        &format!("P13 {case} {deviation:e}"),
        23,
        200_000,
        rays,
        |rng| {
            let deviation = DVec3::new(-deviation, deviation, 0.0) * rng.next_sign();
            let direction = round_to_f32(quadric.generator() + deviation);
            let target = quadric.sample_point(rng);
            let origin = round_to_f32(target - direction * rng.next_uniform(0.5, 3.0));
            let ray = create_unnormalised_ray::<R>(origin, direction);
            let Some(near) = quadric.near_root(ray.origin.to_f64(), ray.direction.to_f64()) else {
                return Verdict::Skipped;
            };
            match intersect(&quadric.to_shape(), &ray) {
                None => Verdict::Wrong(format!(
                    "no hit is found, although the ray hits the shape at distance {near}{}",
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

/// Returns the distance and the point of a ray's hit of an ellipsoid around the origin, in f64. The
/// computation is in the space where the ellipsoid is the unit sphere. `s` holds the semi-axes, `o`
/// and `d` are the ray's origin and direction.
pub fn intersect_ellipsoid_in_f64(o: DVec3, d: DVec3, s: DVec3) -> Option<(f64, DVec3)> {
    let (f, e) = (o / s, d / s);
    let middle = -f.dot(e) / e.length_squared();
    let l = f + e * middle;
    let half = (1.0 - l.length_squared()) / e.length_squared();
    (half >= 0.0).then(|| (middle - half.sqrt(), o + d * (middle - half.sqrt())))
}

/// Judges rays towards an ellipsoid with the semi-axes 1, 1 and `k`, from a distance of ten times
/// the greatest semi-axis. The rays are aimed at random points of the ellipsoid's outline, scaled
/// by `share`. The function `f` judges one ray. Its parameters are the semi-axes, the shape, the
/// ray's origin and the ray's direction.
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
            let across = rng.sample_offset_in_disc((origin / semi).normalize(), share) * semi;
            let d = round_to_f32((across - origin).normalize());
            f(semi, &shape, origin, d)
        },
    )
}

/// Judges the hit distances that `intersect` returns for the rays of [`judge_extreme_ellipsoid`]. A
/// miss is wrong. So is an error above `bound` times the least semi-axis.
pub fn judge_hit_distance_of_extreme_ellipsoid<R: Real>(
    k: f64,
    bound: f64,
    rays: RayCount,
    intersect: IntersectFunction<R>,
) -> CaseOutcome {
    judge_extreme_ellipsoid::<R>(k, 0.98, rays, |semi, shape, o, d| {
        let ray = create_unnormalised_ray::<R>(o, d);
        let Some((t, _)) = intersect_ellipsoid_in_f64(o, d, semi) else {
            return Verdict::Skipped;
        };
        match intersect(&(*shape).into(), &ray) {
            None => Verdict::Wrong(format!(
                "no hit is found, although the ray hits the ellipsoid{}",
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
