//! The hyperboloid of one sheet: clipped at two heights, and open at both rims.

use glam::DVec3;

use super::frame::{angle_coordinate, eval_disk_support, length_2d, radial_direction};
use super::prepared_ray::FAR_RATIO;
use super::quadratic::{Crossings, Quadratic, call_cold, choose_reference_point, point_at_hit};
use super::spawn_offset::offset_curved_origins;
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    rounding_bound, sample::integrate_area,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A hyperboloid: (x/a)² − (y/c)² + (z/a)² = 1 relative to the centre, for |y| ≤ half_height. The
/// normal points away from the axis.
#[derive(Clone, Copy, Debug)]
pub struct Hyperboloid<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Waist radius a, positive.
    pub waist: R,
    /// Slope constant c, positive.
    pub slope: R,
    /// Greatest |y − centre.y| of the surface; zero for an empty shape.
    pub half_height: R,
}

impl<R: Real> Hyperboloid<R> {
    /// Creates a hyperboloid from the centre, the waist radius a, the slope constant c, and the
    /// half height.
    pub fn new(centre: DVec3, waist: f64, slope: f64, half_height: f64) -> Self {
        Self {
            centre: R::Vec3::from_f64(centre),
            waist: R::from_f64(waist),
            slope: R::from_f64(slope),
            half_height: R::from_f64(half_height),
        }
    }

    /// Intersects a ray with the unclipped hyperboloid.
    ///
    /// With `close`, the formula starts from the ray's point nearest to the centre, otherwise from
    /// the ray's origin ([`choose_reference_point`]).
    #[inline(always)]
    fn find_crossings(&self, prepared_ray: &PreparedRay, close: bool) -> Option<Crossings> {
        let (waist, slope) = (self.waist.to_f64(), self.slope.to_f64());
        let (ahead, f) = choose_reference_point(prepared_ray, self.centre.to_f64(), close);
        // The equation is multiplied by (a·c)², so that its terms are products of two stored
        // numbers, without a division.
        let scale = DVec3::new(slope, waist, slope);
        let (d, f) = (prepared_ray.direction * scale, f * scale);
        let form = |p: DVec3, q: DVec3| p.x * q.x + p.z * q.z - p.y * q.y;
        let unit = (waist * slope) * (waist * slope);
        let (a, b) = (form(d, d), form(d, f));
        let quadratic = Quadratic::new(a, b, form(f, f) - unit);
        if !close {
            if f.dot(f) > unit * (FAR_RATIO * FAR_RATIO) {
                return call_cold(move || self.find_crossings(prepared_ray, true));
            }
            return quadratic.roots();
        }
        // Computes b² − a·c from the minors of (d, f), as |d × f|² for a sphere.
        let m = d.cross(f);
        let discriminant = unit * a + (m.x * m.x + m.z * m.z - m.y * m.y);
        Quadratic {
            discriminant,
            ..quadratic
        }
        .roots()
        .map(|r| r.shift(ahead))
    }

    /// Evaluates the surface point of a point close to the surface. The error of the point is
    /// proportional to a sum of lengths: `scale`, the waist, and the greatest coordinates of centre
    /// and point.
    fn eval_surface_point(&self, point: DVec3, scale: f64) -> SurfacePoint {
        let centre = self.centre.to_f64();
        let (waist, slope) = (self.waist.to_f64(), self.slope.to_f64());
        let offset = point - centre;
        let (across, up) = (slope * slope, waist * waist);
        let gradient = DVec3::new(offset.x * across, -offset.y * up, offset.z * across);
        let scale = scale + centre.abs().max_element() + point.abs().max_element() + waist;
        SurfacePoint::new(point, gradient.normalize(), rounding_bound(scale))
    }

    /// Radius of the surface at the height `y` above the centre.
    fn radius_at(&self, y: f64) -> f64 {
        self.waist.to_f64() * length_2d(y / self.slope.to_f64(), 1.0)
    }

    /// Inverse of the sampling density per area, at the height `y` above the centre. It is the
    /// product of the circumference, the slant of the meridian and the total height.
    fn inverse_area_density(&self, y: f64) -> f64 {
        let (a, c, radius) = (self.waist.to_f64(), self.slope.to_f64(), self.radius_at(y));
        let lean = a * a * y / (c * c * radius);
        2.0 * self.half_height.to_f64() * core::f64::consts::TAU * radius * length_2d(lean, 1.0)
    }
}

impl<R: Real> Shape<R> for Hyperboloid<R> {
    /// Support function. Only the two rims matter, since the surface curves inwards between them.
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        let height = self.half_height.to_f64();
        let rim = eval_disk_support(
            self.centre.to_f64(),
            DVec3::Y,
            self.radius_at(height),
            direction,
        );
        Some(rim + height * direction.y.abs())
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let half_height = self.half_height.to_f64();
        let above = prepared_ray.origin.y - self.centre.y().to_f64();
        let clipped = |t: f64| (above + prepared_ray.direction.y * t).abs() <= half_height;
        if half_height == 0.0 {
            return None;
        }
        self.find_crossings(prepared_ray, !R::IS_SINGLE)?
            .nearest_hit(range, side, clipped)
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
            // Both radii of curvature are least at the waist: the meridian's on the outer side, the
            // circle's on the inner side.
            let (waist, slope) = (self.waist.to_f64(), self.slope.to_f64());
            [slope * (slope / waist), waist]
        })
    }

    /// Texture coordinates in [0, 1]: u runs around the axis, v from the upper rim to the lower.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let offset = self.locate_surface_point(prepared_ray, hit).point - self.centre.to_f64();
        let (u, dpdu) = angle_coordinate(DVec3::new(offset.x, 0.0, offset.z), DVec3::Y);
        let v = R::from_f64(0.5) - R::from_f64(offset.y) / (self.half_height + self.half_height);
        TextureCoordinates {
            u,
            v,
            dpdu,
            mirrored: false,
        }
    }
}

/// Samples the height and the angle around the axis uniformly.
impl<R: Real> SampleArea<R> for Hyperboloid<R> {
    fn area(&self) -> f64 {
        integrate_area(|u, _| {
            self.inverse_area_density((2.0 * u - 1.0) * self.half_height.to_f64())
        })
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let y = (2.0 * u.to_f64() - 1.0) * self.half_height.to_f64();
        let offset = radial_direction(DVec3::Y, v.to_f64()) * self.radius_at(y) + DVec3::Y * y;
        (
            self.eval_surface_point(self.centre.to_f64() + offset, 0.0),
            1.0 / self.inverse_area_density(y),
        )
    }

    fn area_density(&self, point: &SurfacePoint) -> f64 {
        1.0 / self.inverse_area_density(point.point.y - self.centre.y().to_f64())
    }
}
