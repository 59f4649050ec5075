//! Rays that leave a surface: where they start, and the exact directions that refraction asks for.

use glam::DVec3;
use raywright_bvh::{Hit, Ray, Real, Vector};

use super::PathSegment;
use crate::interaction::Interaction;
use crate::material::{Glass, Interface};
use crate::prepare::{Prepared, Spawn};

/// Distances from which on hits count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeastDistances<R> {
    /// Of rays of the camera.
    pub camera: R,
    /// Of all others but those to lights.
    pub secondary: R,
}

impl<R: Real> Prepared<R> {
    /// From what distances on hits of rays count under the scene's rule.
    pub(crate) fn least_distances(&self) -> LeastDistances<R> {
        match self.rules.spawn {
            Spawn::ErrorBound => LeastDistances {
                camera: R::ZERO,
                secondary: R::ZERO,
            },
            Spawn::Constant {
                camera_min,
                secondary_min,
                ..
            } => LeastDistances {
                camera: camera_min,
                secondary: secondary_min,
            },
        }
    }

    /// The ray that leaves a surface in a unit direction. `side` is the normal's factor where the
    /// offset is constant: 1 for the side that the ray came from, −1 for the other.
    #[inline(always)]
    pub(crate) fn spawn(&self, at: &Interaction<R>, direction: R::Vec3, side: R) -> Ray<R> {
        let origin = match self.rules.spawn {
            Spawn::ErrorBound => at.surface.spawn(direction),
            Spawn::Constant {
                offset,
                along_ray: true,
                ..
            } => at.surface.point + direction * offset,
            Spawn::Constant { offset, .. } => at.surface.point + at.normal * (offset * side),
        };
        Ray::new(origin, direction)
    }

    /// Whether a surface gives off what its material does on the side that was hit.
    #[inline(always)]
    pub(super) fn shines(&self, at: &Interaction<R>) -> bool {
        at.outside || !self.objects[at.object as usize].culled
    }

    /// A boundary of glass as a ray meets it, with all digits that are known.
    #[inline(always)]
    pub(super) fn interface(
        &self,
        leg: &PathSegment<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        glass: &Glass<R>,
    ) -> Interface {
        let (n, out) = (at.normal, at.surface.normal);
        // A normal that is the geometric one from before it was stored.
        let known = || self.geometry.located(&leg.ray, hit).normal.to_f64();
        let n = if n == out {
            known()
        } else if n == -out {
            -known()
        } else {
            n.to_f64()
        };
        Interface::new(
            leg.ray.direction.to_f64() + leg.rest.to_f64(),
            n * at.side().to_f64(),
            glass.eta(at.outside),
        )
    }
}

/// A direction as it is stored, and what storing takes from it.
#[inline(always)]
pub(super) fn stored<R: Real>(exact: DVec3) -> (R::Vec3, R::Vec3) {
    let stored = R::Vec3::from_f64(exact);
    (stored, R::Vec3::from_f64(exact - stored.to_f64()))
}

impl<R: Real> Interaction<R> {
    /// The shading normal's factor by which it is on the side that the ray came from, also where
    /// the object's points outwards always.
    #[inline(always)]
    pub(super) fn side(&self) -> R {
        if self.direction.dot(self.normal) > R::ZERO {
            -R::ONE
        } else {
            R::ONE
        }
    }

    /// The shading normal on that side.
    #[inline(always)]
    pub(super) fn facing_normal(&self) -> R::Vec3 {
        self.normal * self.side()
    }
}
