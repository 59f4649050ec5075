//! The cone, whole or truncated: a solid, closed at its ends.

use glam::DVec3;

use super::drift::Drift;
use super::frame::{disk_support, length, split, spoke, turn};
use super::quadratic::{Crossings, Quadratic, Span, approach, slab, tests_close};
use super::turned::{BASE, TOP, Turned, WALL};
use super::{Parameters, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, Under, slack};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

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
    fn wall(&self, probe: &PreparedRay, close: bool) -> Option<Crossings> {
        let (axis, d) = (self.axis.to_f64(), probe.direction);
        let (base_radius, top_radius) = (self.radius.to_f64(), self.top_radius.to_f64());
        let (ahead, f) = approach(probe, self.base.to_f64(), close);
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
        if quadratic.a > 0.0 {
            let roots = quadratic.roots()?;
            // Both on one nappe: the sign of the radius between them tells which.
            let middle = reach - opening * quadratic.b / quadratic.a;
            return (middle >= 0.0).then(|| roots.moved(ahead));
        }
        // Steeper than the wall or parallel to it: all beyond one root, on the side where the radius grows. Such a line
        // always meets the cone, whatever rounding makes of its discriminant.
        let roots = Quadratic { discriminant: quadratic.discriminant.max(0.0), ..quadratic }.roots()?;
        let roots = roots.moved(ahead);
        let grows = if quadratic.a < 0.0 { opening > 0.0 } else { quadratic.b < 0.0 };
        Some(if grows {
            Crossings { enter: roots.enter, leave: f64::INFINITY }
        } else {
            Crossings { enter: -f64::INFINITY, leave: roots.leave }
        })
    }

    #[inline(always)]
    fn span(&self, probe: &PreparedRay, close: bool) -> Option<Span> {
        let wall = if self.radius == self.top_radius { self.tube(probe, close)? } else { self.wall(probe, close)? };
        let axis = self.axis.to_f64();
        let height = axis.dot(probe.origin - self.base.to_f64());
        let ends = slab(height, axis.dot(probe.direction), axis.dot(axis), BASE, TOP)?;
        Some(Span::of(wall.enter, wall.leave, WALL).cut(ends))
    }

    /// The wall when both radii are equal: no nappe to choose, and along the axis no crossing.
    #[inline(always)]
    fn tube(&self, probe: &PreparedRay, close: bool) -> Option<Crossings> {
        let as_cylinder =
            super::Cylinder { base: self.base, axis: self.axis, radius: self.radius, ends: super::cylinder::Ends::None };
        as_cylinder.wall(probe, close)
    }

    #[inline(always)]
    fn scale(&self, point: DVec3) -> f64 {
        let own = self.base.abs().max_element() + self.axis.abs().max_element() + self.radius.max(self.top_radius);
        own.to_f64() + point.abs().max_element()
    }

    /// The radius at a fraction of the axis.
    #[inline(always)]
    fn radius_at(&self, along: f64) -> f64 {
        let (base, top) = (self.radius.to_f64(), self.top_radius.to_f64());
        base + (top - base) * along
    }

    /// The point of the wall at a fraction `along` of the axis, in the direction `out` across the axis, or at the tip where
    /// there is no such direction.
    fn on_wall(&self, along: f64, out: DVec3) -> SurfacePoint {
        let axis = self.axis.to_f64();
        let (height, distance) = (axis.length(), out.length());
        let has_side = distance > 0.0;
        let out = if has_side { out * (1.0 / distance) } else { DVec3::ZERO };
        let taper = self.top_radius.to_f64() - self.radius.to_f64();
        let point = self.base.to_f64() + axis * along + out * self.radius_at(along);
        let normal = if has_side { out * height - axis * (taper / height) } else { axis * 1.0_f64.copysign(-taper) };
        SurfacePoint::new(point, normal.normalize(), slack(self.scale(point)))
    }

    /// The point of an end at an offset from its centre.
    fn on_cap(&self, part: u8, offset: DVec3) -> SurfacePoint {
        let axis = self.axis.to_f64();
        let (end, normal) = if part == TOP { (1.0, axis.normalize()) } else { (0.0, -axis.normalize()) };
        let point = self.base.to_f64() + axis * end + offset;
        SurfacePoint::new(point, normal, slack(self.scale(point)))
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
    fn intersect(&self, probe: &PreparedRay, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        self.span(probe, tests_close(probe, self.base, self.radius.max(self.top_radius)))?.nearest(range, side)
    }

    fn locate_under(&self, probe: &PreparedRay, hit: ShapeHit<R>, maps: Under<'_>) -> SurfacePoint {
        let part = hit.u.to_f64() as u8;
        // The unrounded end of the span, so that the fraction along the axis is the hit's own.
        let t = self.span(probe, true).map_or_else(|| hit.t.to_f64(), |span| span.unrounded(hit));
        let raw = probe.origin + probe.direction * t;
        let (along, out) = split(raw - self.base.to_f64(), self.axis.to_f64());
        let located = if part == WALL { self.on_wall(along, out) } else { self.on_cap(part, out) };
        let solid = Turned { axis: self.axis.to_f64(), radii: [self.radius, self.top_radius].map(Real::to_f64) };
        let drift = Drift::around::<R>(maps, located.point, located.error);
        SurfacePoint { below: located.point + solid.inwards(part, (along, out), drift), ..located }
    }

    /// u turns about the axis; v runs down it, from 0 at the top to 1 at the base; on an end from its centre to its rim.
    fn parameters(&self, probe: &PreparedRay, hit: ShapeHit<R>) -> Parameters<R> {
        let part = hit.u.to_f64() as u8;
        let point = self.locate(probe, hit).point;
        let (along, out) = split(point - self.base.to_f64(), self.axis.to_f64());
        let (u, dpdu) = turn(out, self.axis.to_f64());
        let end_radius = if part == TOP { self.top_radius } else { self.radius };
        let v = if part == WALL { R::from_f64(1.0 - along) } else { R::from_f64(out.length()) / end_radius };
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

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let [wall, base, top] = self.areas();
        let out: DVec3 = spoke(self.axis.to_f64(), u.to_f64());
        let place = v.to_f64() * (wall + base + top);
        let on_cap = |part, share: f64, radius: R| {
            let distance: f64 = share.clamp(0.0, 1.0).sqrt();
            self.on_cap(part, out * (distance * radius.to_f64()))
        };
        let located = if place < wall {
            // The radius there is the root of an even mixture of the two squared ones.
            let (low, high, share) = (self.radius.to_f64(), self.top_radius.to_f64(), place / wall);
            let radius = (low * low + (high * high - low * low) * share).max(0.0).sqrt();
            // (radius − low)/(high − low), without the difference of equals.
            let along = (low + high) * share / (radius + low).max(f64::MIN_POSITIVE);
            self.on_wall(along.min(1.0), out)
        } else if place < wall + base {
            on_cap(BASE, (place - wall) / base, self.radius)
        } else {
            on_cap(TOP, (place - wall - base) / top, self.top_radius)
        };
        (located, 1.0 / self.area())
    }

    fn density(&self, _: &SurfacePoint) -> f64 {
        1.0 / self.area()
    }
}
