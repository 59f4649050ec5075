//! The ellipsoid with axes along x, y, z.

use glam::DVec3;

use super::drift::Drift;
use super::probe::FAR;
use super::quadratic::{Crossings, Quadratic, always_close, approach, point_at};
use super::sample::area_by_quadrature;
use super::sphere::{on_globe, sphere_direction};
use super::unit::unit_of;
use super::{CoreVec, Located, Maps, Parameters, Probe, SampleArea, Shape, ShapeHit, Under, num, slack, wide};
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector};

/// A sphere scaled along the axes.
#[derive(Clone, Copy, Debug)]
pub struct Ellipsoid<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Half-lengths along x, y, z, above zero.
    pub semi_axes: R::Vec3,
}

impl<R: Real> Ellipsoid<R> {
    /// From centre and half-lengths.
    pub fn new(centre: DVec3, semi_axes: DVec3) -> Self {
        Self { centre: R::Vec3::from_f64(centre), semi_axes: R::Vec3::from_f64(semi_axes) }
    }

    /// The crossings, in the space where the ellipsoid is a sphere: each axis is scaled by the other two half-lengths, whose
    /// product is exact in a wider core, and the radius there is the product of all three.
    #[inline(always)]
    fn crossings<P: Precision<Real = R>>(&self, probe: &Probe<P>, close: bool) -> Option<Crossings<P::Core>> {
        let s = wide::<P>(self.semi_axes);
        let (unit, per_unit) = unit_of::<P>(s.max_element());
        let s = s * per_unit;
        let scale = CoreVec::<P>::new(s.y() * s.z(), s.z() * s.x(), s.x() * s.y());
        let (ahead, f) = approach(probe, wide::<P>(self.centre), close);
        let (d, f, radius) = (probe.direction * scale, f * per_unit * scale, s.x() * s.y() * s.z());
        let (a, b) = (d.dot(d), d.dot(f));
        if !close {
            let (squared, room) = (f.dot(f), radius * radius);
            if P::ROBUST && squared > room * num(FAR * FAR) {
                return self.far_crossings(probe);
            }
            return Quadratic::new(a, b, squared - room).roots::<P>().map(|r| r.in_units_of(unit));
        }
        // As for the sphere: how far the line passes from the centre, without cancellation.
        let middle = -b / a;
        let l = f + d * middle;
        let half_squared = (radius * radius - l.dot(l)) / a;
        let met = half_squared >= P::Core::ZERO;
        met.then(|| {
            let (middle, half) = (middle + ahead, half_squared.sqrt());
            Crossings { enter: middle - half, leave: middle + half }
        })
    }

    /// From so many of its sizes away, out of line: few rays come from there.
    #[cold]
    #[inline(never)]
    fn far_crossings<P: Precision<Real = R>>(&self, probe: &Probe<P>) -> Option<Crossings<P::Core>> {
        self.crossings(probe, true)
    }

    /// Normal and error bound at a point near the surface.
    fn at<P: Precision<Real = R>>(&self, point: CoreVec<P>, scale: P::Core) -> Located<P::Core> {
        let (centre, s) = (wide::<P>(self.centre), wide::<P>(self.semi_axes));
        let offset = point - centre;
        let (_, per_unit) = unit_of::<P>(s.max_element());
        let (f, r) = (offset * per_unit, s * per_unit);
        let gradient = CoreVec::<P>::new(f.x() / (r.x() * r.x()), f.y() / (r.y() * r.y()), f.z() / (r.z() * r.z()));
        let scale = scale + centre.abs().max_element() + s.max_element();
        Located::new(point, gradient.normalize(), slack(scale))
    }

    /// From a point to where a ray starts that goes in: as on the unit sphere of which this is an image, for which see
    /// [`super::drift::off_bends`].
    #[inline(never)]
    fn inwards<P: Precision<Real = R>>(&self, located: &Located<P::Core>, maps: Maps<'_, P::Core>) -> CoreVec<P> {
        let (zero, one, s) = (P::Core::ZERO, P::Core::ONE, wide::<P>(self.semi_axes));
        let drift = Drift::around::<P>(Some(maps), located.point, located.error);
        let x = drift.along(CoreVec::<P>::new(one / s.x(), zero, zero));
        let y = drift.along(CoreVec::<P>::new(zero, one / s.y(), zero));
        let z = drift.along(CoreVec::<P>::new(zero, zero, one / s.z()));
        let share = x * x + y * y + z * z;
        if share < one { (wide::<P>(self.centre) - located.point) * share } else { CoreVec::<P>::ZERO }
    }
}

impl<R: Real> Shape<R> for Ellipsoid<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        Some(self.centre.to_f64().dot(direction) + (self.semi_axes.to_f64() * direction).length())
    }

    #[inline]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        self.crossings(probe, always_close::<P>())?.nearest(range, side, |_| true)
    }

    fn locate_under<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>, maps: Under<'_, P>) -> Located<P::Core> {
        let crossings = if P::ROBUST { self.crossings(probe, true) } else { None };
        let point = point_at(probe, crossings, hit);
        let way = (probe.origin - point).abs().max_element();
        let located = self.at::<P>(point, way + point.abs().max_element());
        match maps {
            Some(maps) if P::ROBUST => Located { below: located.point + self.inwards::<P>(&located, maps), ..located },
            _ => located,
        }
    }

    /// Those of the sphere of which it is the image.
    fn parameters<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let (centre, s) = (self.centre.to_f64(), self.semi_axes.to_f64());
        let n = ((self.locate(probe, hit).point.to_f64() - centre) / s).normalize();
        let [u, v] = on_globe::<f64>(n).map(R::from_f64);
        let dpdu = R::Vec3::from_f64(DVec3::new(n.z, 0.0, -n.x) * s * core::f64::consts::TAU);
        Parameters { u, v, dpdu, mirrored: false }
    }
}

impl<R: Real> Ellipsoid<R> {
    /// How many times larger the surface is at a point than the unit sphere at its image, by the unit direction there.
    fn stretch(&self, n: DVec3) -> f64 {
        let s = self.semi_axes.to_f64();
        DVec3::new(n.x * s.y * s.z, n.y * s.z * s.x, n.z * s.x * s.y).length()
    }
}

/// Drawn evenly over the unit sphere and mapped: the density follows the stretch of the map.
impl<R: Real> SampleArea<R> for Ellipsoid<R> {
    fn area(&self) -> f64 {
        area_by_quadrature(|u, v| 4.0 * core::f64::consts::PI * self.stretch(sphere_direction(u, v)))
    }

    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        let n = sphere_direction(u.to_f64(), v.to_f64());
        let point = CoreVec::<P>::from_f64(self.centre.to_f64() + self.semi_axes.to_f64() * n);
        let density = 1.0 / (4.0 * core::f64::consts::PI * self.stretch(n));
        (self.at::<P>(point, P::Core::ZERO), num(density))
    }

    fn density<P: Precision<Real = R>>(&self, point: &Located<P::Core>) -> P::Core {
        let n = ((point.point.to_f64() - self.centre.to_f64()) / self.semi_axes.to_f64()).normalize();
        num(1.0 / (4.0 * core::f64::consts::PI * self.stretch(n)))
    }
}
