//! The triangle: watertight in the robust precisions, Möller–Trumbore in the fast one.

use glam::DVec3;

use super::border::{Face, off_border};
use super::edges::{Corner, Crossing, are_collinear, corner_slack, cross};
use super::unit::{unit_of, unit_of_both};
use super::{CoreVec, Located, Parameters, Probe, SampleArea, Shape, ShapeHit, Under, num, wide};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vector, convert};

/// Three corners, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Triangle<R: Real> {
    /// Corners.
    pub vertices: [R::Vec3; 3],
}

impl<R: Real> Triangle<R> {
    /// From its corners. A triangle without area, its corners on one line or in one place, becomes a point, which no ray
    /// hits: seen from the side its rounded projection could have an area.
    pub fn new(vertices: [R::Vec3; 3]) -> Self {
        let [a, b, c] = vertices;
        Self { vertices: if are_collinear(a.to_f64(), b.to_f64(), c.to_f64()) { [a; 3] } else { vertices } }
    }

    /// Unit normal by the right-hand rule, in f64; zero for a triangle without area.
    pub fn normal(&self) -> DVec3 {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        (b - a).cross(c - a).normalize_or_zero()
    }
}

impl<R: Real> Shape<R> for Triangle<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        // Written so that NaN stays NaN.
        let [a, b, c] = self.vertices.map(|p| p.to_f64().dot(direction));
        Some((a + b + c) * 0.0 + a.max(b).max(c))
    }

    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::from_points(self.vertices.map(Vector::to_f64)))
    }

    #[inline(always)]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        if !P::ROBUST {
            return self.moller_trumbore(probe, range, side);
        }
        let Crossing { t, weights: [u, v], from_outside, .. } = self.crossing(probe)?;
        (range.contains(t) && side.accepts(from_outside)).then(|| ShapeHit { t, u: convert(u), v: convert(v) })
    }

    #[inline]
    fn locate_under<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>, maps: Under<'_, P>) -> Located<P::Core> {
        let [a, b, c] = self.vertices.map(wide::<P>);
        // The rounding of stored weights moves the point along the plane only, but in a map's space that may be far.
        let again = if P::ROBUST && probe.mapped { self.crossing(probe) } else { None };
        let weights = again.map_or_else(|| [convert(hit.u), convert(hit.v)], |crossing| crossing.weights);
        // From the weights it lies in the triangle's plane whatever the ray's distance was.
        let weights = inside::<P>([a, b, c], weights);
        let located = Self::at::<P>([a, b, c], weights);
        match maps {
            Some(maps) if P::ROBUST => off_border::<P>(located, Face::Triangle, [b - a, c - a], weights, maps),
            _ => located,
        }
    }

    fn parameters<P: Precision<Real = R>>(&self, _: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let [a, b, _] = self.vertices;
        Parameters { u: hit.u, v: hit.v, dpdu: b - a, mirrored: true }
    }
}

/// Weights of the second and third corner kept away from the border by what rounding the point may move it. A ray that
/// starts at an inner edge of a closed mesh then starts on the inner side of *both* faces there.
#[inline(always)]
fn inside<P: Precision>([a, b, c]: [CoreVec<P>; 3], [u, v]: [P::Core; 2]) -> [P::Core; 2] {
    let least = u.min(v).min(P::Core::ONE - u - v);
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let normal = ab.cross(ac);
    let reach = a.abs().max(b.abs()).max(c.abs()).max_element() * convert::<P::Real, P::Core>(P::Real::ROUNDOFF);
    // A weight is a distance from an edge over the height above it, and no height is below twice the area over the longest
    // edge. Compared in squares: there is a root to take only near the border.
    let longest = ab.dot(ab).max(ac.dot(ac)).max(bc.dot(bc));
    let margin = reach * reach * num(64.0) * longest;
    let area = normal.dot(normal);
    if !P::ROBUST || least * least.abs() * area >= margin {
        return [u, v];
    }
    // Mixed with the centroid so far that the least weight becomes the margin, but moved by no more than a few roundings:
    // a needle stays a needle.
    let third: P::Core = num(1.0 / 3.0);
    let share = ((margin / area).sqrt() - least) / (third - least);
    let way = (ab * (third - u) + ac * (third - v)).length();
    let share = share.min(reach * num(16.0) / way).clamp(P::Core::ZERO, P::Core::ONE);
    [u + (third - u) * share, v + (third - v) * share]
}

