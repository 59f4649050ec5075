//! The filter: which triangles of a block the exact test may hit within range, by f32 with proven
//! bounds.
//!
//! With C the first corner from the origin, e₁ and e₂ the edges there, d the direction, N = e₁ × e₂
//! and r = C × d, the weights of a hit are U = e₂·r, V = −e₁·r and W = D − U − V over D = N·d, and
//! its distance is T/D with T = N·C ("Fast, Minimum Storage Ray/Triangle Intersection", Möller,
//! Trumbore 1997). In f32 each is wrong by no more than a bound, so that the filter can say
//! *missed*, *before the range* or *beyond it* only where the exact test says the same.
//!
//! **Bounds.** Let u = 2⁻²⁴, w = 2⁻⁵³, E the longer one of the two edges and R the distance of the
//! farthest corner from the origin, so |C| ≤ R and E ≤ 2R. An edge and C have relative errors of u
//! a component. A component of r or N is a difference of two products: errors of u from each
//! factor's own difference, u for a product, u for the difference. The sums of two products'
//! magnitudes have, as a vector, a length of √2 |a||b| at most. A scalar product of three terms
//! adds u and 2u. Summed up, whether or not operations are fused:
//!
//! - U and V: 7√2 u E R |d| < 10 u E R |d|. D: 7√2 u E² |d| < 10 u E² |d| ≤ 20 u E R |d|. W, their
//!   difference, with its own two roundings: 46 u E R |d|. So 46 u E R |d| bounds all three.
//! - T: 8√2 u E² R < 12 u E² R.
//!
//! The exact test takes exact signs of edge functions of corners that it has projected in f64, each
//! moved by 4 w R at most across the ray and along it. So what it hits passes the true triangle by
//! less than 6 w R, and a weight, an edge's length times a distance from that edge, is 12 w E R |d|
//! at most on the wrong side: nothing beside the 2 u E R |d| by which 48 is more than 46, however
//! small the triangle is. Its distance is that of the moved corners' plane: along the true one,
//! whose slope is E² |d|/|D| at most, it is off by 10 w R E² |d|/|D|, which times |D| is nothing
//! beside 12 u E² R. A smallest number covers what underflows. So with
//!
//! - e = 48 u E R |d| + least: *missed* if and only if the least weight is below −e and the
//!   greatest above e. No sign of D is needed.
//! - e_D = 12 u E² |d| + least and e_T = e_D · 2R/|d| + least: with s the sign of D, which is
//!   certain where |D| > e_D, *before the range* where s T + e_T < tmin |D| − |tmin| e_D, *beyond
//!   it* where s T − e_T > far |D| + |far| e_D. The ends may have either sign. Half of e_T is to
//!   spare: 12 u R E²/|D| of a distance, which is 12 u R at least, while rounding a distance to f32
//!   takes u R.
//! - *Certainly hit*: the weights beyond e on one side, |D| > e_D, and the distance certainly
//!   within the range.
//!
//! The constants in use are a little greater, for the rounding of the bounds themselves. R is a
//! lane's own: the sum of C's components, and E. So small triangles are told apart in a large scene
//! too.
//!
//! **What is not a number** is never missed: comparisons are written so that it is left to the
//! exact test. Corners, origins and directions so large or small that a product of three lengths
//! might leave the range of f32 get infinite bounds ([`super::triangle8::LARGE`],
//! [`super::traversal_ray`]).

use super::traversal_ray::LeafRay;
use super::triangle8::Triangle8;
use crate::math::simd::Simd;

/// So many times its error a determinant has to be before anything is said of the distance: what
/// the exact test places because it is seen edge-on ([`crate::shapes::EDGE_ON`]) has less. Such a
/// triangle's D is below 24 · 2⁻²⁵ E² |d| = 12 u E² |d|, and with the error of f32 below 24 of the
/// 2 · 14 that are asked for.
///
/// With one in place of two nothing would be *beyond* wrongly either where the range ends above
/// zero: |T| in f32 is below (12 + 12) u E² R for such a triangle, and e_T is 28 u E² R. Two needs
/// no such argument.
const TOLD: f32 = 2.0;

/// More than what underflows.
const UNDERFLOW: f32 = 512.0 * f32::MIN_POSITIVE;

/// What the filter leaves, a bit a lane, and for [`certain`] what it found on the way.
#[derive(Clone, Copy)]
pub(super) struct Candidates<S: Simd> {
    pub lanes: u32,
    least: S::Floats,
    greatest: S::Floats,
    determinant: S::Floats,
    distance: S::Floats,
    errors: Bounds<S>,
}

#[inline(always)]
pub(super) fn spread<S: Simd>(s: S, v: [f32; 3]) -> [S::Floats; 3] {
    [s.splat(v[0]), s.splat(v[1]), s.splat(v[2])]
}

#[inline(always)]
pub(super) fn dot<S: Simd>(s: S, a: [S::Floats; 3], b: [S::Floats; 3]) -> S::Floats {
    s.mul_add(a[0], b[0], s.mul_add(a[1], b[1], s.mul(a[2], b[2])))
}

#[inline(always)]
pub(super) fn cross<S: Simd>(s: S, a: [S::Floats; 3], b: [S::Floats; 3]) -> [S::Floats; 3] {
    [
        s.mul_sub(a[1], b[2], s.mul(a[2], b[1])),
        s.mul_sub(a[2], b[0], s.mul(a[0], b[2])),
        s.mul_sub(a[0], b[1], s.mul(a[1], b[0])),
    ]
}

