//! The axis-aligned box.

use glam::DVec3;

use super::quadratic::{RaySpan, point_at_hit};
use super::spawn_offset::SpawnOffset;
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
    TransformChain, rounding_bound,
};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A solid box with axis-aligned faces. In a hit, [`ShapeHit::u`] is the number of the face:
/// 2·axis, plus one for the face at the greater coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Cuboid<R: Real> {
    /// Least corner.
    pub min: R::Vec3,
    /// Greatest corner, greater than `min` in every axis.
    pub max: R::Vec3,
}

impl<R: Real> Cuboid<R> {
    /// Creates a box from its least and its greatest corner.
    pub fn new(min: DVec3, max: DVec3) -> Self {
        Self {
            min: R::Vec3::from_f64(min),
            max: R::Vec3::from_f64(max),
        }
    }

    /// Returns the vector along an axis whose component is `sign`. With ±1 it is the outward unit
    /// normal of a face.
    #[inline(always)]
    fn face_normal<V: Vector<C>, C: Real>(axis: usize, sign: C) -> V {
        let at = |i: usize| if i == axis { sign } else { C::ZERO };
        V::new(at(0), at(1), at(2))
    }

    /// Intersects a ray with the slabs between all three pairs of faces. Returns the range of
    /// distances inside the box.
    #[inline(always)]
    fn intersect_slabs(&self, prepared_ray: &PreparedRay) -> Option<RaySpan> {
        let (below, above) = (
            self.min.to_f64() - prepared_ray.origin,
            self.max.to_f64() - prepared_ray.origin,
        );
        let mut span = RaySpan::from_range(-f64::INFINITY, f64::INFINITY, 0);
        for axis in 0..3_u8 {
            let position = usize::from(axis);
            let (low, high, slope) = (
                below.component(position),
                above.component(position),
                prepared_ray.direction.component(position),
            );
            // A ray perpendicular to this axis is either always or never between the two faces; the
            // sign of a zero component does not matter.
            if slope == 0.0 {
                let between = low <= 0.0 && 0.0 <= high;
                if !between {
                    return None;
                }
                continue;
            }
            span = span.intersection(RaySpan::from_faces(
                low / slope,
                high / slope,
                [2 * axis, 2 * axis + 1],
                slope > 0.0,
            ));
        }
        Some(span)
    }

    /// Evaluates the surface point of a face. `raw` is a point close to the face. It is moved onto
    /// the face. Near the face's border it is also moved inwards, by the rounding error of stored
    /// coordinates.
    #[inline(always)]
    fn eval_face_point(&self, raw: DVec3, (axis, greater): (usize, bool)) -> SurfacePoint {
        let at = |i: usize| {
            let (min, max) = (self.min.component(i), self.max.component(i));
            if i == axis {
                return (if greater { max } else { min }).to_f64();
            }
            raw[i]
                .min(max.next_down().to_f64())
                .max(min.next_up().to_f64())
        };
        let size = self.min.abs().max(self.max.abs()).to_f64().max_element();
        let normal = Self::face_normal::<DVec3, f64>(axis, if greater { 1.0 } else { -1.0 });
        SurfacePoint::new(
            DVec3::new(at(0), at(1), at(2)),
            normal,
            rounding_bound(size),
        )
    }

    /// Returns the base point of inward rays for a hit on a face: the point from which their
    /// origins are offset along the normal. It is the hit point, moved until a rounded ray origin
    /// stays inside all faces under the given maps.
    ///
    /// Outward rays need no move, since every point above a face is outside. A box without maps
    /// needs no move either: its faces are perpendicular, so the hit point is already far enough
    /// from the other faces.
    #[inline(never)]
    fn inward_ray_base(
        &self,
        surface_point: &SurfacePoint,
        (axis, greater): (usize, bool),
        transform_chain: TransformChain<'_>,
    ) -> DVec3 {
        let spawn_offset = SpawnOffset::from_surface_error::<R>(
            Some(transform_chain),
            surface_point.point,
            surface_point.error,
        );
        let at = |i: usize| {
            let (min, max) = (
                self.min.component(i).to_f64(),
                self.max.component(i).to_f64(),
            );
            let (x, margin) = (
                surface_point.point.component(i),
                spawn_offset.offset_along(Self::face_normal(i, 1.0)),
            );
            let (low, high) = (min + margin, max - margin);
            // A box thinner than the error of its points has no inside.
            if low < high {
                if i != axis {
                    return x.max(low).min(high);
                }
                return if greater { x.max(low) } else { x.min(high) };
            }
            x
        };
        DVec3::new(at(0), at(1), at(2))
    }
}

