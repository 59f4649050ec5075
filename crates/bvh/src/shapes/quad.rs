//! The quad: a parallelogram, watertight against any face that shares two of its corners.

use glam::DVec3;

use super::border::{FaceKind, move_ray_origins_off_border};
use super::edges::{ProjectedCorner, flat_face_error_bound, intersect_projected_triangle};
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A parallelogram, stored as four corners, each rounded individually. Two quads with a common edge
/// store the same bits for it. The outward normal is edge_u × edge_v.
#[derive(Clone, Copy, Debug)]
pub struct Quad<R: Real> {
    /// Corners in order: corner, + edge_u, + edge_u + edge_v, + edge_v.
    pub corners: [R::Vec3; 4],
}

impl<R: Real> Quad<R> {
    /// Creates a quad from a corner and the two edges that start at it.
    pub fn new(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> Self {
        Self {
            corners: [
                corner,
                corner + edge_u,
                corner + edge_u + edge_v,
                corner + edge_v,
            ]
            .map(R::Vec3::from_f64),
        }
    }

    /// Returns both diagonals. Their cross product has the direction of the normal. So both halves
    /// of the quad have the same normal, although rounded corners need not be coplanar.
    #[inline(always)]
    fn diagonals(&self) -> [DVec3; 2] {
        let [a, b, c, d] = self.corners.map(Vector::to_f64);
        [c - a, d - b]
    }

    #[inline(always)]
    fn normal(&self) -> DVec3 {
        let [first, second] = self.diagonals();
        first.cross(second).normalize()
    }

    /// Evaluates the point with the given texture coordinates in [0, 1]. The point lies on one of
    /// the two triangles on either side of the first diagonal.
    #[inline(always)]
    fn eval_point(&self, [u, v]: [f64; 2]) -> DVec3 {
        let [a, b, c, d] = self.corners.map(Vector::to_f64);
        if u >= v {
            a + (b - a) * (u - v) + (c - a) * v
        } else {
            a + (c - a) * u + (d - a) * (v - u)
        }
    }

    #[inline(always)]
    fn max_coordinate(&self) -> R {
        self.corners
            .iter()
            .fold(R::ZERO, |m, c| m.max(c.abs().max_element()))
    }

    /// Upper bound of the distance of a computed hit point from the exact hit point.
    #[inline(always)]
    fn intersection_error(&self) -> f64 {
        let [first, second] = self.diagonals();
        let longest = first.dot(first).max(second.dot(second));
        flat_face_error_bound(
            self.max_coordinate().to_f64(),
            longest,
            1.0 / first.cross(second).length(),
        )
    }

    /// Upper bound of the error of a hit point, in each axis, including the rounding of the
    /// corners.
    #[inline(always)]
    fn point_error(&self) -> f64 {
        // The second term covers the rounding of the corners, which moves them off their common
        // plane.
        self.intersection_error()
            + (self.max_coordinate() * R::ROUNDOFF * R::from_f64(4.0)).to_f64()
    }

    /// Distance between the lines of the two diagonals. It measures how far rounding has moved the
    /// corners off a common plane.
    fn planarity_error(&self) -> f64 {
        let [a, b, ..] = self.corners.map(Vector::to_f64);
        self.normal().dot(b - a).abs()
    }

    /// Intersects a ray with the two triangles on either side of the first diagonal, each by the
    /// watertight test. Returns the distance, both texture coordinates, and whether the ray comes
    /// from outside.
    #[inline(always)]
    fn intersect_watertight(&self, prepared_ray: &PreparedRay) -> Option<(f64, [f64; 2], bool)> {
        // Written out, since an array's `map` is not always inlined.
        let [a, b, c, d] = self.corners;
        let (a, b) = (
            ProjectedCorner::new(prepared_ray, a.to_f64()),
            ProjectedCorner::new(prepared_ray, b.to_f64()),
        );
        let (c, d) = (
            ProjectedCorner::new(prepared_ray, c.to_f64()),
            ProjectedCorner::new(prepared_ray, d.to_f64()),
        );
        if let Some(hit) = intersect_projected_triangle(prepared_ray, &a, &b, &c) {
            let [second, third] = hit.weights;
            return Some((hit.t, [second + third, third], hit.from_outside));
        }
        let hit = intersect_projected_triangle(prepared_ray, &a, &c, &d)?;
        let [second, third] = hit.weights;
        Some((hit.t, [second, second + third], hit.from_outside))
    }
}

impl<R: Real> Shape<R> for Quad<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        // Written so that NaN propagates.
        let [a, b, c, d] = self.corners.map(|p| p.to_f64().dot(direction));
        Some((a + b + c + d) * 0.0 + a.max(b).max(c).max(d))
    }

    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::from_points(self.corners.map(Vector::to_f64)))
    }

    #[inline]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let (t, [u, v], from_outside) = self.intersect_watertight(prepared_ray)?;
        let t = R::from_f64(t);
        (range.contains(t) && side.accepts(from_outside)).then(|| ShapeHit {
            t,
            u: R::from_f64(u),
            v: R::from_f64(v),
        })
    }

    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let [a, b, _, d] = self.corners.map(Vector::to_f64);
        let normal = self.normal();
        // The rounding of stored coordinates moves the point only within the plane. In a mapped
        // space that move may be large, so the coordinates are computed again.
        let repeated_hit = if prepared_ray.is_mapped {
            self.intersect_watertight(prepared_ray)
        } else {
            None
        };
        let [u, v] =
            repeated_hit.map_or_else(|| [hit.u.to_f64(), hit.v.to_f64()], |(_, place, _)| place);
        // The point is kept off the border by the rounding of its coordinates. A ray that starts at
        // a concave edge of a closed room then starts on the inner side of both walls.
        let reach = a.abs().max(b.abs()).max(d.abs()).max_element() * R::ROUNDOFF.to_f64() * 8.0;
        let keep = |x: f64, edge: DVec3| {
            let margin = (reach / edge.length()).min(0.5);
            x.max(margin).min(1.0 - margin)
        };
        let (u, v) = (keep(u, b - a), keep(v, d - a));
        let surface_point = SurfacePoint::new(self.eval_point([u, v]), normal, self.point_error());
        match transform_chain {
            Some(transform_chain) => move_ray_origins_off_border::<R>(
                surface_point,
                FaceKind::Parallelogram,
                [b - a, d - a],
                [u, v],
                transform_chain,
            ),
            None => surface_point,
        }
    }

    /// Texture coordinates in [0, 1]: u along the first edge, v along the second.
    fn texture_coordinates(&self, _: &PreparedRay, hit: ShapeHit<R>) -> TextureCoordinates<R> {
        let [a, b, _, _]: [R::Vec3; 4] = self.corners;
        TextureCoordinates {
            u: hit.u,
            v: hit.v,
            dpdu: b - a,
            mirrored: true,
        }
    }
}

impl<R: Real> SampleArea<R> for Quad<R> {
    fn area(&self) -> f64 {
        let [a, b, c, d] = self.corners.map(Vector::to_f64);
        0.5 * (c - a).cross(d - b).length()
    }

    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let point = self.eval_point([u.to_f64(), v.to_f64()]);
        let surface_point = SurfacePoint::new(
            point,
            self.normal(),
            self.intersection_error() + self.planarity_error(),
        );
        (surface_point, 1.0 / self.area())
    }
}
