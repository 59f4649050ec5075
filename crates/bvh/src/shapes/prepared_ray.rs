//! A ray with the values that every intersection test needs, computed once per query.

use glam::DVec3;

use crate::ray::Ray;
use crate::scalar::{Real, Vector};

/// Distance, in sizes of a shape, from which it counts as far: there f32 resolves distances to 2⁻¹⁴
/// of the size.
pub(crate) const FAR: f64 = 1024.0;

/// A ray in f64, the precision of all tests, for any stored scalar.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Origin, exactly.
    pub origin: DVec3,
    /// Direction, of unit length up to the rounding of the stored direction; of any length in the
    /// space of an instance.
    pub direction: DVec3,
    /// Time, see [`Ray::time`].
    pub time: f64,
    /// Whether this is a camera ray, see [`Ray::culls`].
    pub culls: bool,
    /// Whether this is the space of a transformed shape or an instance. The map may magnify the
    /// effect of a rounded distance along the surface, so points are computed from unrounded
    /// distances.
    pub mapped: bool,
    /// Squared length of `direction`.
    pub length_squared: f64,
    /// `length_squared`, reduced by more than the rounding of any sum of a few products with it. A
    /// discriminant computed with it is never negative if that of the same coefficients, or the
    /// exact one, is not.
    pub shortened: f64,
    /// The inverse of `length_squared`.
    pub inverse_length_squared: f64,
    /// Two vectors perpendicular to the direction, such that (first, second, direction) is
    /// right-handed: a basis of the plane onto which triangles are projected. Each is at least as
    /// long as the direction's largest component.
    pub across: [DVec3; 2],
}

impl PreparedRay {
    /// Ratio of [`PreparedRay::shortened`] to the squared length.
    pub(crate) const SHORTER: f64 = 1.0 - f64::ROUNDOFF * 64.0;

    /// Prepares a ray.
    #[inline(always)]
    pub fn new<R: Real>(ray: Ray<R>) -> Self {
        Self::of(ray, true)
    }

    /// Prepares a ray; with `faces` also for triangles and quads.
    #[inline(always)]
    pub(crate) fn of<R: Real>(ray: Ray<R>, faces: bool) -> Self {
        let (origin, direction) = (ray.origin.to_f64(), ray.direction.to_f64());
        let length_squared = direction.dot(direction);
        let inverse_length_squared = 1.0 / length_squared;
        let shortened = length_squared * Self::SHORTER;
        let across = if faces {
            across(direction)
        } else {
            [DVec3::ZERO; 2]
        };
        let (time, culls, mapped) = (ray.time.to_f64(), ray.culls, false);
        Self {
            origin,
            direction,
            time,
            culls,
            mapped,
            length_squared,
            shortened,
            inverse_length_squared,
            across,
        }
    }

    /// Prepares a stored world-space ray for spheres and planes.
    #[inline(always)]
    pub(crate) fn in_world(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Self::of(Ray::<f32>::new(origin.into(), direction.into()), false)
    }

    /// Prepares a ray in a mapped space. The direction may have any length, which is the unit of
    /// distances.
    #[inline(always)]
    pub(crate) fn mapped(origin: DVec3, direction: DVec3, culls: bool) -> Self {
        Self {
            mapped: true,
            ..Self::new(Ray {
                origin,
                direction,
                time: 0.0,
                culls,
            })
        }
    }

    /// Whether a point computed from a stored distance could be off by 2⁻¹⁴ of a shape of the given
    /// size, and always in a mapped space. Such a point is computed from the unrounded distance
    /// instead.
    #[inline(always)]
    pub(crate) fn needs_unrounded<R: Real>(&self, t: R, size: R) -> bool {
        self.mapped || t > size * R::from_f64(FAR)
    }

    /// The point at a stored distance.
    #[inline(always)]
    pub(crate) fn at<R: Real>(&self, t: R) -> DVec3 {
        self.origin + self.direction * t.to_f64()
    }
}

/// The shear of "Watertight Ray/Triangle Intersection" (Woop, Benthin, Wald 2013) without its
/// division: sheared coordinates times the direction's largest component.
#[inline(always)]
fn across(d: DVec3) -> [DVec3; 2] {
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
