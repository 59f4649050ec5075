//! The disk.

use glam::DVec3;

use super::frame::{disk_support, spoke, turn};
use super::{Located, Parameters, Probe, SampleArea, Shape, ShapeHit, Under, num, slack, wide};
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert};

/// The part of a plane within `radius` of a point of it.
#[derive(Clone, Copy, Debug)]
pub struct Disk<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// The outside; of unit length up to the rounding of its components.
    pub normal: R::Vec3,
    /// Radius, above zero.
    pub radius: R,
}

impl<R: Real> Disk<R> {
    /// From centre, a normal of any length above zero, and radius.
    pub fn new(centre: DVec3, normal: DVec3, radius: f64) -> Self {
        Self { centre: R::Vec3::from_f64(centre), normal: R::Vec3::from_f64(normal.normalize()), radius: R::from_f64(radius) }
    }
}

impl<R: Real> Shape<R> for Disk<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        Some(disk_support(self.centre.to_f64(), self.normal.to_f64(), self.radius.to_f64(), direction))
    }

    #[inline]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let (normal, radius) = (wide::<P>(self.normal), convert::<R, P::Core>(self.radius));
        let f = probe.origin - wide::<P>(self.centre);
        let slope = normal.dot(probe.direction);
        // A ray in the plane gives 0/0 or x/0: neither lies in an open range.
        let distance = -normal.dot(f) / slope;
        let t = convert(distance);
        let offset = f + probe.direction * distance;
        (range.contains(t) && offset.dot(offset) <= radius * radius && side.accepts(slope < P::Core::ZERO))
            .then_some(ShapeHit::at(t))
    }

    fn locate_under<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>, _: Under<'_, P>) -> Located<P::Core> {
        let (normal, centre) = (wide::<P>(self.normal), wide::<P>(self.centre));
        let point = if P::ROBUST {
            let height = normal.dot(centre - probe.origin);
            probe.origin + probe.direction * (height / normal.dot(probe.direction))
        } else {
            probe.at(hit.t)
        };
        let way = (point - probe.origin).abs().max_element();
        let error = slack(point.abs().max_element() + centre.abs().max_element() + way);
        Located::new(point, normal.normalize(), error)
    }

    /// u turns about the normal, v runs from the centre to the rim.
    fn parameters<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let offset = self.locate(probe, hit).point - wide::<P>(self.centre);
        let (u, dpdu) = turn::<P>(offset, self.normal);
        Parameters { u, v: convert::<P::Core, R>(offset.length()) / self.radius, dpdu, mirrored: false }
    }
}

impl<R: Real> SampleArea<R> for Disk<R> {
    fn area(&self) -> f64 {
        core::f64::consts::PI * self.radius.to_f64() * self.radius.to_f64()
    }

    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        let centre = wide::<P>(self.centre);
        let radius = convert::<R, P::Core>(self.radius);
        let point = centre + spoke::<P>(self.normal, u) * (radius * convert::<R, P::Core>(v).sqrt());
        let error = slack(centre.abs().max_element() + radius);
        (Located::new(point, wide::<P>(self.normal).normalize(), error), num(1.0 / self.area()))
    }

    fn density<P: Precision<Real = R>>(&self, _: &Located<P::Core>) -> P::Core {
        num(1.0 / self.area())
    }
}
