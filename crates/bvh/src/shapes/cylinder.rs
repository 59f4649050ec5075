//! The cylinder: infinite, a finite open tube, or a finite solid with caps.

use glam::DVec3;

use super::frame::{eval_disk_support, split_along_axis};
use super::quadratic::{point_at_hit, uses_near_reference_point};
use super::revolution::{SurfaceOfRevolution, WALL};
use super::spawn_offset::offset_curved_origins;
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    rounding_bound,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// Ends of a cylinder along its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CylinderEnds {
    /// No ends: the cylinder is infinite.
    None,
    /// Open ends: a tube.
    Open,
    /// Caps: the cylinder is a solid.
    Capped,
}

/// A cylinder: its wall has the distance `radius` from a line or from a segment.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder<R: Real> {
    /// Centre of one end. For an infinite cylinder it is any point of the axis.
    pub base: R::Vec3,
    /// Vector from `base` to the centre of the other end. For an infinite cylinder it has any
    /// positive length.
    pub axis: R::Vec3,
    /// Radius, above zero.
    pub radius: R,
    /// Kind of ends.
    pub ends: CylinderEnds,
}

impl<R: Real> Cylinder<R> {
    /// Creates a cylinder. `base` is the centre of one end, or any point of an infinite axis.
    /// `axis` is a direction of any positive length. `height` is `None` for an infinite cylinder.
    /// `caps` is whether a finite cylinder is closed.
    pub fn new(base: DVec3, axis: DVec3, radius: f64, height: Option<f64>, caps: bool) -> Self {
        let ends = match height {
            None => CylinderEnds::None,
            Some(_) if caps => CylinderEnds::Capped,
            Some(_) => CylinderEnds::Open,
        };
        Self {
            base: R::Vec3::from_f64(base),
            axis: R::Vec3::from_f64(axis.normalize() * height.unwrap_or(1.0)),
            radius: R::from_f64(radius),
            ends,
        }
    }

    #[inline(always)]
    fn surface_of_revolution(&self) -> SurfaceOfRevolution {
        SurfaceOfRevolution::new(self.base, self.axis, [self.radius; 2])
    }

    /// Evaluates the surface point of the wall, at the fraction `along` of the axis and in the
    /// direction `out` from the axis. `out` has any positive length.
    fn eval_wall_point(&self, along: f64, out: DVec3) -> SurfacePoint {
        let normal = out.normalize();
        let point = self.base.to_f64() + self.axis.to_f64() * along + normal * self.radius.to_f64();
        SurfacePoint::new(
            point,
            normal,
            rounding_bound(self.surface_of_revolution().error_scale(point)),
        )
    }

    /// Returns the areas of the wall and of one cap.
    fn wall_and_cap_areas(&self) -> (f64, f64) {
        let (radius, height) = (self.radius.to_f64(), self.axis.to_f64().length());
        let cap = if self.ends == CylinderEnds::Capped {
            core::f64::consts::PI * radius * radius
        } else {
            0.0
        };
        (core::f64::consts::TAU * radius * height, cap)
    }
}

impl<R: Real> Shape<R> for Cylinder<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        let (base, axis, radius) = (self.base.to_f64(), self.axis.to_f64(), self.radius.to_f64());
        let end = |centre: DVec3| eval_disk_support(centre, axis, radius, direction);
        (self.ends != CylinderEnds::None).then(|| end(base) + axis.dot(direction).max(0.0))
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let solid = self.surface_of_revolution();
        let wall = solid.intersect_infinite_tube(
            prepared_ray,
            uses_near_reference_point(prepared_ray, self.base, self.radius),
        )?;
        match self.ends {
            CylinderEnds::None => wall.nearest_hit(range, side, |_| true),
            CylinderEnds::Open => {
                let span = solid.clip_to_ends(prepared_ray)?;
                wall.nearest_hit(range, side, |t| span.near <= t && t <= span.far)
            }
            CylinderEnds::Capped => solid
                .clip_wall_crossings(prepared_ray, wall)?
                .nearest_hit(range, side),
        }
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let part = hit.u.to_f64() as u8;
        let (solid, wall) = (
            self.surface_of_revolution(),
            self.surface_of_revolution()
                .intersect_infinite_tube(prepared_ray, true),
        );
        let span = || {
            Some(
                solid
                    .clip_wall_crossings(prepared_ray, wall?)?
                    .to_crossings(),
            )
        };
        let raw = point_at_hit(
            prepared_ray,
            if self.ends == CylinderEnds::Capped {
                span()
            } else {
                wall
            },
            hit,
        );
        let (mut along, mut out) = split_along_axis(raw - self.base.to_f64(), self.axis.to_f64());
        if self.ends == CylinderEnds::Capped && transform_chain.is_none() {
            // Without maps the wall and the caps are perpendicular, so only rounding can move an
            // origin across their seam. The point is kept off the seam by that rounding, for rays
            // that start inside.
            let reach = solid.error_scale(raw) * R::ROUNDOFF.to_f64() * 4.0;
            let margin = (reach / self.axis.to_f64().length()).min(0.5);
            along = along.max(margin).min(1.0 - margin);
            let (distance, rim) = (out.length(), self.radius.to_f64() - reach);
            if part != WALL && distance > rim {
                out *= rim.max(0.0) / distance;
            }
        }
        let surface_point = if part == WALL {
            self.eval_wall_point(along, out)
        } else {
            solid.eval_cap_point(part, out)
        };
        let radius = self.radius.to_f64();
        if self.ends != CylinderEnds::Capped {
            return offset_curved_origins::<R>(surface_point, transform_chain, || {
                [f64::INFINITY, radius]
            });
        }
        if transform_chain.is_none() {
            surface_point
        } else {
            solid.move_inward_ray_base::<R>(surface_point, part, (along, out), transform_chain)
        }
    }

    /// Texture coordinates. u runs around the axis, in [0, 1]. v depends on the surface:
    ///
    /// - wall of a finite cylinder: from 0 at the top to 1 at the base;
    /// - infinite cylinder: distance from the base along the axis, in world units;
    /// - cap: from 0 at the centre to 1 at the rim.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let top = if self.ends == CylinderEnds::None {
            0.0
        } else {
            1.0
        };
        self.surface_of_revolution().texture_coordinates(
            self.locate_surface_point(prepared_ray, hit).point,
            hit.u.to_f64() as u8,
            top,
        )
    }
}

/// Samples the wall and the caps by area. Of an infinite cylinder, the part along `axis` is
/// sampled.
impl<R: Real> SampleArea<R> for Cylinder<R> {
    fn area(&self) -> f64 {
        let (wall, cap) = self.wall_and_cap_areas();
        wall + 2.0 * cap
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let ((wall, cap), area) = (self.wall_and_cap_areas(), self.area());
        let on_wall = |along, out| self.eval_wall_point(along, out);
        (
            self.surface_of_revolution().sample_surface(
                [wall, cap, cap],
                area,
                [u, v].map(Real::to_f64),
                on_wall,
            ),
            1.0 / area,
        )
    }
}
