//! The cone, complete or truncated: a solid with caps.

use glam::DVec3;

use super::frame::{eval_disk_support, length_2d, split_along_axis};
use super::quadratic::{
    Crossings, Quadratic, RaySpan, choose_reference_point, point_at_hit, uses_near_reference_point,
};
use super::revolution::{SurfaceOfRevolution, WALL};
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    rounding_bound,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A cone, complete or truncated: a solid whose radius changes linearly along its axis. The
/// formulas need no unit axis, so rounding the stored axis does not make the cone elliptic.
#[derive(Clone, Copy, Debug)]
pub struct Cone<R: Real> {
    /// Centre of the base.
    pub base: R::Vec3,
    /// Vector from the centre of the base to the centre of the other end, or to the apex.
    pub axis: R::Vec3,
    /// Radius of the base, at least zero.
    pub radius: R,
    /// Radius of the other end, at least zero. At least one radius is positive.
    pub top_radius: R,
}

impl<R: Real> Cone<R> {
    /// Creates a cone from the centre of its base, an axis direction of any positive length, the
    /// radii of base and top, and the height.
    pub fn new(base: DVec3, axis: DVec3, radius: f64, top_radius: f64, height: f64) -> Self {
        Self {
            base: R::Vec3::from_f64(base),
            axis: R::Vec3::from_f64(axis.normalize() * height),
            radius: R::from_f64(radius),
            top_radius: R::from_f64(top_radius),
        }
    }

    /// Intersects a ray with the nappe on which the cone's radius is nonnegative. A nappe is one
    /// half of the infinite double cone. A ray is inside the nappe in a single range of distances,
    /// although it may be inside the double cone in two.
    ///
    /// With `close`, the formula starts from the ray's point nearest to the base, otherwise from
    /// the ray's origin ([`choose_reference_point`]).
    #[inline(always)]
    fn intersect_wall(&self, prepared_ray: &PreparedRay, close: bool) -> Option<Crossings> {
        let (axis, d) = (self.axis.to_f64(), prepared_ray.direction);
        let (base_radius, top_radius) = (self.radius.to_f64(), self.top_radius.to_f64());
        let (ahead, f) = choose_reference_point(prepared_ray, self.base.to_f64(), close);
        let squared = axis.dot(axis);
        let (m, n) = (d.cross(axis), f.cross(axis));
        // The radius at distance t, times the squared axis, is `reach + t·opening`.
        let taper = top_radius - base_radius;
        let (reach, opening) = (
            base_radius * squared + taper * f.dot(axis),
            taper * d.dot(axis),
        );
        let quadratic = Quadratic::new(
            squared * m.dot(m) - opening * opening,
            squared * m.dot(n) - reach * opening,
            squared * n.dot(n) - reach * reach,
        );
        if quadratic.a > 0.0 {
            let crossings = quadratic.roots()?;
            // Both roots lie on one nappe, and the sign of the radius between the roots selects it.
            let middle = reach - opening * quadratic.b / quadratic.a;
            return (middle >= 0.0).then(|| crossings.shift(ahead));
        }
        // The ray is steeper than the wall, or parallel to it: everything beyond one root is
        // inside, on the side where the radius grows. Such a line always intersects the cone,
        // whatever rounding does to the discriminant.
        let crossings = Quadratic {
            discriminant: quadratic.discriminant.max(0.0),
            ..quadratic
        }
        .roots()?;
        let crossings = crossings.shift(ahead);
        let grows = if quadratic.a < 0.0 {
            opening > 0.0
        } else {
            quadratic.b < 0.0
        };
        Some(if grows {
            Crossings {
                enter: crossings.enter,
                leave: f64::INFINITY,
            }
        } else {
            Crossings {
                enter: -f64::INFINITY,
                leave: crossings.leave,
            }
        })
    }

    /// Returns the range of distances at which the ray is inside the solid. `close` is the
    /// parameter of [`Self::intersect_wall`].
    #[inline(always)]
    fn intersect_solid(&self, prepared_ray: &PreparedRay, close: bool) -> Option<RaySpan> {
        let solid = self.surface_of_revolution();
        // Equal radii have no nappe, and a ray along the axis has no crossing.
        let wall = if self.radius == self.top_radius {
            solid.intersect_infinite_tube(prepared_ray, close)?
        } else {
            self.intersect_wall(prepared_ray, close)?
        };
        solid.clip_wall_crossings(prepared_ray, wall)
    }