/// Decodes the number of a face: returns its axis, and whether the face is at the greater
/// coordinate.
fn decode_face_number<R: Real>(number: R) -> (usize, bool) {
    let face = number.to_f64() as usize;
    ((face / 2).min(2), face % 2 == 1)
}

impl<R: Real> Shape<R> for Cuboid<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        let (min, max) = (self.min.to_f64(), self.max.to_f64());
        Some((0.5 * (min + max)).dot(direction) + (0.5 * (max - min)).dot(direction.abs()))
    }

    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::from_points([self.min.to_f64(), self.max.to_f64()]))
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        self.intersect_slabs(prepared_ray)?.nearest_hit(range, side)
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let (axis, greater) = decode_face_number(hit.u);
        let span = if prepared_ray.is_mapped {
            self.intersect_slabs(prepared_ray)
        } else {
            None
        };
        let surface_point = self.eval_face_point(
            point_at_hit(prepared_ray, span.map(RaySpan::to_crossings), hit),
            (axis, greater),
        );
        match transform_chain {
            Some(transform_chain) => SurfacePoint {
                below: self.inward_ray_base(&surface_point, (axis, greater), transform_chain),
                ..surface_point
            },
            None => surface_point,
        }
    }

    /// Texture coordinates in [0, 1] on each face. As seen from outside, u runs to the right and v
    /// down. On vertical faces +y is up. On the top, seen from above, and on the bottom, seen from
    /// below, +x is to the right.
    fn texture_coordinates(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
    ) -> TextureCoordinates<R> {
        let point = self.surface(prepared_ray, hit).point;
        let size: R::Vec3 = self.max - self.min;
        let (axis, greater) = decode_face_number(hit.u);
        // Axis of u, whether u decreases along it, axis of v, and whether v decreases along it.
        let (along_u, u_falls, along_v, v_falls) = [
            (2, greater, 1, true),
            (0, false, 2, !greater),
            (0, !greater, 1, true),
        ][axis];
        // Far from the origin a size may round to zero. All points then have the same coordinate.
        let share = |i: usize, falls: bool| {
            let distance = if falls {
                self.max.component(i) - point.component(i)
            } else {
                point.component(i) - self.min.component(i)
            };
            if size.component(i) > R::ZERO {
                distance / size.component(i)
            } else {
                R::ZERO
            }
        };
        let length = if u_falls {
            -size.component(along_u)
        } else {
            size.component(along_u)
        };
        let dpdu = Self::face_normal::<R::Vec3, R>(along_u, length);
        TextureCoordinates {
            u: share(along_u, u_falls),
            v: share(along_v, v_falls),
            dpdu,
            mirrored: false,
        }
    }
}

impl<R: Real> SampleArea<R> for Cuboid<R> {
    fn area(&self) -> f64 {
        let s = self.max.to_f64() - self.min.to_f64();
        2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
    }

    /// Samples a face by area, then a point on it. `u` selects a pair of opposite faces. The
    /// position of `u` within the range of that pair selects a face of the pair. The position
    /// within the range of that face is the first coordinate on the face, and `v` is the second.
    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let s = self.max.to_f64() - self.min.to_f64();
        let pairs = [s.y * s.z, s.z * s.x, s.x * s.y];
        let total = pairs[0] + pairs[1] + pairs[2];
        let mut remaining_area = u.to_f64() * total;
        let mut axis = 0;
        while axis < 2 && remaining_area >= pairs[axis] {
            remaining_area -= pairs[axis];
            axis += 1;
        }
        // The side within the pair, and the position on that side.
        let side_and_position = (remaining_area / pairs[axis]).min(1.0) * 2.0;
        let greater = side_and_position >= 1.0;
        let (along_u, along_v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut position = self.min.to_f64();
        position[along_u] += s[along_u] * (side_and_position - f64::from(u8::from(greater)));
        position[along_v] += s[along_v] * v.to_f64();
        (
            self.eval_face_point(position, (axis, greater)),
            1.0 / self.area(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;
    use glam::Vec3;

    /// Protects: texture coordinates are finite even on a face that rounding collapsed to a line.
    #[test]
    fn a_face_without_width_has_coordinates() {
        let plate = Cuboid::<f32>::new(DVec3::new(1e8, 0.0, 0.0), DVec3::new(1e8 + 1.0, 2.0, 2.0));
        assert_eq!(plate.min.x, plate.max.x);
        let prepared_ray = PreparedRay::new(Ray::<f32>::new(Vec3::new(1e8, 0.5, -1.0), Vec3::Z));
        let found = plate.texture_coordinates(
            &prepared_ray,
            ShapeHit {
                t: 1.0,
                u: 4.0,
                v: 0.0,
            },
        );
        assert_eq!((found.u, found.v), (0.0, 0.75));
    }
}
