//! The paraboloid, clipped and open at its rim.

use glam::DVec3;

use super::drift::off_bends;
use super::frame::{length, turn};
use super::quadratic::{Crossings, Quadratic, approach, point_at, tests_close};
use super::unit::unit_of;
use super::{
    CoreVec, Located, Parameters, Probe, SampleArea, Shape, ShapeHit, Under, num, sample::area_by_quadrature, slack, wide,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert};

/// y = (x² + z²)·height/radius² about its lowest point, up to `height`. Its normal points away from the axis and down.
#[derive(Clone, Copy, Debug)]
pub struct Paraboloid<R: Real> {
    /// Lowest point.
    pub apex: R::Vec3,
    /// Radius of the rim, above zero.
    pub radius: R,
    /// Height of the rim above the apex; zero: the shape is nowhere.
    pub height: R,
}

impl<R: Real> Paraboloid<R> {
    /// From the lowest point, the radius of the rim and its height.
    pub fn new(apex: DVec3, radius: f64, height: f64) -> Self {
        Self { apex: R::Vec3::from_f64(apex), radius: R::from_f64(radius), height: R::from_f64(height) }
    }

    /// The crossings of the whole bowl.
    #[inline(always)]
    fn crossings<P: Precision<Real = R>>(&self, probe: &Probe<P>, close: bool) -> Option<Crossings<P::Core>> {
        let (radius, height) = (convert::<R, P::Core>(self.radius), convert::<R, P::Core>(self.height));
        let (ahead, f) = approach(probe, wide::<P>(self.apex), close);
        let (unit, per_unit) = unit_of::<P>(radius.max(height));
        let (radius, height, f) = (radius * per_unit, height * per_unit, f * per_unit);
        let d = probe.direction;
        let flat = |p: CoreVec<P>, q: CoreVec<P>| p.x() * q.x() + p.z() * q.z();
        let room = radius * radius;
        let quadratic = Quadratic::new(
            height * flat(d, d),
            height * flat(d, f) - room * d.y() * num(0.5),
            height * flat(f, f) - room * f.y(),
        );
        quadratic.roots::<P>().map(|r| r.in_units_of(unit).moved(ahead))
    }

    /// The surface at a point near it.
    fn at<P: Precision<Real = R>>(&self, point: CoreVec<P>, scale: P::Core) -> Located<P::Core> {
        let apex = wide::<P>(self.apex);
        let (radius, height) = (convert::<R, P::Core>(self.radius), convert::<R, P::Core>(self.height));
        let (_, per_unit) = unit_of::<P>(radius.max(height));
        let offset = (point - apex) * per_unit;
        let (steep, room) = ((height + height) * per_unit, radius * per_unit * (radius * per_unit));
        let gradient = CoreVec::<P>::new(offset.x() * steep, -room, offset.z() * steep);
        let scale = scale + apex.abs().max_element() + point.abs().max_element() + radius + height;
        Located::new(point, gradient.normalize(), slack(scale))
    }
}

impl<R: Real> Shape<R> for Paraboloid<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        let (apex, radius, height) = (self.apex.to_f64(), self.radius.to_f64(), self.height.to_f64());
        // On the bowl at a fraction s of the rim's radius: s·across + s²·up, greatest at the rim or where its slope is zero.
        let (across, up) = (radius * length(direction.x, direction.z), height * direction.y);
        let inner = across / (-2.0 * up);
        let s = if up < 0.0 && inner < 1.0 { inner } else { 1.0 };
        Some(apex.dot(direction) + s * across + s * s * up)
    }

    #[inline]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let height = convert::<R, P::Core>(self.height);
        let above = probe.origin.y() - convert::<R, P::Core>(self.apex.y());
        if height == P::Core::ZERO {
            return None;
        }
        self.crossings(probe, tests_close(probe, self.apex, self.radius.min(self.height)))?
            .nearest(range, side, |t| above + probe.direction.y() * t <= height)
    }

    fn locate_under<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>, maps: Under<'_, P>) -> Located<P::Core> {
        let crossings = if P::ROBUST { self.crossings(probe, true) } else { None };
        let point = point_at(probe, crossings, hit);
        let located = self.at::<P>(point, (probe.origin - point).abs().max_element());
        off_bends::<P>(located, maps, || {
            // It bends most at the apex.
            let (radius, height) = (convert::<R, P::Core>(self.radius), convert::<R, P::Core>(self.height));
            [P::Core::INFINITY, radius * (radius / height) * num(0.5)]
        })
    }

    /// u turns about the axis, v runs down with the height, from 0 at the rim to 1 at the apex.
    fn parameters<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let offset = self.locate(probe, hit).point - wide::<P>(self.apex);
        let across = CoreVec::<P>::new(offset.x(), P::Core::ZERO, offset.z());
        let (u, dpdu) = turn::<P>(across, R::Vec3::new(R::ZERO, R::ONE, R::ZERO));
        Parameters { u, v: R::ONE - convert::<P::Core, R>(offset.y()) / self.height, dpdu, mirrored: false }
    }
}

impl<R: Real> Paraboloid<R> {
    /// One over the density at a distance from the axis: the rim's disk, as much larger as the bowl leans there.
    fn inverse_density(&self, distance: f64) -> f64 {
        let (radius, height) = (self.radius.to_f64(), self.height.to_f64());
        let lean = 2.0 * height * distance / (radius * radius);
        core::f64::consts::PI * radius * radius * length(lean, 1.0)
    }
}

/// Drawn evenly over the disk below the rim.
impl<R: Real> SampleArea<R> for Paraboloid<R> {
    fn area(&self) -> f64 {
        area_by_quadrature(|u, _| self.inverse_density(u.sqrt() * self.radius.to_f64()))
    }

    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        let (share, angle) = (u.to_f64(), v.to_f64() * core::f64::consts::TAU);
        let distance = share.sqrt() * self.radius.to_f64();
        let offset = DVec3::new(distance * libm::cos(angle), share * self.height.to_f64(), distance * libm::sin(angle));
        let point = CoreVec::<P>::from_f64(self.apex.to_f64() + offset);
        (self.at::<P>(point, P::Core::ZERO), num(1.0 / self.inverse_density(distance)))
    }

    fn density<P: Precision<Real = R>>(&self, point: &Located<P::Core>) -> P::Core {
        let offset = point.point.to_f64() - self.apex.to_f64();
        num(1.0 / self.inverse_density(length(offset.x, offset.z)))
    }
}
