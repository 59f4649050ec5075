//! Common code of cylinders and cones: solids of revolution whose radius changes linearly between
//! two ends.

use super::frame::{angle_coordinate, radial_direction, split_along_axis, tangent};
use super::quadratic::{Crossings, Quadratic, RaySpan, choose_reference_point};
use super::spawn_offset::SpawnOffset;
use super::{OuterTransforms, PreparedRay, SurfacePoint, TextureCoordinates, rounding_bound};
use crate::scalar::{Real, Vector};
use glam::DVec3;

/// Numbers of the surface's parts: wall, base and top. A hit stores such a number as its first
/// shape-specific number.
pub(super) const WALL: u8 = 0;
pub(super) const BASE: u8 = 1;
pub(super) const TOP: u8 = 2;

/// A solid of revolution whose radius changes linearly between two ends. Its formulas are
/// homogeneous in the axis. So rounding the axis changes the length or the direction of the solid,
/// but never its roundness.
pub(super) struct SurfaceOfRevolution {
    /// Centre of the base.
    pub base: DVec3,
    /// Vector from the centre of the base to the centre of the other end.
    pub axis: DVec3,
    /// Radii of the base and of the other end.
    pub radii: [f64; 2],
    /// Length to which error bounds are proportional: the greatest coordinates of base and axis
    /// plus the greater radius.
    size: f64,
}

impl SurfaceOfRevolution {
    #[inline(always)]
    pub fn new<R: Real>(base: R::Vec3, axis: R::Vec3, radii: [R; 2]) -> Self {
        let size = base.abs().max_element() + axis.abs().max_element() + radii[0].max(radii[1]);
        Self {
            base: base.to_f64(),
            axis: axis.to_f64(),
            radii: radii.map(Real::to_f64),
            size: size.to_f64(),
        }
    }

    /// Intersects a ray with the wall of a solid of equal radii, extended infinitely. Returns
    /// distances from the ray's origin.
    ///
    /// With `close`, the formula starts from the ray's point nearest to the base, otherwise from
    /// the ray's origin ([`choose_reference_point`]).
    #[inline(always)]
    pub fn intersect_infinite_tube(
        &self,
        prepared_ray: &PreparedRay,
        close: bool,
    ) -> Option<Crossings> {
        let (axis, radius) = (self.axis, self.radii[0]);
        let (ahead, f) = choose_reference_point(prepared_ray, self.base, close);
        let (m, n) = (prepared_ray.direction.cross(axis), f.cross(axis));
        let (length, room) = (axis.dot(axis), radius * radius);
        let (a, b, c) = (m.dot(m), m.dot(n), n.dot(n) - room * length);
        if a == 0.0 {
            // A ray along the axis never crosses the wall: the whole ray is inside or outside.
            return (c <= a).then_some(Crossings {
                enter: -f64::INFINITY,
                leave: f64::INFINITY,
            });
        }
        // Computes b² − a·c without cancellation: the ray passes the axis at distance |m·f|/|m|.
        let pass = m.dot(f);
        let discriminant = (a * room - pass * pass) * length;
        Quadratic {
            a,
            b,
            c,
            discriminant,
        }
        .roots()
        .map(|w| w.shift(ahead))
    }

    /// Returns the range of distances at which the ray is between the planes of both ends. `None`
    /// if the ray is parallel to these planes and not between them.
    #[inline(always)]
    pub fn clip_to_ends(&self, prepared_ray: &PreparedRay) -> Option<RaySpan> {
        let (height, slope) = (
            self.axis.dot(prepared_ray.origin - self.base),
            self.axis.dot(prepared_ray.direction),
        );
        let top = self.axis.dot(self.axis);
        if slope == 0.0 {
            return (0.0 <= height && height <= top)
                .then(|| RaySpan::from_range(-f64::INFINITY, f64::INFINITY, BASE));
        }
        Some(RaySpan::from_faces(
            -height / slope,
            (top - height) / slope,
            [BASE, TOP],
            slope > 0.0,
        ))
    }

    /// Returns the range of distances at which the ray is inside the solid: both between the
    /// crossings of the wall and between the ends.
    #[inline(always)]
    pub fn clip_wall_crossings(
        &self,
        prepared_ray: &PreparedRay,
        wall: Crossings,
    ) -> Option<RaySpan> {
        Some(
            RaySpan::from_range(wall.enter, wall.leave, WALL)
                .intersection(self.clip_to_ends(prepared_ray)?),
        )
    }

    /// Length to which the rounding error of a point of the surface is proportional.
    #[inline(always)]
    pub fn error_scale(&self, point: DVec3) -> f64 {
        self.size + point.abs().max_element()
    }

    /// Evaluates the surface point of a cap (`BASE` or `TOP`) at an offset from the centre of the
    /// cap.
    pub fn eval_cap_point(&self, part: u8, offset: DVec3) -> SurfacePoint {
        let (end, normal) = if part == TOP {
            (1.0, self.axis.normalize())
        } else {
            (0.0, -self.axis.normalize())
        };
        let point = self.base + self.axis * end + offset;
        SurfacePoint::new(point, normal, rounding_bound(self.error_scale(point)))
    }

