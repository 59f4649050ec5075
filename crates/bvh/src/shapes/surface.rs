//! The surface at a hit and its error bound, and rays that start beyond that error.

use crate::ray::{Interval, Ray};
use crate::scalar::{Real, Vector};
use glam::DVec3;

/// The surface at a hit in f64: point, normal and error bound, before they are rounded to the
/// precision of the stored geometry as a [`Surface`].
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Hit point, corrected to lie on the surface.
    pub point: DVec3,
    /// Base point of rays to the outer side. The origin of such a ray is this point, offset along
    /// the normal and rounded. It is the hit point, or a nearby point whose ray origins lie on the
    /// outer side of all adjacent surfaces.
    pub above: DVec3,
    /// Base point of rays to the inner side, as `above` for that side.
    pub below: DVec3,
    /// Outward geometric unit normal, for a hit from either side.
    pub normal: DVec3,
    /// Upper bound, in each axis, of two errors: the distance between `point` and the surface, and
    /// the error of a later intersection test of this surface.
    pub error: f64,
}

impl SurfacePoint {
    /// Creates a surface point whose base points for rays to either side are the hit point itself.
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

    /// Rounds the surface point to the stored scalar. The error bound is increased by that
    /// rounding.
    #[inline(always)]
    pub fn to_scalar<R: Real>(&self) -> Surface<R> {
        let rounding = R::ROUNDOFF.to_f64();
        let error = self.error + self.point.abs().max_element() * rounding;
        Surface {
            point: R::Vec3::from_f64(self.point),
            above: R::Vec3::from_f64(self.above),
            below: R::Vec3::from_f64(self.below),
            // The factor covers the rounding of the error bound itself.
            error: R::from_f64(error * (1.0 + rounding * 4.0)),
            normal: R::Vec3::from_f64(self.normal),
        }
    }
}

/// The surface at a hit: point, outward normal and error bound, in the precision of the stored
/// geometry.
#[derive(Clone, Copy, Debug)]
#[doc(alias = "SurfaceInteraction")]
pub struct Surface<R: Real> {
    /// Hit point, corrected to lie on the surface.
    pub point: R::Vec3,
    /// Base point of rays to the outer side, as [`SurfacePoint::above`].
    pub above: R::Vec3,
    /// Base point of rays to the inner side, as [`SurfacePoint::below`].
    pub below: R::Vec3,
    /// Upper bound, in each axis, of two errors: the distance between `point` and the exact
    /// surface, and the error of a later intersection test of this surface ("Managing Rounding
    /// Error", Physically Based Rendering, 4th edition, 6.8).
    pub error: R,
    /// Outward geometric unit normal, for a hit from either side.
    pub normal: R::Vec3,
}

/// Texture coordinates u and v at a hit, and the derivative of the hit point by u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureCoordinates<R: Real> {
    /// First texture coordinate.
    pub u: R,
    /// Second texture coordinate.
    pub v: R,
    /// Derivative dp/du of the point p; not normalised, and possibly zero.
    pub dpdu: R::Vec3,
    /// Whether dp/du × dp/dv points outwards. If so, an image with columns along u and rows down
    /// along v appears mirrored from outside.
    pub mirrored: bool,
}

impl<R: Real> Surface<R> {
    /// Computes the origin of a ray in `direction`. It is the base point for the side to which the
    /// direction points (the outer side for a tangent), offset along the normal by the error bound.
    /// Each coordinate is rounded away from the surface.
    #[inline(always)]
    pub fn spawn_ray_origin(&self, direction: R::Vec3) -> R::Vec3 {
        self.offset_ray_origin(direction, self.error)
    }

    /// Creates the shadow ray to a point that lies on no surface, such as a point light, and the
    /// open range of distances before that point. `None` if the distance is zero or not finite.
    #[inline]
    pub fn spawn_ray_to_point(&self, target: R::Vec3) -> Option<(Ray<R>, Interval<R>)> {
        add_open_range(ray_between_points(
            self.spawn_ray_origin(target - self.point),
            target,
        ))
    }

