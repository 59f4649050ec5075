//! Bounds of a light in space and direction, for sampling many lights ("Importance Sampling of Many
//! Lights with Adaptive Tree Splitting", Conty Estevez, Kulla 2018).

use core::f64::consts::{PI, TAU};

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

// The cone of directions from a point to a sphere, sampled uniformly by solid angle ("Monte Carlo
// Techniques for Direct Lighting Calculations", Shirley, Wang, Zimmerman 1996).

/// The cone of directions that hit a sphere from a point outside the sphere.
#[derive(Clone, Copy, Debug)]
pub struct DirectionCone {
    axis: DVec3,
    distance: f64,
    radius: f64,
    /// 1 − cos θ for the half-angle θ, computed as sin²θ / (1 + cos θ): this form keeps its digits
    /// for small spheres.
    height: f64,
}

impl DirectionCone {
    /// Returns the cone of directions from `from` to a sphere. `None` if `from` lies inside or on
    /// the sphere: then all or half of the directions hit the sphere.
    pub fn new(centre: DVec3, radius: f64, from: DVec3) -> Option<Self> {
        let across = centre - from;
        let distance = across.length();
        // False for NaN too.
        (distance > radius && radius > 0.0).then(|| {
            let share = radius / distance;
            let sine2 = share * share;
            let cosine = ((1.0 - share) * (1.0 + share)).sqrt();
            Self {
                axis: across / distance,
                distance,
                radius,
                height: sine2 / (1.0 + cosine),
            }
        })
    }

    /// Solid angle in steradians.
    pub fn solid_angle(&self) -> f64 {
        TAU * self.height
    }

    /// Samples a direction of the cone uniformly by solid angle, for two uniform numbers in [0, 1).
    /// Returns the sphere's outward unit normal where this direction first hits the sphere.
    pub fn sample_normal(&self, [u, v]: [f64; 2]) -> DVec3 {
        let (height, turn) = (u * self.height, v * TAU);
        let sine2 = height * (2.0 - height);
        // In units of the radius: the distance of the ray from the centre, and the distance from
        // the ray's closest approach back to its entry. The digits of the normal then do not depend
        // on the sphere's distance.
        let ratio = self.distance / self.radius;
        let past2 = (ratio * ratio * sine2).min(1.0);
        let (past, entry) = (past2.sqrt(), (1.0 - past2).sqrt());
        let (cosine, sine) = (1.0 - height, sine2.sqrt());
        let (along, beside) = (-past * sine - entry * cosine, past * cosine - entry * sine);
        let ((x, y), (sin, cos)) = (self.axis.any_orthonormal_pair(), libm::sincos(turn));
        self.axis * along + (x * cos + y * sin) * beside
    }
}
