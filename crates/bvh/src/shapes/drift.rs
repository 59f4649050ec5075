//! How far the start of a ray may lie from where its surface was hit, seen from a space under maps:
//! what keeps a start on its own side of *everything* near it.
//!
//! A start is lifted off one face, and rounded, in the world. Under a map that flattens a shape
//! aslant, both take it along the other faces too, and there the inverse map magnifies what was a
//! rounding in the world. Of a curved face it then lies above the tangent plane, but so far to the
//! side that the face has bent away from there.

use super::{SurfacePoint, Transform, Under};
use crate::scalar::Real;
use glam::DVec3;

/// The maps between the space of a shape and the world, the innermost first.
#[derive(Clone, Copy, Debug)]
pub struct Maps<'a> {
    pub(crate) map: &'a Transform,
    pub(crate) outer: Option<&'a Maps<'a>>,
}

impl<'a> Maps<'a> {
    fn to_world(self, located: &SurfacePoint) -> SurfacePoint {
        let mapped = self.map.located_to_world(located);
        self.outer.map_or(mapped, |outer| outer.to_world(&mapped))
    }

    fn gradient_to_world(self, gradient: DVec3) -> DVec3 {
        let mapped = self.map.normal_to_world(gradient);
        self.outer
            .map_or(mapped, |outer| outer.gradient_to_world(mapped))
    }

    /// How long in the space of the shape at most is what is one in each axis of the world.
    fn magnification(self) -> f64 {
        let own = self.map.magnification;
        self.outer.map_or(own, |outer| own * outer.magnification())
    }
}

/// What a start may move by, in each axis of the world, and the maps to there.
#[derive(Clone, Copy)]
pub(super) struct Drift<'a> {
    by: f64,
    maps: Option<Maps<'a>>,
}

impl<'a> Drift<'a> {
    /// Around a point of a face in the shape's space, wrong by up to `error` there.
    ///
    /// A start is lifted along the normal by its error bound times the sum of the normal's
    /// components, in each axis by up to (1 + √3)/2 bounds. Its point is rounded, by less than a
    /// bound, and so is the sum; then comes the next number, up to two bounds away. All that is
    /// less than five and a half bounds, and where the error of the test makes most of the bound,
    /// not the rounding, less than half of that: as much is left for the other faces' being as
    /// uncertain as this one.
    #[inline]
    pub fn around<R: Real>(maps: Option<Maps<'a>>, point: DVec3, error: f64) -> Self {
        // Only the place and the bound matter.
        let own = SurfacePoint::new(point, DVec3::ONE, error);
        let located = maps.map_or(own, |maps| maps.to_world(&own));
        let rounding = located.point.abs().max_element() * R::ROUNDOFF.to_f64();
        Self {
            by: (located.error + rounding) * 5.5,
            maps,
        }
    }

    /// A gradient in the world.
    #[inline]
    pub fn in_world(&self, gradient: DVec3) -> DVec3 {
        self.maps
            .map_or(gradient, |maps| maps.gradient_to_world(gradient))
    }

    /// The most by which a start may differ from its point in the direction of a gradient: by so
    /// much may `gradient · p` change.
    #[inline]
    pub fn along(&self, gradient: DVec3) -> f64 {
        let g = self.in_world(gradient).abs();
        (g.x + g.y + g.z) * self.by
    }

    /// The most by which a start may differ from its point in any direction.
    #[inline]
    pub fn reach(&self) -> f64 {
        self.by * self.maps.map_or(2.0, Maps::magnification)
    }
}

/// A surface that bends, with its starts moved off it by what it may bend away under them: `balls`
/// are the radii of balls that touch it anywhere without crossing it, from the outer side and from
/// the inner; infinite where it bends away.
///
/// A start that is lifted by its bound lies above the tangent plane at its point, up to `reach` r
/// from it. Moved along the normal by r²/ρ it lies in the ball of radius ρ there, for r below ρ: (ρ
/// − r²/ρ)² + r² < ρ². No larger reach leaves it a safe place.
#[inline(always)]
pub(super) fn off_bends<R: Real>(
    located: SurfacePoint,
    maps: Under<'_>,
    balls: impl FnOnce() -> [f64; 2],
) -> SurfacePoint {
    match maps {
        Some(maps) => off_balls::<R>(&located, maps, balls()),
        None => located,
    }
}

#[inline(never)]
fn off_balls<R: Real>(located: &SurfacePoint, maps: Maps<'_>, balls: [f64; 2]) -> SurfacePoint {
    let reach = Drift::around::<R>(Some(maps), located.point, located.error).reach();
    let [above, below] = balls.map(|ball| {
        if reach < ball {
            reach * (reach / ball)
        } else {
            0.0
        }
    });
    SurfacePoint {
        above: located.point + located.normal * above,
        below: located.point - located.normal * below,
        ..*located
    }
}
