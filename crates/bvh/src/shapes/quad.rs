//! The quad: a parallelogram, watertight against whatever shares two of its corners.

use glam::DVec3;

use super::border::{Face, off_border};
use super::edges::{Corner, corner_slack, cross};
use super::unit::unit_of_both;
use super::{CoreVec, Located, Parameters, Probe, SampleArea, Shape, ShapeHit, Under, num, wide};
use crate::aabb::Aabb;
use crate::ray::{Interval, Side};
use crate::scalar::{Precision, Real, Vec3Of, Vector, convert};

/// A parallelogram by its four corners, of which each is rounded by itself: faces that share an edge share its bits.
/// The outside is edge_u × edge_v.
#[derive(Clone, Copy, Debug)]
pub struct Quad<R: Real> {
    /// Corners in order: corner, + edge_u, + edge_u + edge_v, + edge_v.
    pub corners: [R::Vec3; 4],
}

impl<R: Real> Quad<R> {
    /// From a corner and the two edges that leave it.
    pub fn new(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> Self {
        Self { corners: [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v].map(R::Vec3::from_f64) }
    }

    /// The diagonals in a unit of their length. Their product is the normal: so the two halves have one, though rounded
    /// corners need not lie in a plane.
    #[inline(always)]
    fn diagonals<P: Precision<Real = R>>(&self) -> [CoreVec<P>; 2] {
        let [a, b, c, d] = self.corners.map(wide::<P>);
        let (first, second) = (c - a, d - b);
        let (_, per_unit) = unit_of_both::<P>(first, second);
        [first * per_unit, second * per_unit]
    }

    #[inline(always)]
    fn normal<P: Precision<Real = R>>(&self) -> CoreVec<P> {
        let [first, second] = self.diagonals::<P>();
        first.cross(second).normalize()
    }

    /// The point with given texture coordinates: on one half of the quad or on the other.
    #[inline(always)]
    fn point<P: Precision<Real = R>>(&self, [u, v]: [P::Core; 2]) -> CoreVec<P> {
        let [a, b, c, d] = self.corners.map(wide::<P>);
        if u >= v { a + (b - a) * (u - v) + (c - a) * v } else { a + (c - a) * u + (d - a) * (v - u) }
    }

    #[inline(always)]
    fn error<P: Precision<Real = R>>(&self) -> P::Core {
        let scale = self.corners.iter().fold(R::ZERO, |m, c| m.max(c.abs().max_element()));
        let [first, second] = self.diagonals::<P>();
        let longest = first.dot(first).max(second.dot(second));
        // The second term for corners that rounding has moved out of the common plane.
        corner_slack(convert(scale), longest, P::Core::ONE / first.cross(second).length())
            + convert::<R, P::Core>(scale * R::ROUNDOFF * num(4.0))
    }

    /// Two triangles with a diagonal, each watertight: the distance, both coordinates, and whether the ray comes from outside.
    #[inline(always)]
    fn watertight<P: Precision<Real = R>>(&self, probe: &Probe<P>) -> Option<(R, [P::Core; 2], bool)> {
        // One by one: an array's map is not always inlined.
        let [a, b, c, d] = self.corners;
        let (a, b) = (Corner::new(probe, a), Corner::new(probe, b));
        let (c, d) = (Corner::new(probe, c), Corner::new(probe, d));
        if let Some(hit) = cross(probe, &a, &b, &c) {
            let [second, third] = hit.weights;
            return Some((hit.t, [second + third, third], hit.from_outside));
        }
        let hit = cross(probe, &a, &c, &d)?;
        let [second, third] = hit.weights;
        Some((hit.t, [second, second + third], hit.from_outside))
    }

    /// The plane, and the point's coordinates in it.
    #[inline(always)]
    fn textbook<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        let [a, b, _, d] = self.corners;
        let (a, b, d) = (wide::<P>(a), wide::<P>(b), wide::<P>(d));
        let (edge_u, edge_v) = (b - a, d - a);
        let (unit, per_unit) = unit_of_both::<P>(edge_u, edge_v);
        let (edge_u, edge_v) = (edge_u * per_unit, edge_v * per_unit);
        let normal = edge_u.cross(edge_v);
        let slope = normal.dot(probe.direction);
        let f = (probe.origin - a) * per_unit;
        let distance = -normal.dot(f) / slope;
        let p = f + probe.direction * distance;
        let inverse = P::Core::ONE / normal.dot(normal);
        let (u, v) = (p.cross(edge_v).dot(normal) * inverse, edge_u.cross(p).dot(normal) * inverse);
        let inside = u.min(v).min(P::Core::ONE - u).min(P::Core::ONE - v) >= P::Core::ZERO;
        let t = convert(distance * unit);
        (inside && range.contains(t) && side.accepts(slope < P::Core::ZERO)).then(|| ShapeHit { t, u: convert(u), v: convert(v) })
    }
}

