//! The surface at a hit, its error bound, and rays that start outside that error.

use crate::ray::{Interval, Ray};
use crate::scalar::{Real, Vector};
use glam::DVec3;

/// The surface at a hit in f64, before it is rounded to the stored scalar.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The hit point, moved onto the surface.
    pub point: DVec3,
    /// Base point of rays to the outer side, before the offset along the normal. Either the hit
    /// point, or a nearby point from which the offset and rounded origin is on the outer side of
    /// all adjacent surfaces.
    pub above: DVec3,
    /// Base point of rays to the inner side, likewise.
    pub below: DVec3,
    /// Outward geometric unit normal, for a hit from either side.
    pub normal: DVec3,
    /// Bound, in each axis, on the distance of `point` from the surface, and on the error of any
    /// later test of this surface.
    pub error: f64,
}

impl SurfacePoint {
    /// A surface whose hit point is itself the base point of rays.
    #[inline(always)]
    pub fn new(point: DVec3, normal: DVec3, error: f64) -> Self {
        Self {
            point,
            above: point,
            below: point,
            normal,
            error,
        }
    }

    /// Rounds to the stored scalar; the error bound grows by that rounding.
    #[inline(always)]
    pub fn to_scalar<R: Real>(&self) -> Surface<R> {
        let rounding = R::ROUNDOFF.to_f64();
        let error = self.error + self.point.abs().max_element() * rounding;
        Surface {
            point: R::Vec3::from_f64(self.point),
            above: R::Vec3::from_f64(self.above),
            below: R::Vec3::from_f64(self.below),
            // The factor covers the rounding of the bound itself.
            error: R::from_f64(error * (1.0 + rounding * 4.0)),
            normal: R::Vec3::from_f64(self.normal),
        }
    }
}

/// The surface at a hit.
#[derive(Clone, Copy, Debug)]
#[doc(alias = "SurfaceInteraction")]
pub struct Surface<R: Real> {
    /// The hit point, moved onto the surface.
    pub point: R::Vec3,
    /// Base point of rays to the outer side, as [`SurfacePoint::above`].
    pub above: R::Vec3,
    /// Base point of rays to the inner side, as [`SurfacePoint::below`].
    pub below: R::Vec3,
    /// Bound, in each axis, on the distance of `point` from the exact surface, including the error
    /// of a later test of this surface ("Managing Rounding Error", Physically Based Rendering, 4th
    /// edition, 6.8).
    pub error: R,
    /// Outward geometric unit normal, for a hit from either side.
    pub normal: R::Vec3,
}

/// Texture coordinates at a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters<R: Real> {
    /// First texture coordinate.
    pub u: R,
    /// Second texture coordinate.
    pub v: R,
    /// Derivative of the point by u; not normalised, and possibly zero.
    pub dpdu: R::Vec3,
    /// Whether an image with columns along u and rows down along v appears mirrored from outside:
    /// whether dp/du × dp/dv points outwards.
    pub mirrored: bool,
}

impl<R: Real> Surface<R> {
    /// Origin of a ray in `direction`: offset along the normal by the error bound, to the side of
    /// the direction (outside for a tangent). Each coordinate is rounded away from the surface.
    #[inline(always)]
    pub fn spawn(&self, direction: R::Vec3) -> R::Vec3 {
        self.lifted(direction, self.error)
    }

    /// The shadow ray to a point, with the range before it, for a light without a surface. `None`
    /// at distance zero.
    #[inline]
    pub fn spawn_to(&self, target: R::Vec3) -> Option<(Ray<R>, Interval<R>)> {
        open(between(self.spawn(target - self.point), target))
    }

    /// The shadow ray to a point of another surface, with the range before it, such that it hits
    /// neither of both surfaces. `None` if the points coincide.
    #[inline]
    pub fn spawn_to_surface(&self, target: &Self) -> Option<(Ray<R>, Interval<R>)> {
        open(self.way_to_surface(target))
    }

    /// [`Self::spawn_to_surface`] without a branch: the ray and its length, which are valid only if
    /// the length is positive and finite.
    #[inline(always)]
    pub fn way_to_surface(&self, target: &Self) -> (Ray<R>, R) {
        let across = target.point - self.point;
        let (start, end) = (
            self.lifted(across, self.error),
            target.lifted(-across, target.error),
        );
        let (ray, distance) = between::<R>(start, end);
        // The rounded unit direction makes the ray miss its end point slightly, so the ray ends at
        // the tangent plane of the target. A ray almost parallel to that plane is limited to little
        // more than its length.
        let normal = target.normal.to_f64();
        let to_plane =
            normal.dot(end.to_f64() - start.to_f64()) / normal.dot(ray.direction.to_f64());
        (
            ray,
            R::from_f64(f64::min(to_plane, distance.to_f64() * (1.0 + BESIDE))),
        )
    }

    #[inline(always)]
    fn lifted(&self, direction: R::Vec3, error: R) -> R::Vec3 {
        // In f64, where products of f32 numbers are exact: a tangent must not count as an inward
        // ray.
        let inward = self.normal.to_f64().dot(direction.to_f64()) < 0.0;
        let (from, normal) = if inward {
            (self.below, -self.normal)
        } else {
            (self.above, self.normal)
        };
        let size = normal.abs();
        let moved = from + normal * ((size.x() + size.y() + size.z()) * error);
        let [x, y, z] = [moved.x(), moved.y(), moved.z()];
        R::Vec3::new(
            x.next_towards(normal.x()),
            y.next_towards(normal.y()),
            z.next_towards(normal.z()),
        )
    }
}

/// Excess length of a shadow ray, relative to its length.
const BESIDE: f64 = 1.0 / 4096.0;

/// The ray between two points, and its length. Lengths are computed in f64, so that they neither
/// underflow nor overflow.
#[inline(always)]
fn between<R: Real>(start: R::Vec3, end: R::Vec3) -> (Ray<R>, R) {
    let across = end.to_f64() - start.to_f64();
    let distance = across.length();
    (
        Ray::new(start, R::Vec3::from_f64(across / distance)),
        R::from_f64(distance),
    )
}

/// The ray, and the open range before its end.
#[inline(always)]
fn open<R: Real>((ray, max): (Ray<R>, R)) -> Option<(Ray<R>, Interval<R>)> {
    (max > R::ZERO && max.is_finite()).then_some((ray, Interval { min: R::ZERO, max }))
}
