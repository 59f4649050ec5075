//! Edge functions whose sign is exact: what makes triangles and quads watertight.
//!
//! Corners are projected along the ray onto a plane, each by itself, so that two faces that share a corner agree on it to
//! the bit. The three edge functions of a face are then differences of products of those coordinates. With coordinates
//! rounded to f32 the products are exact in f64 and the sign of the difference is the true one: whether the ray passes left
//! or right of an edge is the same question with the same answer for both faces at it ("Watertight Ray/Triangle
//! Intersection", Woop, Benthin, Wald 2013, section 3, with the recheck in f64 done always).

use super::{CoreVec, Probe};
use crate::scalar::{Precision, Real, Vector, convert, convert_vec};

/// A corner in the plane across the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner<P: Precision> {
    /// From the ray's origin, in space.
    offset: CoreVec<P>,
    /// Projected.
    x: P::Core,
    y: P::Core,
    /// Projected and rounded to the stored scalar: decides which side of the ray an edge is on.
    rounded: [P::Core; 2],
}

/// Where the ray passes a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing<P: Precision> {
    /// Distance along the ray.
    pub t: P::Real,
    /// Weights of the second and third corner.
    pub weights: [P::Real; 2],
    /// Whether the ray arrives against the right-handed normal.
    pub from_outside: bool,
}

impl<P: Precision> Corner<P> {
    /// Projects a corner.
    #[inline(always)]
    pub fn new(probe: &Probe<P>, corner: <P::Real as Real>::Vec3) -> Self {
        let offset = convert_vec::<P::Real, P::Core>(corner) - probe.origin;
        let (x, y) = (offset.dot(probe.across[0]), offset.dot(probe.across[1]));
        let round = |c: P::Core| convert::<P::Real, P::Core>(convert::<P::Core, P::Real>(c));
        Self { offset, x, y, rounded: [round(x), round(y)] }
    }

    /// The edge function of the edge from `self` to `to`, of exact sign: positive when the ray has the edge on its right.
    #[inline(always)]
    fn edge(&self, to: &Self) -> P::Core {
        let ([ax, ay], [bx, by]) = (self.rounded, to.rounded);
        let products_are_exact = P::Core::ROUNDOFF < convert(P::Real::ROUNDOFF);
        if products_are_exact { bx * ay - by * ax } else { exact_difference(bx, ay, by, ax) }
    }
}

/// Where the ray passes through the triangle of three projected corners; its border belongs to it. None for a triangle that
/// the ray sees edge-on: its neighbours are hit instead.
#[inline(always)]
pub(crate) fn cross<P: Precision>(probe: &Probe<P>, a: &Corner<P>, b: &Corner<P>, c: &Corner<P>) -> Option<Crossing<P>> {
    let zero = P::Core::ZERO;
    let (u, v, w) = (b.edge(c), c.edge(a), a.edge(b));
    // Without short circuits: most triangles are missed, by an edge that no branch predictor can guess. −0 counts as 0.
    if ((u < zero) | (v < zero) | (w < zero)) & ((u > zero) | (v > zero) | (w > zero)) {
        return None;
    }
    // Of one sign, so the sum is zero only when all of them are.
    let determinant = u + v + w;
    let seen = determinant.abs() > zero;
    if !seen {
        return None;
    }
    weigh(probe, [a, b, c], determinant > zero, [u, v, w])
}

/// Distance and weights. They come from the unrounded projections, so that rounding decides at the border only; weights that
/// this makes negative are zero.
#[inline(always)]
fn weigh<P: Precision>(
    probe: &Probe<P>,
    [a, b, c]: [&Corner<P>; 3],
    from_outside: bool,
    rounded: [P::Core; 3],
) -> Option<Crossing<P>> {
    let zero = P::Core::ZERO;
    let side = if from_outside { P::Core::ONE } else { -P::Core::ONE };
    let weight = |p: &Corner<P>, q: &Corner<P>| ((q.x * p.y - q.y * p.x) * side).max(zero);
    let (mut u, mut v, mut w) = (weight(b, c), weight(c, a), weight(a, b));
    let mut sum = u + v + w;
    let usable = sum > zero;
    if !usable {
        [u, v, w] = rounded.map(|e| e * side);
        sum = u + v + w;
    }
    let inverse = P::Core::ONE / sum;
    let (u, v, w) = (u * inverse, v * inverse, w * inverse);
    let along = a.offset.dot(probe.direction) * u + b.offset.dot(probe.direction) * v + c.offset.dot(probe.direction) * w;
    let t = convert(along * probe.inverse_length_squared);
    Some(Crossing { t, weights: [convert(v), convert(w)], from_outside })
}

/// a·b − c·d rounded, with the exact sign, where products are not exact: the rounding errors of the products, by fused
/// multiply-add, decide when the products themselves are too close (Kahan's method with the sum of three carried out
/// without error as far as the sign depends on it). Exact unless a product's error underflows.
#[cold]
fn exact_tail(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (p, q) = (a * b, c * d);
    let (p_error, q_error) = (a.mul_add(b, -p), c.mul_add(d, -q));
    // p − q is exact here by Sterbenz' lemma; the difference of the two errors is split into its rounding and the rest.
    let high = p_error - q_error;
    let back = high - p_error;
    let low = (p_error - (high - back)) - (q_error + back);
    let sum = (p - q) + high;
    if sum == 0.0 { low } else { sum }
}

#[inline(always)]
fn exact_difference<C: Real>(a: C, b: C, c: C, d: C) -> C {
    let (p, q) = (a * b, c * d);
    let difference = p - q;
    if difference.abs() > (p.abs() + q.abs()) * (C::ROUNDOFF * C::from_f64(4.0)) {
        return difference;
    }
    C::from_f64(exact_tail(a.to_f64(), b.to_f64(), c.to_f64(), d.to_f64()))
}