    #[inline(always)]
    fn surface_of_revolution(&self) -> SurfaceOfRevolution {
        SurfaceOfRevolution::new(self.base, self.axis, [self.radius, self.top_radius])
    }

    /// Evaluates the surface point of the wall, at the fraction `along` of the axis and in the
    /// direction `out` from the axis. `out` is perpendicular to the axis, of any length. At the
    /// apex `out` may be zero.
    fn eval_wall_point(&self, along: f64, out: DVec3) -> SurfacePoint {
        let axis = self.axis.to_f64();
        let (height, distance) = (axis.length(), out.length());
        let has_side = distance > 0.0;
        let out = if has_side {
            out * (1.0 / distance)
        } else {
            DVec3::ZERO
        };
        let taper = self.top_radius.to_f64() - self.radius.to_f64();
        let point =
            self.base.to_f64() + axis * along + out * (self.radius.to_f64() + taper * along);
        let normal = if has_side {
            out * height - axis * (taper / height)
        } else {
            axis * 1.0_f64.copysign(-taper)
        };
        SurfacePoint::new(
            point,
            normal.normalize(),
            rounding_bound(self.surface_of_revolution().error_scale(point)),
        )
    }

    /// Returns the areas of the wall, the base and the other end.
    fn part_areas(&self) -> [f64; 3] {
        let (base, top, height) = (
            self.radius.to_f64(),
            self.top_radius.to_f64(),
            self.axis.to_f64().length(),
        );
        let pi = core::f64::consts::PI;
        [
            pi * (base + top) * length_2d(height, base - top),
            pi * base * base,
            pi * top * top,
        ]
    }
}

impl<R: Real> Shape<R> for Cone<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        let (base, axis) = (self.base.to_f64(), self.axis.to_f64());
        let end =
            |centre: DVec3, radius: R| eval_disk_support(centre, axis, radius.to_f64(), direction);
        let (base, top) = (end(base, self.radius), end(base + axis, self.top_radius));
        Some((base + top) * 0.0 + base.max(top))
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        self.intersect_solid(
            prepared_ray,
            uses_near_reference_point(prepared_ray, self.base, self.radius.max(self.top_radius)),
        )?
        .nearest_hit(range, side)
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let part = hit.u.to_f64() as u8;
        // The unrounded end of the range makes the fraction along the axis accurate.
        let raw = point_at_hit(
            prepared_ray,
            self.intersect_solid(prepared_ray, true)
                .map(RaySpan::to_crossings),
            hit,
        );
        let (along, out) = split_along_axis(raw - self.base.to_f64(), self.axis.to_f64());
        let surface_point = if part == WALL {
            self.eval_wall_point(along, out)
        } else {
            self.surface_of_revolution().eval_cap_point(part, out)
        };
        self.surface_of_revolution().move_inward_ray_base::<R>(
            surface_point,
            part,
            (along, out),
            transform_chain,
        )
    }

    /// Texture coordinates in [0, 1]: u runs around the axis. On the wall v runs from the top to
    /// the base. On a cap v runs from the centre to the rim.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        self.surface_of_revolution().texture_coordinates(
            self.locate_surface_point(prepared_ray, hit).point,
            hit.u.to_f64() as u8,
            1.0,
        )
    }
}

impl<R: Real> SampleArea<R> for Cone<R> {
    fn area(&self) -> f64 {
        self.part_areas().iter().sum()
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let on_wall = |share: f64, out| {
            // For points uniform in area, the squared radius is uniform between the squares of both
            // radii.
            let (low, high) = (self.radius.to_f64(), self.top_radius.to_f64());
            let radius = (low * low + (high * high - low * low) * share)
                .max(0.0)
                .sqrt();
            // The fraction along the axis, (radius − low)/(high − low), without cancellation.
            let along = (low + high) * share / (radius + low).max(f64::MIN_POSITIVE);
            self.eval_wall_point(along.min(1.0), out)
        };
        let area = self.area();
        (
            self.surface_of_revolution().sample_surface(
                self.part_areas(),
                area,
                [u, v].map(Real::to_f64),
                on_wall,
            ),
            1.0 / area,
        )
    }
}
