//! Hits, compared with ray marching for sign changes of the implicit function.

use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{AnyShape, Quad, Shape, ShapeHit, TransformedShape};
use raywright_bvh::{
    Aabb, Interval, PreparedRay, Ray, Real, Side, SurfacePoint, TextureCoordinates, Vector,
};

use super::gallery::{Oracle, ShapeRng, gallery};

/// A shape, with or without a map.
trait Subject<R: Real> {
    fn hit(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>>;
    fn at(&self, prepared_ray: &PreparedRay, hit: ShapeHit<R>) -> SurfacePoint;
    fn coordinates(&self, prepared_ray: &PreparedRay, hit: ShapeHit<R>) -> TextureCoordinates<R>;
    fn extent(&self) -> Option<Aabb>;
}

impl<R: Real> Subject<R> for AnyShape<R> {
    fn hit(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        self.intersect(prepared_ray, range, side)
    }
    fn at(&self, prepared_ray: &PreparedRay, hit: ShapeHit<R>) -> SurfacePoint {
        self.locate_surface_point(prepared_ray, hit)
    }
    fn coordinates(&self, prepared_ray: &PreparedRay, hit: ShapeHit<R>) -> TextureCoordinates<R> {
        self.texture_coordinates(prepared_ray, hit)
    }
    fn extent(&self) -> Option<Aabb> {
        self.bounds()
    }
}

impl<R: Real> Subject<R> for TransformedShape<R> {
    fn hit(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        self.intersect(prepared_ray, range, side)
    }
    fn at(&self, prepared_ray: &PreparedRay, hit: ShapeHit<R>) -> SurfacePoint {
        self.locate_surface_point(prepared_ray, hit)
    }
    fn coordinates(&self, prepared_ray: &PreparedRay, hit: ShapeHit<R>) -> TextureCoordinates<R> {
        self.texture_coordinates(prepared_ray, hit)
    }
    fn extent(&self) -> Option<Aabb> {
        self.bounds()
    }
}

/// Distances up to `end` at which the function changes sign along the ray, and whether it falls
/// there, by even steps and bisection. Crossings outside the clip are omitted. The flag marks a ray
/// on which the function came near zero between steps, so that the number of crossings is unknown.
fn crossings(
    oracle: &Oracle,
    origin: DVec3,
    direction: DVec3,
    end: f64,
) -> (Vec<(f64, bool)>, bool) {
    const STEPS: u32 = 1200;
    let at = |t: f64| origin + direction * t;
    let value = |t: f64| (oracle.value)(at(t));
    let (mut found, mut doubtful) = (vec![], false);
    let step = end / f64::from(STEPS);
    let mut last = value(0.0);
    let mut before = last;
    for i in 1..=STEPS {
        let (from, to) = (f64::from(i - 1) * step, f64::from(i) * step);
        let next = value(to);
        if (last < 0.0) != (next < 0.0) {
            let (mut low, mut high) = (from, to);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if (value(middle) < 0.0) == (last < 0.0) {
                    low = middle
                } else {
                    high = middle
                }
            }
            let clip = |t: f64| (oracle.clip)(at(t));
            doubtful |= clip(low - 1e-5) != clip(low + 1e-5) || low < 1e-5;
            if clip(low) {
                found.push((low, next < 0.0));
            }
        } else {
            // Nearer to zero than on either side: it may have crossed zero twice in between.
            doubtful |=
                last.abs() <= before.abs() && last.abs() <= next.abs() && last.abs() < 3.0 * step;
        }
        (before, last) = (last, next);
    }
    (found, doubtful)
}

fn check<R: Real>(name: &str, subject: &impl Subject<R>, oracle: &Oracle, tolerance: f64) -> u32 {
    let rng = &mut ShapeRng(0x5eed + name.len() as u64);
    let mut hits = 0;
    for index in 0..1000 {
        let inside = index % 3 == 0;
        let origin = if inside {
            rng.cube() * 1.5
        } else {
            rng.direction() * (4.0 + rng.unit())
        };
        let direction = (rng.cube() * 1.5 - origin).normalize();
        let vector = |v: DVec3| R::Vec3::from_f64(v);
        let ray = Ray::<R>::new(vector(origin), vector(direction));
        let (o, d) = (ray.origin.to_f64(), ray.direction.to_f64());
        let (expected, doubtful) = crossings(oracle, o, d, 20.0);
        if doubtful {
            continue;
        }
        let prepared_ray = PreparedRay::new(ray);
        for (side, wanted_value) in [
            (Side::Both, expected.first()),
            (Side::Outside, expected.iter().find(|e| e.1)),
            (Side::Inside, expected.iter().find(|e| !e.1)),
        ] {
            let range = Interval {
                min: R::ZERO,
                max: R::from_f64(20.0),
            };
            let got = subject.hit(&prepared_ray, range, side);
            let place = format!("{name} ray {index} {side:?} origin {o:?} direction {d:?}");
            let (Some(got), Some(&(t, falls))) = (got, wanted_value) else {
                assert!(
                    got.is_none() && wanted_value.is_none(),
                    "{place}: got {got:?}, expected {wanted_value:?}"
                );
                continue;
            };
            hits += 1;
            assert!(
                (got.t.to_f64() - t).abs() <= tolerance * 40.0,
                "{place}: t {:?}, expected {t}",
                got.t
            );
            check_surface::<R>(
                &place,
                subject,
                oracle,
                &prepared_ray,
                got,
                falls,
                tolerance,
            );
            // The interval is open at the hit itself.
            let closed = Interval {
                min: range.min,
                max: got.t,
            };
            assert!(
                subject.hit(&prepared_ray, closed, side).is_none(),
                "{place}: hit at the excluded end"
            );
        }
    }
    hits
}

