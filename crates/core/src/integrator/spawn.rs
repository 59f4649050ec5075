//! Rays that leave a surface: their origins, and exact directions for refraction.

use glam::DVec3;
use raywright_bvh::{Hit, Ray, Real, Vector};

use super::PathSegment;
use crate::interaction::Interaction;
use crate::material::{Glass, Interface};
use crate::prepare::{Prepared, PreparedSpawn};

/// Least distances of valid hits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeastDistances<R> {
    /// For camera rays.
    pub camera: R,
    /// For all other rays but shadow rays.
    pub secondary: R,
}

impl<R: Real> Prepared<R> {
    /// Least distances of valid hits under the scene's rule.
    pub(crate) fn least_distances(&self) -> LeastDistances<R> {
        match self.rules.spawn {
            PreparedSpawn::ErrorBound => LeastDistances {
                camera: R::ZERO,
                secondary: R::ZERO,
            },
            PreparedSpawn::Constant {
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
    pub(crate) fn spawn(
        &self,
        interaction: &Interaction<R>,
        direction: R::Vec3,
        side: R,
    ) -> Ray<R> {
        let origin = match self.rules.spawn {
            PreparedSpawn::ErrorBound => interaction.surface.spawn(direction),
            PreparedSpawn::Constant {
                offset,
                along_ray: true,
                ..
            } => interaction.surface.point + direction * offset,
            PreparedSpawn::Constant { offset, .. } => {
                interaction.surface.point + interaction.normal * (offset * side)
            }
        };
        Ray::new(origin, direction)
    }

    /// Whether the hit side of a surface emits.
    #[inline(always)]
    pub(super) fn shines(&self, interaction: &Interaction<R>) -> bool {
        interaction.outside || !self.objects[interaction.object as usize].culled
    }

    /// A glass boundary at a hit, with all known digits.
    #[inline(always)]
    pub(super) fn interface(
        &self,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
        glass: &Glass<R>,
    ) -> Interface {
        let (n, out) = (interaction.normal, interaction.surface.normal);
        // The unrounded geometric normal, if it is the shading normal.
        let known = || {
            self.geometry
                .surface_point(&segment.ray, hit)
                .normal
                .to_f64()
        };
        let n = if n == out {
            known()
        } else if n == -out {
            -known()
        } else {
            n.to_f64()
        };
        Interface::new(
            segment.ray.direction.to_f64() + segment.rest.to_f64(),
            n * interaction.side().to_f64(),
            glass.eta(interaction.outside),
        )
    }
}

/// A direction as stored, and its rounding error.
#[inline(always)]
pub(super) fn round_direction<R: Real>(exact: DVec3) -> (R::Vec3, R::Vec3) {
    let stored = R::Vec3::from_f64(exact);
    (stored, R::Vec3::from_f64(exact - stored.to_f64()))
}

impl<R: Real> Interaction<R> {
    /// Factor that turns the shading normal to the ray's side, also if the object's normal always
    /// points outwards.
    #[inline(always)]
    pub(super) fn side(&self) -> R {
        if self.direction.dot(self.normal) > R::ZERO {
            -R::ONE
        } else {
            R::ONE
        }
    }

    /// The shading normal on the ray's side.
    #[inline(always)]
    pub(super) fn facing_normal(&self) -> R::Vec3 {
        self.normal * self.side()
    }
}
