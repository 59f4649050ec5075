//! The triangle, with a watertight intersection test.

use glam::DVec3;

use super::border::{FaceKind, move_ray_origins_off_border};
use super::edges::{
    ProjectedCorner, TriangleHit, are_collinear, flat_face_error_bound,
    intersect_projected_triangle,
};
use super::{
    OuterTransforms, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint, TextureCoordinates,
};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// A triangle of three corners, counter-clockwise as seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Triangle<R: Real> {
    /// Positions of the three corners.
    pub vertices: [R::Vec3; 3],
}

impl<R: Real> Triangle<R> {
    /// Creates a triangle from its corners. If the corners are collinear or coincident, all become
    /// one point, which no ray hits. Otherwise the rounded projection of such corners could have an
    /// area.
    pub fn new(vertices: [R::Vec3; 3]) -> Self {
        let [a, b, c] = vertices;
        Self {
            vertices: if are_collinear(a.to_f64(), b.to_f64(), c.to_f64()) {
                [a; 3]
            } else {
                vertices
            },
        }
    }

    /// Unit normal by the right-hand rule, in f64; zero for a triangle of zero area.
    pub fn normal(&self) -> DVec3 {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Intersects the triangle with a ray by the watertight test, at any distance and from either
    /// side.
    #[inline(always)]
    pub(crate) fn intersect_watertight(
        &self,
        prepared_ray: &PreparedRay,
    ) -> Option<TriangleHit<f64>> {
        // Written out, since an array's `map` is not always inlined.
        let [a, b, c] = self.vertices;
        intersect_projected_triangle(
            prepared_ray,
            &ProjectedCorner::new(prepared_ray, a.to_f64()),
            &ProjectedCorner::new(prepared_ray, b.to_f64()),
            &ProjectedCorner::new(prepared_ray, c.to_f64()),
        )
    }

    /// Evaluates the surface point at the barycentric weights `u` and `v` of the second and third
    /// corner.
    #[inline(always)]
    fn eval_surface_point([a, b, c]: [DVec3; 3], [u, v]: [f64; 2]) -> SurfacePoint {
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let (normal, scale) = (
            ab.cross(ac),
            a.abs().max(b.abs()).max(c.abs()).max_element(),
        );
        let longest = ab.dot(ab).max(ac.dot(ac)).max(bc.dot(bc));
        let inverse = 1.0 / normal.length();
        let error = flat_face_error_bound(scale, longest, inverse);
        SurfacePoint::new(a + ab * u + ac * v, normal * inverse, error)
    }

    /// Evaluates the surface point at the barycentric weights of the second and third corner. Near
    /// an edge, the point is first moved off the edge by its rounding error.
    #[inline(always)]
    pub(crate) fn eval_inset_surface_point(&self, weights: [f64; 2]) -> SurfacePoint {
        let corners = self.vertices.map(Vector::to_f64);
        Self::eval_surface_point(corners, move_weights_off_border::<R>(corners, weights))
    }

    /// Evaluates the surface point as [`Self::eval_inset_surface_point`], but without the move off
    /// an edge. So loops over several triangles in lanes have no branch. The flag is whether the
    /// point needs no move. If it is false, the surface point is invalid.
    #[inline(always)]
    pub(crate) fn eval_interior_surface_point(
        corners: [DVec3; 3],
        weights: [f64; 2],
    ) -> (SurfacePoint, bool) {
        (
            Self::eval_surface_point(corners, weights),
            BorderDistance::new::<R>(corners, weights).is_beyond_margin(),
        )
    }
}

impl<R: Real> Shape<R> for Triangle<R> {
    fn support_function(&self, direction: DVec3) -> Option<f64> {
        // Written so that NaN propagates.
        let [a, b, c] = self.vertices.map(|p| p.to_f64().dot(direction));
        Some((a + b + c) * 0.0 + a.max(b).max(c))
    }

    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::from_points(self.vertices.map(Vector::to_f64)))
    }

    #[inline(always)]
    fn intersect(
        &self,
        prepared_ray: &PreparedRay,
        range: Interval<R>,
        side: Side,
    ) -> Option<ShapeHit<R>> {
        let TriangleHit {
            t,
            weights: [u, v],
            from_outside,
        } = self.intersect_watertight(prepared_ray)?;
        let t = R::from_f64(t);
        (range.contains(t) && side.accepts(from_outside)).then(|| ShapeHit {
            t,
            u: R::from_f64(u),
            v: R::from_f64(v),
        })
    }

    #[inline]
    fn locate_point_under_transforms(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        // The rounding of stored weights moves the point only within the plane. In a mapped space
        // that move may be large, so the weights are computed again.
        let repeated_hit = if prepared_ray.is_mapped {
            self.intersect_watertight(prepared_ray)
        } else {
            None
        };
        let weights = repeated_hit.map_or_else(
            || [hit.u.to_f64(), hit.v.to_f64()],
            |crossing| crossing.weights,
        );
        // A point computed from weights lies in the triangle's plane at any distance from the ray's
        // origin.
        let weights = move_weights_off_border::<R>([a, b, c], weights);
        let surface_point = Self::eval_surface_point([a, b, c], weights);
        match transform_chain {
            Some(transform_chain) => move_ray_origins_off_border::<R>(
                surface_point,
                FaceKind::Triangle,
                [b - a, c - a],
                weights,
                transform_chain,
            ),
            None => surface_point,
        }
    }

    fn texture_coordinates(&self, _: &PreparedRay, hit: ShapeHit<R>) -> TextureCoordinates<R> {
        let [a, b, _] = self.vertices;
        TextureCoordinates {
            u: hit.u,
            v: hit.v,
            dpdu: b - a,
            mirrored: true,
        }
    }
}

