//! The disk.

use glam::DVec3;

use super::frame::{angle_coordinate, eval_disk_support, radial_direction};
use super::plane::intersect_plane;
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    rounding_bound,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A disk: all points of a plane at most `radius` away from `centre`.
#[derive(Clone, Copy, Debug)]
pub struct Disk<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Outward normal, of unit length up to rounding.
    pub normal: R::Vec3,
    /// Radius, above zero.
    pub radius: R,
}

impl<R: Real> Disk<R> {
    /// Creates a disk from the centre, a normal of any positive length, and the radius.
    pub fn new(centre: DVec3, normal: DVec3, radius: f64) -> Self {
        Self {
            centre: R::Vec3::from_f64(centre),
            normal: R::Vec3::from_f64(normal.normalize()),
            radius: R::from_f64(radius),
        }
    }
}

impl<R: Real> Shape<R> for Disk<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        Some(eval_disk_support(
            self.centre.to_f64(),
            self.normal.to_f64(),
            self.radius.to_f64(),
            direction,
        ))
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let (normal, radius) = (self.normal.to_f64(), self.radius.to_f64());
        let f = prepared_ray.origin - self.centre.to_f64();
        let slope = normal.dot(prepared_ray.direction);
        // For a ray in the plane the distance is 0/0 or x/0, which no open range contains.
        let distance = -normal.dot(f) / slope;
        let t = R::from_f64(distance);
        let offset = f + prepared_ray.direction * distance;
        (range.contains(t) && offset.dot(offset) <= radius * radius && side.accepts(slope < 0.0))
            .then_some(ShapeHit::from_distance(t))
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        _: ShapeHit<R>,
        _: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let normal = self.normal.to_f64();
        let (point, error) = intersect_plane(prepared_ray, normal, self.centre.to_f64());
        SurfacePoint::new(point, normal.normalize(), error)
    }

    /// Texture coordinates in [0, 1]: u runs around the normal, v runs from the centre to the rim.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let offset = self.locate_surface_point(prepared_ray, hit).point - self.centre.to_f64();
        let (u, dpdu) = angle_coordinate(offset, self.normal.to_f64());
        TextureCoordinates {
            u,
            v: R::from_f64(offset.length()) / self.radius,
            dpdu,
            mirrored: false,
        }
    }
}

impl<R: Real> SampleArea<R> for Disk<R> {
    fn area(&self) -> f64 {
        core::f64::consts::PI * self.radius.to_f64() * self.radius.to_f64()
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let centre = self.centre.to_f64();
        let radius = self.radius.to_f64();
        let point = centre
            + radial_direction(self.normal.to_f64(), u.to_f64()) * (radius * v.to_f64().sqrt());
        let error = rounding_bound(centre.abs().max_element() + radius);
        (
            SurfacePoint::new(point, self.normal.to_f64().normalize(), error),
            1.0 / self.area(),
        )
    }
}