impl<R: Real> Triangle<R> {
    /// The watertight test.
    #[inline(always)]
    pub(crate) fn crossing<P: Precision<Real = R>>(&self, probe: &Probe<P>) -> Option<Crossing<P>> {
        // One by one: an array's map is not always inlined.
        let [a, b, c] = self.vertices;
        cross(probe, &Corner::new(probe, a), &Corner::new(probe, b), &Corner::new(probe, c))
    }

    /// The surface at the weights of the second and third corner.
    #[inline(always)]
    fn at<P: Precision<Real = R>>([a, b, c]: [CoreVec<P>; 3], [u, v]: [P::Core; 2]) -> Located<P::Core> {
        let (ab, ac) = (b - a, c - a);
        let (_, per_unit) = unit_of_both::<P>(ab, ac);
        let (p, q, r) = (ab * per_unit, ac * per_unit, (c - b) * per_unit);
        let (normal, scale) = (p.cross(q), a.abs().max(b.abs()).max(c.abs()).max_element());
        let longest = p.dot(p).max(q.dot(q)).max(r.dot(r));
        let inverse = P::Core::ONE / normal.length();
        let error = corner_slack(scale, longest, inverse);
        Located::new(a + ab * u + ac * v, normal * inverse, error)
    }

    /// "Fast, Minimum Storage Ray/Triangle Intersection" (Möller, Trumbore 1997). Leaks at shared edges.
    #[inline(always)]
    fn moller_trumbore<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let [a, b, c] = self.vertices;
        let (a, b, c) = (wide::<P>(a), wide::<P>(b), wide::<P>(c));
        let (ab, ac) = (b - a, c - a);
        let p = probe.direction.cross(ac);
        let determinant = ab.dot(p);
        let inverse = P::Core::ONE / determinant;
        let s = probe.origin - a;
        let u = s.dot(p) * inverse;
        let q = s.cross(ab);
        let v = probe.direction.dot(q) * inverse;
        // One branch for all three edges: a determinant of zero makes u and v infinite or NaN, then t as well.
        let met = u.min(v).min(P::Core::ONE - (u + v)) >= P::Core::ZERO;
        if !met {
            return None;
        }
        // A product of three lengths: in a unit of two of them, for sizes whose cubes f32 can't hold.
        let (unit, per_unit) = unit_of::<P>(q.abs().max_element());
        let t: R = convert(ac.dot(q * per_unit) * (inverse * unit));
        (range.contains(t) && side.accepts(determinant > P::Core::ZERO)).then(|| ShapeHit { t, u: convert(u), v: convert(v) })
    }
}

impl<R: Real> SampleArea<R> for Triangle<R> {
    fn area(&self) -> f64 {
        let [a, b, c] = self.vertices.map(Vector::to_f64);
        0.5 * (b - a).cross(c - a).length()
    }

    /// The square is folded along its diagonal by a root ("Physically Based Rendering", 3rd edition, 13.6.5).
    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        let [a, b, c] = self.vertices.map(wide::<P>);
        let root = convert::<R, P::Core>(u).sqrt();
        let weights = [P::Core::ONE - root, convert::<R, P::Core>(v) * root];
        (Self::at::<P>([a, b, c], weights), num(1.0 / self.area()))
    }

    fn density<P: Precision<Real = R>>(&self, _: &Located<P::Core>) -> P::Core {
        num(1.0 / self.area())
    }
}
