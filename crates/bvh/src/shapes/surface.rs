//! The surface at a hit, how far its point may be off, and rays that start outside that error.

use crate::ray::{Interval, Ray};
use crate::scalar::{Real, Vector};
use glam::DVec3;

/// The surface at a hit in f64, before it is rounded to what is stored.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The hit point, moved onto the surface.
    pub point: DVec3,
    /// Where rays to the outer side start, before they are lifted off the surface: the point, or
    /// one beside it from which a start comes to lie on that side of everything there, wherever
    /// rounding moves it.
    pub above: DVec3,
    /// The same for rays to the inner side.
    pub below: DVec3,
    /// Geometric unit normal, pointing outwards whichever side was hit.
    pub normal: DVec3,
    /// Bound on the distance, in each axis, of `point` from the surface, and of the surface from
    /// where another test of it will find it.
    pub error: f64,
}

impl SurfacePoint {
    /// A surface from whose point rays may start as it is.
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

    /// Rounded to the stored scalar, the bound grown by that rounding.
    #[inline(always)]
    pub fn stored<R: Real>(&self) -> Surface<R> {
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
pub struct Surface<R: Real> {
    /// The hit point, moved onto the surface.
    pub point: R::Vec3,
    /// Where rays to the outer side start, before they are lifted off: as [`SurfacePoint::above`].
    pub above: R::Vec3,
    /// Where rays to the inner side start, before they are lifted off: as [`SurfacePoint::below`].
    pub below: R::Vec3,
    /// Bound on the distance, in each axis, of `point` from the exact surface, including the error
    /// of the test that may meet the surface again ("Managing Rounding Error", Physically Based
    /// Rendering, 4th edition, 6.8).
    pub error: R,
    /// Geometric unit normal, pointing outwards whichever side was hit.
    pub normal: R::Vec3,
}

/// Texture coordinates at a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters<R: Real> {
    /// First texture coordinate.
    pub u: R,
    /// Second texture coordinate.
    pub v: R,
    /// Derivative of the point by u; not normalised, zero where it vanishes.
    pub dpdu: R::Vec3,
    /// Whether an image whose columns run along u and whose rows run down along v is seen mirrored
    /// from outside: whether dp/du × dp/dv points outwards.
    pub mirrored: bool,
}

impl<R: Real> Surface<R> {
    /// Where a ray that leaves in `direction` starts: off the surface along the normal by as much
    /// as the point may be wrong, on the side to which the direction points (outside for a
    /// tangent), each coordinate rounded away from the surface.
    #[inline(always)]
    pub fn spawn(&self, direction: R::Vec3) -> R::Vec3 {
        self.lifted(direction, self.error)
    }

    /// The ray to another point and the range before it, for a shadow ray to a light without a
    /// surface. None at distance zero, where there is no direction.
    #[inline]
    pub fn spawn_to(&self, target: R::Vec3) -> Option<(Ray<R>, Interval<R>)> {
        open(between(self.spawn(target - self.point), target))
    }

    /// The ray to a point of another surface and the range before it, such that neither surface is
    /// in its own light. None where the two points coincide.
    #[inline]
    pub fn spawn_to_surface(&self, target: &Self) -> Option<(Ray<R>, Interval<R>)> {
        open(self.way_to_surface(target))
    }

    /// The same without a branch: the ray and its length, of which neither is of use unless the
    /// length is above zero and finite.
    #[inline(always)]
    pub fn way_to_surface(&self, target: &Self) -> (Ray<R>, R) {
        let across = target.point - self.point;
        let (start, end) = (
            self.lifted(across, self.error),
            target.lifted(-across, target.error),
        );
        let (ray, distance) = between::<R>(start, end);
        // A unit direction is rounded, so that the ray passes beside its end: it is over where it
        // comes to the plane of the surface there. A ray along that plane ends no farther away than
        // it should.
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
        // In f64, where products of f32 are exact: a tangent must not be taken for a ray that goes
        // in.
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

/// How much farther than its end a shadow ray may go, as a share of its length.
const BESIDE: f64 = 1.0 / 4096.0;

/// The ray from one point to another, and how far that is; lengths in f64, so that they neither
/// vanish nor overflow on the way.
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
