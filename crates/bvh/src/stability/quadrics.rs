//! Cases P13, P15 and P17: rays for which the leading coefficient of a quadric vanishes, ellipsoids
//! of extreme shape, and a torus that is far away.

use glam::{DVec2, Vec3Swizzles};

use super::prelude::*;
use super::shapes::find_closest_approach;

/// A quadric with rays for which its leading coefficient vanishes: the cone with radius 3 and
/// height 4, with its tip up, or the hyperboloid a = c = 1, from y = -1.5 to 1.5.
struct VanishingQuadric {
    name: &'static str,
    /// A generator of the cone, or an asymptote of the hyperboloid. The direction is exact in f32,
    /// also with a changed component.
    generator: DVec3,
    /// Height of the point of symmetry of the quadratic form: the tip, or the centre.
    middle: f64,
    /// Factors of the squared distance from the axis and of the squared height, and the constant, in
    /// the quadratic form.
    form: [f64; 3],
    /// Heights, from the point of symmetry, between which hits are certain, and between which points
    /// are drawn.
    clip: [[f64; 2]; 2],
    /// Height of a cap, from the point of symmetry; NaN for none.
    cap: f64,
}

const VANISHING_QUADRICS: [VanishingQuadric; 2] = [
    VanishingQuadric {
        name: "cone",
        generator: DVec3::new(3.0, 4.0, 0.0),
        middle: 4.0,
        form: [16.0, 9.0, 0.0],
        clip: [[-3.9, -0.1], [-3.8, -0.2]],
        cap: -4.0,
    },
    VanishingQuadric {
        name: "hyperboloid",
        generator: DVec3::new(1.0, 1.0, 0.0),
        middle: 0.0,
        form: [1.0, 1.0, 1.0],
        clip: [[-1.45, 1.45], [-1.4, 1.4]],
        cap: f64::NAN,
    },
];

impl VanishingQuadric {
    /// Draws a point of the surface away from the generator.
    fn sample_point(&self, rng: &mut CaseRng) -> DVec3 {
        let ([out, up, constant], [low, high]) = (self.form, self.clip[1]);
        let height = rng.next_uniform(low, high);
        let (sin, cos) = rng.next_uniform(1.0, 5.3).sin_cos();
        let radius = ((up * height * height + constant) / out).sqrt();
        DVec3::new(cos * radius, self.middle + height, sin * radius)
    }

    /// Returns the distance of the near root along a ray, in lengths of the direction `d`, in f64.
    /// `None` for a root that is not the ray's first hit of the shape, or that is too uncertain: on
    /// a tangent, close to the rim or close to the origin `o`.
    fn near_root(&self, o: DVec3, d: DVec3) -> Option<f64> {
        let ([out, up, constant], f) = (self.form, o - DVec3::Y * self.middle);
        let form = |a: DVec3, b: DVec3| out * (a.x * b.x + a.z * b.z) - up * a.y * b.y;
        let (a, b, c) = (form(d, d), form(d, f), form(f, f) - constant);
        let discriminant = b * b - a * c;
        if discriminant < 1e-3 * b * b {
            return None;
        }
        let q = -(b + discriminant.sqrt().copysign(b));
        // The root q/a is infinite for a = 0.
        let mut roots = [c / q, q / a];
        roots.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let ([near, far], [low, high]) = (roots, self.clip[0]);
        let y = f.y + d.y * near;
        // An earlier root or a cap would be another hit.
        let is_hidden = [far, (self.cap - f.y) / d.y]
            .iter()
            .any(|&t| 0.0 < t && t < near);
        (near >= 0.1 && low <= y && y <= high && !is_hidden).then_some(near)
    }

    /// Returns the shape in the stored scalar.
    fn to_shape<R: Real>(&self) -> AnyShape<R> {
        if self.cap.is_nan() {
            return Hyperboloid::new(DVec3::ZERO, 1.0, 1.0, 1.5).into();
        }
        Cone::new(DVec3::ZERO, DVec3::Y, 3.0, 0.0, self.middle).into()
    }
}

