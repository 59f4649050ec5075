//! The sphere.

use super::{Located, Parameters, Probe, Shape, ShapeHit, first_root};
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
    fn support(&self, direction: DVec3) -> Option<f64> {
        Some(self.centre.to_f64().dot(direction) + self.radius.to_f64() * direction.length())
    }

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
        // Written so that NaN is a miss.
        let met = half_squared >= P::Core::ZERO;
        if !met {
            return None;
        }
        let half = half_squared.sqrt();
        let (near, far) = (convert(middle - half), convert(middle + half));
        first_root(near, far, range, side).map(ShapeHit::at)
    }

    #[inline]
    fn locate<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Located<P::Core> {
        let centre = convert_vec::<R, P::Core>(self.centre);
        let radius = convert::<R, P::Core>(self.radius);
        let raw = probe.at(hit.t);
        let normal = (raw - centre).normalize();
        let scale = centre.abs().max_element() + radius;
        if P::ROBUST {
            // Reprojected onto the sphere in the core's scalar.
            return Located {
                point: centre + normal * radius,
                normal,
                error: scale * (P::Core::ROUNDOFF * P::Core::from_f64(16.0)),
            };
        }
        // b² − c is wrong by some roundings of |f|², the distance from the surface by that over the diameter.
        let f = probe.origin - centre;
        let error = (scale + f.dot(f) / radius) * (P::Core::ROUNDOFF * P::Core::from_f64(16.0));
        Located { point: raw, normal, error }
    }

    /// u runs about +y from the −x side, v from the top: the orientation of an equirectangular map.
    #[inline]
    fn parameters<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let n = self.surface(probe, hit).normal;
        let pi = R::from_f64(core::f64::consts::PI);
        let u = n.z().atan2(n.x()) / (pi + pi) + R::from_f64(0.5);
        let v = n.y().acos() / pi;
        let dpdu = R::Vec3::new(-n.z(), R::ZERO, n.x()) * (self.radius * (pi + pi));
        Parameters { u, v, dpdu }
    }
}
