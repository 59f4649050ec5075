//! The cone, whole or truncated: a solid, closed at its ends.

use glam::DVec3;

use super::drift::Drift;
use super::frame::{disk_support, length, split, spoke, turn};
use super::quadratic::{Crossings, Quadratic, Span, approach, slab, tests_close};
use super::turned::{BASE, TOP, Turned, WALL};
use super::unit::unit_of;
use super::{CoreVec, Located, Parameters, Probe, SampleArea, Shape, ShapeHit, Under, num, slack, wide};
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert};

/// A solid whose radius changes evenly along its axis. Formulas are homogeneous in the axis, as for the cylinder.
#[derive(Clone, Copy, Debug)]
pub struct Cone<R: Real> {
    /// Centre of the base.
    pub base: R::Vec3,
    /// From the base to the centre of the other end, or to the tip.
    pub axis: R::Vec3,
    /// Radius of the base, not below zero.
    pub radius: R,
    /// Radius of the other end, not below zero; one of the two is above.
    pub top_radius: R,
}

impl<R: Real> Cone<R> {
    /// From the centre of the base, the direction of the axis with any length above zero, the two radii and the height.
    pub fn new(base: DVec3, axis: DVec3, radius: f64, top_radius: f64, height: f64) -> Self {
        Self {
            base: R::Vec3::from_f64(base),
            axis: R::Vec3::from_f64(axis.normalize() * height),
            radius: R::from_f64(radius),
            top_radius: R::from_f64(top_radius),
        }
    }

    /// The distances that the ray spends within the wall's nappe of non-negative radius: one range, though the double cone
    /// may have two.
    #[inline(always)]
    fn wall<P: Precision<Real = R>>(&self, probe: &Probe<P>, close: bool) -> Option<Crossings<P::Core>> {
        let (axis, d) = (wide::<P>(self.axis), probe.direction);
        let (base_radius, top_radius) = (convert::<R, P::Core>(self.radius), convert::<R, P::Core>(self.top_radius));
        let (unit, per_unit) = unit_of::<P>(axis.abs().max_element().max(base_radius).max(top_radius));
        let (axis, base_radius, top_radius) = (axis * per_unit, base_radius * per_unit, top_radius * per_unit);
        let (ahead, f) = approach(probe, wide::<P>(self.base), close);
        let f = f * per_unit;
        let squared = axis.dot(axis);
        let (m, n) = (d.cross(axis), f.cross(axis));
        // The radius at the ray's point, times the axis squared: `reach + t·opening`.
        let taper = top_radius - base_radius;
        let (reach, opening) = (base_radius * squared + taper * f.dot(axis), taper * d.dot(axis));
        let quadratic = Quadratic::new(
            squared * m.dot(m) - opening * opening,
            squared * m.dot(n) - reach * opening,
            squared * n.dot(n) - reach * reach,
        );
        let (zero, infinite) = (P::Core::ZERO, P::Core::INFINITY);
        if quadratic.a > zero {
            let roots = quadratic.roots::<P>()?;
            // Both on one nappe: the sign of the radius between them tells which.
            let middle = reach - opening * quadratic.b / quadratic.a;
            return (middle >= zero).then(|| roots.in_units_of(unit).moved(ahead));
        }
        // Steeper than the wall or parallel to it: all beyond one root, on the side where the radius grows. Such a line
        // always meets the cone, whatever rounding makes of its discriminant.
        let roots = Quadratic { discriminant: quadratic.discriminant.max(zero), ..quadratic }.roots::<P>()?;
        let roots = roots.in_units_of(unit).moved(ahead);
        let grows = if quadratic.a < zero { opening > zero } else { quadratic.b < zero };
        Some(if grows {
            Crossings { enter: roots.enter, leave: infinite }
        } else {
            Crossings { enter: -infinite, leave: roots.leave }
        })
    }

    #[inline(always)]
    fn span<P: Precision<Real = R>>(&self, probe: &Probe<P>, close: bool) -> Option<Span<P::Core>> {
        let wall = if self.radius == self.top_radius { self.tube(probe, close)? } else { self.wall(probe, close)? };
        let axis = wide::<P>(self.axis);
        let height = axis.dot(probe.origin - wide::<P>(self.base));
        let ends = slab(height, axis.dot(probe.direction), axis.dot(axis), BASE, TOP)?;
        Some(Span::of(wall.enter, wall.leave, WALL).cut(ends))
    }

    /// The wall when both radii are equal: no nappe to choose, and along the axis no crossing.
    #[inline(always)]
    fn tube<P: Precision<Real = R>>(&self, probe: &Probe<P>, close: bool) -> Option<Crossings<P::Core>> {
        let as_cylinder =
            super::Cylinder { base: self.base, axis: self.axis, radius: self.radius, ends: super::cylinder::Ends::None };
        as_cylinder.wall(probe, close)
    }

    #[inline(always)]
    fn scale<P: Precision<Real = R>>(&self, point: CoreVec<P>) -> P::Core {
        let own = self.base.abs().max_element() + self.axis.abs().max_element() + self.radius.max(self.top_radius);
        convert::<R, P::Core>(own) + point.abs().max_element()
    }

    /// The radius at a fraction of the axis.
    #[inline(always)]
    fn radius_at<P: Precision<Real = R>>(&self, along: P::Core) -> P::Core {
        let (base, top) = (convert::<R, P::Core>(self.radius), convert::<R, P::Core>(self.top_radius));
        base + (top - base) * along
    }

