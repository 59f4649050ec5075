//! The torus.

use glam::DVec3;

use super::drift::off_bends;
use super::frame::{disk_support, split, spoke, turn};
use super::quartic::Quartic;
use super::unit::unit_of;
use super::{CoreVec, Located, Parameters, Probe, SampleArea, Shape, ShapeHit, Under, num, slack, wide};
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert};

/// All points at `minor_radius` from a circle. Formulas are homogeneous in the axis, as for the cylinder.
#[derive(Clone, Copy, Debug)]
pub struct Torus<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Axis of symmetry; any length above zero.
    pub axis: R::Vec3,
    /// Radius of the circle.
    pub major_radius: R,
    /// Radius of the tube, above zero and below the major one.
    pub minor_radius: R,
}

/// A ray seen by a torus of major radius one: the quartic in the distance from `middle`, and how that distance scales.
struct Profile<C> {
    quartic: Quartic<C>,
    /// Crossings lie within this distance.
    reach: C,
    /// Distance along the ray = middle + scale · x.
    middle: C,
    scale: C,
}

impl<R: Real> Torus<R> {
    /// From the centre, an axis of any length above zero, and the two radii.
    pub fn new(centre: DVec3, axis: DVec3, major_radius: f64, minor_radius: f64) -> Self {
        Self {
            centre: R::Vec3::from_f64(centre),
            axis: R::Vec3::from_f64(axis.normalize()),
            major_radius: R::from_f64(major_radius),
            minor_radius: R::from_f64(minor_radius),
        }
    }

    /// Robust: measured from the ray's point nearest to the centre, so that coefficients are of the torus' own size and the
    /// cubic one vanishes; none when that point is beyond the sphere around the torus, the ray stays above or below the tube
    /// wherever it is in that sphere, or passes through the hole.
    #[inline(always)]
    fn profile<P: Precision<Real = R>>(&self, probe: &Probe<P>) -> Option<Profile<P::Core>> {
        let (two, four): (P::Core, P::Core) = (num(2.0), num(4.0));
        let (axis, major) = (wide::<P>(self.axis), convert::<R, P::Core>(self.major_radius));
        let one_over = P::Core::ONE / major;
        let f = probe.origin - wide::<P>(self.centre);
        let ahead = -f.dot(probe.direction) * probe.inverse_length_squared;
        let near = f + probe.direction * ahead;
        let tube = convert::<R, P::Core>(self.minor_radius) * one_over;
        let f = near * one_over;
        let room = (P::Core::ONE + tube) * (P::Core::ONE + tube) - f.dot(f);
        let met = room >= P::Core::ZERO;
        if !met {
            return None;
        }
        // In units of the major radius along the ray.
        let inverse_length = probe.inverse_length_squared.sqrt();
        let d = probe.direction * inverse_length;
        let inverse_axis = P::Core::ONE / axis.dot(axis);
        let (height, lean) = (f.dot(axis), d.dot(axis));
        let reach = room.sqrt();
        let squared = f.dot(f);
        // Both by more than any rounding: there the quartic is far above zero. No nearer to the tube's height than that:
        let level = tube * axis.dot(axis).sqrt() * num(1.005);
        // and nowhere at that height as far from the axis as the tube.
        let (steep, hole) = (lean * lean, (P::Core::ONE - tube) * (P::Core::ONE - tube) * num(0.99));
        let rise = level + height.abs();
        if height.abs() - lean.abs() * reach > level || rise * rise < (hole - squared) * steep {
            return None;
        }
        let g = squared + (P::Core::ONE - tube) * (P::Core::ONE + tube);
        let quartic = Quartic {
            p: two * g - four + four * lean * lean * inverse_axis,
            q: num::<P::Core>(8.0) * height * lean * inverse_axis,
            w: g * g - four * (squared - height * height * inverse_axis),
        };
        Some(Profile { quartic, reach, middle: ahead, scale: major * inverse_length })
    }

    /// The textbook's: coefficients from the origin, the cubic one removed afterwards. In units of the torus and, along a
    /// mapped ray, of its direction, as fourth powers of both occur.
    #[inline(always)]
    fn textbook<P: Precision<Real = R>>(&self, probe: &Probe<P>) -> Option<Profile<P::Core>> {
        let (two, four): (P::Core, P::Core) = (num(2.0), num(4.0));
        let (axis, major, tube) = (
            wide::<P>(self.axis).normalize(),
            convert::<R, P::Core>(self.major_radius),
            convert::<R, P::Core>(self.minor_radius),
        );
        let (unit, per_unit) = unit_of::<P>(major);
        let (_, per_step) = unit_of::<P>(probe.direction.abs().max_element());
        let (major, tube) = (major * per_unit, tube * per_unit);
        let (f, d) = ((probe.origin - wide::<P>(self.centre)) * per_unit, probe.direction * per_step);
        let (aa, b, ff) = (d.dot(d), f.dot(d), f.dot(f));
        let (height, lean) = (f.dot(axis), d.dot(axis));
        let g = ff + major * major - tube * tube;
        let rr = four * major * major;
        let lead = P::Core::ONE / (aa * aa);
        let c3 = four * aa * b * lead;
        let c2 = (two * aa * g + four * b * b - rr * (aa - lean * lean)) * lead;
        let c1 = (four * b * g - two * rr * (b - height * lean)) * lead;
        let c0 = (g * g - rr * (ff - height * height)) * lead;
        let shift = c3 / four;
        let s2 = shift * shift;
        let quartic = Quartic {
            p: c2 - num::<P::Core>(6.0) * s2,
            q: c1 - two * shift * c2 + num::<P::Core>(8.0) * s2 * shift,
            w: c0 - shift * c1 + s2 * c2 - num::<P::Core>(3.0) * s2 * s2,
        };
        let reach = (major + tube) * P::Core::from_f64(1.001) / aa.sqrt();
        Some(Profile { quartic, reach, middle: -shift * (unit * per_step), scale: unit * per_step })
    }

