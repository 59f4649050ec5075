//! The triangle: watertight in the robust precisions, Möller–Trumbore in the fast one.

use super::{Probe, Shape, ShapeHit, Surface, magnitude};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert, convert_vec};

/// Three corners, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Triangle<R: Real> {
    /// Corners.
    pub vertices: [R::Vec3; 3],
}

impl<R: Real> Triangle<R> {
    /// Unit normal by the right-hand rule, in f64; zero for a triangle without area.
    pub fn normal(&self) -> glam::DVec3 {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        (b - a).cross(c - a).normalize_or_zero()
    }
}

impl<R: Real> Shape<R> for Triangle<R> {
    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::from_points(self.vertices.map(Vector::to_f64)))
    }

    #[inline(always)]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        if P::ROBUST { self.watertight(probe, range, side) } else { self.moller_trumbore(probe, range, side) }
    }

    #[inline]
    fn surface<P: Precision<Real = R>>(&self, _: &Probe<P>, hit: ShapeHit<R>) -> Surface<R> {
        let [a, b, c] = self.vertices.map(convert_vec::<R, P::Core>);
        let (u, v) = (convert::<R, P::Core>(hit.u), convert::<R, P::Core>(hit.v));
        // The point from its barycentric coordinates lies in the triangle's plane whatever the ray's distance was.
        let point: R::Vec3 = convert_vec::<P::Core, R>(a + (b - a) * u + (c - a) * v);
        let scale = self.vertices.iter().fold(R::ZERO, |m, &p| m.max(magnitude::<P>(p)));
        let normal = R::Vec3::from_f64(self.normal());
        let dpdu: R::Vec3 = convert_vec::<P::Core, R>(b - a);
        Surface { point, error: scale * (R::ROUNDOFF * R::from_f64(4.0)), normal, u: hit.u, v: hit.v, dpdu }
    }
}

impl<R: Real> Triangle<R> {
    /// Edge functions of the corners relative to the ray, computed in the core's scalar: with f32 input and an f64 core
    /// every difference is a single rounding, and the two triangles at an edge compute the same number for it with
    /// opposite signs, so no ray passes between them (the property of "Watertight Ray/Triangle Intersection", Woop,
    /// Benthin, Wald 2013, without its shear). An edge function of exactly zero belongs to both.
    #[inline(always)]
    fn watertight<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let [a, b, c] = self.vertices.map(|p| convert_vec::<R, P::Core>(p) - probe.origin);
        let d = probe.direction;
        let u = d.dot(c.cross(b));
        let v = d.dot(a.cross(c));
        let w = d.dot(b.cross(a));
        let zero = P::Core::ZERO;
        if (u < zero || v < zero || w < zero) && (u > zero || v > zero || w > zero) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == zero || determinant.is_nan() {
            return None;
        }
        let inverse = P::Core::ONE / determinant;
        let (u, v, w) = (u * inverse, v * inverse, w * inverse);
        let t: R = convert((a.dot(d) * u + b.dot(d) * v + c.dot(d) * w) * probe.inverse_length_squared);
        // u, v, w are negative sums of one sign convention: the determinant is positive for a ray against the normal.
        (range.contains(t) && side.accepts(determinant > zero)).then(|| ShapeHit { t, u: convert(v), v: convert(w) })
    }

    /// "Fast, Minimum Storage Ray/Triangle Intersection" (Möller, Trumbore 1997). Leaks at shared edges.
    #[inline(always)]
    fn moller_trumbore<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let [a, b, c] = self.vertices.map(convert_vec::<R, P::Core>);
        let (ab, ac) = (b - a, c - a);
        let p = probe.direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant == P::Core::ZERO {
            return None;
        }
        let inverse = P::Core::ONE / determinant;
        let s = probe.origin - a;
        let u = s.dot(p) * inverse;
        if !(P::Core::ZERO..=P::Core::ONE).contains(&u) {
            return None;
        }
        let q = s.cross(ab);
        let v = probe.direction.dot(q) * inverse;
        if !(v >= P::Core::ZERO && u + v <= P::Core::ONE) {
            return None;
        }
        let t: R = convert(ac.dot(q) * inverse);
        (range.contains(t) && side.accepts(determinant > P::Core::ZERO)).then(|| ShapeHit { t, u: convert(u), v: convert(v) })
    }
}
