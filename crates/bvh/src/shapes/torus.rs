//! The torus.

use glam::DVec3;

use super::frame::{angle_coordinate, eval_disk_support, radial_direction, split_along_axis};
use super::quartic::Quartic;
use super::spawn_offset::offset_curved_origins;
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    rounding_bound,
};
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A torus: all points at distance `minor_radius` from a circle. The formulas need no unit axis, so
/// rounding the stored axis does not deform the torus.
#[derive(Clone, Copy, Debug)]
pub struct Torus<R: Real> {
    /// Centre.
    pub centre: R::Vec3,
    /// Axis of symmetry, of any positive length.
    pub axis: R::Vec3,
    /// Radius of the circle along the centre of the tube.
    pub major_radius: R,
    /// Radius of the tube, positive and below `major_radius`.
    pub minor_radius: R,
}

/// The quartic for the intersection of a ray and a torus, scaled to major radius one. Its variable
/// x is the scaled distance along the ray, from the point at distance `middle`.
struct TorusQuartic {
    quartic: Quartic,
    /// Upper bound of |x| over all roots.
    reach: f64,
    /// Distance along the ray at x = 0. At any x the distance is middle + scale · x.
    middle: f64,
    scale: f64,
}

impl<R: Real> Torus<R> {
    /// Creates a torus from the centre, an axis of any positive length, and both radii.
    pub fn new(centre: DVec3, axis: DVec3, major_radius: f64, minor_radius: f64) -> Self {
        Self {
            centre: R::Vec3::from_f64(centre),
            axis: R::Vec3::from_f64(axis.normalize()),
            major_radius: R::from_f64(major_radius),
            minor_radius: R::from_f64(minor_radius),
        }
    }

    /// Computes the quartic of a ray, relative to the ray's point nearest to the centre. So the
    /// coefficients have the size of the torus, and the cubic term vanishes. Returns `None` for a
    /// ray that certainly misses in one of these ways:
    ///
    /// - outside the bounding sphere,
    /// - above or below the tube within that sphere,
    /// - through the hole.
    #[inline(always)]
    fn build_quartic(&self, prepared_ray: &PreparedRay) -> Option<TorusQuartic> {
        let (axis, major) = (self.axis.to_f64(), self.major_radius.to_f64());
        let one_over = 1.0 / major;
        let f = prepared_ray.origin - self.centre.to_f64();
        let ahead = -f.dot(prepared_ray.direction) * prepared_ray.inverse_length_squared;
        let near = f + prepared_ray.direction * ahead;
        let tube = self.minor_radius.to_f64() * one_over;
        let f = near * one_over;
        let room = (1.0 + tube) * (1.0 + tube) - f.dot(f);
        let is_hit = room >= 0.0;
        if !is_hit {
            return None;
        }
        // From here on, lengths along the ray are in units of the major radius.
        let inverse_length = prepared_ray.inverse_length_squared.sqrt();
        let d = prepared_ray.direction * inverse_length;
        let inverse_axis = 1.0 / axis.dot(axis);
        let (height, lean) = (f.dot(axis), d.dot(axis));
        let reach = room.sqrt();
        let squared = f.dot(f);
        // The following two bounds have a margin larger than any rounding error; beyond them the
        // quartic is far above zero. The first bound: the ray's height above the torus's plane
        // stays beyond this level of the tube.
        let level = tube * axis.dot(axis).sqrt() * 1.005;
        // The second bound: wherever the ray's height is within the level, the ray is closer to the
        // axis than the tube.
        let (steep, hole) = (lean * lean, (1.0 - tube) * (1.0 - tube) * 0.99);
        let rise = level + height.abs();
        if height.abs() - lean.abs() * reach > level || rise * rise < (hole - squared) * steep {
            return None;
        }
        let g = squared + (1.0 - tube) * (1.0 + tube);
        let quartic = Quartic {
            p: 2.0 * g - 4.0 + 4.0 * lean * lean * inverse_axis,
            q: 8.0 * height * lean * inverse_axis,
            w: g * g - 4.0 * (squared - height * height * inverse_axis),
        };
        Some(TorusQuartic {
            quartic,
            reach,
            middle: ahead,
            scale: major * inverse_length,
        })
    }

    /// Evaluates the surface point in the unit direction `normal` from the centre of the tube.
    /// `spoke` is the unit vector from the centre of the torus to that point of the tube's centre
    /// line.
    fn eval_tube_point(&self, spoke: DVec3, normal: DVec3) -> SurfacePoint {
        let (major, minor) = (self.major_radius.to_f64(), self.minor_radius.to_f64());
        let point = self.centre.to_f64() + spoke * major + normal * minor;
        let size = self.centre.abs().max_element() + self.major_radius + self.minor_radius;
        SurfacePoint::new(
            point,
            normal,
            rounding_bound(size.to_f64() + point.abs().max_element()),
        )
    }

