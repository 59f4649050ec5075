//! The triangle, watertight.

use glam::DVec3;

use super::border::{Face, off_border};
use super::edges::{ProjectedCorner, TriangleHit, are_collinear, corner_slack, cross};
use super::{OuterTransforms, Parameters, PreparedRay, SampleArea, Shape, ShapeHit, SurfacePoint};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Real, Vector};

/// Three corners, counter-clockwise as seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Triangle<R: Real> {
    /// Corners.
    pub vertices: [R::Vec3; 3],
}

impl<R: Real> Triangle<R> {
    /// From three corners. A triangle of zero area, with collinear or coincident corners, becomes a
    /// point, which no ray hits: its rounded projection could otherwise have an area.
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

    /// The watertight intersection test.
    #[inline(always)]
    pub(crate) fn crossing(&self, prepared_ray: &PreparedRay) -> Option<TriangleHit<f64>> {
        // Written out: an array's `map` is not always inlined.
        let [a, b, c] = self.vertices;
        cross(
            prepared_ray,
            &ProjectedCorner::new(prepared_ray, a.to_f64()),
            &ProjectedCorner::new(prepared_ray, b.to_f64()),
            &ProjectedCorner::new(prepared_ray, c.to_f64()),
        )
    }

    /// The surface at the given weights of the second and third corner.
    #[inline(always)]
    fn at([a, b, c]: [DVec3; 3], [u, v]: [f64; 2]) -> SurfacePoint {
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let (normal, scale) = (
            ab.cross(ac),
            a.abs().max(b.abs()).max(c.abs()).max_element(),
        );
        let longest = ab.dot(ab).max(ac.dot(ac)).max(bc.dot(bc));
        let inverse = 1.0 / normal.length();
        let error = corner_slack(scale, longest, inverse);
        SurfacePoint::new(a + ab * u + ac * v, normal * inverse, error)
    }

    /// The surface point at the given barycentric weights, which are first moved off the edges of
    /// the triangle.
    #[inline(always)]
    pub(crate) fn surface_point(&self, weights: [f64; 2]) -> SurfacePoint {
        let corners = self.vertices.map(Vector::to_f64);
        Self::at(corners, inside::<R>(corners, weights))
    }

    /// [`Self::surface_point`] without a branch, for several triangles in lanes. The flag says
    /// whether the point is far from the border; otherwise the surface is not valid.
    #[inline(always)]
    pub(crate) fn located_inside(corners: [DVec3; 3], weights: [f64; 2]) -> (SurfacePoint, bool) {
        (
            Self::at(corners, weights),
            BorderDistance::new::<R>(corners, weights).is_far(),
        )
    }
}

impl<R: Real> Shape<R> for Triangle<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
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
        } = self.crossing(prepared_ray)?;
        let t = R::from_f64(t);
        (range.contains(t) && side.accepts(from_outside)).then(|| ShapeHit {
            t,
            u: R::from_f64(u),
            v: R::from_f64(v),
        })
    }

    #[inline]
    fn locate_under(
        &self,
        prepared_ray: &PreparedRay,
        hit: ShapeHit<R>,
        transform_chain: OuterTransforms<'_>,
    ) -> SurfacePoint {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        // The rounding of stored weights moves the point only along the plane, but that may be far
        // in a mapped space.
        let again = if prepared_ray.mapped {
            self.crossing(prepared_ray)
        } else {
            None
        };
        let weights = again.map_or_else(
            || [hit.u.to_f64(), hit.v.to_f64()],
            |crossing| crossing.weights,
        );
        // A point from weights lies in the triangle's plane, however far the ray came.
        let weights = inside::<R>([a, b, c], weights);
        let surface_point = Self::at([a, b, c], weights);
        match transform_chain {
            Some(transform_chain) => off_border::<R>(
                surface_point,
                Face::Triangle,
                [b - a, c - a],
                weights,
                transform_chain,
            ),
            None => surface_point,
        }
    }

    fn parameters(&self, _: &PreparedRay, hit: ShapeHit<R>) -> Parameters<R> {
        let [a, b, _] = self.vertices;
        Parameters {
            u: hit.u,
            v: hit.v,
            dpdu: b - a,
            mirrored: true,
        }
    }
}

/// The weights, moved off the border by the rounding of the point. A ray that starts at an inner
/// edge of a closed mesh then starts on the inner side of *both* faces.
#[inline(always)]
fn inside<R: Real>([a, b, c]: [DVec3; 3], [u, v]: [f64; 2]) -> [f64; 2] {
    let border = BorderDistance::new::<R>([a, b, c], [u, v]);
    if border.is_far() {
        return [u, v];
    }
    let BorderDistance {
        least: minimum,
        reach,
        margin,
        area,
    } = border;
    let (ab, ac) = (b - a, c - a);
    // The point moves towards the centroid until the least weight equals the margin, but by no more
    // than a few roundings, so that points of a needle stay in place.
    let third = 1.0 / 3.0;
    let share = ((margin / area).sqrt() - minimum) / (third - minimum);
    let distance = (ab * (third - u) + ac * (third - v)).length();
    #[expect(
        clippy::manual_clamp,
        reason = "of a way of no length, NaN, nothing is left; a clamp would keep it"
    )]
    let share = share.min(reach * 16.0 / distance).max(0.0).min(1.0);
    [u + (third - u) * share, v + (third - v) * share]
}

/// Distance of a point of a triangle from its border.
struct BorderDistance {
    /// The least of the three weights.
    least: f64,
    /// Greatest rounding of the point in each axis.
    reach: f64,
    /// The least distance from the border times the longest edge, and twice the area; both squared.
    margin: f64,
    area: f64,
}

impl BorderDistance {
    #[inline(always)]
    fn new<R: Real>([a, b, c]: [DVec3; 3], [u, v]: [f64; 2]) -> Self {
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let normal = ab.cross(ac);
        let reach = a.abs().max(b.abs()).max(c.abs()).max_element() * R::ROUNDOFF.to_f64();
        let longest = ab.dot(ab).max(ac.dot(ac)).max(bc.dot(bc));
        Self {
            least: u.min(v).min(1.0 - u - v),
            reach,
            margin: reach * reach * 64.0 * longest,
            area: normal.dot(normal),
        }
    }

    /// Whether the point is farther than the margin. A weight is the distance from an edge over the
    /// height above it, and every height is at least twice the area over the longest edge. Squares
    /// are compared, so that only points near the border need a root.
    #[inline(always)]
    fn is_far(&self) -> bool {
        self.least * self.least.abs() * self.area >= self.margin
    }
}

impl<R: Real> SampleArea<R> for Triangle<R> {
    fn area(&self) -> f64 {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Folds the square along its diagonal by a root ("Physically Based Rendering", 3rd edition,
    /// 13.6.5).
    fn sample_area(&self, u: R, v: R) -> (SurfacePoint, f64) {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        let root = u.to_f64().sqrt();
        let weights = [1.0 - root, v.to_f64() * root];
        (Self::at([a, b, c], weights), 1.0 / self.area())
    }
}
