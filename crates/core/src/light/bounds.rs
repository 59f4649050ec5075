//! Where a light is and which way it shines, for choosing among many ("Importance Sampling of Many
//! Lights with Adaptive Tree Splitting", Conty Estevez, Kulla 2018).

use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::Aabb;

/// A box around a light and a cone around the directions into which it shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Around its points.
    pub space: Aabb,
    /// The middle of its normals; of unit length.
    pub axis: DVec3,
    /// The greatest angle in radians between the axis and a normal; π: all directions.
    pub normals: f64,
    /// The greatest angle in radians between a normal and a direction in which light leaves there.
    pub emission: f64,
}

impl LightBounds {
    /// A surface whose normals are unknown.
    pub fn round(space: Aabb) -> Self {
        Self {
            space,
            axis: DVec3::Y,
            normals: PI,
            emission: 0.5 * PI,
        }
    }

    /// A flat surface that shines to the side of its normal.
    pub fn flat(space: Aabb, normal: DVec3) -> Self {
        Self {
            space,
            axis: normal,
            normals: 0.0,
            emission: 0.5 * PI,
        }
    }

    /// A point that shines within an angle of a direction: as what has a normal along each of
    /// those, since its light does not weaken towards the edge as that of a surface does.
    pub fn point(at: DVec3, axis: DVec3, angle: f64) -> Self {
        Self {
            space: Aabb { min: at, max: at },
            axis,
            normals: angle,
            emission: 0.0,
        }
    }

    /// Whether light may leave in a unit direction.
    pub fn shines(&self, direction: DVec3) -> bool {
        let widest = self.normals + self.emission;
        widest >= PI || self.axis.dot(direction) >= libm::cos(widest) - 1e-6
    }
}
