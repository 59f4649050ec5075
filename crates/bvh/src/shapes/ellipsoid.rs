//! The axis-aligned ellipsoid.

use glam::DVec3;

use super::prepared_ray::FAR_RATIO;
use super::quadratic::{Crossings, Quadratic, call_cold, choose_reference_point, point_at_hit};
use super::sample::integrate_area;
use super::spawn_offset::SpawnOffset;
use super::sphere::{globe_coordinates, sample_sphere_direction};
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    TransformChain, rounding_bound,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// An ellipsoid: a sphere scaled along the coordinate axes.
#[derive(Clone, Copy, Debug)]
pub struct Ellipsoid<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Semi-axes along x, y, z, each positive.
    pub semi_axes: R::Vec3,
}

impl<R: Real> Ellipsoid<R> {
    /// Creates an ellipsoid from the centre and the semi-axes along x, y, z.
    pub fn new(centre: DVec3, semi_axes: DVec3) -> Self {
        Self {
            centre: R::Vec3::from_f64(centre),
            semi_axes: R::Vec3::from_f64(semi_axes),
        }
    }

    /// Intersects a ray with the ellipsoid, in a space where the ellipsoid is a sphere. Each axis
    /// is scaled by the product of the semi-axes along the other two. So the sphere's radius is the
    /// product of all three semi-axes. For semi-axes stored in f32 the scales are exact in f64.
    ///
    /// With `close`, the formula starts from the ray's point nearest to the centre, otherwise from
    /// the ray's origin ([`choose_reference_point`]).
    #[inline(always)]
    fn find_crossings(&self, prepared_ray: &PreparedRay, close: bool) -> Option<Crossings> {
        let s = self.semi_axes.to_f64();
        let scale = DVec3::new(s.y * s.z, s.z * s.x, s.x * s.y);
        let (ahead, f) = choose_reference_point(prepared_ray, self.centre.to_f64(), close);
        let (d, f, radius) = (prepared_ray.direction * scale, f * scale, s.x * s.y * s.z);
        let (a, b) = (d.dot(d), d.dot(f));
        if !close {
            let (squared, room) = (f.dot(f), radius * radius);
            if squared > room * (FAR_RATIO * FAR_RATIO) {
                return call_cold(move || self.find_crossings(prepared_ray, true));
            }
            return Quadratic::new(a, b, squared - room).roots();
        }
        // The distance of the line from the centre is computed without cancellation, as for the
        // sphere.
        let middle = -b / a;
        let l = f + d * middle;
        let half_squared = (radius * radius - l.dot(l)) / a;
        let is_hit = half_squared >= 0.0;
        is_hit.then(|| {
            let (middle, half) = (middle + ahead, half_squared.sqrt());
            Crossings {
                enter: middle - half,
                leave: middle + half,
            }
        })
    }

    /// Evaluates the surface point of a point close to the surface. The error of the point is
    /// proportional to the sum of `scale`, the centre's greatest coordinate and the greatest
    /// semi-axis.
    fn eval_surface_point(&self, point: DVec3, scale: f64) -> SurfacePoint {
        let (centre, s) = (self.centre.to_f64(), self.semi_axes.to_f64());
        let offset = point - centre;
        let gradient = offset / (s * s);
        let scale = scale + centre.abs().max_element() + s.max_element();
        SurfacePoint::new(point, gradient.normalize(), rounding_bound(scale))
    }

    /// Returns the offset from a hit point to the base point of inward rays, from which their
    /// origins are offset along the normal. The offset is computed for the unit sphere of which
    /// this ellipsoid is the image (see [`super::spawn_offset::offset_curved_origins`]).
    #[inline(never)]
    fn inward_ray_offset(
        &self,
        surface_point: &SurfacePoint,
        transform_chain: TransformChain<'_>,
    ) -> DVec3 {
        let s = self.semi_axes.to_f64();
        let spawn_offset = SpawnOffset::from_surface_error::<R>(
            Some(transform_chain),
            surface_point.point,
            surface_point.error,
        );
        let [x, y, z] = [DVec3::X / s.x, DVec3::Y / s.y, DVec3::Z / s.z]
            .map(|gradient| spawn_offset.offset_along(gradient));
        let share = x * x + y * y + z * z;
        if share < 1.0 {
            (self.centre.to_f64() - surface_point.point) * share
        } else {
            DVec3::ZERO
        }
    }

    /// Local factor by which the map from the unit sphere to the ellipsoid changes areas. `n` is
    /// the unit normal of the sphere.
    fn area_scale_at_normal(&self, n: DVec3) -> f64 {
        let s = self.semi_axes.to_f64();
        DVec3::new(n.x * s.y * s.z, n.y * s.z * s.x, n.z * s.x * s.y).length()
    }
}

impl<R: Real> Shape<R> for Ellipsoid<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        Some(self.centre.to_f64().dot(direction) + (self.semi_axes.to_f64() * direction).length())
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        self.find_crossings(prepared_ray, !R::IS_SINGLE)?
            .nearest_hit(range, side, |_| true)
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let point = point_at_hit(prepared_ray, self.find_crossings(prepared_ray, true), hit);
        let distance = (prepared_ray.origin - point).abs().max_element();
        let surface_point = self.eval_surface_point(point, distance + point.abs().max_element());
        match transform_chain {
            Some(transform_chain) => SurfacePoint {
                below: surface_point.point
                    + self.inward_ray_offset(&surface_point, transform_chain),
                ..surface_point
            },
            None => surface_point,
        }
    }

    /// Texture coordinates in [0, 1]: those of the unit sphere of which this ellipsoid is the
    /// image.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let (centre, s) = (self.centre.to_f64(), self.semi_axes.to_f64());
        let n = ((self.locate_surface_point(prepared_ray, hit).point - centre) / s).normalize();
        let [u, v] = globe_coordinates::<f64>(n).map(R::from_f64);
        let dpdu = R::Vec3::from_f64(DVec3::new(n.z, 0.0, -n.x) * s * core::f64::consts::TAU);
        TextureCoordinates {
            u,
            v,
            dpdu,
            mirrored: false,
        }
    }
}

/// Samples the unit sphere uniformly and maps the point to the ellipsoid. The density is that of
/// the sphere, divided by the local factor between the areas.
impl<R: Real> SampleArea<R> for Ellipsoid<R> {
    fn area(&self) -> f64 {
        integrate_area(|u, v| {
            4.0 * core::f64::consts::PI * self.area_scale_at_normal(sample_sphere_direction(u, v))
        })
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let n = sample_sphere_direction(u.to_f64(), v.to_f64());
        let point = self.centre.to_f64() + self.semi_axes.to_f64() * n;
        let density = 1.0 / (4.0 * core::f64::consts::PI * self.area_scale_at_normal(n));
        (self.eval_surface_point(point, 0.0), density)
    }

    fn area_density(&self, point: &SurfacePoint) -> f64 {
        let n = ((point.point - self.centre.to_f64()) / self.semi_axes.to_f64()).normalize();
        1.0 / (4.0 * core::f64::consts::PI * self.area_scale_at_normal(n))
    }
}