/// Judges a hit distance.
fn judge_distance(hit: Option<FormulaHit>, expected: f64, bound: f64) -> Verdict {
    let error = hit.map_or(f64::INFINITY, |hit| (hit.t - expected).abs());
    within(error, bound, || {
        format!("{hit:?} instead of one at the distance {expected}, error")
    })
}

/// Semi-axes k of the ellipsoids, beside two semi-axes of 1.
pub const EXTREME_SEMI_AXES: [f64; 4] = [1e-3, 1e-2, 1e2, 1e3];

/// Draws a ray towards an ellipsoid around the origin with the semi-axes `semi`, from a distance of
/// ten times the greatest. It is aimed at a random point of the ellipsoid's outline, scaled by 0.98.
/// Returns it with the distance of the hit in lengths of its direction, computed in f64 in the space
/// where the ellipsoid is the unit sphere; `None` for a miss.
pub fn draw_ray_to_ellipsoid(rng: &mut CaseRng, semi: DVec3) -> Option<(Ray<f64>, f64)> {
    let o = round_to_f32(rng.sample_direction() * (10.0 * semi.max_element()));
    // The outline is the unit disc perpendicular to the ray, in the space where the ellipsoid is
    // the unit sphere.
    let across = rng.sample_offset_in_disc((o / semi).normalize(), 0.98) * semi;
    let d = round_to_f32((across - o).normalize());
    let unit = Ray::new(o / semi, d / semi);
    let [enters, _] = find_closest_approach(&unit, DVec3::ZERO, 1.0).1?;
    Some((
        create_unnormalised_ray(o, d),
        enters / unit.direction.length(),
    ))
}

/// Computes the signed distance of a point from the torus with major radius 1 around the y axis and
/// tube radius `tube`, negative inside.
fn distance_to_tube(p: DVec3, tube: f64) -> f64 {
    DVec2::new(p.xz().length() - 1.0, p.y).length() - tube
}

/// Finds the first crossing of a ray with the torus by sphere tracing, starting at the bounding
/// sphere. No step can jump over the tube. Returns the distance of the crossing, and the least
/// distance from the torus along the ray.
fn trace_distance_field(o: DVec3, d: DVec3, tube: f64) -> (Option<f64>, f64) {
    let middle = -o.dot(d);
    let near = o + d * middle;
    let room = (1.0 + tube) * (1.0 + tube) - near.length_squared();
    if room < 0.0 {
        return (None, f64::INFINITY);
    }
    let (mut s, end, mut minimum) = (-room.sqrt(), room.sqrt(), f64::INFINITY);
    for _ in 0..5000 {
        let free = distance_to_tube(near + d * s, tube);
        minimum = minimum.min(free);
        if free < 1e-12 {
            break;
        }
        s += free;
        if s > end {
            return (None, minimum);
        }
    }
    (Some(middle + s), minimum)
}

/// Judges a hit of a torus by a ray.
fn judge_torus_hit<R: Real>(hit: Option<FormulaHit>, ray: &Ray<f64>, tube: f64) -> Verdict {
    let length = ray.direction.length();
    let (expected, minimum) = trace_distance_field(ray.origin, ray.direction / length, tube);
    match (hit, expected) {
        (None, None) => Verdict::Right(0.0),
        // A ray that grazes the tube within the precision of f64 is undecidable.
        (None, Some(t)) if distance_to_tube(ray.at((t + 1e-7) / length), tube) > -1e-11 => {
            Verdict::Undecidable
        }
        (Some(_), None) if minimum < 1e-11 => Verdict::Undecidable,
        (Some(hit), Some(t)) => {
            let off = distance_to_tube(hit.on_ray, tube).abs() / tube;
            // The hit must lie on the tube, and at the first crossing: the distance between two
            // crossings far exceeds rounding.
            let late = (hit.t * length - t).abs() / tube;
            let bound = bound_in::<R>(if tube < 0.05 { 1e-2 } else { 1e-3 });
            within(off, bound, || "distance of the hit point from the torus")
                & require(late < 0.3, || "hit after the first crossing")
        }
        _ => require(false, || {
            format!("{hit:?} where the torus is at {expected:?}, passed at {minimum:e}")
        }),
    }
}

