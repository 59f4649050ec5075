//! Drift of a ray's origin: its distance, in object space, from the hit point at which the ray
//! starts. The base points of rays are moved to compensate for the drift. So each origin stays on
//! the right side of *every* nearby surface.
//!
//! In world space an origin is offset along the normal of one face, and rounded. Under a map that
//! shears and flattens a shape, both steps also move the origin towards other faces. The inverse
//! map magnifies the rounding. Above a curved face, the origin lies above the tangent plane, but
//! possibly so far from the hit point that the face has curved away from that plane.

use super::{OuterTransforms, SurfacePoint, Transform};
use crate::scalar::Real;
use glam::DVec3;

/// The nested maps from object space to the world, the innermost map first.
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

    /// Upper bound of a length in object space: that of any vector whose world-space components are
    /// at most one.
    fn magnification(self) -> f64 {
        let own = self.map.magnification;
        self.outer.map_or(own, |outer| own * outer.magnification())
    }
}

/// The maps from object space to the world, with an upper bound of the drift at one hit point. The
/// drift is the distance between the hit point and the origin of a ray that starts there.
#[derive(Clone, Copy)]
pub(super) struct SpawnOffset<'a> {
    /// Upper bound of the drift along each axis of the world.
    world_offset: f64,
    transform_chain: Option<TransformChain<'a>>,
}

impl<'a> SpawnOffset<'a> {
    /// Computes the bound of the drift at a point in object space. `error` is the error bound of
    /// the point, in each axis.
    ///
    /// An origin is offset along the normal by the error bound times the sum of the normal's
    /// absolute components. In each axis that is up to (1 + √3)/2 bounds. The rounding of the point
    /// and of the offset sum each add less than one bound. The step to the next number adds up to
    /// two bounds. The total is below five and a half bounds. If the error of the intersection test
    /// exceeds the rounding, the total is below half as much. The remaining half covers the same
    /// uncertainty of the other faces.
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

    /// Returns the greatest drift along a gradient: the greatest difference of `gradient · p`
    /// between the hit point and a possible ray origin p.
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

/// Moves the base points of rays away from a curved surface, to allow for its curvature. `balls`
/// returns two radii, for the outer and the inner side. A ball of such a radius may touch the
/// surface on that side at any point without crossing it. A radius is infinite if the surface
/// curves away from the side.
///
/// Let r be the drift: an origin lies above the tangent plane, up to r away from the hit point. Let
/// ρ be the radius of the ball. After a move along the normal by r²/ρ, the origin lies in the ball
/// if r is below ρ: (ρ − r²/ρ)² + r² < ρ². For a greater r no origin is safe.
#[inline(always)]
pub(super) fn offset_curved_origins<R: Real>(
    surface_point: SurfacePoint,
    transform_chain: OuterTransforms<'_>,
    balls: impl FnOnce() -> [f64; 2],
) -> SurfacePoint {
    match transform_chain {
        Some(transform_chain) => {
            offset_curved_base_points::<R>(&surface_point, transform_chain, balls())
        }
        None => surface_point,
    }
}

/// Moves the base points of rays along the normal by r²/ρ on each side, as
/// [`offset_curved_origins`] describes.
#[inline(never)]
fn offset_curved_base_points<R: Real>(
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