    /// The root that was stored as a hit's distance.
    fn unrounded<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Option<P::Core> {
        let profile = self.profile(probe)?;
        profile.quartic.crossings(profile.reach, |x, enters| {
            let t = profile.middle + profile.scale * x;
            (convert::<P::Core, R>(t) == hit.t && enters != hit.leaves()).then_some(t)
        })
    }

    #[inline(always)]
    fn scale<P: Precision<Real = R>>(&self, point: CoreVec<P>) -> P::Core {
        let own = self.centre.abs().max_element() + self.major_radius + self.minor_radius;
        convert::<R, P::Core>(own) + point.abs().max_element()
    }

    /// The point of the tube around the circle's point in direction `spoke`, in the direction `normal` from there.
    fn on_tube<P: Precision<Real = R>>(&self, spoke: CoreVec<P>, normal: CoreVec<P>) -> Located<P::Core> {
        let (major, minor) = (convert::<R, P::Core>(self.major_radius), convert::<R, P::Core>(self.minor_radius));
        let point = wide::<P>(self.centre) + spoke * major + normal * minor;
        Located::new(point, normal, slack(self.scale::<P>(point)))
    }
}

impl<R: Real> Shape<R> for Torus<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        let (centre, axis) = (self.centre.to_f64(), self.axis.to_f64());
        let ring = disk_support(centre, axis, self.major_radius.to_f64(), direction);
        Some(ring + self.minor_radius.to_f64() * direction.length())
    }

    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let profile = if P::ROBUST { self.profile(probe)? } else { self.textbook(probe)? };
        profile.quartic.crossings(profile.reach, |x, enters| {
            let t = convert(profile.middle + profile.scale * x);
            (range.contains(t) && side.accepts(enters)).then(|| if enters { ShapeHit::at(t) } else { ShapeHit::leaving(t) })
        })
    }

    fn locate_under<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>, maps: Under<'_, P>) -> Located<P::Core> {
        let (centre, major) = (wide::<P>(self.centre), convert::<R, P::Core>(self.major_radius));
        // From the nearest point of the circle.
        let tube = |offset: CoreVec<P>| {
            let spoke = split::<P>(offset, self.axis).1.normalize();
            (spoke, offset - spoke * major)
        };
        // In a map's space and from far the rounding of the stored distance may be large: the root is looked up again.
        let looked_up = probe.needs_unrounded(hit.t, self.minor_radius);
        let exact = if looked_up { self.unrounded(probe, hit) } else { None };
        let raw = exact.map_or_else(|| probe.at(hit.t), |t| probe.origin + probe.direction * t);
        let (spoke, off) = tube(raw - centre);
        if P::ROBUST {
            let minor = convert::<R, P::Core>(self.minor_radius);
            return off_bends::<P>(self.on_tube::<P>(spoke, off.normalize()), maps, || [major - minor, minor]);
        }
        let error = slack(self.scale::<P>(probe.origin) + convert::<R, P::Core>(hit.t));
        Located::new(raw, off.normalize(), error)
    }

    /// u turns about the axis, v about the tube from its inner side, down on the outer one.
    fn parameters<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let located = self.locate(probe, hit);
        let (_, out) = split::<P>(located.point - wide::<P>(self.centre), self.axis);
        let (u, dpdu) = turn::<P>(out, self.axis);
        let axis = wide::<P>(self.axis).normalize();
        let up: R = convert(located.normal.dot(axis));
        let away: R = convert(located.normal.dot(out.normalize()));
        let full: R = num(core::f64::consts::TAU);
        Parameters { u, v: num::<R>(0.5) - up.atan2(away) / full, dpdu, mirrored: false }
    }
}

impl<R: Real> Torus<R> {
    /// One over the density where the tube's normal leans away from the axis by `away`.
    fn inverse_density(&self, away: f64) -> f64 {
        let (major, minor) = (self.major_radius.to_f64(), self.minor_radius.to_f64());
        core::f64::consts::TAU * core::f64::consts::TAU * minor * (major + minor * away)
    }
}

/// Drawn evenly over both angles.
impl<R: Real> SampleArea<R> for Torus<R> {
    fn area(&self) -> f64 {
        self.inverse_density(0.0)
    }

    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        let out = spoke::<P>(self.axis, u);
        let angle = v.to_f64() * core::f64::consts::TAU;
        let (away, up) = (libm::cos(angle), libm::sin(angle));
        let normal = out * num::<P::Core>(away) + wide::<P>(self.axis).normalize() * num::<P::Core>(up);
        (self.on_tube::<P>(out, normal), num(1.0 / self.inverse_density(away)))
    }

    fn density<P: Precision<Real = R>>(&self, point: &Located<P::Core>) -> P::Core {
        let axis = self.axis.to_f64().normalize();
        let offset = point.point.to_f64() - self.centre.to_f64();
        let out = (offset - axis * axis.dot(offset)).normalize();
        num(1.0 / self.inverse_density(point.normal.to_f64().dot(out)))
    }
}
