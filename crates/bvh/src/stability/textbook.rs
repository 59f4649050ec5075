//! Textbook intersection tests, all in f32, for comparison with the library. They show the errors
//! of careless formulas. The library itself uses none of them.

use crate::shapes::{AnyShape, Cone, Ellipsoid, Hyperboloid, Sphere, Torus, Triangle};
use crate::{Ray, Surface};
use glam::Vec3;

/// Distances at which a ray enters and leaves a solid.
type TextbookCrossings = [f32; 2];

/// Returns the distance of the closest hit of a ray with a shape by the textbook formula; `None`
/// for a miss.
///
/// # Panics
/// For a shape without a textbook formula.
pub fn intersect(shape: &AnyShape<f32>, ray: &Ray<f32>) -> Option<f32> {
    match shape {
        AnyShape::Sphere(sphere) => {
            nearest_crossing_ahead(self::intersect_sphere(sphere, ray)?, |_| true)
        }
        AnyShape::Ellipsoid(body) => {
            nearest_crossing_ahead(intersect_ellipsoid(body, ray)?, |_| true)
        }
        AnyShape::Hyperboloid(sheet) => {
            nearest_crossing_ahead(intersect_hyperboloid(sheet, ray)?, |t| {
                (ray.at(t).y - sheet.centre.y).abs() <= sheet.half_height
            })
        }
        AnyShape::Cone(cone) => nearest_crossing_ahead(self::intersect_cone(cone, ray)?, |_| true),
        AnyShape::Torus(ring) => intersect_torus(ring, ray),
        AnyShape::Triangle(face) => intersect_triangle(face, ray),
        // Only shapes that a case compares have a formula here.
        _ => panic!(
            "the textbook has formulas only for sphere, ellipsoid, hyperboloid, cone, torus and triangle"
        ),
    }
}

/// Returns the nearest crossing that is in front of the origin and for which `keep` returns true.
fn nearest_crossing_ahead(crossings: TextbookCrossings, keep: impl Fn(f32) -> bool) -> Option<f32> {
    let ahead = crossings
        .into_iter()
        .filter(|&t| t > 0.0 && t < f32::INFINITY && keep(t));
    ahead.min_by(f32::total_cmp)
}

/// Computes the roots (−b ± √(b² − a·c))/a; `None` if they are not real.
fn quadratic_roots(a: f32, b: f32, c: f32) -> Option<TextbookCrossings> {
    let discriminant = b * b - a * c;
    (discriminant >= 0.0).then(|| {
        [
            (-b - discriminant.sqrt()) / a,
            (discriminant.sqrt() - b) / a,
        ]
    })
}

fn intersect_sphere(sphere: &Sphere<f32>, ray: &Ray<f32>) -> Option<TextbookCrossings> {
    let (f, d) = (ray.origin - sphere.centre, ray.direction);
    quadratic_roots(d.dot(d), f.dot(d), f.dot(f) - sphere.radius * sphere.radius)
}

/// Returns the surface where a ray hits a sphere by the textbook formula: the point at the hit
/// distance, and the normal away from the centre. The formula gives no error bound, so `error` is
/// infinite.
pub fn intersect_sphere_surface(shape: &Sphere<f32>, ray: &Ray<f32>) -> Option<Surface<f32>> {
    let point = ray.at(nearest_crossing_ahead(
        intersect_sphere(shape, ray)?,
        |_| true,
    )?);
    let normal = (point - shape.centre).normalize();
    Some(Surface {
        point,
        above: point,
        below: point,
        error: f32::INFINITY,
        normal,
    })
}

/// Intersects a ray with an ellipsoid, in the space where the ellipsoid is a sphere. Each axis is
/// scaled by the product of the semi-axes along the other two.
fn intersect_ellipsoid(body: &Ellipsoid<f32>, ray: &Ray<f32>) -> Option<TextbookCrossings> {
    let s = body.semi_axes;
    let scale = Vec3::new(s.y * s.z, s.z * s.x, s.x * s.y);
    let (d, f, radius) = (
        ray.direction * scale,
        (ray.origin - body.centre) * scale,
        s.x * s.y * s.z,
    );
    quadratic_roots(d.dot(d), d.dot(f), f.dot(f) - radius * radius)
}

fn intersect_hyperboloid(sheet: &Hyperboloid<f32>, ray: &Ray<f32>) -> Option<TextbookCrossings> {
    let (a, c) = (sheet.waist, sheet.slope);
    let scale = Vec3::new(c, a, c);
    let (d, f) = (ray.direction * scale, (ray.origin - sheet.centre) * scale);
    let form = |p: Vec3, q: Vec3| p.x * q.x + p.z * q.z - p.y * q.y;
    quadratic_roots(form(d, d), form(d, f), form(f, f) - (a * c) * (a * c))
}