    /// Texture coordinates at a point of a surface part. u runs around the axis. On the wall v is
    /// `top` minus the fraction along the axis. On a cap v runs from 0 at the centre to 1 at the
    /// rim.
    pub fn texture_coordinates<R: Real>(
        &self,
        point: DVec3,
        part: u8,
        top: f64,
    ) -> TextureCoordinates<R> {
        let (along, out) = split_along_axis(point - self.base, self.axis);
        let (u, dpdu) = angle_coordinate(out, self.axis);
        let end_radius = R::from_f64(self.radii[usize::from(part == TOP)]);
        let v = if part == WALL {
            R::from_f64(top - along)
        } else {
            R::from_f64(out.length()) / end_radius
        };
        // u has the same direction of rotation on both caps. The base faces away from the top, so u
        // runs to the left on the base.
        TextureCoordinates {
            u,
            v,
            dpdu,
            mirrored: part == BASE,
        }
    }

    /// Samples a point of the surface by two numbers in [0, 1). The three areas are those of the
    /// wall, the base and the top; `area` is their sum. `on_wall` returns the surface point of the
    /// wall. Its arguments are a fraction of the wall's area and a direction perpendicular to the
    /// axis.
    pub fn sample_surface(
        &self,
        [wall, base, top]: [f64; 3],
        area: f64,
        [u, v]: [f64; 2],
        on_wall: impl FnOnce(f64, DVec3) -> SurfacePoint,
    ) -> SurfacePoint {
        let (out, area_position) = (radial_direction(self.axis, u), v * area);
        let on_cap = |part, share: f64, radius: f64| {
            self.eval_cap_point(part, out * (share.clamp(0.0, 1.0).sqrt() * radius))
        };
        if area_position < wall {
            on_wall(area_position / wall, out)
        } else if area_position < wall + base {
            on_cap(BASE, (area_position - wall) / base, self.radii[0])
        } else {
            on_cap(TOP, (area_position - wall - base) / top, self.radii[1])
        }
    }

    /// Moves `below` of a surface point to the inside of the solid. `below` is the base point of
    /// inward rays, from which their origins are offset along the normal. After the move, no
    /// rounded origin lies outside under the maps of the chain. `position` is the point's fraction
    /// along the axis, and its offset perpendicular to the axis.
    pub fn move_inward_ray_base<R: Real>(
        &self,
        surface_point: SurfacePoint,
        part: u8,
        position: (f64, DVec3),
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let spawn_offset = SpawnOffset::from_surface_error::<R>(
            transform_chain,
            surface_point.point,
            surface_point.error,
        );
        SurfacePoint {
            below: surface_point.point + self.inward_ray_offset(part, position, spawn_offset),
            ..surface_point
        }
    }

    /// Computes the offset from a surface point to the base point of inward rays. Rounding and the
    /// offset along the normal may move a ray origin towards the wall or an end. The base point
    /// keeps that distance from the wall and from both ends. `along` is the surface point's
    /// fraction along the axis, and `out` its offset perpendicular to the axis.
    ///
    /// Outward rays need no offset, since every point above a tangent plane of a convex solid is
    /// outside. In a solid thinner than the error of its points no base point is safe, so the
    /// offset is zero.
    #[inline(never)]
    fn inward_ray_offset(
        &self,
        part: u8,
        (along, out): (f64, DVec3),
        spawn_offset: SpawnOffset<'_>,
    ) -> DVec3 {
        let (axis, [base, top]) = (self.axis, self.radii);
        let along = match part {
            BASE => 0.0,
            TOP => 1.0,
            _ => along,
        };
        let (taper, squared, length) = (top - base, axis.dot(axis), out.length());
        let over_axis = axis * (1.0 / squared);
        // On the axis, as at an apex that is hit exactly, any perpendicular direction serves.
        let away = if length > 0.0 {
            out * (1.0 / length)
        } else {
            tangent(axis.normalize())
        };
        // Greatest displacement of an origin towards the ends, the near and the opposite wall, and
        // sideways.
        let lengthwise = spawn_offset.offset_along(over_axis);
        let (nearer, opposite) = (
            spawn_offset.offset_along(away - over_axis * taper),
            spawn_offset.offset_along(away + over_axis * taper),
        );
        let aside = spawn_offset.offset_along(axis.cross(away) * (1.0 / squared.sqrt()));

        let mut minimum = if part == BASE { 0.0 } else { lengthwise };
        let mut maximum = if part == TOP { 1.0 } else { 1.0 - lengthwise };
        // Near an apex the opposite wall is close too. The solid has a safe inside only where it is
        // wide enough.
        let room = nearer.max(opposite) + aside;
        if taper > 0.0 {
            minimum = minimum.max((room - base) / taper);
        } else if taper < 0.0 {
            maximum = maximum.min((room - base) / taper);
        }
        let has_inside = minimum <= maximum && base.max(top) >= room;
        if !has_inside {
            return DVec3::ZERO;
        }
        let along_there = along.max(minimum).min(maximum);
        let radius = base + taper * along_there;
        // A sideways displacement brings the wall nearer: by at most the displacement itself, and
        // by less in a wide circle.
        let narrowest = radius - taper.abs() * lengthwise;
        let bend = if narrowest > aside {
            aside * (aside / narrowest)
        } else {
            aside
        };
        // On the wall, the normal offset already puts the origin below the tangent plane.
        let distance = if part == WALL {
            radius - bend
        } else {
            length.min(radius - nearer - bend)
        };
        let from = if part == WALL {
            base + taper * along
        } else {
            length
        };
        axis * (along_there - along) + away * (distance - from)
    }
}
