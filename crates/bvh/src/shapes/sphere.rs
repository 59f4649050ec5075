//! The sphere.

use super::prepared_ray::FAR_RATIO;
use super::quadratic::{Crossings, call_cold, choose_reference_point};
use super::spawn_offset::offset_curved_origins;
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    first_accepted_root, rounding_bound,
};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};
use glam::DVec3;

/// A sphere: all points at distance `radius` from `centre`.
#[derive(Clone, Copy, Debug)]
pub struct Sphere<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Radius, positive.
    pub radius: R,
}

impl<R: Real> Shape<R> for Sphere<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        Some(self.centre.to_f64().dot(direction) + self.radius.to_f64() * direction.length())
    }

    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::from_centre(
            self.centre.to_f64(),
            DVec3::splat(self.radius.to_f64()),
        ))
    }

    /// Intersects a ray with the sphere.
    ///
    /// The fastest form is the textbook discriminant b² − a·c. For spheres stored in f32 its error
    /// is 2⁻³⁰ of r², with r the radius, for origins up to 1024 radii away. Farther away its error
    /// grows with the square of the distance, and no digit is left at 10⁸ radii. So for far
    /// spheres, and for spheres stored in f64, the discriminant is computed from the perpendicular
    /// distance of the centre to the ray. The error of that form grows only linearly with the
    /// distance ("Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter
    /// 7).
    ///
    /// A first test rejects most rays without the second form. It is the textbook discriminant with
    /// [`PreparedRay::lower_length_squared`] in place of the squared length. For an origin outside
    /// the sphere, this discriminant is too great by 64 roundings of its terms, more than its
    /// error. For an origin inside, it can't be negative. So if it is negative, the ray misses by
    /// either form.
    #[inline(always)]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let f = prepared_ray.origin - self.centre.to_f64();
        let r = self.radius.to_f64();
        let (b, room) = (f.dot(prepared_ray.direction), r * r);
        let discriminant = if !R::IS_SINGLE {
            self.stable_discriminant(prepared_ray)
        } else {
            let outside = f.dot(f) - room;
            let may_meet = b * b - outside * prepared_ray.lower_length_squared >= 0.0;
            if !may_meet {
                return None;
            }
            if outside > room * (FAR_RATIO * FAR_RATIO) {
                call_cold(move || self.stable_discriminant(prepared_ray))
            } else {
                b * b - outside * prepared_ray.length_squared
            }
        };
        // Written so that NaN is a miss.
        let is_hit = discriminant >= 0.0;
        if !is_hit {
            return None;
        }
        let (root, inverse) = (discriminant.sqrt(), prepared_ray.inverse_length_squared);
        first_accepted_root(
            R::from_f64((-b - root) * inverse),
            R::from_f64((root - b) * inverse),
            range,
            side,
        )
    }

    #[inline]
    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let (centre, radius) = (self.centre.to_f64(), self.radius.to_f64());
        if prepared_ray.needs_unrounded_distance(hit.t, self.radius) {
            // The roots are computed again: in a mapped space, or for a small distant sphere, the
            // rounding of the stored distance may be large.
            let (ahead, l) = choose_reference_point(prepared_ray, centre, true);
            let half = ((radius * radius - l.dot(l)).max(0.0)
                * prepared_ray.inverse_length_squared)
                .sqrt();
            let t = Crossings {
                enter: ahead - half,
                leave: ahead + half,
            }
            .unrounded_distance(hit);
            let surface_point =
                self.eval_surface_point((l + prepared_ray.direction * (t - ahead)).normalize());
            // Mapped rays always take this branch, so no other branch needs the maps.
            return offset_curved_origins::<R>(surface_point, transform_chain, || {
                [f64::INFINITY, radius]
            });
        }
        self.eval_surface_point((prepared_ray.at(hit.t) - centre).normalize())
    }

    /// Texture coordinates in [0, 1]. u starts at the −x side and runs around +y, to the right as
    /// seen from outside. v runs down from the top. An image wraps around the sphere like a map
    /// around a globe.
    #[inline]
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let n = self.locate_surface_point(prepared_ray, hit).normal;
        let [u, v] = globe_coordinates::<f64>(n).map(R::from_f64);
        let around = self.radius.to_f64() * core::f64::consts::TAU;
        let dpdu = DVec3::new(n.z, 0.0, -n.x) * around;
        TextureCoordinates {
            u,
            v,
            dpdu: R::Vec3::from_f64(dpdu),
            mirrored: false,
        }
    }
}

impl<R: Real> Sphere<R> {
    /// Computes a quarter of the discriminant from the perpendicular distance of the centre to the
    /// ray. This form is accurate at any distance.
    #[inline(always)]
    fn stable_discriminant(&self, prepared_ray: &PreparedRay) -> f64 {
        let (f, r) = (
            prepared_ray.origin - self.centre.to_f64(),
            self.radius.to_f64(),
        );
        let l = f - prepared_ray.direction
            * (f.dot(prepared_ray.direction) * prepared_ray.inverse_length_squared);
        (r * r - l.dot(l)) * prepared_ray.length_squared
    }

    /// Evaluates the surface point in the unit direction `normal` from the centre. The computation
    /// is in f64, so the error bound is small beside the rounding to f32.
    #[inline(always)]
    pub fn eval_surface_point(&self, normal: DVec3) -> SurfacePoint {
        let (centre, radius) = (self.centre.to_f64(), self.radius.to_f64());
        SurfacePoint::new(
            centre + normal * radius,
            normal,
            rounding_bound(centre.abs().max_element() + radius),
        )
    }
}

