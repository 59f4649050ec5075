//! How far the start of a ray may lie from where its surface was hit, seen from a space under maps: what keeps a start beside
//! an edge on its own side of *both* faces there.
//!
//! A start is lifted off one face, and rounded, in the world. Under a map that flattens a shape aslant, both take it along
//! the other faces too, and there the inverse map magnifies what was a rounding in the world.

use super::frame::tangent;
use super::{CoreVec, num};
use crate::scalar::{Precision, Real, Vector, convert};
use crate::shapes::Located;
use crate::transform::Transform;

/// The maps between the space of a shape and the world, the innermost first.
#[derive(Clone, Copy, Debug)]
pub struct Maps<'a, C: Real> {
    map: &'a Transform<C>,
    outer: Option<&'a Maps<'a, C>>,
}

impl<'a, C: Real> Maps<'a, C> {
    /// A map with those of the space that it leads to.
    pub fn new(map: &'a Transform<C>, outer: Option<&'a Maps<'a, C>>) -> Self {
        Self { map, outer }
    }

    fn to_world(self, located: &Located<C>) -> Located<C> {
        let mapped = self.map.located_to_world(located);
        self.outer.map_or(mapped, |outer| outer.to_world(&mapped))
    }

    fn gradient_to_world(self, gradient: C::Vec3) -> C::Vec3 {
        let mapped = self.map.normal_to_world(gradient);
        self.outer.map_or(mapped, |outer| outer.gradient_to_world(mapped))
    }
}

/// The greatest share of a shape's size by which a point is kept from its edges. Where starts move by more, the shape is
/// thinner than its points are exact: no place in it is safe, and the point stays where the ray met it.
pub(super) const MOST_MOVED: f64 = 1.0 / 16.0;

/// What a start may move by, in each axis of the world, and the maps to there.
#[derive(Clone, Copy)]
pub(super) struct Drift<'a, C: Real> {
    by: C,
    maps: Option<Maps<'a, C>>,
}

/// A point of a solid of revolution as a start can use it.
pub(super) struct Kept<C: Real> {
    /// Fraction of the axis.
    pub along: C,
    /// Offset across the axis; on the wall only its direction counts.
    pub out: C::Vec3,
    /// On the wall, not on an end.
    pub on_wall: bool,
}

impl<'a, C: Real> Drift<'a, C> {
    /// Around a point of a face in the shape's space, wrong by up to `error` there.
    ///
    /// A start is lifted along the normal by its error bound times the sum of the normal's components, in each axis by up to
    /// (1 + √3)/2 bounds; its point is rounded, by less than a bound, and so is the sum, and then comes the next number. The
    /// other face is as uncertain as this one. Five bounds are all of that.
    #[inline(always)]
    pub fn around<P: Precision<Core = C>>(maps: Option<Maps<'a, C>>, point: CoreVec<P>, error: C) -> Self {
        // Only the place and the bound matter.
        let own = Located::new(point, C::Vec3::ONE, error);
        let located = maps.map_or(own, |maps| maps.to_world(&own));
        let rounding = located.point.abs().max_element() * convert::<P::Real, C>(P::Real::ROUNDOFF);
        Self { by: (located.error + rounding) * num(5.0), maps }
    }

    /// The most by which a start may differ from its point in the direction of a gradient: by so much may `gradient · p` change.
    #[inline(always)]
    pub fn along(&self, gradient: C::Vec3) -> C {
        let g = self.maps.map_or(gradient, |maps| maps.gradient_to_world(gradient)).abs();
        (g.x() + g.y() + g.z()) * self.by
    }

    /// A point of a solid of revolution kept away from its seams: `along` is its fraction of the axis, `out` its offset across
    /// it, `end` the radius of the end on which it lies, none on the wall, which runs straight between two radii.
    pub fn off_seams(&self, axis: C::Vec3, [base, top]: [C; 2], end: Option<C>, (along, out): (C, C::Vec3)) -> Kept<C> {
        let (squared, distance) = (axis.dot(axis), out.length());
        let over_axis = axis * (C::ONE / squared);
        // On the axis, as at a tip that is hit exactly, any direction will do.
        let away =
            if distance > C::ZERO { out * (C::ONE / distance) } else { C::Vec3::from_f64(tangent(axis.to_f64().normalize())) };
        // How fast a start may come nearer to the wall, and how far it may come off to the side.
        let nearer = self.along(away - over_axis * (top - base));
        let aside = self.along(axis.cross(away) * (C::ONE / squared.sqrt()));
        if let Some(radius) = end {
            // Off to the side a start leaves the circle later than straight on, but it does.
            let rim = (radius * radius - aside * aside).max(C::ZERO).sqrt() - nearer;
            let widest = base.max(top) * num(MOST_MOVED);
            if radius > widest && radius - rim > widest {
                return Kept { along, out, on_wall: false };
            }
            if rim > C::ZERO {
                return Kept { along, out: if distance > rim { away * rim } else { out }, on_wall: false };
            }
            // An end too small to start from, as a tip is: then from the wall beside it.
        }
        let most: C = num(MOST_MOVED);
        let margin = self.along(over_axis);
        let margin = if margin <= most { margin } else { C::ZERO };
        let along = along.max(margin).min(C::ONE - margin);
        // Near a tip the wall on the other side is a seam too.
        let room = (nearer + aside).min(base.max(top) * most);
        let thin = base + (top - base) * along < room;
        if !thin {
            return Kept { along, out, on_wall: true };
        }
        // So close to the tip that the offset may be little but rounding: made perpendicular once more.
        let out = away - over_axis * axis.dot(away);
        Kept { along: (room - base) / (top - base), out, on_wall: true }
    }
}