    /// Creates the shadow ray to a point of another surface, and the open range of distances before
    /// that point. In this range the ray hits neither surface. `None` if the distance is zero or
    /// not finite.
    #[inline]
    pub fn spawn_ray_to_surface(&self, target: &Self) -> Option<(Ray<R>, Interval<R>)> {
        let (ray, length, _) = self.spawn_unchecked_ray_to_surface(target);
        add_open_range((ray, length))
    }

    /// Creates the ray of [`Self::spawn_ray_to_surface`], and its length, without a branch. Both
    /// are valid only if the length is positive and finite.
    ///
    /// The two flags are for [`RayEndTriangles`](crate::RayEndTriangles). The origin of the
    /// ray is moved off this surface to one of its sides, and the end off `target`. The first flag is
    /// whether the ray leaves this surface towards that side. The second is whether the ray reaches
    /// `target` from that side. Both are true unless the points are about as near to each other as
    /// their error bounds.
    #[inline(always)]
    pub fn spawn_unchecked_ray_to_surface(&self, target: &Self) -> (Ray<R>, R, [bool; 2]) {
        let across = target.point - self.point;
        let (start, end) = (
            self.offset_ray_origin(across, self.error),
            target.offset_ray_origin(-across, target.error),
        );
        let (ray, distance) = ray_between_points::<R>(start, end);
        // The rounded unit direction makes the ray miss its end point slightly, so the ray ends at
        // the tangent plane of the target. The length of a ray almost parallel to that plane is
        // limited to little more than the distance of the points.
        let (normal, direction) = (target.normal.to_f64(), ray.direction.to_f64());
        let to_plane = normal.dot(end.to_f64() - start.to_f64()) / normal.dot(direction);
        // The sides as `offset_ray_origin` chooses them, by the direction between the points.
        let (own, across) = (self.normal.to_f64(), across.to_f64());
        let sides = [
            (own.dot(across) < 0.0) == (own.dot(direction) < 0.0),
            (normal.dot(across) > 0.0) == (normal.dot(direction) > 0.0),
        ];
        (
            ray,
            R::from_f64(f64::min(
                to_plane,
                distance.to_f64() * (1.0 + EXCESS_LENGTH),
            )),
            sides,
        )
    }

    #[inline(always)]
    fn offset_ray_origin(&self, direction: R::Vec3, error: R) -> R::Vec3 {
        // Computed in f64, where products of f32 numbers are exact: a tangent must not count as an
        // inward ray.
        let inward = self.normal.to_f64().dot(direction.to_f64()) < 0.0;
        let size = self.normal.abs();
        let offset = self.normal * ((size.x() + size.y() + size.z()) * error);
        // Both origins are computed: of a choice between the base points, the compiler would make
        // gather instructions in lanes, which are slow.
        let (outer, inner) = (self.above + offset, self.below - offset);
        let (moved, normal) = if inward {
            (inner, -self.normal)
        } else {
            (outer, self.normal)
        };
        let [x, y, z] = [moved.x(), moved.y(), moved.z()];
        R::Vec3::new(
            x.next_towards(normal.x()),
            y.next_towards(normal.y()),
            z.next_towards(normal.z()),
        )
    }
}

/// Greatest relative excess of a shadow ray's length over the distance between its two end points.
const EXCESS_LENGTH: f64 = 1.0 / 4096.0;

/// Returns the ray from `start` to `end`, and its length. Squares are computed in f64, where they
/// neither underflow nor overflow.
#[inline(always)]
fn ray_between_points<R: Real>(start: R::Vec3, end: R::Vec3) -> (Ray<R>, R) {
    let across = end.to_f64() - start.to_f64();
    let distance = across.length();
    (
        Ray::new(start, R::Vec3::from_f64(across / distance)),
        R::from_f64(distance),
    )
}

/// Returns the ray with the open range of distances from 0 to `max`; `None` if `max` is zero or not
/// finite.
#[inline(always)]
fn add_open_range<R: Real>((ray, max): (Ray<R>, R)) -> Option<(Ray<R>, Interval<R>)> {
    (max > R::ZERO && max.is_finite()).then_some((ray, Interval { min: R::ZERO, max }))
}
