//! The cylinder: infinite, a finite open tube, or a finite solid with caps.

use glam::DVec3;

use super::drift::{Drift, off_bends};
use super::frame::{disk_support, split, spoke, turn};
use super::quadratic::{Crossings, Quadratic, Span, approach, point_at, slab, tests_close};
use super::turned::{BASE, TOP, Turned, WALL};
use super::{Parameters, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, Under, slack};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// What bounds a cylinder along its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Nothing: it is infinite.
    None,
    /// It ends, open.
    Open,
    /// It ends in caps and is a solid.
    Capped,
}

/// All points at `radius` from a line, or from a piece of it. Formulas are homogeneous in the axis, so that the rounding of
/// its components changes the shape's length or direction and never its roundness.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder<R: Real> {
    /// A point of the axis; the centre of one end when there are ends.
    pub base: R::Vec3,
    /// From the base to the other end; any length above zero for an infinite one.
    pub axis: R::Vec3,
    /// Radius, above zero.
    pub radius: R,
    /// How it ends.
    pub ends: Ends,
}

impl<R: Real> Cylinder<R> {
    /// From a point of the axis, its direction of any length above zero, radius, and the height unless infinite.
    pub fn new(base: DVec3, axis: DVec3, radius: f64, height: Option<f64>, caps: bool) -> Self {
        let ends = match height {
            None => Ends::None,
            Some(_) if caps => Ends::Capped,
            Some(_) => Ends::Open,
        };
        Self {
            base: R::Vec3::from_f64(base),
            axis: R::Vec3::from_f64(axis.normalize() * height.unwrap_or(1.0)),
            radius: R::from_f64(radius),
            ends,
        }
    }

    /// The infinite wall along a ray, in distances from the ray's origin.
    #[inline(always)]
    pub(super) fn wall(&self, probe: &PreparedRay, close: bool) -> Option<Crossings> {
        let (axis, radius) = (self.axis.to_f64(), self.radius.to_f64());
        let (ahead, f) = approach(probe, self.base.to_f64(), close);
        let (m, n) = (probe.direction.cross(axis), f.cross(axis));
        let (length, room) = (axis.dot(axis), radius * radius);
        let (a, b, c) = (m.dot(m), m.dot(n), n.dot(n) - room * length);
        if a == 0.0 {
            // Along the axis the wall is never crossed: everything is inside or nothing is.
            return (c <= a).then_some(Crossings { enter: -f64::INFINITY, leave: f64::INFINITY });
        }
        // b² − a·c without cancellation: the ray passes the axis at |m·f|/|m|.
        let pass = m.dot(f);
        let discriminant = (a * room - pass * pass) * length;
        Quadratic { a, b, c, discriminant }.roots().map(|w| w.moved(ahead))
    }

    /// Where the ray is between the two ends, in distances from the ray's origin.
    #[inline(always)]
    fn between_ends(&self, probe: &PreparedRay) -> Option<Span> {
        let axis = self.axis.to_f64();
        let height = axis.dot(probe.origin - self.base.to_f64());
        slab(height, axis.dot(probe.direction), axis.dot(axis), BASE, TOP)
    }

    /// Where the ray is within the wall and between the ends.
    #[inline(always)]
    fn solid(&self, probe: &PreparedRay, wall: Crossings) -> Option<Span> {
        Some(Span::of(wall.enter, wall.leave, WALL).cut(self.between_ends(probe)?))
    }

    /// Where the ray is at a hit: at the unrounded distance where the precision asks for it.
    fn raw(&self, probe: &PreparedRay, hit: ShapeHit<R>) -> DVec3 {
        let wall = self.wall(probe, true);
        if self.ends != Ends::Capped {
            return point_at(probe, wall, hit);
        }
        let solid = wall.and_then(|w| self.solid(probe, w));
        point_at(probe, solid.map(|s| Crossings { enter: s.near, leave: s.far }), hit)
    }

    #[inline(always)]
    fn scale(&self, point: DVec3) -> f64 {
        let own = self.base.abs().max_element() + self.axis.abs().max_element() + self.radius;
        own.to_f64() + point.abs().max_element()
    }

    /// The point of the wall at a fraction `along` of the axis, seen from the axis in the direction `out`.
    fn on_wall(&self, along: f64, out: DVec3) -> SurfacePoint {
        let normal = out.normalize();
        let point = self.base.to_f64() + self.axis.to_f64() * along + normal * self.radius.to_f64();
        SurfacePoint::new(point, normal, slack(self.scale(point)))
    }

    /// The point of a cap at an offset from its centre.
    fn on_cap(&self, part: u8, offset: DVec3) -> SurfacePoint {
        let axis = self.axis.to_f64();
        let (end, normal) = if part == TOP { (1.0, axis.normalize()) } else { (0.0, -axis.normalize()) };
        let point = self.base.to_f64() + axis * end + offset;
        SurfacePoint::new(point, normal, slack(self.scale(point)))
    }
}

