//! Edge functions whose sign is exact: what makes triangles and quads watertight.
//!
//! Corners are projected along the ray onto a plane, each by itself, so that two faces that share a corner agree on it to
//! the bit. The three edge functions of a face are then differences of products of those coordinates, and their sign is made
//! exact: whether the ray passes left or right of an edge is the same question with the same answer for both faces at it
//! ("Watertight Ray/Triangle Intersection", Woop, Benthin, Wald 2013, section 3). The coordinates are those of the core: were
//! they rounded to f32, where products are exact in f64, a needle's far corner would move by more than the needle is wide,
//! and a ray that leaves it would meet it again somewhere along it.

use glam::DVec3;

use super::{CoreVec, Probe, slack};
use crate::scalar::{Precision, Real, Vector, convert, convert_vec};

/// A corner as the ray sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner<P: Precision> {
    /// From the ray's origin, in space.
    offset: CoreVec<P>,
    /// Projected onto the plane across the ray.
    x: P::Core,
    y: P::Core,
}

/// Where the ray passes a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing<P: Precision> {
    /// Distance along the ray.
    pub t: P::Real,
    /// Weights of the second and third corner.
    pub weights: [P::Core; 2],
    /// Whether the ray arrives against the right-handed normal.
    pub from_outside: bool,
}

impl<P: Precision> Corner<P> {
    /// Projects a corner.
    #[inline(always)]
    pub fn new(probe: &Probe<P>, corner: <P::Real as Real>::Vec3) -> Self {
        let offset = convert_vec::<P::Real, P::Core>(corner) - probe.origin;
        Self { offset, x: offset.dot(probe.across[0]), y: offset.dot(probe.across[1]) }
    }

    /// The edge function of the edge from `self` to `to`, of exact sign: positive when the ray has the edge on its right.
    #[inline(always)]
    fn edge(&self, to: &Self) -> P::Core {
        exact_difference(to.x, self.y, to.y, self.x)
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
    let inverse = P::Core::ONE / determinant;
    let (u, v, w) = (u * inverse, v * inverse, w * inverse);
    let along = a.offset.dot(probe.direction) * u + b.offset.dot(probe.direction) * v + c.offset.dot(probe.direction) * w;
    let t = convert(along * probe.inverse_length_squared);
    Some(Crossing { t, weights: [v, w], from_outside: determinant > zero })
}

/// What a test of a flat face by its corners may be wrong by: the flatter one of its triangles is, `longest_squared` over
/// twice its area, the less its corners tell where its plane is.
#[inline(always)]
pub(super) fn corner_slack<C: Real>(scale: C, longest_squared: C, inverse_twice_area: C) -> C {
    slack(scale) * (longest_squared * inverse_twice_area).min(C::ONE / C::ROUNDOFF)
}

/// a·b − c·d rounded, with the exact sign: the rounding errors of the products, by fused multiply-add, decide when the
/// products themselves are too close (Kahan's method with the sum of three carried out without error as far as the sign
/// depends on it). Exact unless a product's error underflows.
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

/// Whether three points lie on one line; exact where the differences of their coordinates are, as those of f32 numbers
/// within nine orders of magnitude.
pub(super) fn are_collinear(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let (p, q) = (b - a, c - a);
    let minor = |a: f64, b: f64, c: f64, d: f64| exact_difference(a, b, c, d);
    minor(p.y, q.z, p.z, q.y) == 0.0 && minor(p.z, q.x, p.x, q.z) == 0.0 && minor(p.x, q.y, p.y, q.x) == 0.0
}

/// a·b − c·d with the exact sign.
#[inline(always)]
fn exact_difference<C: Real>(a: C, b: C, c: C, d: C) -> C {
    let (p, q) = (a * b, c * d);
    let difference = p - q;
    // Wrong by at most u·(|p| + |q| + |difference|), and |q| is at most |p| + |difference|: one product tells the size of both.
    if difference.abs() >= p.abs() * (C::ROUNDOFF * C::from_f64(8.0)) {
        return difference;
    }
    C::from_f64(exact_tail(a.to_f64(), b.to_f64(), c.to_f64(), d.to_f64()))
}

#[cfg(test)]
mod tests {
    use super::exact_difference;

    /// SplitMix64.
    fn next(state: &mut u64) -> u64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Protects: the sign of a·b − c·d whatever cancels, and its value to a third, against whole numbers of 128 bits: products
    /// that are equal, that differ in their last bits, and that differ by as much as decides which formula is taken.
    #[test]
    fn differences_of_products_are_those_of_whole_numbers() {
        let state = &mut 7;
        let (mut equal, mut close, mut rounded_away) = (0, 0, 0);
        for _ in 0..2_000_000 {
            let odd = |state: &mut u64, bits: u32| (next(state) >> (64 - bits) | 1 | 1 << (bits - 1)) as i64;
            let bits = 24 + (next(state) % 29) as u32;
            let (x, y) = (odd(state, bits), odd(state, bits));
            // (x + m)(y − n) is close to x·y where m·y ≈ n·x: steps by a ratio of small numbers, or none.
            let step = (next(state) % 4) as i64;
            let other = (step as f64 * y as f64 / x as f64).round() as i64;
            let jitter = (next(state) % 3) as i64 - 1;
            let (c, d) = if next(state).is_multiple_of(8) { (y, x) } else { (x + step, y - other + jitter) };
            let exact = i128::from(x) * i128::from(y) - i128::from(c) * i128::from(d);
            let found = exact_difference(x as f64, y as f64, c as f64, d as f64);
            assert_eq!(found.partial_cmp(&0.0), Some(exact.cmp(&0)), "{x}·{y} − {c}·{d} = {exact}, not {found}");
            let wrong = (found - exact as f64).abs();
            assert!(wrong <= exact.unsigned_abs() as f64 * 0.34, "{x}·{y} − {c}·{d} = {exact}, not {found}");
            let products = x as f64 * y as f64 - c as f64 * d as f64;
            equal += u32::from(exact == 0);
            rounded_away += u32::from(exact != 0 && products == 0.0);
            close += u32::from(exact != 0 && products.abs() <= x as f64 * y as f64 * 8.0 * f64::EPSILON);
        }
        assert!(equal > 1000 && close > 1000 && rounded_away > 1000, "{equal} {close} {rounded_away}");
    }
}
