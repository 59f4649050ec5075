//! Bounds of a light in space and direction, for sampling many lights ("Importance Sampling of Many
//! Lights with Adaptive Tree Splitting", Conty Estevez, Kulla 2018).

use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::Aabb;

/// Bounding box of a light and bounding cone of its emission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Bounding box.
    pub space: Aabb,
    /// Axis of the cone of normals, unit.
    pub axis: DVec3,
    /// Greatest angle in radians between the axis and a normal; π for all directions.
    pub normals: f64,
    /// Greatest angle in radians between a normal and a direction of emission there.
    pub emission: f64,
}

impl LightBounds {
    /// Bounds of a surface with unknown normals.
    pub fn round(space: Aabb) -> Self {
        Self {
            space,
            axis: DVec3::Y,
            normals: PI,
            emission: 0.5 * PI,
        }
    }

    /// Bounds of a flat surface that emits on the side of its normal.
    pub fn flat(space: Aabb, normal: DVec3) -> Self {
        Self {
            space,
            axis: normal,
            normals: 0.0,
            emission: 0.5 * PI,
        }
    }

    /// Bounds of a point light that emits within an angle of a direction. Each of those directions
    /// counts as a normal, since the light does not weaken towards the edge as a surface's does.
    pub fn point(point: DVec3, axis: DVec3, angle: f64) -> Self {
        Self {
            space: Aabb {
                min: point,
                max: point,
            },
            axis,
            normals: angle,
            emission: 0.0,
        }
    }

    /// Whether the light may emit in a unit direction.
    pub fn shines(&self, direction: DVec3) -> bool {
        let widest = self.normals + self.emission;
        widest >= PI || self.axis.dot(direction) >= libm::cos(widest) - 1e-6
    }
}