/// Intersects a ray with the part of a cone's nappe between both ends.
fn intersect_cone(cone: &Cone<f32>, ray: &Ray<f32>) -> Option<TextbookCrossings> {
    let (axis, d, f) = (cone.axis, ray.direction, ray.origin - cone.base);
    let (squared, taper) = (axis.dot(axis), cone.top_radius - cone.radius);
    let (m, n) = (d.cross(axis), f.cross(axis));
    // The radius at distance t, times the squared axis, is reach + t·opening.
    let (reach, opening) = (
        cone.radius * squared + taper * f.dot(axis),
        taper * d.dot(axis),
    );
    let a = squared * m.dot(m) - opening * opening;
    let b = squared * m.dot(n) - reach * opening;
    let c = squared * n.dot(n) - reach * reach;
    let [enter, leave] = quadratic_roots(a, b, c)?;
    let wall = match () {
        () if a > 0.0 && reach - opening * b / a < 0.0 => return None,
        () if a > 0.0 => [enter, leave],
        // The ray is steeper than the wall: everything beyond one root is inside, on the side where
        // the radius grows.
        () if opening > 0.0 => [enter, f32::INFINITY],
        () => [f32::NEG_INFINITY, leave],
    };
    let (height, slope) = (axis.dot(f), axis.dot(d));
    let ends = [-height / slope, (squared - height) / slope];
    let (near, far) = (
        wall[0].max(ends[0].min(ends[1])),
        wall[1].min(ends[0].max(ends[1])),
    );
    (near < far).then_some([near, far])
}

/// Intersects a ray with a torus by a quartic. Its coefficients are computed relative to the ray's
/// origin. Then the cubic term is eliminated.
fn intersect_torus(torus: &Torus<f32>, ray: &Ray<f32>) -> Option<f32> {
    let (major, tube, axis) = (
        torus.major_radius,
        torus.minor_radius,
        torus.axis.normalize(),
    );
    let (f, d) = (ray.origin - torus.centre, ray.direction);
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
    find_quartic_zero([p, q, w], (major + tube) * 1.001 / aa.sqrt(), |x| {
        (x - shift > 0.0).then_some(x - shift)
    })
}

/// Finds the least zero of x⁴ + p·x² + q·x + w in [−reach, reach] for which `take` returns a
/// result, and returns that result. Zeros are found by bisection between the extrema.
fn find_quartic_zero(
    [p, q, w]: [f32; 3],
    reach: f32,
    take: impl Fn(f32) -> Option<f32>,
) -> Option<f32> {
    let value = |x: f32| ((x * x + p) * x + q) * x + w;
    let slope = |x: f32| (4.0 * x * x + 2.0 * p) * x + q;
    let knee = (-p / 6.0).max(0.0).sqrt().min(reach);
    let mut turns = vec![-reach];
    turns.extend(
        [(-reach, -knee), (-knee, knee), (knee, reach)]
            .into_iter()
            .filter_map(|piece| find_zero(piece, slope)),
    );
    turns.push(reach);
    turns
        .windows(2)
        .filter_map(|piece| find_zero((piece[0], piece[1]), value))
        .find_map(take)
}

/// Finds the zero of a monotone function between two points by bisection; `None` if the values at
/// both points have the same sign.
fn find_zero((mut low, mut high): (f32, f32), f: impl Fn(f32) -> f32) -> Option<f32> {
    let rises = f(low) < 0.0;
    if rises == (f(high) < 0.0) {
        return None;
    }
    for _ in 0..48 {
        let middle = 0.5 * (low + high);
        if (f(middle) < 0.0) == rises {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// Intersects a ray with a triangle ("Fast, Minimum Storage Ray/Triangle Intersection", Möller,
/// Trumbore 1997).
fn intersect_triangle(face: &Triangle<f32>, ray: &Ray<f32>) -> Option<f32> {
    let [a, b, c] = face.vertices;
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

/// Whether a ray hits any of the triangles, by the textbook formula.
pub fn hits_any_triangle(triangles: &[Triangle<f32>], ray: &Ray<f32>) -> bool {
    triangles
        .iter()
        .any(|face| intersect_triangle(face, ray).is_some())
}

/// Whether a ray enters a box, by a slab test in f32. To avoid a division by zero, the reciprocal
/// of each direction component is clamped to at most 2²³.
pub(crate) fn enters_box_by_clamped_reciprocals([min, max]: [Vec3; 2], ray: &Ray<f32>) -> bool {
    const MOST: f32 = 8_388_608.0;
    let inverse = ray.direction.map(|d| (1.0 / d).clamp(-MOST, MOST));
    let (a, b) = ((min - ray.origin) * inverse, (max - ray.origin) * inverse);
    let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
    near.max(0.0) <= far
}