/// Cases of quadrics and tori.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Rays along, or nearly along, a generator of a cone or an asymptote of a hyperboloid, with
        // two components of the direction changed. The near root has a relative error of at most
        // 1e-5.
        ("P13", |trial| {
            for quadric in &VANISHING_QUADRICS {
                for deviation in [1e-1, 1e-3, 1e-5, 1e-7, 0.0] {
                    let part = format!("{} {deviation:e}", quadric.name);
                    trial.judge(&part, (23, 200_000), BOTH, |rng, formula| {
                        let deviation = DVec3::new(-deviation, deviation, 0.0) * rng.next_sign();
                        let d = round_to_f32(quadric.generator + deviation);
                        let o = round_to_f32(
                            quadric.sample_point(rng) - d * rng.next_uniform(0.5, 3.0),
                        );
                        let Some(near) = quadric.near_root(o, d) else {
                            return Verdict::Skipped;
                        };
                        let hit =
                            formula.intersect(quadric.to_shape(), create_unnormalised_ray(o, d));
                        judge_distance(hit, near, 1e-5 * near)
                    });
                }
            }
        }),
        // Hits of flat and of needle-like ellipsoids. The distance is right within a thousandth of
        // the least semi-axis, that of the textbook within a hundredth.
        ("P15", |trial| {
            for k in EXTREME_SEMI_AXES {
                let semi = round_to_f32(DVec3::new(1.0, 1.0, k));
                let rays = (25 + k.to_bits() % 97, 200_000);
                trial.judge(&format!("k = {k:e}"), rays, BOTH, |rng, formula| {
                    let Some((ray, t)) = draw_ray_to_ellipsoid(rng, semi) else {
                        return Verdict::Skipped;
                    };
                    let hit = formula.intersect(Ellipsoid::new(DVec3::ZERO, semi), ray);
                    let bound = bound_in::<R>(if formula.is_textbook { 1e-2 } else { 1e-3 });
                    judge_distance(hit, t, bound * semi.min_element())
                });
            }
        }),
        // Tori with three tube radii, by rays from 3 to 1000 major radii away, spread over the
        // bounding sphere. A miss of the torus is wrong, and so is a false hit. A hit point is wrong
        // if its distance from the surface exceeds a thousandth of the tube radius, for a tube
        // radius below 0.05 a hundredth, or if it is not at the first crossing.
        ("P17", |trial| {
            for tube in [0.3_f32, 0.1, 0.01] {
                for far in [3.0, 10.0, 100.0, 1000.0] {
                    let (part, tube) = (format!("tube {tube} at {far:e}"), f64::from(tube));
                    trial.judge(&part, (30 + far as u64, 40_000), BOTH, |rng, formula| {
                        // Half of the rays are parallel to the torus's plane, along which the tube's
                        // top is grazed.
                        let flat = DVec3::new(1.0, rng.choose(&[0.0, 1.0]), 1.0);
                        let out = (rng.sample_direction() * flat).normalize();
                        // Half of the rays are aimed at the tube itself.
                        let target = if rng.next_sign() > 0.0 {
                            let ring = rng.sample_offset_in_disc(DVec3::Y, 1.0).normalize();
                            ring + rng.sample_offset_in_disc(out, 1.2 * tube)
                        } else {
                            rng.sample_offset_in_disc(out, 1.0 + tube)
                        };
                        let ray = create_ray_towards(out * far, target);
                        let hit =
                            formula.intersect(Torus::new(DVec3::ZERO, DVec3::Y, 1.0, tube), ray);
                        judge_torus_hit::<R>(hit, &ray, tube)
                    });
                }
            }
        }),
    ]
}
