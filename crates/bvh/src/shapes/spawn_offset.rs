//! Drift: the distance, in object space, between a hit point and the origin of a ray that starts at
//! it. Base points of rays are moved to compensate for the drift, so that an origin stays on the
//! right side of *every* nearby surface.
//!
//! In world space an origin is offset along the normal of one face, and rounded. Under a map that
//! shears and flattens a shape, both steps also move the origin along the other faces, and the
//! inverse map magnifies the rounding. Above a curved face, the origin lies above the tangent
//! plane, but possibly so far aside that the face has curved away from the plane.

use super::{OuterTransforms, SurfacePoint, Transform};
use crate::scalar::Real;
use glam::DVec3;

/// The nested maps from object space to the world, the innermost first.
#[derive(Clone, Copy, Debug)]
pub struct TransformChain<'a> {
    /// Innermost map, from object space.
    pub(crate) map: &'a Transform,
    /// Further maps, from the space after `map` to the world.
    pub(crate) outer: Option<&'a TransformChain<'a>>,
}

impl<'a> TransformChain<'a> {
    fn to_world(self, surface_point: &SurfacePoint) -> SurfacePoint {
        let mapped = self.map.surface_point_to_world(surface_point);
        self.outer.map_or(mapped, |outer| outer.to_world(&mapped))
    }

    fn gradient_to_world(self, gradient: DVec3) -> DVec3 {
        let mapped = self.map.normal_to_world(gradient);
        self.outer
            .map_or(mapped, |outer| outer.gradient_to_world(mapped))
    }

    /// Upper bound of the object-space length of a vector whose world-space components are at most
    /// one.
    fn magnification(self) -> f64 {
        let own = self.map.magnification;
        self.outer.map_or(own, |outer| own * outer.magnification())
    }
}

/// The maps from object space to the world, and an upper bound of the drift around one hit point:
/// of the distance between the hit point and the origin of a ray that starts there.
#[derive(Clone, Copy)]
pub(super) struct SpawnOffset<'a> {
    /// Upper bound of the drift along each axis of the world.
    world_offset: f64,
    transform_chain: Option<TransformChain<'a>>,
}

impl<'a> SpawnOffset<'a> {
    /// Computes the drift bound for a point in object space with the given error.
    ///
    /// An origin is offset along the normal by the error bound times the sum of the normal's
    /// absolute components, which is up to (1 + √3)/2 bounds in each axis. The rounding of the
    /// point and of the offset sum each add less than one bound. The step to the next number adds
    /// up to two bounds. The total is below five and a half bounds. Where the error of the
    /// intersection test exceeds the rounding, the total is below half as much. The remaining half
    /// covers the same uncertainty of the other faces.
    #[inline]
    pub fn from_surface_error<R: Real>(
        transform_chain: Option<TransformChain<'a>>,
        point: DVec3,
        error: f64,
    ) -> Self {
        // The normal has no effect here: only the position and the error bound are mapped.
        let surface_point = SurfacePoint::new(point, DVec3::ONE, error);
        let located_surface_point = transform_chain.map_or(surface_point, |transform_chain| {
            transform_chain.to_world(&surface_point)
        });
        let rounding = located_surface_point.point.abs().max_element() * R::ROUNDOFF.to_f64();
        Self {
            world_offset: (located_surface_point.error + rounding) * 5.5,
            transform_chain,
        }
    }

    /// Maps a gradient, such as a plane's normal, from object space to the world.
    #[inline]
    pub fn gradient_to_world(&self, gradient: DVec3) -> DVec3 {
        self.transform_chain.map_or(gradient, |transform_chain| {
            transform_chain.gradient_to_world(gradient)
        })
    }

    /// Returns the greatest drift along a gradient: the greatest change of `gradient · p` from the
    /// hit point to any possible ray origin p.
    #[inline]
    pub fn offset_along(&self, gradient: DVec3) -> f64 {
        let g = self.gradient_to_world(gradient).abs();
        (g.x + g.y + g.z) * self.world_offset
    }

    /// Returns the greatest drift in any direction, as a length in object space.
    #[inline]
    pub fn max_offset(&self) -> f64 {
        self.world_offset
            * self
                .transform_chain
                .map_or(2.0, TransformChain::magnification)
    }
}

/// Moves the ray origins of a point on a curved surface off the surface, to allow for its
/// curvature. `balls` returns the radii of two balls, on the outer and on the inner side, that may
/// touch the surface at any point without crossing it. A radius is infinite where the surface
/// curves away from the side.
///
/// An origin that is offset by its error bound lies above the tangent plane, up to the reach r away
/// from the point. After a move along the normal by r²/ρ, the origin lies in the ball of radius ρ,
/// if r is below ρ: (ρ − r²/ρ)² + r² < ρ². A larger reach has no safe origin.
#[inline(always)]
pub(super) fn offset_ray_origins_for_curvature<R: Real>(
    surface_point: SurfacePoint,
    transform_chain: OuterTransforms<'_>,
    balls: impl FnOnce() -> [f64; 2],
) -> SurfacePoint {
    match transform_chain {
        Some(transform_chain) => {
            offset_base_points_for_curvature::<R>(&surface_point, transform_chain, balls())
        }
        None => surface_point,
    }
}

/// Moves the base points of rays into the balls of [`offset_ray_origins_for_curvature`]: along the
/// normal by reach²/radius on each side.
#[inline(never)]
fn offset_base_points_for_curvature<R: Real>(
    surface_point: &SurfacePoint,
    transform_chain: TransformChain<'_>,
    balls: [f64; 2],
) -> SurfacePoint {
    let reach = SpawnOffset::from_surface_error::<R>(
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
