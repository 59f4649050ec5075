//! The infinite plane.

use glam::DVec3;

use super::frame::tangent;
use super::{
    OuterTransforms, PreparedRay, Shape, ShapeHit, SurfacePoint, TextureCoordinates, rounding_bound,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A plane: all points p with (p − point)·normal = 0. It is unbounded, so no tree holds it.
#[derive(Clone, Copy, Debug)]
pub struct Plane<R: Real> {
    /// Any point of the plane.
    pub point: R::Vec3,
    /// Outward unit normal.
    pub normal: R::Vec3,
    /// Unit tangent, the direction of u.
    pub tangent: R::Vec3,
}

impl<R: Real> Plane<R> {
    /// Creates a plane through a point with the given unit normal. The tangent is the x axis,
    /// projected onto the plane, unless the normal is close to x. So on a floor u and v are the
    /// world's x and z.
    pub fn new(point: R::Vec3, normal: R::Vec3) -> Self {
        Self {
            point,
            normal,
            tangent: R::Vec3::from_f64(tangent(normal.to_f64())),
        }
    }
}

/// Intersects a ray with the plane through the point `through`. Returns the hit point and its error
/// bound. The bound is that of the computation in f64, since the distance is not rounded to the
/// stored scalar.
#[inline(always)]
pub(super) fn intersect_plane(
    prepared_ray: &PreparedRay,
    normal: DVec3,
    through: DVec3,
) -> (DVec3, f64) {
    let height = normal.dot(through - prepared_ray.origin);
    let point = prepared_ray.origin
        + prepared_ray.direction * (height / normal.dot(prepared_ray.direction));
    let distance = (point - prepared_ray.origin).abs().max_element();
    (
        point,
        rounding_bound(point.abs().max_element() + through.abs().max_element() + distance),
    )
}

impl<R: Real> Shape<R> for Plane<R> {
    fn support_function(&self, _: DVec3) -> Option<f64> {
        None
    }

    #[inline(always)]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let normal = self.normal.to_f64();
        let slope = normal.dot(prepared_ray.direction);
        let height = normal.dot(self.point.to_f64() - prepared_ray.origin);
        // For a ray in the plane the distance is 0/0 or x/0, which no open range contains.
        let t = R::from_f64(height / slope);
        (t.is_finite() && range.contains(t) && side.accepts(slope < 0.0))
            .then_some(ShapeHit::from_distance(t))
    }

    #[inline]
    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        _: ShapeHit<R>,
        _: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let normal = self.normal.to_f64();
        let (point, error) = intersect_plane(prepared_ray, normal, self.point.to_f64());
        SurfacePoint::new(point, normal, error)
    }

    /// Texture coordinates in world units, relative to `point`: u along the tangent, v
    /// perpendicular to it. On a floor they are the world's x and z.
    #[inline]
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let offset = self.surface(prepared_ray, hit).point - self.point;
        let bitangent = self.tangent.cross(self.normal);
        TextureCoordinates {
            u: offset.dot(self.tangent),
            v: offset.dot(bitangent),
            dpdu: self.tangent,
            mirrored: false,
        }
    }
}