impl<R: Real> Shape<R> for Cylinder<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        let (base, axis, radius) = (self.base.to_f64(), self.axis.to_f64(), self.radius.to_f64());
        let end = |centre: DVec3| disk_support(centre, axis, radius, direction);
        (self.ends != Ends::None).then(|| end(base) + axis.dot(direction).max(0.0))
    }

    #[inline]
    fn intersect(&self, probe: &PreparedRay, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let wall = self.wall(probe, tests_close(probe, self.base, self.radius))?;
        match self.ends {
            Ends::None => wall.nearest(range, side, |_| true),
            Ends::Open => {
                let span = self.between_ends(probe)?;
                wall.nearest(range, side, |t| span.near <= t && t <= span.far)
            }
            Ends::Capped => self.solid(probe, wall)?.nearest(range, side),
        }
    }

    fn locate_under(&self, probe: &PreparedRay, hit: ShapeHit<R>, maps: Under<'_>) -> SurfacePoint {
        let part = hit.u.to_f64() as u8;
        let raw = self.raw(probe, hit);
        let (mut along, mut out) = split(raw - self.base.to_f64(), self.axis.to_f64());
        if self.ends == Ends::Capped && maps.is_none() {
            // Wall and caps are at right angles here, so only rounding brings a start across a seam. Kept away from the seam
            // by what rounding the point may move it, for rays that start inside.
            let reach = self.scale(raw) * R::ROUNDOFF.to_f64() * 4.0;
            let margin = (reach / self.axis.to_f64().length()).min(0.5);
            along = along.max(margin).min(1.0 - margin);
            let (distance, rim) = (out.length(), self.radius.to_f64() - reach);
            if part != WALL && distance > rim {
                out *= rim.max(0.0) / distance;
            }
        }
        let located = if part == WALL { self.on_wall(along, out) } else { self.on_cap(part, out) };
        let radius = self.radius.to_f64();
        if self.ends != Ends::Capped {
            return off_bends::<R>(located, maps, || [f64::INFINITY, radius]);
        }
        if maps.is_none() {
            return located;
        }
        let solid = Turned { axis: self.axis.to_f64(), radii: [radius; 2] };
        let drift = Drift::around::<R>(maps, located.point, located.error);
        SurfacePoint { below: located.point + solid.inwards(part, (along, out), drift), ..located }
    }

    /// u turns about the axis; v runs down it, from 0 at the top to 1 at the base, of an infinite one in its own units from the
    /// base; on a cap from the centre to the rim.
    fn parameters(&self, probe: &PreparedRay, hit: ShapeHit<R>) -> Parameters<R> {
        let point = self.locate(probe, hit).point;
        let (along, out) = split(point - self.base.to_f64(), self.axis.to_f64());
        let (u, dpdu) = turn(out, self.axis.to_f64());
        let top = if self.ends == Ends::None { 0.0 } else { 1.0 };
        let v = if hit.u == R::ZERO { R::from_f64(top - along) } else { R::from_f64(out.length()) / self.radius };
        // The turn is one for both ends, so on the base, which faces the other way, it runs to the left.
        Parameters { u, v, dpdu, mirrored: hit.u.to_f64() == f64::from(BASE) }
    }
}

impl<R: Real> Cylinder<R> {
    /// Areas of the wall and of one cap.
    fn areas(&self) -> (f64, f64) {
        let (radius, height) = (self.radius.to_f64(), self.axis.to_f64().length());
        let cap = if self.ends == Ends::Capped { core::f64::consts::PI * radius * radius } else { 0.0 };
        (core::f64::consts::TAU * radius * height, cap)
    }
}

/// Of a finite one; an infinite one counts as if it ended.
impl<R: Real> SampleArea<R> for Cylinder<R> {
    fn area(&self) -> f64 {
        let (wall, cap) = self.areas();
        wall + 2.0 * cap
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let (wall, cap) = self.areas();
        let out: DVec3 = spoke(self.axis.to_f64(), u.to_f64());
        let place = v.to_f64() * (wall + 2.0 * cap);
        let on_cap = |part, share: f64| {
            let distance: f64 = share.clamp(0.0, 1.0).sqrt();
            self.on_cap(part, out * (distance * self.radius.to_f64()))
        };
        let located = if place < wall {
            self.on_wall(place / wall, out)
        } else if place < wall + cap {
            on_cap(BASE, (place - wall) / cap)
        } else {
            on_cap(TOP, (place - wall - cap) / cap)
        };
        (located, 1.0 / self.area())
    }

    fn density(&self, _: &SurfacePoint) -> f64 {
        1.0 / self.area()
    }
}