/// Moves the barycentric weights of a point off the edges of its triangle, by the rounding of the
/// point. So a ray that starts at a concave edge of a closed mesh starts on the inner side of
/// *both* faces.
#[inline(always)]
fn move_weights_off_border<R: Real>([a, b, c]: [DVec3; 3], [u, v]: [f64; 2]) -> [f64; 2] {
    let border = BorderDistance::new::<R>([a, b, c], [u, v]);
    if border.is_beyond_margin() {
        return [u, v];
    }
    let BorderDistance {
        least_weight: minimum,
        rounding: reach,
        scaled_margin_squared: margin,
        twice_area_squared: area,
    } = border;
    let (ab, ac) = (b - a, c - a);
    // The point moves towards the centroid until its least weight equals the margin. The move is
    // limited to 16 roundings, so that points of a needle stay almost in place.
    let third = 1.0 / 3.0;
    let share = ((margin / area).sqrt() - minimum) / (third - minimum);
    let distance = (ab * (third - u) + ac * (third - v)).length();
    #[expect(
        clippy::manual_clamp,
        reason = "a move of length zero gives NaN, which becomes zero here; `clamp` would keep NaN"
    )]
    let share = share.min(reach * 16.0 / distance).max(0.0).min(1.0);
    [u + (third - u) * share, v + (third - v) * share]
}

/// Terms of the test whether a point of a triangle is too close to an edge of the triangle.
struct BorderDistance {
    /// Least of the point's three barycentric weights.
    least_weight: f64,
    /// Upper bound of the point's rounding error in each axis.
    rounding: f64,
    /// Square of a product: the required distance from an edge times the longest edge.
    scaled_margin_squared: f64,
    /// Square of twice the area of the triangle.
    twice_area_squared: f64,
}

impl BorderDistance {
    #[inline(always)]
    fn new<R: Real>([a, b, c]: [DVec3; 3], [u, v]: [f64; 2]) -> Self {
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let normal = ab.cross(ac);
        let reach = a.abs().max(b.abs()).max(c.abs()).max_element() * R::ROUNDOFF.to_f64();
        let longest = ab.dot(ab).max(ac.dot(ac)).max(bc.dot(bc));
        Self {
            least_weight: u.min(v).min(1.0 - u - v),
            rounding: reach,
            scaled_margin_squared: reach * reach * 64.0 * longest,
            twice_area_squared: normal.dot(normal),
        }
    }

    /// Whether the point is at least the required distance away from every edge. A weight is the
    /// distance from an edge over the triangle's height above that edge. Every height is at least
    /// twice the area over the longest edge. Squares are compared, so that only points near an edge
    /// need a square root.
    #[inline(always)]
    fn is_beyond_margin(&self) -> bool {
        self.least_weight * self.least_weight.abs() * self.twice_area_squared
            >= self.scaled_margin_squared
    }
}

impl<R: Real> SampleArea<R> for Triangle<R> {
    fn area(&self) -> f64 {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Samples a point of the triangle uniformly, by the square-root map of the unit square
    /// ("Physically Based Rendering", 3rd edition, 13.6.5).
    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        let root = u.to_f64().sqrt();
        let weights = [1.0 - root, v.to_f64() * root];
        (
            Self::eval_surface_point([a, b, c], weights),
            1.0 / self.area(),
        )
    }
}
