//! The hyperboloid of one sheet, clipped and open.

use glam::DVec3;

use super::drift::off_bends;
use super::frame::{disk_support, length, turn};
use super::probe::FAR;
use super::quadratic::{Crossings, Quadratic, always_close, approach, point_at};
use super::unit::unit_of;
use super::{
    CoreVec, Located, Parameters, Probe, SampleArea, Shape, ShapeHit, Under, num, sample::area_by_quadrature, slack, wide,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert};

/// (x/a)² − (y/c)² + (z/a)² = 1 about its centre, for |y| ≤ half_height. Its normal points away from the axis.
#[derive(Clone, Copy, Debug)]
pub struct Hyperboloid<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Radius a of the waist, above zero.
    pub waist: R,
    /// Slope constant c, above zero.
    pub slope: R,
    /// |y − centre.y| up to which it reaches; zero: nowhere.
    pub half_height: R,
}

impl<R: Real> Hyperboloid<R> {
    /// From centre, waist radius a, slope constant c and half height.
    pub fn new(centre: DVec3, waist: f64, slope: f64, half_height: f64) -> Self {
        Self {
            centre: R::Vec3::from_f64(centre),
            waist: R::from_f64(waist),
            slope: R::from_f64(slope),
            half_height: R::from_f64(half_height),
        }
    }

    /// The crossings of the whole sheet.
    #[inline(always)]
    fn crossings<P: Precision<Real = R>>(&self, probe: &Probe<P>, close: bool) -> Option<Crossings<P::Core>> {
        let (waist, slope) = (convert::<R, P::Core>(self.waist), convert::<R, P::Core>(self.slope));
        let (ahead, f) = approach(probe, wide::<P>(self.centre), close);
        let (size, per_unit) = unit_of::<P>(waist.max(slope));
        let (waist, slope, f) = (waist * per_unit, slope * per_unit, f * per_unit);
        // Times (a·c)²: products of two stored numbers, no division.
        let scale = CoreVec::<P>::new(slope, waist, slope);
        let (d, f) = (probe.direction * scale, f * scale);
        let form = |p: CoreVec<P>, q: CoreVec<P>| p.x() * q.x() + p.z() * q.z() - p.y() * q.y();
        let unit = (waist * slope) * (waist * slope);
        let (a, b) = (form(d, d), form(d, f));
        let quadratic = Quadratic::new(a, b, form(f, f) - unit);
        if !close {
            if P::ROBUST && f.dot(f) > unit * num(FAR * FAR) {
                return self.far_crossings(probe);
            }
            return quadratic.roots::<P>().map(|r| r.in_units_of(size));
        }
        // b² − a·c by the minors of (d, f), as |d × f|² is for a sphere.
        let m = d.cross(f);
        let discriminant = unit * a + (m.x() * m.x() + m.z() * m.z() - m.y() * m.y());
        Quadratic { discriminant, ..quadratic }.roots::<P>().map(|r| r.moved(ahead))
    }

    /// From so many of its sizes away, out of line: few rays come from there.
    #[cold]
    #[inline(never)]
    fn far_crossings<P: Precision<Real = R>>(&self, probe: &Probe<P>) -> Option<Crossings<P::Core>> {
        self.crossings(probe, true)
    }

    /// The surface at a point near it.
    fn at<P: Precision<Real = R>>(&self, point: CoreVec<P>, scale: P::Core) -> Located<P::Core> {
        let centre = wide::<P>(self.centre);
        let (waist, slope) = (convert::<R, P::Core>(self.waist), convert::<R, P::Core>(self.slope));
        let (_, per_unit) = unit_of::<P>(waist.max(slope));
        let offset = (point - centre) * per_unit;
        let (across, up) = (slope * per_unit * (slope * per_unit), waist * per_unit * (waist * per_unit));
        let gradient = CoreVec::<P>::new(offset.x() * across, -offset.y() * up, offset.z() * across);
        let scale = scale + centre.abs().max_element() + point.abs().max_element() + waist;
        Located::new(point, gradient.normalize(), slack(scale))
    }

    /// Distance from the axis at a height above the centre, in f64.
    fn radius_at(&self, y: f64) -> f64 {
        self.waist.to_f64() * length(y / self.slope.to_f64(), 1.0)
    }
}

impl<R: Real> Shape<R> for Hyperboloid<R> {
    /// It curves inwards: it reaches as far as its two rims.
    fn support(&self, direction: DVec3) -> Option<f64> {
        let height = self.half_height.to_f64();
        let rim = disk_support(self.centre.to_f64(), DVec3::Y, self.radius_at(height), direction);
        Some(rim + height * direction.y.abs())
    }

    #[inline]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let half_height = convert::<R, P::Core>(self.half_height);
        let above = probe.origin.y() - convert::<R, P::Core>(self.centre.y());
        let clipped = |t: P::Core| (above + probe.direction.y() * t).abs() <= half_height;
        if half_height == P::Core::ZERO {
            return None;
        }
        self.crossings(probe, always_close::<P>())?.nearest(range, side, clipped)
    }

    fn locate_under<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>, maps: Under<'_, P>) -> Located<P::Core> {
        let crossings = if P::ROBUST { self.crossings(probe, true) } else { None };
        let point = point_at(probe, crossings, hit);
        let located = self.at::<P>(point, (probe.origin - point).abs().max_element());
        off_bends::<P>(located, maps, || {
            // Outside it is the profile that bends, most at the waist; inside, and there most as well, the circle.
            let (waist, slope) = (convert::<R, P::Core>(self.waist), convert::<R, P::Core>(self.slope));
            [slope * (slope / waist), waist]
        })
    }

    /// u turns about the axis, v runs from the upper rim to the lower.
    fn parameters<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let offset = self.locate(probe, hit).point - wide::<P>(self.centre);
        let across = CoreVec::<P>::new(offset.x(), P::Core::ZERO, offset.z());
        let (u, dpdu) = turn::<P>(across, R::Vec3::new(R::ZERO, R::ONE, R::ZERO));
        let v = num::<R>(0.5) - convert::<P::Core, R>(offset.y()) / (self.half_height + self.half_height);
        Parameters { u, v, dpdu, mirrored: false }
    }
}

impl<R: Real> Hyperboloid<R> {
    /// One over the density at a height: the ring there times its slant, over the whole height.
    fn inverse_density(&self, y: f64) -> f64 {
        let (a, c, radius) = (self.waist.to_f64(), self.slope.to_f64(), self.radius_at(y));
        let lean = a * a * y / (c * c * radius);
        2.0 * self.half_height.to_f64() * core::f64::consts::TAU * radius * length(lean, 1.0)
    }
}

/// Drawn evenly over height and angle.
impl<R: Real> SampleArea<R> for Hyperboloid<R> {
    fn area(&self) -> f64 {
        area_by_quadrature(|u, _| self.inverse_density((2.0 * u - 1.0) * self.half_height.to_f64()))
    }

    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        let y = (2.0 * u.to_f64() - 1.0) * self.half_height.to_f64();
        let angle = v.to_f64() * core::f64::consts::TAU;
        let radius = self.radius_at(y);
        let offset = DVec3::new(radius * libm::cos(angle), y, radius * libm::sin(angle));
        let point = CoreVec::<P>::from_f64(self.centre.to_f64() + offset);
        (self.at::<P>(point, P::Core::ZERO), num(1.0 / self.inverse_density(y)))
    }

    fn density<P: Precision<Real = R>>(&self, point: &Located<P::Core>) -> P::Core {
        num(1.0 / self.inverse_density(point.point.y().to_f64() - self.centre.y().to_f64()))
    }
}