#[inline(always)]
pub(super) fn sub3<S: Simd>(s: S, a: [S::Floats; 3], b: [S::Floats; 3]) -> [S::Floats; 3] {
    [s.sub(a[0], b[0]), s.sub(a[1], b[1]), s.sub(a[2], b[2])]
}

#[inline(always)]
pub(super) fn corner<S: Simd>(s: S, block: &Triangle8, place: usize) -> [S::Floats; 3] {
    [
        s.load(&block.corners[0][place]),
        s.load(&block.corners[1][place]),
        s.load(&block.corners[2][place]),
    ]
}

/// What rounding takes at most, as above: of weights, of determinants, of distances times these,
/// and of what those are held against.
#[derive(Clone, Copy)]
pub(super) struct Bounds<S: Simd> {
    pub weight: S::Floats,
    pub determinant: S::Floats,
    pub distance: S::Floats,
    pub before: S::Floats,
    pub beyond: S::Floats,
}

impl<S: Simd> Bounds<S> {
    /// Of triangles by their first corners from the origin and their longest edges.
    #[inline(always)]
    pub fn new(s: S, ray: &LeafRay, from: [S::Floats; 3], longest: &[f32; 8], far: f32) -> Self {
        let longest = s.load(longest);
        let sum = s.add(
            s.add(s.abs(from[0]), s.abs(from[1])),
            s.add(s.abs(from[2]), s.splat(ray.reach)),
        );
        let (reach, least) = (s.add(sum, s.max(longest, s.splat(0.0))), s.splat(UNDERFLOW));
        let weight = s.mul_add(s.mul(longest, reach), s.splat(ray.weight), least);
        let determinant = s.mul_add(s.mul(longest, longest), s.splat(ray.determinant), least);
        let reached = s.mul(reach, s.splat(ray.distance));
        let before = s.mul_add(determinant, s.add(reached, s.splat(ray.near.abs())), least);
        let beyond = s.mul_add(determinant, s.add(reached, s.splat(far.abs())), least);
        Self {
            weight,
            determinant,
            distance: s.mul_add(determinant, reached, least),
            before,
            beyond,
        }
    }
}

/// The lanes that the exact test may hit before `far`. The ray comes from memory, one number at a
/// time: a processor spreads them over its lanes as it reads them, and the walk keeps its
/// registers.
#[inline(always)]
pub(super) fn candidates<S: Simd>(
    s: S,
    ray: &LeafRay,
    block: &Triangle8,
    far: f32,
) -> Candidates<S> {
    let a = corner(s, block, 0);
    let (ab, ac) = (
        sub3(s, corner(s, block, 1), a),
        sub3(s, corner(s, block, 2), a),
    );
    let from = sub3(s, a, spread(s, ray.origin));
    let direction = spread(s, ray.direction);
    let (across, normal) = (cross(s, from, direction), cross(s, ab, ac));
    let u = dot(s, ac, across);
    let v = s.negate(dot(s, ab, across));
    let along = dot(s, normal, direction);
    let bounds = Bounds::new(s, ray, from, &block.longest, far);
    undecided(
        s,
        [u, v, along],
        dot(s, normal, from),
        [s.splat(ray.near), s.splat(far)],
        bounds,
    )
}

/// The lanes that are neither missed nor beyond either end of the range for certain, by U, V, D and
/// T.
#[inline(always)]
pub(super) fn undecided<S: Simd>(
    s: S,
    [u, v, along]: [S::Floats; 3],
    distance: S::Floats,
    [near, far]: [S::Floats; 2],
    errors: Bounds<S>,
) -> Candidates<S> {
    let w = s.sub(s.sub(along, u), v);
    let (least, greatest) = (s.min(s.min(u, v), w), s.max(s.max(u, v), w));
    let missed = s.less(least, s.negate(errors.weight)) & s.less(errors.weight, greatest);

    let (determinant, distance) = (s.abs(along), s.signed_by(distance, along));
    let before = s.less(distance, s.mul_sub(near, determinant, errors.before));
    let beyond = s.less(s.mul_add(far, determinant, errors.beyond), distance);
    let told = s.less(s.mul(errors.determinant, s.splat(TOLD)), determinant);
    let lanes = !(missed | (before | beyond) & told) & 0xff;
    Candidates {
        lanes,
        least,
        greatest,
        determinant,
        distance,
        errors,
    }
}

/// Of what is left, the lanes that the exact test hits within the range, for certain.
#[inline(always)]
pub(super) fn certain<S: Simd>(s: S, found: &Candidates<S>, near: f32, far: f32) -> u32 {
    const SLACK: f32 = 1e-6;
    let Candidates {
        lanes,
        least,
        greatest,
        determinant,
        distance,
        ref errors,
    } = *found;
    let inside = s.less(errors.weight, least) | s.less(greatest, s.negate(errors.weight));
    let after = s.mul(
        s.splat(near.max(f32::MIN_POSITIVE) * (1.0 + SLACK)),
        s.add(determinant, errors.determinant),
    );
    let until = s.mul(
        s.splat(far * (1.0 - SLACK)),
        s.sub(determinant, errors.determinant),
    );
    let signed = s.less(s.mul(errors.determinant, s.splat(TOLD)), determinant);
    let after = s.less(after, s.sub(distance, errors.distance));
    let until = s.less(s.add(distance, errors.distance), until);
    lanes & inside & signed & after & until
}