    /// Inverse of the sampling density per area. `away` is the component of the point's unit normal
    /// in the direction away from the axis.
    fn inverse_area_density(&self, away: f64) -> f64 {
        let (major, minor) = (self.major_radius.to_f64(), self.minor_radius.to_f64());
        core::f64::consts::TAU * core::f64::consts::TAU * minor * (major + minor * away)
    }
}

impl<R: Real> Shape<R> for Torus<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        let (centre, axis) = (self.centre.to_f64(), self.axis.to_f64());
        let ring = eval_disk_support(centre, axis, self.major_radius.to_f64(), direction);
        Some(ring + self.minor_radius.to_f64() * direction.length())
    }

    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let profile = self.build_quartic(prepared_ray)?;
        profile.quartic.find_crossings(profile.reach, |x, enters| {
            let t = R::from_f64(profile.middle + profile.scale * x);
            (range.contains(t) && side.accepts(enters)).then(|| {
                if enters {
                    ShapeHit::from_distance(t)
                } else {
                    ShapeHit::from_exit_distance(t)
                }
            })
        })
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let (centre, major) = (self.centre.to_f64(), self.major_radius.to_f64());
        // Unit vector from the centre to the nearest point of the circle, and the offset from that
        // point.
        let tube = |offset: DVec3| {
            let spoke = split_along_axis(offset, self.axis.to_f64()).1.normalize();
            (spoke, offset - spoke * major)
        };
        // In a mapped space, or from far away, the rounding of the stored distance may be large, so
        // the root is computed again.
        let profile = if prepared_ray.needs_unrounded_distance(hit.t, self.minor_radius) {
            self.build_quartic(prepared_ray)
        } else {
            None
        };
        let exact = profile.and_then(
            |TorusQuartic {
                 quartic,
                 reach,
                 middle,
                 scale,
             }| {
                let stored =
                    |t: f64, enters: bool| R::from_f64(t) == hit.t && enters != hit.is_exit();
                quartic.find_crossings(reach, |x, enters| {
                    Some(middle + scale * x).filter(|&t| stored(t, enters))
                })
            },
        );
        let raw = exact.map_or_else(
            || prepared_ray.at(hit.t),
            |t| prepared_ray.origin + prepared_ray.direction * t,
        );
        let (spoke, tube_offset) = tube(raw - centre);
        let minor = self.minor_radius.to_f64();
        offset_curved_origins::<R>(
            self.eval_tube_point(spoke, tube_offset.normalize()),
            transform_chain,
            || [major - minor, minor],
        )
    }

    /// Texture coordinates in [0, 1]. u runs around the axis. v starts at the inner side and runs
    /// around the tube, downwards on the outer side.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let surface_point = self.locate_surface_point(prepared_ray, hit);
        let (_, out) = split_along_axis(
            surface_point.point - self.centre.to_f64(),
            self.axis.to_f64(),
        );
        let (u, dpdu) = angle_coordinate(out, self.axis.to_f64());
        let axis = self.axis.to_f64().normalize();
        let up = R::from_f64(surface_point.normal.dot(axis));
        let away = R::from_f64(surface_point.normal.dot(out.normalize()));
        let full = R::from_f64(core::f64::consts::TAU);
        TextureCoordinates {
            u,
            v: R::from_f64(0.5) - up.atan2(away) / full,
            dpdu,
            mirrored: false,
        }
    }
}

/// Samples the angles around the axis and around the tube uniformly.
impl<R: Real> SampleArea<R> for Torus<R> {
    fn area(&self) -> f64 {
        self.inverse_area_density(0.0)
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let out = radial_direction(self.axis.to_f64(), u.to_f64());
        let angle = v.to_f64() * core::f64::consts::TAU;
        let (away, up) = (libm::cos(angle), libm::sin(angle));
        let normal = out * away + self.axis.to_f64().normalize() * up;
        (
            self.eval_tube_point(out, normal),
            1.0 / self.inverse_area_density(away),
        )
    }

    fn area_density(&self, point: &SurfacePoint) -> f64 {
        let axis = self.axis.to_f64().normalize();
        let offset = point.point - self.centre.to_f64();
        let out = (offset - axis * axis.dot(offset)).normalize();
        1.0 / self.inverse_area_density(point.normal.dot(out))
    }
}
