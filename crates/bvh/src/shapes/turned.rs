//! What cylinders and cones share: solids of revolution whose radius changes evenly between two
//! ends.

use super::drift::Drift;
use super::frame::{split, spoke, tangent, turn};
use super::quadratic::{Crossings, Quadratic, Span, approach};
use super::{Parameters, PreparedRay, SurfacePoint, Under, slack};
use crate::scalar::{Real, Vector};
use glam::DVec3;

/// Parts, as a hit's first number.
pub(super) const WALL: u8 = 0;
pub(super) const BASE: u8 = 1;
pub(super) const TOP: u8 = 2;

/// A solid of revolution that runs straight between two radii. Formulas are homogeneous in the
/// axis, so that the rounding of its components changes the solid's length or direction and never
/// its roundness.
pub(super) struct Turned {
    /// Centre of the base.
    pub base: DVec3,
    /// From there to the centre of the other end.
    pub axis: DVec3,
    /// Radii of the base and of the other end.
    pub radii: [f64; 2],
    /// Greatest coordinates and radius together.
    size: f64,
}

impl Turned {
    #[inline(always)]
    pub fn new<R: Real>(base: R::Vec3, axis: R::Vec3, radii: [R; 2]) -> Self {
        let size = base.abs().max_element() + axis.abs().max_element() + radii[0].max(radii[1]);
        Self {
            base: base.to_f64(),
            axis: axis.to_f64(),
            radii: radii.map(Real::to_f64),
            size: size.to_f64(),
        }
    }

    /// The infinite wall along a ray where both radii are equal, in distances from the ray's
    /// origin.
    #[inline(always)]
    pub fn tube(&self, probe: &PreparedRay, close: bool) -> Option<Crossings> {
        let (axis, radius) = (self.axis, self.radii[0]);
        let (ahead, f) = approach(probe, self.base, close);
        let (m, n) = (probe.direction.cross(axis), f.cross(axis));
        let (length, room) = (axis.dot(axis), radius * radius);
        let (a, b, c) = (m.dot(m), m.dot(n), n.dot(n) - room * length);
        if a == 0.0 {
            // Along the axis the wall is never crossed: everything is inside or nothing is.
            return (c <= a).then_some(Crossings {
                enter: -f64::INFINITY,
                leave: f64::INFINITY,
            });
        }
        // b² − a·c without cancellation: the ray passes the axis at |m·f|/|m|.
        let pass = m.dot(f);
        let discriminant = (a * room - pass * pass) * length;
        Quadratic {
            a,
            b,
            c,
            discriminant,
        }
        .roots()
        .map(|w| w.moved(ahead))
    }

    /// Where the ray is between the two ends, in distances from the ray's origin.
    #[inline(always)]
    pub fn between_ends(&self, probe: &PreparedRay) -> Option<Span> {
        let (height, slope) = (
            self.axis.dot(probe.origin - self.base),
            self.axis.dot(probe.direction),
        );
        let top = self.axis.dot(self.axis);
        if slope == 0.0 {
            return (0.0 <= height && height <= top)
                .then(|| Span::of(-f64::INFINITY, f64::INFINITY, BASE));
        }
        Some(Span::between(
            -height / slope,
            (top - height) / slope,
            [BASE, TOP],
            slope > 0.0,
        ))
    }

    /// Where the ray is within the wall and between the ends.
    #[inline(always)]
    pub fn span(&self, probe: &PreparedRay, wall: Crossings) -> Option<Span> {
        Some(Span::of(wall.enter, wall.leave, WALL).cut(self.between_ends(probe)?))
    }

    /// Lengths that a point of it is made of.
    #[inline(always)]
    pub fn scale(&self, point: DVec3) -> f64 {
        self.size + point.abs().max_element()
    }

    /// The point of an end at an offset from its centre.
    pub fn on_cap(&self, part: u8, offset: DVec3) -> SurfacePoint {
        let (end, normal) = if part == TOP {
            (1.0, self.axis.normalize())
        } else {
            (0.0, -self.axis.normalize())
        };
        let point = self.base + self.axis * end + offset;
        SurfacePoint::new(point, normal, slack(self.scale(point)))
    }