impl<R: Real> SampleArea<R> for Sphere<R> {
    fn area(&self) -> f64 {
        4.0 * core::f64::consts::PI * self.radius.to_f64() * self.radius.to_f64()
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        (
            self.eval_surface_point(sample_sphere_direction(u.to_f64(), v.to_f64())),
            1.0 / self.area(),
        )
    }
}

/// Maps a unit direction to texture coordinates [u, v] in 0..1 on an equirectangular map. u starts
/// at −x and runs around +y. v runs down from the top. Near the poles the coordinates have full
/// precision. An arc cosine would lose half of the digits there.
#[inline(always)]
pub fn equirectangular_coordinates<R: Real>(n: R::Vec3) -> [R; 2] {
    let ring = (n.x() * n.x() + n.z() * n.z()).sqrt();
    [
        n.z().angle(n.x()) / R::from_f64(core::f64::consts::TAU) + R::from_f64(0.5),
        ring.angle(n.y()) / R::from_f64(core::f64::consts::PI),
    ]
}

/// Maps the unit normal of a sphere to texture coordinates. The first coordinate runs opposite to
/// that of an equirectangular map, which is seen from inside. A globe is seen from outside.
pub(super) fn globe_coordinates<R: Real>(n: R::Vec3) -> [R; 2] {
    let [u, v] = equirectangular_coordinates::<R>(n);
    [R::ONE - u, v]
}

/// Samples a unit vector, uniform over the sphere, from two numbers in [0, 1).
pub(super) fn sample_sphere_direction(u: f64, v: f64) -> DVec3 {
    let z = 1.0 - 2.0 * u;
    let (ring, angle) = ((1.0 - z * z).max(0.0).sqrt(), v * core::f64::consts::TAU);
    DVec3::new(ring * libm::cos(angle), ring * libm::sin(angle), z)
}

#[cfg(test)]
mod tests {
    use super::super::{AnyShape, Ellipsoid};
    use super::*;
    use crate::ray::Ray;
    use glam::Vec3;

    /// Texture coordinates at the point where a vertical ray hits a sphere around the origin.
    fn seen(shape: &AnyShape<f32>, x: f32, z: f32, down: f32) -> (f64, f64) {
        let prepared_ray = PreparedRay::new(Ray::<f32>::new(
            Vec3::new(x, -3.0 * down, z),
            Vec3::new(0.0, down, 0.0),
        ));
        let hit = shape
            .intersect(&prepared_ray, Interval::positive(), Side::Both)
            .expect("the ray hits the shape");
        let found = shape.texture_coordinates(&prepared_ray, hit);
        (found.u.into(), found.v.into())
    }

    /// Protects: texture coordinates near the poles keep full precision, where an arc cosine of f32
    /// has steps of 3.5e-4.
    #[test]
    fn s19_coordinates_near_the_poles_keep_their_digits() {
        let sphere = Sphere::<f32> {
            centre: Vec3::ZERO,
            radius: 1.0,
        };
        let egg = Ellipsoid::<f32> {
            centre: Vec3::ZERO,
            semi_axes: Vec3::new(2.0, 1.0, 0.5),
        };
        for (shape, sx, sz) in [(AnyShape::from(sphere), 1.0, 1.0), (egg.into(), 2.0, 0.5)] {
            for distance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7] {
                for turn in [0.3_f32, 2.0, 4.0, 6.0] {
                    let (x, z) = (distance * turn.cos(), distance * turn.sin());
                    let (dx, dz) = (f64::from(x) / sx, f64::from(z) / sz);
                    let ring = (dx * dx + dz * dz).sqrt();
                    let pole = f64::atan2(ring, (1.0 - ring * ring).sqrt()) / core::f64::consts::PI;
                    let around = 0.5 - f64::atan2(dz, dx) / core::f64::consts::TAU;
                    for (down, v) in [(-1.0, pole), (1.0, 1.0 - pole)] {
                        let found = seen(&shape, x, z, down);
                        let ulps = ((found.1 - v) / (v * f64::from(f32::EPSILON))).abs();
                        assert!(
                            ulps <= 4.0,
                            "{distance:e} from a pole: {} instead of {v}, {ulps} ulp",
                            found.1
                        );
                        assert!(
                            (found.0 - around).abs() <= 4.0 * f64::from(f32::EPSILON),
                            "u = {}",
                            found.0
                        );
                    }
                }
            }
            for (down, v) in [(-1.0, 0.0), (1.0, 1.0)] {
                assert_eq!(seen(&shape, 0.0, 0.0, down), (0.5, v));
            }
        }
    }

    /// Protects: across the seam on the −x side u jumps between almost zero and almost one, and on
    /// the seam u is in [0, 1], for zeros of either sign.
    #[test]
    fn s19_coordinates_meet_at_the_seam() {
        let ball = AnyShape::from(Sphere::<f32> {
            centre: Vec3::ZERO,
            radius: 1.0,
        });
        for x in [-0.9_f32, -0.5, -1e-3] {
            for step in [1e-2_f32, 1e-4, 1e-6, 1e-8] {
                let [above, below] = [step, -step].map(|z| seen(&ball, x, z, 1.0).0);
                let turn = f64::from(step).atan2(-f64::from(x)) / core::f64::consts::TAU;
                assert!(
                    (above.min(below) - turn).abs() < 1e-6
                        && (1.0 - above.max(below) - turn).abs() < 1e-6,
                    "{above} and {below} at {step:e}"
                );
            }
            for z in [0.0, -0.0] {
                let (u, v) = seen(&ball, x, z, 1.0);
                assert!(
                    (u == 0.0 || u == 1.0) && (0.0..=1.0).contains(&v),
                    "{u} on the seam"
                );
            }
        }
    }
}
