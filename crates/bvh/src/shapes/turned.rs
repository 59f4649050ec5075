//! What cylinders with ends and cones share: solids of revolution whose radius changes evenly between two ends.

use super::drift::Drift;
use super::frame::tangent;
use glam::DVec3;

/// Parts, as a hit's first number.
pub(super) const WALL: u8 = 0;
pub(super) const BASE: u8 = 1;
pub(super) const TOP: u8 = 2;

/// A solid of revolution that runs straight between two radii.
pub(super) struct Turned {
    /// From the centre of the base to that of the other end.
    pub axis: DVec3,
    /// Radii of the base and of the other end.
    pub radii: [f64; 2],
}

impl Turned {
    /// From a point of a part, at a fraction of the axis and an offset across it, to where a ray starts that goes in: inside of
    /// the wall and of both ends, so far as it may drift against each. The outer side asks for nothing, since what lies above
    /// the tangent plane of any point of a convex body is outside of it. A body that is thinner than its points are exact has no
    /// inside, and the start stays.
    #[inline(never)]
    pub fn inwards(&self, part: u8, (along, out): (f64, DVec3), drift: Drift<'_>) -> DVec3 {
        let (axis, [base, top], zero) = (self.axis, self.radii, 0.0);
        let along = match part {
            BASE => zero,
            TOP => 1.0,
            _ => along,
        };
        let (taper, squared, length) = (top - base, axis.dot(axis), out.length());
        let over_axis = axis * (1.0 / squared);
        // On the axis, as at a tip that is hit exactly, any direction will do.
        let away = if length > zero { out * (1.0 / length) } else { tangent(axis.normalize()) };
        // How fast a start may come nearer to the ends, to the wall, to the wall on the other side, and how far off to the side.
        let lengthwise = drift.along(over_axis);
        let (nearer, opposite) = (drift.along(away - over_axis * taper), drift.along(away + over_axis * taper));
        let aside = drift.along(axis.cross(away) * (1.0 / squared.sqrt()));

        let mut least = if part == BASE { zero } else { lengthwise };
        let mut most = if part == TOP { 1.0 } else { 1.0 - lengthwise };
        // Near a tip the wall on the other side is near as well: only where it is wide enough there is an inside.
        let room = nearer.max(opposite) + aside;
        if taper > zero {
            least = least.max((room - base) / taper);
        } else if taper < zero {
            most = most.min((room - base) / taper);
        }
        let has_inside = least <= most && base.max(top) >= room;
        if !has_inside {
            return DVec3::ZERO;
        }
        let along_there = along.max(least).min(most);
        let radius = base + taper * along_there;
        // Off to the side the wall comes nearer: by no more than a start may go there, and in a wide circle by less.
        let narrowest = radius - taper.abs() * lengthwise;
        let bend = if narrowest > aside { aside * (aside / narrowest) } else { aside };
        // On the wall a lifted start lies below the tangent plane already.
        let distance = if part == WALL { radius - bend } else { length.min(radius - nearer - bend) };
        let from = if part == WALL { base + taper * along } else { length };
        axis * (along_there - along) + away * (distance - from)
    }
}