    /// u turns about the axis; v runs down it from `top`, on an end from its centre to its rim.
    pub fn parameters<R: Real>(&self, point: DVec3, part: u8, top: f64) -> Parameters<R> {
        let (along, out) = split(point - self.base, self.axis);
        let (u, dpdu) = turn(out, self.axis);
        let end_radius = R::from_f64(self.radii[usize::from(part == TOP)]);
        let v = if part == WALL {
            R::from_f64(top - along)
        } else {
            R::from_f64(out.length()) / end_radius
        };
        // The turn is one for both ends, so on the base, which faces the other way, it runs to the
        // left.
        Parameters {
            u,
            v,
            dpdu,
            mirrored: part == BASE,
        }
    }

    /// A point by two numbers in [0, 1), with areas of the wall, of the base and of the other end
    /// and all of them together. That of the wall is told by its share of the wall and the
    /// direction from the axis.
    pub fn sample(
        &self,
        [wall, base, top]: [f64; 3],
        area: f64,
        [u, v]: [f64; 2],
        on_wall: impl FnOnce(f64, DVec3) -> SurfacePoint,
    ) -> SurfacePoint {
        let (out, place) = (spoke(self.axis, u), v * area);
        let on_cap = |part, share: f64, radius: f64| {
            self.on_cap(part, out * (share.clamp(0.0, 1.0).sqrt() * radius))
        };
        if place < wall {
            on_wall(place / wall, out)
        } else if place < wall + base {
            on_cap(BASE, (place - wall) / base, self.radii[0])
        } else {
            on_cap(TOP, (place - wall - base) / top, self.radii[1])
        }
    }

    /// A point of a part, at a fraction of the axis and an offset across it, with its start for
    /// rays that go in where these maps can't bring it out again.
    pub fn start_inside<R: Real>(
        &self,
        located: SurfacePoint,
        part: u8,
        place: (f64, DVec3),
        maps: Under<'_>,
    ) -> SurfacePoint {
        let drift = Drift::around::<R>(maps, located.point, located.error);
        SurfacePoint {
            below: located.point + self.inwards(part, place, drift),
            ..located
        }
    }

    /// From a point of a part, at a fraction of the axis and an offset across it, to where a ray
    /// starts that goes in: inside of the wall and of both ends, so far as it may drift against
    /// each. The outer side asks for nothing, since what lies above the tangent plane of any point
    /// of a convex body is outside of it. A body that is thinner than its points are exact has no
    /// inside, and the start stays.
    #[inline(never)]
    fn inwards(&self, part: u8, (along, out): (f64, DVec3), drift: Drift<'_>) -> DVec3 {
        let (axis, [base, top]) = (self.axis, self.radii);
        let along = match part {
            BASE => 0.0,
            TOP => 1.0,
            _ => along,
        };
        let (taper, squared, length) = (top - base, axis.dot(axis), out.length());
        let over_axis = axis * (1.0 / squared);
        // On the axis, as at a tip that is hit exactly, any direction will do.
        let away = if length > 0.0 {
            out * (1.0 / length)
        } else {
            tangent(axis.normalize())
        };
        // How fast a start may come nearer to the ends, to the wall, to the wall on the other side,
        // and how far off to the side.
        let lengthwise = drift.along(over_axis);
        let (nearer, opposite) = (
            drift.along(away - over_axis * taper),
            drift.along(away + over_axis * taper),
        );
        let aside = drift.along(axis.cross(away) * (1.0 / squared.sqrt()));

        let mut least = if part == BASE { 0.0 } else { lengthwise };
        let mut most = if part == TOP { 1.0 } else { 1.0 - lengthwise };
        // Near a tip the wall on the other side is near as well: only where it is wide enough there
        // is an inside.
        let room = nearer.max(opposite) + aside;
        if taper > 0.0 {
            least = least.max((room - base) / taper);
        } else if taper < 0.0 {
            most = most.min((room - base) / taper);
        }
        let has_inside = least <= most && base.max(top) >= room;
        if !has_inside {
            return DVec3::ZERO;
        }
        let along_there = along.max(least).min(most);
        let radius = base + taper * along_there;
        // Off to the side the wall comes nearer: by no more than a start may go there, and in a
        // wide circle by less.
        let narrowest = radius - taper.abs() * lengthwise;
        let bend = if narrowest > aside {
            aside * (aside / narrowest)
        } else {
            aside
        };
        // On the wall a lifted start lies below the tangent plane already.
        let distance = if part == WALL {
            radius - bend
        } else {
            length.min(radius - nearer - bend)
        };
        let from = if part == WALL {
            base + taper * along
        } else {
            length
        };
        axis * (along_there - along) + away * (distance - from)
    }
}
