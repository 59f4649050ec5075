//! Drift: the distance, in object space, between the point of a hit and the origin of a ray from
//! it. Origins compensate for it to stay on the right side of *every* nearby surface.
//!
//! In world space an origin is offset along one face's normal, and rounded. Under a map that shears
//! and flattens a shape, both also move the origin along the other faces, and the inverse map
//! magnifies the world-space rounding. Above a curved face the origin lies above the tangent plane,
//! but possibly so far aside that the face has curved away from that plane.

use super::{OuterTransforms, SurfacePoint, Transform};
use crate::scalar::Real;
use glam::DVec3;

/// The maps from object space to the world, innermost first.
#[derive(Clone, Copy, Debug)]
pub struct TransformChain<'a> {
    pub(crate) map: &'a Transform,
    pub(crate) outer: Option<&'a TransformChain<'a>>,
}

impl<'a> TransformChain<'a> {
    fn to_world(self, surface_point: &SurfacePoint) -> SurfacePoint {
        let mapped = self.map.located_to_world(surface_point);
        self.outer.map_or(mapped, |outer| outer.to_world(&mapped))
    }

    fn gradient_to_world(self, gradient: DVec3) -> DVec3 {
        let mapped = self.map.normal_to_world(gradient);
        self.outer
            .map_or(mapped, |outer| outer.gradient_to_world(mapped))
    }

    /// Upper bound of the object-space length of a vector with world components of at most one.
    fn magnification(self) -> f64 {
        let own = self.map.magnification;
        self.outer.map_or(own, |outer| own * outer.magnification())
    }
}

/// Greatest drift in each world axis, and the maps to the world.
#[derive(Clone, Copy)]
pub(super) struct SpawnOffset<'a> {
    by: f64,
    transform_chain: Option<TransformChain<'a>>,
}

impl<'a> SpawnOffset<'a> {
    /// Drift around a face's point in object space with the given error.
    ///
    /// An origin is offset along the normal by the error bound times the sum of the normal's
    /// absolute components: in each axis by up to (1 + √3)/2 bounds. Rounding moves the point by
    /// less than a bound, and the offset sum by less than a bound. The step to the next number adds
    /// up to two bounds. The total is below five and a half bounds. Where the test's error
    /// dominates the bound, and not rounding, the total is below half of that. The other half
    /// covers the same uncertainty of the other faces.
    #[inline]
    pub fn around<R: Real>(
        transform_chain: Option<TransformChain<'a>>,
        point: DVec3,
        error: f64,
    ) -> Self {
        // Only the position and the bound matter.
        let surface_point = SurfacePoint::new(point, DVec3::ONE, error);
        let located_surface_point = transform_chain.map_or(surface_point, |transform_chain| {
            transform_chain.to_world(&surface_point)
        });
        let rounding = located_surface_point.point.abs().max_element() * R::ROUNDOFF.to_f64();
        Self {
            by: (located_surface_point.error + rounding) * 5.5,
            transform_chain,
        }
    }

    /// An object-space gradient, mapped to the world.
    #[inline]
    pub fn in_world(&self, gradient: DVec3) -> DVec3 {
        self.transform_chain.map_or(gradient, |transform_chain| {
            transform_chain.gradient_to_world(gradient)
        })
    }

    /// Greatest drift along a gradient: the greatest change of `gradient · p`.
    #[inline]
    pub fn offset_along(&self, gradient: DVec3) -> f64 {
        let g = self.in_world(gradient).abs();
        (g.x + g.y + g.z) * self.by
    }

    /// Greatest drift in any direction, in object space.
    #[inline]
    pub fn max_offset(&self) -> f64 {
        self.by
            * self
                .transform_chain
                .map_or(2.0, TransformChain::magnification)
    }
}

/// A curved surface, with ray origins moved off the surface to allow for its curvature. `balls`
/// returns the radii of balls that touch the surface anywhere without crossing it, on the outer and
/// on the inner side; infinite where it curves away.
///
/// An origin offset by its bound lies above the tangent plane at its point, up to `reach` r from
/// it. Moved along the normal by r²/ρ, the origin lies in the ball of radius ρ, for r below ρ: (ρ −
/// r²/ρ)² + r² < ρ². A larger reach has no safe origin.
#[inline(always)]
pub(super) fn off_bends<R: Real>(
    surface_point: SurfacePoint,
    transform_chain: OuterTransforms<'_>,
    balls: impl FnOnce() -> [f64; 2],
) -> SurfacePoint {
    match transform_chain {
        Some(transform_chain) => off_balls::<R>(&surface_point, transform_chain, balls()),
        None => surface_point,
    }
}

#[inline(never)]
fn off_balls<R: Real>(
    surface_point: &SurfacePoint,
    transform_chain: TransformChain<'_>,
    balls: [f64; 2],
) -> SurfacePoint {
    let reach = SpawnOffset::around::<R>(
        Some(transform_chain),
        surface_point.point,
        surface_point.error,
    )
    .max_offset();
    let [above, below] = balls.map(|ball| {
        if reach < ball {
            reach * (reach / ball)
        } else {
            0.0
        }
    });
    SurfacePoint {
        above: surface_point.point + surface_point.normal * above,
        below: surface_point.point - surface_point.normal * below,
        ..*surface_point
    }
}