    /// The point of the wall at a fraction `along` of the axis, in the direction `out` across the axis, or at the tip where
    /// there is no such direction.
    fn on_wall<P: Precision<Real = R>>(&self, along: P::Core, out: CoreVec<P>) -> Located<P::Core> {
        let axis = wide::<P>(self.axis);
        let (height, distance) = (axis.length(), out.length());
        let has_side = distance > P::Core::ZERO;
        let out = if has_side { out * (P::Core::ONE / distance) } else { CoreVec::<P>::ZERO };
        let taper = convert::<R, P::Core>(self.top_radius) - convert::<R, P::Core>(self.radius);
        let point = wide::<P>(self.base) + axis * along + out * self.radius_at::<P>(along);
        let normal = if has_side { out * height - axis * (taper / height) } else { axis * P::Core::ONE.copysign(-taper) };
        Located::new(point, normal.normalize(), slack(self.scale::<P>(point)))
    }

    /// The point of an end at an offset from its centre.
    fn on_cap<P: Precision<Real = R>>(&self, part: u8, offset: CoreVec<P>) -> Located<P::Core> {
        let axis = wide::<P>(self.axis);
        let (end, normal) = if part == TOP { (P::Core::ONE, axis.normalize()) } else { (P::Core::ZERO, -axis.normalize()) };
        let point = wide::<P>(self.base) + axis * end + offset;
        Located::new(point, normal, slack(self.scale::<P>(point)))
    }
}

impl<R: Real> Shape<R> for Cone<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        let (base, axis) = (self.base.to_f64(), self.axis.to_f64());
        let end = |centre: DVec3, radius: R| disk_support(centre, axis, radius.to_f64(), direction);
        let (base, top) = (end(base, self.radius), end(base + axis, self.top_radius));
        Some((base + top) * 0.0 + base.max(top))
    }

    #[inline]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        self.span(probe, tests_close(probe, self.base, self.radius.max(self.top_radius)))?.nearest(range, side)
    }

    fn locate_under<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>, maps: Under<'_, P>) -> Located<P::Core> {
        let part = hit.u.to_f64() as u8;
        // The unrounded end of the span, so that the fraction along the axis is the hit's own.
        let t = match self.span(probe, P::ROBUST) {
            Some(span) if P::ROBUST => span.unrounded(hit),
            _ => convert(hit.t),
        };
        let raw = probe.origin + probe.direction * t;
        let (along, out) = split::<P>(raw - wide::<P>(self.base), self.axis);
        let located = if part == WALL { self.on_wall::<P>(along, out) } else { self.on_cap::<P>(part, out) };
        if !P::ROBUST {
            return located;
        }
        let solid = Turned { axis: wide::<P>(self.axis), radii: [self.radius, self.top_radius].map(convert::<R, P::Core>) };
        let drift = Drift::around::<P>(maps, located.point, located.error);
        Located { below: located.point + solid.inwards(part, (along, out), drift), ..located }
    }

    /// u turns about the axis; v runs down it, from 0 at the top to 1 at the base; on an end from its centre to its rim.
    fn parameters<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let part = hit.u.to_f64() as u8;
        let point = self.locate(probe, hit).point;
        let (along, out) = split::<P>(point - wide::<P>(self.base), self.axis);
        let (u, dpdu) = turn::<P>(out, self.axis);
        let end_radius = if part == TOP { self.top_radius } else { self.radius };
        let v = if part == WALL { convert(P::Core::ONE - along) } else { convert::<P::Core, R>(out.length()) / end_radius };
        // The turn is one for both ends, so on the base, which faces the other way, it runs to the left.
        Parameters { u, v, dpdu, mirrored: part == BASE }
    }
}

impl<R: Real> Cone<R> {
    /// Areas of the wall, the base and the other end.
    fn areas(&self) -> [f64; 3] {
        let (base, top, height) = (self.radius.to_f64(), self.top_radius.to_f64(), self.axis.to_f64().length());
        let pi = core::f64::consts::PI;
        [pi * (base + top) * length(height, base - top), pi * base * base, pi * top * top]
    }
}

impl<R: Real> SampleArea<R> for Cone<R> {
    fn area(&self) -> f64 {
        self.areas().iter().sum()
    }

    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        let [wall, base, top] = self.areas();
        let out: CoreVec<P> = spoke::<P>(self.axis, u);
        let place = v.to_f64() * (wall + base + top);
        let on_cap = |part, share: f64, radius: R| {
            let distance: P::Core = num(share.clamp(0.0, 1.0).sqrt());
            self.on_cap::<P>(part, out * (distance * convert::<R, P::Core>(radius)))
        };
        let located = if place < wall {
            // The radius there is the root of an even mixture of the two squared ones.
            let (low, high, share) = (self.radius.to_f64(), self.top_radius.to_f64(), place / wall);
            let radius = (low * low + (high * high - low * low) * share).max(0.0).sqrt();
            // (radius − low)/(high − low), without the difference of equals.
            let along = (low + high) * share / (radius + low).max(f64::MIN_POSITIVE);
            self.on_wall::<P>(num(along.min(1.0)), out)
        } else if place < wall + base {
            on_cap(BASE, (place - wall) / base, self.radius)
        } else {
            on_cap(TOP, (place - wall - base) / top, self.top_radius)
        };
        (located, num(1.0 / self.area()))
    }

    fn density<P: Precision<Real = R>>(&self, _: &Located<P::Core>) -> P::Core {
        num(1.0 / self.area())
    }
}