impl<R: Real> Shape<R> for Quad<R> {
    fn support(&self, direction: DVec3) -> Option<f64> {
        // Written so that NaN stays NaN.
        let [a, b, c, d] = self.corners.map(|p| p.to_f64().dot(direction));
        Some((a + b + c + d) * 0.0 + a.max(b).max(c).max(d))
    }

    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::from_points(self.corners.map(Vector::to_f64)))
    }

    #[inline]
    fn intersect<P: Precision<Real = R>>(&self, probe: &Probe<P>, range: Interval<R>, side: Side) -> Option<ShapeHit<R>> {
        if !P::ROBUST {
            return self.textbook(probe, range, side);
        }
        let (t, [u, v], from_outside) = self.watertight(probe)?;
        (range.contains(t) && side.accepts(from_outside)).then(|| ShapeHit { t, u: convert(u), v: convert(v) })
    }

    fn locate_under<P: Precision<Real = R>>(&self, probe: &Probe<P>, hit: ShapeHit<R>, maps: Under<'_, P>) -> Located<P::Core> {
        let [a, b, _, d] = self.corners.map(wide::<P>);
        let normal = self.normal::<P>();
        let (mut u, mut v) = (convert::<R, P::Core>(hit.u), convert::<R, P::Core>(hit.v));
        if P::ROBUST {
            // The rounding of stored coordinates moves the point along the plane only, but in a map's space that may be far.
            if let Some((_, place, _)) = probe.mapped.then(|| self.watertight(probe)).flatten() {
                [u, v] = place;
            }
            // Kept away from the border by what rounding the point may move it: a ray that starts at an inner edge of a
            // closed room then starts on the inner side of both walls.
            let reach = a.abs().max(b.abs()).max(d.abs()).max_element() * convert::<R, P::Core>(R::ROUNDOFF) * num(8.0);
            let keep = |x: P::Core, edge: CoreVec<P>| {
                let margin = (reach / edge.length()).min(num(0.5));
                x.max(margin).min(P::Core::ONE - margin)
            };
            (u, v) = (keep(u, b - a), keep(v, d - a));
        }
        let located = Located::new(self.point::<P>([u, v]), normal, self.error::<P>());
        match maps {
            Some(maps) if P::ROBUST => off_border::<P>(located, Face::Parallelogram, [b - a, d - a], [u, v], maps),
            _ => located,
        }
    }

    /// u along the first edge, v along the second.
    fn parameters<P: Precision<Real = R>>(&self, _: &Probe<P>, hit: ShapeHit<R>) -> Parameters<R> {
        let [a, b, _, _]: [Vec3Of<P>; 4] = self.corners;
        Parameters { u: hit.u, v: hit.v, dpdu: b - a, mirrored: true }
    }
}

impl<R: Real> SampleArea<R> for Quad<R> {
    fn area(&self) -> f64 {
        let [a, b, c, d] = self.corners.map(Vector::to_f64);
        0.5 * (c - a).cross(d - b).length()
    }

    fn sample_area<P: Precision<Real = R>>(&self, u: R, v: R) -> (Located<P::Core>, P::Core) {
        let point = self.point::<P>([convert(u), convert(v)]);
        let located = Located::new(point, self.normal::<P>(), self.error::<P>());
        (located, num(1.0 / self.area()))
    }

    fn density<P: Precision<Real = R>>(&self, _: &Located<P::Core>) -> P::Core {
        num(1.0 / self.area())
    }
}
