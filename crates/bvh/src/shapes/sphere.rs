//! The sphere.

use super::{Probe, Shape, ShapeHit, Surface, first_root, magnitude};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert, convert_vec};
use glam::DVec3;

/// All points at `radius` from `centre`.
#[derive(Clone, Copy, Debug)]
pub struct Sphere<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Radius, above zero.
    pub radius: R,
}

impl<R: Real> Shape<R> for Sphere<R> {
    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::around(self.centre.to_f64(), DVec3::splat(self.radius.to_f64())))
    }

    /// Robust: the discriminant from the perpendicular distance of the centre to the ray, in the core's scalar
    /// ("Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter 7). Textbook: b² − c.
    #[inline(always)]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let f = probe.origin - convert_vec::<R, P::Core>(self.centre);
        let r = convert::<R, P::Core>(self.radius);
        let b = f.dot(probe.direction);
        let (middle, half_squared) = if P::ROBUST {
            let middle = -b * probe.inverse_length_squared;
            let l = f + probe.direction * middle;
            (middle, (r * r - l.dot(l)) * probe.inverse_length_squared)
        } else {
            (-b, b * b - (f.dot(f) - r * r))
        };
        // Written so that a NaN is a miss.
        if !(half_squared >= P::Core::ZERO) {
            return None;
        }
        let half = half_squared.sqrt();
        let (near, far) = (convert(middle - half), convert(middle + half));
        first_root(near, far, range, side).map(ShapeHit::at)
    }

    #[inline]
    fn surface<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Surface<R> {
        let centre = convert_vec::<R, P::Core>(self.centre);
        let radius = convert::<R, P::Core>(self.radius);
        let outward = probe.origin + probe.direction * convert::<R, P::Core>(hit.t) - centre;
        let normal = outward.normalize();
        let (point, error): (R::Vec3, R) = if P::ROBUST {
            // Reprojected onto the sphere in the core's scalar, rounded once to the stored one.
            let point: R::Vec3 = convert_vec::<P::Core, R>(centre + normal * radius);
            let scale = magnitude::<P>(self.centre) + self.radius;
            (point, scale * (R::ROUNDOFF * R::from_f64(2.0)))
        } else {
            let point = probe.ray.at(hit.t);
            (point, (magnitude::<P>(point) + hit.t) * (R::ROUNDOFF * R::from_f64(8.0)))
        };
        let normal: R::Vec3 = convert_vec::<P::Core, R>(normal);
        let (u, v, dpdu) = self.parameters(normal);
        Surface { point, error, normal, u, v, dpdu }
    }
}

impl<R: Real> Sphere<R> {
    /// u runs about +y from the −x side, v from the top: the orientation of an equirectangular map.
    #[inline]
    fn parameters(&self, n: R::Vec3) -> (R, R, R::Vec3) {
        let pi = R::from_f64(core::f64::consts::PI);
        let u = n.z().atan2(n.x()) / (pi + pi) + R::from_f64(0.5);
        let v = n.y().acos() / pi;
        let dpdu = R::Vec3::new(-n.z(), R::ZERO, n.x()) * (self.radius * (pi + pi));
        (u, v, dpdu)
    }
}
