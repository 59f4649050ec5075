//! Rays that leave a surface: their origins, and the exact directions of reflection and refraction.

use glam::DVec3;
use raywright_bvh::{Hit, Ray, Real, Vector};

use super::PathSegment;
use crate::interaction::Interaction;
use crate::material::{Glass, SmoothInterface};
use crate::prepare::{PreparedScene, PreparedSpawnRule};

/// Least distances from the ray's origin at which hits count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MinHitDistances<R> {
    /// For camera rays.
    pub camera: R,
    /// For all other rays except shadow rays.
    pub secondary: R,
}

impl<R: Real> PreparedScene<R> {
    /// Returns the least distances from the ray's origin at which hits count, according to the
    /// scene's spawn rule.
    pub(crate) fn min_hit_distances(&self) -> MinHitDistances<R> {
        match self.rules.spawn {
            PreparedSpawnRule::ErrorBound => MinHitDistances {
                camera: R::ZERO,
                secondary: R::ZERO,
            },
            PreparedSpawnRule::Constant {
                camera_min,
                secondary_min,
                ..
            } => MinHitDistances {
                camera: camera_min,
                secondary: secondary_min,
            },
        }
    }

    /// Returns the ray that leaves a surface in a unit direction. Only a spawn rule that offsets
    /// origins along the shading normal reads `side`: 1 offsets along the normal, −1 against it.
    #[inline(always)]
    pub(crate) fn spawn_ray(
        &self,
        interaction: &Interaction<R>,
        direction: R::Vec3,
        side: R,
    ) -> Ray<R> {
        let origin = match self.rules.spawn {
            PreparedSpawnRule::ErrorBound => interaction.surface.spawn_ray_origin(direction),
            PreparedSpawnRule::Constant {
                offset,
                along_ray: true,
                ..
            } => interaction.surface.point + direction * offset,
            PreparedSpawnRule::Constant { offset, .. } => {
                interaction.surface.point + interaction.normal * (offset * side)
            }
        };
        Ray::new(origin, direction)
    }

    /// Returns the ray that continues straight behind a surface.
    #[inline(always)]
    pub(crate) fn spawn_straight_ray(&self, interaction: &Interaction<R>) -> Ray<R> {
        self.spawn_ray(
            interaction,
            interaction.direction,
            -interaction.facing_sign(),
        )
    }

    /// Whether the hit side of an emissive surface emits light.
    #[inline(always)]
    pub(super) fn is_emissive_side(&self, interaction: &Interaction<R>) -> bool {
        interaction.outside || !self.objects[interaction.object as usize].is_culled
    }

    /// Returns the reflection and refraction at a smooth dielectric surface. They are computed in
    /// `f64`, from the ray's direction before its rounding.
    #[inline(always)]
    pub(super) fn dielectric_interface(
        &self,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
        glass: &Glass<R>,
    ) -> SmoothInterface {
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
        SmoothInterface::new(
            segment.ray.direction.to_f64() + segment.direction_error.to_f64(),
            n * interaction.facing_sign().to_f64(),
            glass.eta(interaction.outside),
        )
    }
}

/// Rounds a direction to the renderer's precision. Returns the rounded direction and its rounding
/// error (exact minus rounded).
#[inline(always)]
pub(super) fn round_direction<R: Real>(exact: DVec3) -> (R::Vec3, R::Vec3) {
    let stored = R::Vec3::from_f64(exact);
    (stored, R::Vec3::from_f64(exact - stored.to_f64()))
}

impl<R: Real> Interaction<R> {
    /// Returns 1 if the shading normal lies on the side from which the ray arrived, else −1. The
    /// shading normal of some objects always points outwards.
    #[inline(always)]
    pub(super) fn facing_sign(&self) -> R {
        if self.direction.dot(self.normal) > R::ZERO {
            -R::ONE
        } else {
            R::ONE
        }
    }

    /// Returns the shading normal on the side from which the ray arrived.
    #[inline(always)]
    pub(super) fn facing_normal(&self) -> R::Vec3 {
        self.normal * self.facing_sign()
    }
}
