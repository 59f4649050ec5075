//! Bounds of a light in space and direction, for sampling many lights ("Importance Sampling of Many
//! Lights with Adaptive Tree Splitting", Conty Estevez, Kulla 2018).

use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::Aabb;

/// Bounds of a light: a box around its points, and a cone around its directions of emission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Bounding box of the light's points.
    pub bounding_box: Aabb,
    /// Unit axis of the cone of surface normals.
    pub axis: DVec3,
    /// Greatest angle in radians between the axis and a surface normal; π if normals have any
    /// direction.
    pub normal_angle: f64,
    /// Greatest angle in radians between a normal and a direction of emission from the same point.
    pub emission_angle: f64,
}

impl LightBounds {
    /// Returns the bounds of a curved surface, whose normals may have any direction.
    pub fn for_curved_surface(space: Aabb) -> Self {
        Self {
            bounding_box: space,
            axis: DVec3::Y,
            normal_angle: PI,
            emission_angle: 0.5 * PI,
        }
    }

    /// Returns the bounds of a flat surface that emits on the side of its normal.
    pub fn for_flat_surface(space: Aabb, normal: DVec3) -> Self {
        Self {
            bounding_box: space,
            axis: normal,
            normal_angle: 0.0,
            emission_angle: 0.5 * PI,
        }
    }

    /// Returns the bounds of a point or spot light that emits within `angle` radians of `axis`.
    /// Every such direction counts as a surface normal: unlike a surface, the light does not weaken
    /// towards the edge of the cone.
    pub fn for_point_light(point: DVec3, axis: DVec3, angle: f64) -> Self {
        Self {
            bounding_box: Aabb {
                min: point,
                max: point,
            },
            axis,
            normal_angle: angle,
            emission_angle: 0.0,
        }
    }

    /// Returns flux over greatest intensity of a surface, divided by π: 1 if flat, 4 if curved.
    pub fn flux_per_intensity(&self) -> f64 {
        if self.normal_angle > 0.0 { 4.0 } else { 1.0 }
    }

    /// Whether the light may emit in a unit direction.
    pub fn may_emit(&self, direction: DVec3) -> bool {
        let widest = self.normal_angle + self.emission_angle;
        widest >= PI || self.axis.dot(direction) >= libm::cos(widest) - 1e-6
    }
}