fn check_surface<R: Real>(
    place: &str,
    subject: &impl Subject<R>,
    oracle: &Oracle,
    prepared_ray: &PreparedRay,
    hit: ShapeHit<R>,
    falls: bool,
    tolerance: f64,
) {
    let surface_point = subject.at(prepared_ray, hit);
    let (p, n) = (surface_point.point.to_f64(), surface_point.normal.to_f64());
    let d = prepared_ray.direction;
    assert!(
        (oracle.value)(p).abs() <= tolerance * 4.0,
        "{place}: {p:?} is off the surface by {}",
        (oracle.value)(p)
    );
    let along = prepared_ray.origin + d * hit.t.to_f64();
    assert!(
        (p - along).length() <= tolerance * 40.0,
        "{place}: {p:?} is off the ray, {along:?}"
    );
    assert!(
        (n.length() - 1.0).abs() <= tolerance,
        "{place}: normal {n:?}"
    );
    assert_eq!(
        n.dot(d) < 0.0,
        falls,
        "{place}: normal {n:?} against direction {d:?}"
    );
    let slope =
        |axis: DVec3| ((oracle.value)(p + axis * 1e-6) - (oracle.value)(p - axis * 1e-6)) / 2e-6;
    let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize();
    // At an edge of a solid the difference quotient mixes two faces.
    let edge = [DVec3::X, DVec3::Y, DVec3::Z].iter().any(|&axis| {
        let bend = (oracle.value)(p + axis * 1e-4) + (oracle.value)(p - axis * 1e-4)
            - 2.0 * (oracle.value)(p);
        bend.abs() > 1e-6
    });
    assert!(
        edge || gradient.dot(n) > 1.0 - 1e-6 - tolerance,
        "{place}: normal {n:?}, gradient {gradient:?}"
    );
    if let Some(bounds) = subject.extent() {
        let room = DVec3::splat(tolerance * 4.0);
        assert!(
            (bounds.min - room).cmple(p).all() && p.cmple(bounds.max + room).all(),
            "{place}: {p:?} outside {bounds:?}"
        );
    }
    let parameters = subject.coordinates(prepared_ray, hit);
    let across = parameters.dpdu.to_f64();
    assert!(
        parameters.u.is_finite() && parameters.v.is_finite(),
        "{place}: {parameters:?}"
    );
    assert!(
        across.dot(n).abs() <= 1e-4 * across.length() + tolerance,
        "{place}: derivative {across:?}, normal {n:?}"
    );
}

fn all<R: Real>(tolerance: f64) {
    let map = DAffine3::from_translation(DVec3::new(0.2, -0.1, 0.3))
        * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0)
        * DAffine3::from_scale(DVec3::new(-0.8, 1.3, 0.6));
    for (name, shape, oracle) in gallery::<R>() {
        let hits = check::<R>(name, &shape, &oracle, tolerance);
        assert!(hits > 30, "{name}: only {hits} hits");
        let transformed_shape = TransformedShape::<R>::new(shape, map).unwrap();
        let hits = check::<R>(
            &format!("{name}, placed"),
            &transformed_shape,
            &oracle.under(map),
            tolerance * 4.0,
        );
        assert!(hits > 30, "{name}, placed: only {hits} hits");
    }
}

/// Protects: every formula of every shape: distance, sides, clipping, point, normal, bounds and
/// texture coordinates, also under a reflection.
#[test]
fn robust_shapes_meet_their_implicit_functions() {
    all::<f32>(4e-7);
}

/// Protects: the same formulas in f64 with a far smaller tolerance, where a nearly right formula
/// fails.
#[test]
fn reference_shapes_meet_their_implicit_functions() {
    all::<f64>(1e-12);
}

/// Protects: a point near the border of a quad is moved off it by eight roundings of its greatest
/// coordinate, on either side, even if one edge is a hundred times the other: rays that start at an
/// inner edge of a long room start inside.
#[test]
fn points_keep_from_borders_of_long_quads() {
    let (long, short) = (100.0, 1.0);
    let kept = 8.0 * f64::from(f32::ROUNDOFF) * long;
    for [width, height] in [[long, short], [short, long]] {
        let quad = Quad::<f32>::new(DVec3::ZERO, DVec3::X * width, DVec3::Y * height);
        let near = 1e-6;
        for (x, y) in [
            (near, 0.4),
            (width - near, 0.4),
            (0.6, near),
            (0.6, height - near),
        ] {
            let ray = Ray::<f64>::new(DVec3::new(x, y, 1.0), DVec3::NEG_Z);
            let prepared_ray = PreparedRay::new(Ray::<f32>::new(
                Vector::from_f64(ray.origin),
                Vector::from_f64(ray.direction),
            ));
            // A ray that rounding moved over the border has no hit.
            let Some(hit) = quad.intersect(&prepared_ray, Interval::positive(), Side::Both) else {
                continue;
            };
            let p = quad.locate_surface_point(&prepared_ray, hit).point;
            let from_border = p.x.min(width - p.x).min(p.y).min(height - p.y);
            assert!(
                (from_border / kept - 1.0).abs() < 1e-3,
                "{width} by {height}: {p:?} for ({x}, {y}), {from_border:e}"
            );
        }
    }
}
