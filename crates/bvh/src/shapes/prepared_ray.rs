//! A ray with what every test of it needs, prepared once per query.

use glam::DVec3;

use crate::ray::Ray;
use crate::scalar::{Real, Vector};

/// So many sizes of a shape are far: from there f32 tells distances to 2⁻¹⁴ of the shape.
pub(crate) const FAR: f64 = 1024.0;

/// A ray in f64, in which all tests compute, whatever is stored.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Origin, exactly.
    pub origin: DVec3,
    /// Direction; of unit length only up to the rounding of the stored one, and of any length in
    /// the space of an instance.
    pub direction: DVec3,
    /// When it is asked, see [`Ray::time`].
    pub time: f64,
    /// Whether it passes backs that are culled, see [`Ray::culls`].
    pub culls: bool,
    /// Whether this is the space of a placed shape or an instance. There a rounding of the
    /// distance, moved along the surface by projecting it back, may come out of the map magnified,
    /// so that points are made from unrounded distances.
    pub mapped: bool,
    /// Squared length of `direction`.
    pub length_squared: f64,
    /// The same, less by more than the rounding of any sum of a few products with it: a
    /// discriminant made with it is never below zero where one from the same coefficients, or from
    /// the exact ones, is not.
    pub shortened: f64,
    /// One over it.
    pub inverse_length_squared: f64,
    /// Two vectors across the direction, such that (first, second, direction) is right-handed: they
    /// span the plane onto which triangles are projected. As long as the largest component of the
    /// direction at least.
    pub across: [DVec3; 2],
}

impl PreparedRay {
    /// What [`PreparedRay::shortened`] is of the squared length.
    pub(crate) const SHORTER: f64 = 1.0 - f64::ROUNDOFF * 64.0;

    /// Prepares a ray.
    #[inline(always)]
    pub fn new<R: Real>(ray: Ray<R>) -> Self {
        Self::of(ray, true)
    }

    /// Prepares a ray, for triangles and quads too or not.
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

    /// Prepares a stored ray for spheres and planes.
    #[inline(always)]
    pub(crate) fn in_world(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Self::of(Ray::<f32>::new(origin.into(), direction.into()), false)
    }

    /// Prepares a ray of a mapped space, of any length: distances are in units of that length.
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

    /// Whether a point made from a stored distance could lie beside the hit by as much as 2⁻¹⁴ of a
    /// shape of this size. Such a point is made from the unrounded distance instead, and always in
    /// a map's space.
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
/// division: a point's shear coordinates times the direction's largest component.
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
