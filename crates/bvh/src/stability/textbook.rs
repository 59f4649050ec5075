//! Textbook intersection tests, all in f32, for comparison with the library. They show the errors
//! of careless formulas. The library itself uses none of them.

use super::prelude::*;
use crate::shapes::quartic::Quartic;

/// Returns the distance of the closest hit of a ray with a shape by the textbook formula; `None`
/// for a miss.
///
/// # Panics
/// For a shape without a textbook formula, and for a cone whose axis is not the y axis.
pub fn intersect<R: Real>(shape: &AnyShape<R>, ray: &Ray<R>) -> Option<f32> {
    let ray = &Ray::new(ray.origin.to_f32(), ray.direction.to_f32());
    let (d, from) = (ray.direction, |centre: R::Vec3| {
        ray.origin - centre.to_f32()
    });
    // Height of the middle, and the range of heights beside it: the clip of a hyperboloid or cone.
    let (mut middle, mut clip) = (0.0, f32::NEG_INFINITY..=f32::INFINITY);
    let sheet = |p: Vec3, q: Vec3| p.x * q.x + p.z * q.z - p.y * q.y;
    // The roots (−b ± √(b² − a·c))/a for a quadratic form of a direction d and an offset f:
    // a = form(d, d), b = form(d, f), c = form(f, f) − constant.
    let roots = |scale: Vec3, f: Vec3, form: &dyn Fn(Vec3, Vec3) -> f32, constant: f32| {
        let (d, f) = (d * scale, f * scale);
        let (a, b, c) = (form(d, d), form(d, f), form(f, f) - constant);
        let root = (b * b - a * c).sqrt();
        [(-b - root) / a, (root - b) / a]
    };
    let crossings = match shape {
        AnyShape::Sphere(sphere) => {
            let radius = sphere.radius.to_f32();
            roots(Vec3::ONE, from(sphere.centre), &Vec3::dot, radius * radius)
        }
        // In the space where the ellipsoid is a sphere: each axis is scaled by the product of the
        // semi-axes along the other two.
        AnyShape::Ellipsoid(body) => {
            let s = body.semi_axes.to_f32();
            let radius = s.x * s.y * s.z;
            roots(
                Vec3::new(s.y * s.z, s.z * s.x, s.x * s.y),
                from(body.centre),
                &Vec3::dot,
                radius * radius,
            )
        }
        AnyShape::Hyperboloid(body) => {
            let (a, c) = (body.waist.to_f32(), body.slope.to_f32());
            let half = body.half_height.to_f32();
            (middle, clip) = (body.centre.y().to_f32(), -half..=half);
            roots(
                Vec3::new(c, a, c),
                from(body.centre),
                &sheet,
                (a * c) * (a * c),
            )
        }
        AnyShape::Cone(cone) => {
            let (axis, tip) = (cone.axis.to_f32(), cone.base + cone.axis);
            assert!(
                axis.x == 0.0 && axis.z == 0.0,
                "the cone stands on its base"
            );
            (middle, clip) = (tip.y().to_f32(), -axis.y..=0.0);
            roots(
                Vec3::new(axis.y, cone.radius.to_f32(), axis.y),
                from(tip),
                &sheet,
                0.0,
            )
        }
        AnyShape::Torus(ring) => return intersect_torus(ring, ray),
        AnyShape::Triangle(face) => return intersect_triangle(face, ray),
        // Only shapes that a case compares have a formula here.
        _ => panic!("the textbook has no formula for {shape:?}"),
    };
    let is_ahead =
        |&t: &f32| t > 0.0 && t < f32::INFINITY && clip.contains(&(ray.at(t).y - middle));
    crossings
        .into_iter()
        .filter(is_ahead)
        .min_by(f32::total_cmp)
}

/// Intersects a ray with a torus by a quartic. Its coefficients are computed relative to the ray's
/// origin. Then the cubic term is eliminated. The zeros are those of the library.
fn intersect_torus<R: Real>(torus: &Torus<R>, ray: &Ray<f32>) -> Option<f32> {
    let [major, tube] = [torus.major_radius, torus.minor_radius].map(R::to_f32);
    let axis = torus.axis.to_f32().normalize();
    let (f, d) = (ray.origin - torus.centre.to_f32(), ray.direction);
    let (aa, b, ff) = (d.dot(d), f.dot(d), f.dot(f));
    let (height, lean) = (f.dot(axis), d.dot(axis));
    let g = ff + major * major - tube * tube;
    let (rr, lead) = (4.0 * major * major, 1.0 / (aa * aa));
    let c3 = 4.0 * aa * b * lead;
    let c2 = (2.0 * aa * g + 4.0 * b * b - rr * (aa - lean * lean)) * lead;
    let c1 = (4.0 * b * g - 2.0 * rr * (b - height * lean)) * lead;
    let c0 = (g * g - rr * (ff - height * height)) * lead;
    let shift = c3 / 4.0;
    let s2 = shift * shift;
    let p = c2 - 6.0 * s2;
    let q = c1 - 2.0 * shift * c2 + 8.0 * s2 * shift;
    let w = c0 - shift * c1 + s2 * c2 - 3.0 * s2 * s2;
    let quartic = Quartic {
        p: p.into(),
        q: q.into(),
        w: w.into(),
    };
    let reach = (major + tube) * 1.001 / aa.sqrt();
    quartic.find_crossings(reach.into(), |x, _| {
        Some(x as f32 - shift).filter(|&t| t > 0.0)
    })
}

/// Intersects a ray with a triangle ("Fast, Minimum Storage Ray/Triangle Intersection", Möller,
/// Trumbore 1997).
fn intersect_triangle<R: Real>(face: &Triangle<R>, ray: &Ray<f32>) -> Option<f32> {
    let [a, b, c] = face.vertices.map(Vector::to_f32);
    let (ab, ac) = (b - a, c - a);
    let p = ray.direction.cross(ac);
    let inverse = 1.0 / ab.dot(p);
    let s = ray.origin - a;
    let u = s.dot(p) * inverse;
    let q = s.cross(ab);
    let v = ray.direction.dot(q) * inverse;
    let is_inside = u.min(v).min(1.0 - (u + v)) >= 0.0;
    if !is_inside {
        return None;
    }
    let t = ac.dot(q) * inverse;
    (t > 0.0 && t < f32::INFINITY).then_some(t)
}

/// Whether a ray enters a box, by a slab test in f32. To avoid a division by zero, the reciprocal
/// of each direction component is clamped to at most 2²³.
pub(crate) fn enters_box<R: Real>(corners: [DVec3; 2], ray: &Ray<R>) -> bool {
    const MOST: f32 = 8_388_608.0;
    let inverse = ray.direction.to_f32().map(|d| (1.0 / d).clamp(-MOST, MOST));
    let [a, b] = corners.map(|p| (p.as_vec3() - ray.origin.to_f32()) * inverse);
    let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
    near.max(0.0) <= far
}
