//! The sphere.

use super::quadratic::{Crossings, approach};
use super::{CoreVec, Located, Parameters, Probe, SampleArea, Shape, ShapeHit, first_root, has_wider_core, num, slack, wide};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert};
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

    /// b² − a·c as in every textbook: of f32 input in an f64 core it is wrong by less than the input's own rounding up to
    /// 10⁸ radii away, and no form is faster. Without a wider core from the perpendicular distance of the centre to the ray
    /// ("Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter 7).
    #[inline(always)]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let f = probe.origin - wide::<P>(self.centre);
        let r = convert::<R, P::Core>(self.radius);
        let b = f.dot(probe.direction);
        let discriminant = if P::ROBUST && !has_wider_core::<P>() {
            let l = f - probe.direction * (b * probe.inverse_length_squared);
            (r * r - l.dot(l)) * probe.length_squared
        } else {
            b * b - (f.dot(f) - r * r) * probe.length_squared
        };
        // Written so that NaN is a miss.
        let met = discriminant >= P::Core::ZERO;
        if !met {
            return None;
        }
        let (root, inverse) = (discriminant.sqrt(), probe.inverse_length_squared);
        first_root(convert((-b - root) * inverse), convert((root - b) * inverse), range, side)
    }

    #[inline]
    fn locate<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Located<P::Core> {
        let (centre, radius) = (wide::<P>(self.centre), convert::<R, P::Core>(self.radius));
        if P::ROBUST && probe.mapped {
            // From the roots again, as the rounding of the stored distance may be large in the map's space.
            let (ahead, l) = approach(probe, centre, true);
            let half = ((radius * radius - l.dot(l)).max(P::Core::ZERO) * probe.inverse_length_squared).sqrt();
            let t = Crossings { enter: ahead - half, leave: ahead + half }.unrounded(hit);
            return self.at::<P>((l + probe.direction * (t - ahead)).normalize());
        }
        let raw = probe.at(hit.t);
        let f = raw - centre;
        if P::ROBUST {
            return self.at::<P>(f.normalize());
        }
        // b² − c is wrong by some roundings of the squared distance, the point's height over the surface by that over the
        // diameter.
        let way = probe.origin - centre;
        let scale = centre.abs().max_element() + radius + way.dot(way) / radius;
        Located { point: raw, normal: f.normalize(), error: slack(scale) }
    }

    /// u runs about +y from the −x side, v from the top: the orientation of an equirectangular map.
    #[inline]
    fn parameters<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let n = self.surface(probe, hit).normal;
        let pi: R = num(core::f64::consts::PI);
        let u = n.z().atan2(n.x()) / (pi + pi) + num(0.5);
        let v = n.y().acos() / pi;
        let dpdu = R::Vec3::new(-n.z(), R::ZERO, n.x()) * (self.radius * (pi + pi));
        Parameters { u, v, dpdu }
    }
}

impl<R: Real> Sphere<R> {
    /// The surface in a direction from the centre; in the core's scalar, so that only the rounding to storage is left.
    #[inline(always)]
    fn at<P: Precision<Real = R>>(&self, normal: CoreVec<P>) -> Located<P::Core> {
        let (centre, radius) = (wide::<P>(self.centre), convert::<R, P::Core>(self.radius));
        Located { point: centre + normal * radius, normal, error: slack(centre.abs().max_element() + radius) }
    }
}

impl<R: Real> SampleArea<R> for Sphere<R> {
    fn area(&self) -> f64 {
        4.0 * core::f64::consts::PI * self.radius.to_f64() * self.radius.to_f64()
    }

    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        (self.at::<P>(CoreVec::<P>::from_f64(sphere_direction(u.to_f64(), v.to_f64()))), num(1.0 / self.area()))
    }

    fn density<P: Precision<Real = R>>(&self, _: &Located<P::Core>) -> P::Core {
        num(1.0 / self.area())
    }
}

/// A unit vector for two numbers in [0, 1), evenly over the sphere.
pub(super) fn sphere_direction(u: f64, v: f64) -> DVec3 {
    let z = 1.0 - 2.0 * u;
    let (ring, angle) = ((1.0 - z * z).max(0.0).sqrt(), v * core::f64::consts::TAU);
    DVec3::new(ring * libm::cos(angle), ring * libm::sin(angle), z)
}
