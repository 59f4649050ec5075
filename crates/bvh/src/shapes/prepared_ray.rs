//! A ray with the values that every intersection test needs, computed once per query.

use glam::DVec3;

use crate::ray::Ray;
use crate::scalar::{Real, Vector};

/// Ratio of a ray origin's distance from a shape to the shape's size, from which on the shape
/// counts as far. At this distance f32 resolves distances to 2⁻¹⁴ of the size.
pub(crate) const FAR_RATIO: f64 = 1024.0;

/// A ray converted to f64, with values that intersection tests share, such as the squared length of
/// its direction. The [`Ray`] from which it is made may be in f32 or f64.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Origin, exactly that of the stored ray in world space.
    pub origin: DVec3,
    /// Direction. In world space it has unit length up to rounding. In the space of an instance it
    /// has any length.
    pub direction: DVec3,
    /// Time, see [`Ray::time`].
    pub time: f64,
    /// Whether this is a camera ray, see [`Ray::is_camera_ray`].
    pub is_camera_ray: bool,
    /// Whether the ray was mapped into the space of a transformed shape or of an instance. The map
    /// back to the world may magnify the error of a rounded distance. So hit points on such a ray
    /// are computed from unrounded distances.
    pub is_mapped: bool,
    /// Squared length of `direction`.
    pub length_squared: f64,
    /// Lower bound of `length_squared`, smaller by more than the rounding errors of a quadric's
    /// discriminant. Let D be the discriminant with this bound. If D is negative, then so are the
    /// exact discriminant and the discriminant with `length_squared`.
    pub lower_length_squared: f64,
    /// The inverse of `length_squared`.
    pub inverse_length_squared: f64,
    /// Two vectors perpendicular to the direction. They span the plane onto which the tests of
    /// triangles and quads project corners. The system (first, second, direction) is right-handed.
    /// Each vector is at least as long as the direction's largest component. For a ray that is not
    /// prepared for triangles, both are zero.
    pub projection_axes: [DVec3; 2],
}

impl PreparedRay {
    /// Ratio of [`PreparedRay::lower_length_squared`] to the squared length.
    pub(crate) const LOWER_BOUND_FACTOR: f64 = 1.0 - f64::ROUNDOFF * 64.0;

    /// Prepares a world-space ray for shapes of every kind.
    #[inline(always)]
    pub fn new<R: Real>(ray: Ray<R>) -> Self {
        Self::from_ray(ray, true)
    }

    /// Prepares a world-space ray for all shapes except triangles and quads. With `for_faces`,
    /// prepares it for these too.
    #[inline(always)]
    pub(crate) fn from_ray<R: Real>(ray: Ray<R>, for_faces: bool) -> Self {
        let (origin, direction) = (ray.origin.to_f64(), ray.direction.to_f64());
        let length_squared = direction.dot(direction);
        let inverse_length_squared = 1.0 / length_squared;
        let shortened = length_squared * Self::LOWER_BOUND_FACTOR;
        let across = if for_faces {
            projection_axes(direction)
        } else {
            [DVec3::ZERO; 2]
        };
        let (time, culls, mapped) = (ray.time.to_f64(), ray.is_camera_ray, false);
        Self {
            origin,
            direction,
            time,
            is_camera_ray: culls,
            is_mapped: mapped,
            length_squared,
            lower_length_squared: shortened,
            inverse_length_squared,
            projection_axes: across,
        }
    }

    /// Prepares a world-space ray, stored in f32, for spheres and planes only.
    #[inline(always)]
    pub(crate) fn from_world_ray(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Self::from_ray(Ray::<f32>::new(origin.into(), direction.into()), false)
    }

    /// Prepares a ray that was mapped into object space, for shapes of every kind. The direction
    /// may have any length. Distances along the ray are in units of that length.
    #[inline(always)]
    pub(crate) fn from_mapped_ray(origin: DVec3, direction: DVec3, culls: bool) -> Self {
        Self {
            is_mapped: true,
            ..Self::new(Ray {
                origin,
                direction,
                time: 0.0,
                is_camera_ray: culls,
            })
        }
    }

    /// Whether the hit point must be computed from the unrounded distance instead of the stored
    /// distance `t`. This is so for every mapped ray. For any other ray it is so if the rounding of
    /// `t` could move the point by 2⁻¹⁴ of `size`, the size of the shape.
    #[inline(always)]
    pub(crate) fn needs_unrounded_distance<R: Real>(&self, t: R, size: R) -> bool {
        self.is_mapped || t > size * R::from_f64(FAR_RATIO)
    }

    /// Returns the point of the ray at the stored distance `t`.
    #[inline(always)]
    pub(crate) fn at<R: Real>(&self, t: R) -> DVec3 {
        self.origin + self.direction * t.to_f64()
    }
}

/// Computes [`PreparedRay::projection_axes`] for a direction. They are the shear of "Watertight
/// Ray/Triangle Intersection" (Woop, Benthin, Wald 2013), multiplied by the direction's largest
/// component. The product avoids a division.
#[inline(always)]
fn projection_axes(d: DVec3) -> [DVec3; 2] {
    let size = d.abs();
    let sign = |major: f64| 1.0_f64.copysign(major);
    if size.x > size.y && size.x > size.z {
        let s = sign(d.x);
        [DVec3::new(-d.y, d.x, 0.0) * s, DVec3::new(-d.z, 0.0, d.x)]
    } else if size.y > size.z {
        let s = sign(d.y);
        [DVec3::new(0.0, -d.z, d.y) * s, DVec3::new(d.y, -d.x, 0.0)]
    } else {
        let s = sign(d.z);
        [DVec3::new(d.z, 0.0, -d.x) * s, DVec3::new(0.0, d.z, -d.y)]
    }
}
