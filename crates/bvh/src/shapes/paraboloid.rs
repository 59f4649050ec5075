//! The paraboloid: clipped at a height, and open at its rim.

use glam::DVec3;

use super::frame::{angle_coordinate, length_2d, radial_direction};
use super::quadratic::{
    Crossings, Quadratic, choose_reference_point, point_at_hit, uses_near_reference_point,
};
use super::spawn_offset::offset_curved_origins;
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    rounding_bound, sample::integrate_area,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A paraboloid: y = (x² + z²)·height/radius² relative to the apex, for y ≤ `height`. The normal
/// points down and away from the axis.
#[derive(Clone, Copy, Debug)]
pub struct Paraboloid<R: Real> {
    /// Lowest point.
    pub apex: R::Vec3,
    /// Radius of the rim, positive.
    pub radius: R,
    /// Height of the rim above the apex; zero for an empty shape.
    pub height: R,
}

impl<R: Real> Paraboloid<R> {
    /// Creates a paraboloid from the apex, the radius of the rim, and the height of the rim.
    pub fn new(apex: DVec3, radius: f64, height: f64) -> Self {
        Self {
            apex: R::Vec3::from_f64(apex),
            radius: R::from_f64(radius),
            height: R::from_f64(height),
        }
    }

    /// Intersects a ray with the unclipped paraboloid.
    ///
    /// With `close`, the formula starts from the ray's point nearest to the apex, otherwise from
    /// the ray's origin ([`choose_reference_point`]).
    #[inline(always)]
    fn find_crossings(&self, prepared_ray: &PreparedRay, close: bool) -> Option<Crossings> {
        let (radius, height) = (self.radius.to_f64(), self.height.to_f64());
        let (ahead, f) = choose_reference_point(prepared_ray, self.apex.to_f64(), close);
        let d = prepared_ray.direction;
        let flat = |p: DVec3, q: DVec3| p.x * q.x + p.z * q.z;
        let room = radius * radius;
        let quadratic = Quadratic::new(
            height * flat(d, d),
            height * flat(d, f) - room * d.y * 0.5,
            height * flat(f, f) - room * f.y,
        );
        quadratic.roots().map(|r| r.shift(ahead))
    }

    /// Evaluates the surface point of a point close to the surface. The error of the point is
    /// proportional to a sum of lengths: `scale`, the shape's sizes, and the greatest coordinates
    /// of apex and point.
    fn eval_surface_point(&self, point: DVec3, scale: f64) -> SurfacePoint {
        let apex = self.apex.to_f64();
        let (radius, height) = (self.radius.to_f64(), self.height.to_f64());
        let offset = point - apex;
        let (steep, room) = (height + height, radius * radius);
        let gradient = DVec3::new(offset.x * steep, -room, offset.z * steep);
        let scale = scale + apex.abs().max_element() + point.abs().max_element() + radius + height;
        SurfacePoint::new(point, gradient.normalize(), rounding_bound(scale))
    }

    /// Inverse of the sampling density per area, at `distance` from the axis. It is the area of the
    /// rim's disk times the slant of the meridian.
    fn inverse_area_density(&self, distance: f64) -> f64 {
        let (radius, height) = (self.radius.to_f64(), self.height.to_f64());
        let lean = 2.0 * height * distance / (radius * radius);
        core::f64::consts::PI * radius * radius * length_2d(lean, 1.0)
    }
}

impl<R: Real> Shape<R> for Paraboloid<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        let (apex, radius, height) = (
            self.apex.to_f64(),
            self.radius.to_f64(),
            self.height.to_f64(),
        );
        // The support at the fraction s of the rim's radius is s·across + s²·up. It is greatest at
        // the rim, or where its derivative is zero.
        let (across, up) = (
            radius * length_2d(direction.x, direction.z),
            height * direction.y,
        );
        let inner = across / (-2.0 * up);
        let s = if up < 0.0 && inner < 1.0 { inner } else { 1.0 };
        Some(apex.dot(direction) + s * across + s * s * up)
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let height = self.height.to_f64();
        let above = prepared_ray.origin.y - self.apex.y().to_f64();
        if height == 0.0 {
            return None;
        }
        self.find_crossings(
            prepared_ray,
            uses_near_reference_point(prepared_ray, self.apex, self.radius.min(self.height)),
        )?
        .nearest_hit(range, side, |t| {
            above + prepared_ray.direction.y * t <= height
        })
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let point = point_at_hit(prepared_ray, self.find_crossings(prepared_ray, true), hit);
        let surface_point =
            self.eval_surface_point(point, (prepared_ray.origin - point).abs().max_element());
        offset_curved_origins::<R>(surface_point, transform_chain, || {
            // The radius of curvature is least at the apex.
            let (radius, height) = (self.radius.to_f64(), self.height.to_f64());
            [f64::INFINITY, radius * (radius / height) * 0.5]
        })
    }

    /// Texture coordinates in [0, 1]: u runs around the axis, v from the rim down to the apex.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let offset = self.locate_surface_point(prepared_ray, hit).point - self.apex.to_f64();
        let (u, dpdu) = angle_coordinate(DVec3::new(offset.x, 0.0, offset.z), DVec3::Y);
        TextureCoordinates {
            u,
            v: R::ONE - R::from_f64(offset.y) / self.height,
            dpdu,
            mirrored: false,
        }
    }
}

/// Samples the disk of the rim uniformly and projects the point down to the surface.
impl<R: Real> SampleArea<R> for Paraboloid<R> {
    fn area(&self) -> f64 {
        integrate_area(|u, _| self.inverse_area_density(u.sqrt() * self.radius.to_f64()))
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let distance = u.to_f64().sqrt() * self.radius.to_f64();
        let offset = radial_direction(DVec3::Y, v.to_f64()) * distance
            + DVec3::Y * (u.to_f64() * self.height.to_f64());
        (
            self.eval_surface_point(self.apex.to_f64() + offset, 0.0),
            1.0 / self.inverse_area_density(distance),
        )
    }

    fn area_density(&self, point: &SurfacePoint) -> f64 {
        let offset = point.point - self.apex.to_f64();
        1.0 / self.inverse_area_density(length_2d(offset.x, offset.z))
    }
}
