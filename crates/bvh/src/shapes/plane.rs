//! The infinite plane.

use super::{Probe, Shape, ShapeHit, Surface, magnitude};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert, convert_vec};

/// All points p with (p − point)·normal = 0. Without bounds: it stays outside any tree.
#[derive(Clone, Copy, Debug)]
pub struct Plane<R: Real> {
    /// Any point of the plane.
    pub point: R::Vec3,
    /// Unit normal; the outside.
    pub normal: R::Vec3,
    /// Unit tangent, the direction of u.
    pub tangent: R::Vec3,
}

impl<R: Real> Plane<R> {
    /// A plane through a point; `normal` has unit length. The tangent is x where the normal allows it, so that for a floor
    /// u and v are world x and z.
    pub fn new(point: R::Vec3, normal: R::Vec3) -> Self {
        let n = normal.to_f64();
        let axis = if n.x.abs() < 0.9 { glam::DVec3::X } else { glam::DVec3::Y };
        let tangent = (axis - n * n.dot(axis)).normalize();
        Self { point, normal, tangent: R::Vec3::from_f64(tangent) }
    }
}

impl<R: Real> Shape<R> for Plane<R> {
    fn bounds(&self) -> Option<Aabb> {
        None
    }

    #[inline(always)]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let normal = convert_vec::<R, P::Core>(self.normal);
        let slope = normal.dot(probe.direction);
        let height = normal.dot(convert_vec::<R, P::Core>(self.point) - probe.origin);
        // A ray in the plane gives 0/0 or x/0: neither lies in an open range.
        let t: R = convert(height / slope);
        (t.is_finite() && range.contains(t) && side.accepts(slope < P::Core::ZERO)).then_some(ShapeHit::at(t))
    }

    #[inline]
    fn surface<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Surface<R> {
        let normal = convert_vec::<R, P::Core>(self.normal);
        let through = convert_vec::<R, P::Core>(self.point);
        let raw = probe.origin + probe.direction * convert::<R, P::Core>(hit.t);
        let (point, error): (R::Vec3, R) = if P::ROBUST {
            // Moved back onto the plane along the normal; what remains is the rounding of the stored coordinates.
            let on_plane = raw - normal * (normal.dot(raw - through) / normal.dot(normal));
            let point: R::Vec3 = convert_vec::<P::Core, R>(on_plane);
            (point, (magnitude::<P>(point) + magnitude::<P>(self.point)) * (R::ROUNDOFF * R::from_f64(2.0)))
        } else {
            let point = probe.ray.at(hit.t);
            (point, (magnitude::<P>(point) + hit.t) * (R::ROUNDOFF * R::from_f64(8.0)))
        };
        let offset = point - self.point;
        let bitangent = self.tangent.cross(self.normal);
        Surface { point, error, normal: self.normal, u: offset.dot(self.tangent), v: offset.dot(bitangent), dpdu: self.tangent }
    }
}
