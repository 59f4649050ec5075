//! Cases P13 and P15: rays for which the leading coefficient of a quadric vanishes, and ellipsoids
//! of extreme shape.

use super::prelude::*;

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
    /// Heights, from the point of symmetry, between which hits are certain.
    clip: [f64; 2],
    /// Height of a cap, from the point of symmetry; NaN for none.
    cap: f64,
}

const VANISHING_QUADRICS: [VanishingQuadric; 2] = [
    VanishingQuadric {
        name: "cone",
        generator: DVec3::new(3.0, 4.0, 0.0),
        middle: 4.0,
        form: [16.0, 9.0, 0.0],
        clip: [-3.9, -0.1],
        cap: -4.0,
    },
    VanishingQuadric {
        name: "hyperboloid",
        generator: DVec3::new(1.0, 1.0, 0.0),
        middle: 0.0,
        form: [1.0, 1.0, 1.0],
        clip: [-1.45, 1.45],
        cap: f64::NAN,
    },
];

impl VanishingQuadric {
    /// Draws a point of the surface away from the generator.
    fn sample_point(&self, rng: &mut CaseRng) -> DVec3 {
        let [out, up, constant] = self.form;
        let height = if constant == 0.0 {
            -4.0 * rng.next_uniform(0.05, 0.95)
        } else {
            rng.next_uniform(-1.4, 1.4)
        };
        let angle = rng.next_uniform(1.0, 5.3);
        let radius = ((up * height * height + constant) / out).sqrt();
        DVec3::new(
            angle.cos() * radius,
            self.middle + height,
            angle.sin() * radius,
        )
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
        let [near, far] = if (c / q).abs() < (q / a).abs() {
            [c / q, q / a]
        } else {
            [q / a, c / q]
        };
        let y = f.y + d.y * near;
        let is_certain = near >= 0.1 && self.clip[0] <= y && y <= self.clip[1];
        // An earlier root or a cap would be another hit.
        let is_hidden = [far, (self.cap - f.y) / d.y]
            .iter()
            .any(|&t| 0.0 < t && t < near);
        (is_certain && !is_hidden).then_some(near)
    }

    /// Returns the shape in the stored scalar.
    fn to_shape<R: Real>(&self) -> AnyShape<R> {
        if self.cap.is_nan() {
            return Hyperboloid::new(DVec3::ZERO, 1.0, 1.0, 1.5).into();
        }
        Cone::new(DVec3::ZERO, DVec3::Y, 3.0, 0.0, self.middle).into()
    }
}

/// Judges case P13: rays along, or nearly along, a generator of a cone or an asymptote of a
/// hyperboloid, with two components of the direction changed. The near root has a relative error of
/// at most 1e-5.
pub(super) fn vanishing_coefficients<R: Real>(trial: &mut Trial<R>) {
    for (quadric, deviation) in VANISHING_QUADRICS
        .iter()
        .flat_map(|quadric| [1e-1, 1e-3, 1e-5, 1e-7, 0.0].map(|deviation| (quadric, deviation)))
    {
        let part = format!("{} {deviation:e}", quadric.name);
        trial.judge_shapes(&part, (23, 200_000), true, |rng| {
            let deviation = DVec3::new(-deviation, deviation, 0.0) * rng.next_sign();
            let d = round_to_f32(quadric.generator + deviation);
            let origin = round_to_f32(quadric.sample_point(rng) - d * rng.next_uniform(0.5, 3.0));
            let near = quadric.near_root(origin, d).ok_or(Verdict::Skipped)?;
            let ray = create_unnormalised_ray::<R>(origin, d);
            Ok((
                quadric.to_shape(),
                ray,
                judge_distance(near, 1e-5 * near, 1e-5 * near),
            ))
        });
    }
}

/// Returns the judge of a hit distance, which may be wrong by `bound`, that of the textbook by
/// `textbook_bound`.
fn judge_distance(
    expected: f64,
    bound: f64,
    textbook_bound: f64,
) -> impl Fn(Option<FormulaHit>) -> Verdict {
    move |hit| {
        let error = hit.map_or(f64::INFINITY, |hit| (hit.t - expected).abs());
        let is_textbook = hit.is_some_and(|hit| hit.is_textbook());
        let bound = if is_textbook { textbook_bound } else { bound };
        Verdict::from_error(error, bound, || {
            format!("hit {hit:?} instead of one at the distance {expected}, error")
        })
    }
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

/// Semi-axes k of the ellipsoids, beside two semi-axes of 1.
pub const EXTREME_SEMI_AXES: [f64; 4] = [1e-3, 1e-2, 1e2, 1e3];

/// Draws a ray towards an ellipsoid with the semi-axes `semi`, from a distance of ten times the
/// greatest. It is aimed at a random point of the ellipsoid's outline, scaled by 0.98. Returns it
/// with the hit in f64.
pub fn draw_ray_to_ellipsoid<R: Real>(
    rng: &mut CaseRng,
    semi: DVec3,
) -> Result<(Ray<R>, (f64, DVec3)), Verdict> {
    let origin = round_to_f32(rng.sample_direction() * (10.0 * semi.max_element()));
    // The outline is the unit disc perpendicular to the ray, in the space where the ellipsoid is
    // the unit sphere.
    let across = rng.sample_offset_in_disc((origin / semi).normalize(), 0.98) * semi;
    let d = round_to_f32((across - origin).normalize());
    let hit = intersect_ellipsoid_in_f64(origin, d, semi).ok_or(Verdict::Skipped)?;
    Ok((create_unnormalised_ray::<R>(origin, d), hit))
}

/// Judges case P15: hits of flat and of needle-like ellipsoids. The distance is right within a
/// thousandth of the least semi-axis, that of the textbook within a hundredth.
pub(super) fn extreme_ellipsoids<R: Real>(trial: &mut Trial<R>) {
    for k in EXTREME_SEMI_AXES {
        let semi = round_to_f32(DVec3::new(1.0, 1.0, k));
        let (seed, least) = (25 + k.to_bits() % 97, semi.min_element());
        trial.judge_shapes(&format!("k = {k:e}"), (seed, 200_000), true, |rng| {
            let (ray, (t, _)) = draw_ray_to_ellipsoid::<R>(rng, semi)?;
            Ok((
                Ellipsoid::new(DVec3::ZERO, semi).into(),
                ray,
                judge_distance(t, 1e-3 * least, 1e-2 * least),
            ))
        });
    }
}
