//! The filter of triangle blocks. In f32, with proven error bounds, it selects the triangles that
//! the exact test may hit within the range of distances.
//!
//! Let C be the first corner relative to the ray's origin, e₁ and e₂ the edges at that corner, d
//! the direction, N = e₁ × e₂ and r = C × d. The weights of a hit are U = e₂·r, V = −e₁·r and W = D
//! − U − V, each over D = N·d. The distance is T/D with T = N·C ("Fast, Minimum Storage
//! Ray/Triangle Intersection", Möller, Trumbore 1997). In f32 each of these terms has an error
//! below a bound. The filter can classify a triangle as *missed*, as *before the range* or as
//! *beyond the range*. It does so only where the exact test certainly has the same result.
//!
//! **Bounds.** Let u = 2⁻²⁴, w = 2⁻⁵³, E the length of the longer of e₁ and e₂, and R the distance
//! of the farthest corner from the origin. Then |C| ≤ R and E ≤ 2R. Each component of an edge and
//! of C has relative error u. A component of r or N is a difference of two products. It has an
//! error of u for each factor, u for each product, and u for the difference of the products. The
//! sums of the magnitudes of both products form a vector of length at most √2 |a||b|, for factors a
//! and b. A dot product of three terms adds u and 2u. The total errors, whether or not operations
//! are fused, are below:
//!
//! - U and V: 7√2 u E R |d| < 10 u E R |d|.
//! - D: 7√2 u E² |d| < 10 u E² |d| ≤ 20 u E R |d|.
//! - W, which adds two roundings of its own: 46 u E R |d|. This bounds U, V and D too.
//! - T: 8√2 u E² R < 12 u E² R.
//!
//! **The exact test** projects corners in f64, which moves each corner by at most 4 w R across the
//! ray and along it. The signs of the edge functions of these corners are exact. So a ray that the
//! exact test accepts misses the true triangle by less than 6 w R. A weight is the length of an
//! edge times a distance from that edge. So on the wrong side of an edge it is at most 12 w E R
//! |d|. For triangles of any size that is negligible beside 2 u E R |d|, the difference between 48
//! and 46 below. The exact test's distance belongs to the plane of the moved corners. The slope of
//! the true plane is at most E² |d|/|D|, so the distance is off by at most 10 w R E² |d|/|D|.
//! Multiplied by |D|, that is negligible beside 12 u E² R.
//!
//! **Rules.** The constant `least` covers underflow. Let
//!
//! - e = 48 u E R |d| + least, the bound of the weights;
//! - e_D = 12 u E² |d| + least, the bound of D;
//! - e_T = e_D · 2R/|d| + least, the bound of T;
//! - s the sign of D, which is certain if |D| > e_D;
//! - tmin and far the ends of the range, of either sign.
//!
//! A triangle is
//!
//! - *missed* if and only if the least weight is below −e and the greatest above e, for which the
//!   sign of D is not needed;
//! - *before the range* if s T + e_T < tmin |D| − |tmin| e_D;
//! - *beyond the range* if s T − e_T > far |D| + |far| e_D;
//! - *certainly hit* if all weights are beyond e on one side, |D| > e_D, and the distance is
//!   certainly within the range.
//!
//! Half of e_T is a margin for the rounding of a distance to f32, which is at most u R. As a
//! distance the margin is 12 u R E²/|D|, so at least 12 u R.
//!
//! The constants in use are slightly greater, for the rounding of the bounds themselves. Each lane
//! has its own R: the sum of the absolute components of C, plus E. So small triangles can be
//! separated in a large scene too.
//!
//! **NaN** never counts as *missed*: comparisons are written so that a lane with a NaN gets the
//! exact test. The bounds are infinite if corners, origin or direction are so large or small that a
//! product of three lengths might leave the range of f32 ([`super::triangle8::LARGE_COORDINATE`],
//! [`super::traversal_ray`]).

use super::traversal_ray::LeafRay;
use super::triangle8::Triangle8;
use crate::math::simd::Simd;

/// Factor on the error bound e_D of the determinant D. The filter decides whether a hit lies
/// before, within or beyond the range only if |D| in f32 exceeds this factor times e_D. All symbols
/// are those of the module documentation.
///
/// With a factor of two, the filter never decides this for a triangle that the exact test treats as
/// edge-on ([`crate::shapes::EDGE_ON_RATIO`]):
///
/// - Such a triangle has an exact |D| below 24 · 2⁻²⁶ E² |d| = 6 u E² |d|.
/// - The error of f32 is below 12 u E² |d|, so |D| in f32 is below 18 u E² |d|.
/// - The bound e_D in use is at least 14 u E² |d|, so the filter requires |D| above 28 u E² |d|.
///
/// With a factor of one, *beyond the range* would still be correct for a range that ends above
/// zero. For an edge-on triangle |T| in f32 is below (6 + 12) u E² R, and e_T is 28 u E² R. A
/// factor of two needs no such argument.
const EDGE_ON_FACTOR: f32 = 2.0;

/// Upper bound of the errors from underflow: the constant `least` of the module documentation.
const UNDERFLOW: f32 = 512.0 * f32::MIN_POSITIVE;

/// Result of the filter for eight triangles, one per lane. It keeps intermediate results for
/// [`find_certain_hits`].
#[derive(Clone, Copy)]
pub(super) struct FilterCandidates<S: Simd> {
    /// Mask of the lanes that need the exact test.
    pub lanes: u32,
    /// Mask of the lanes in which the sign of the determinant D is certain: |D| exceeds
    /// [`EDGE_ON_FACTOR`] times its error bound.
    pub is_signed: u32,
    least: S::Floats,
    greatest: S::Floats,
    determinant: S::Floats,
    distance: S::Floats,
    errors: ErrorBounds<S>,
}

#[inline(always)]
pub(super) fn splat_vector<S: Simd>(s: S, v: [f32; 3]) -> [S::Floats; 3] {
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
pub(super) fn load_corner<S: Simd>(s: S, block: &Triangle8, index: usize) -> [S::Floats; 3] {
    [
        s.load(&block.corners[0][index]),
        s.load(&block.corners[1][index]),
        s.load(&block.corners[2][index]),
    ]
}

/// Error bounds of the filter for eight triangles, in the symbols of the module documentation:
///
/// - `weight`: e, the bound of the weights;
/// - `determinant`: e_D, the bound of the determinant D;
/// - `distance`: e_T, the bound of T, which is the distance times D;
/// - `before`: e_T + |tmin| e_D, for the comparison with the near end tmin of the range;
/// - `beyond`: e_T + |far| e_D, for the comparison with the far end.
#[derive(Clone, Copy)]
pub(super) struct ErrorBounds<S: Simd> {
    pub weight: S::Floats,
    pub determinant: S::Floats,
    pub distance: S::Floats,
    pub before: S::Floats,
    pub beyond: S::Floats,
}

impl<S: Simd> ErrorBounds<S> {
    /// Computes the bounds for eight triangles. `from` holds their first corners relative to the
    /// ray's origin. `longest` holds, for each triangle, the length of the longer of the two edges
    /// at that corner. `far` is the far end of the range.
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

/// Filters the eight triangles of a block, for hits at distances up to `far`. The numbers of the
/// ray are read from memory and broadcast to all lanes when they are needed. So they occupy none of
/// the traversal's registers.
#[inline(always)]
pub(super) fn filter_triangle_block<S: Simd>(
    s: S,
    ray: &LeafRay,
    block: &Triangle8,
    far: f32,
) -> FilterCandidates<S> {
    let a = load_corner(s, block, 0);
    let (ab, ac) = (
        sub3(s, load_corner(s, block, 1), a),
        sub3(s, load_corner(s, block, 2), a),
    );
    let from = sub3(s, a, splat_vector(s, ray.origin));
    let direction = splat_vector(s, ray.direction);
    let (across, normal) = (cross(s, from, direction), cross(s, ab, ac));
    let u = dot(s, ac, across);
    let v = s.negate(dot(s, ab, across));
    let along = dot(s, normal, direction);
    let bounds = ErrorBounds::new(s, ray, from, &block.longest, far);
    filter_triangle_lanes(
        s,
        [u, v, along],
        dot(s, normal, from),
        [s.splat(ray.near), s.splat(far)],
        bounds,
    )
}

/// Filters eight triangles by the terms U (`u`), V (`v`), D (`along`) and T (`distance`) of the
/// module documentation. The candidates are the triangles that are neither certainly missed nor
/// certainly outside the range.
#[inline(always)]
pub(super) fn filter_triangle_lanes<S: Simd>(
    s: S,
    [u, v, along]: [S::Floats; 3],
    distance: S::Floats,
    [near, far]: [S::Floats; 2],
    errors: ErrorBounds<S>,
) -> FilterCandidates<S> {
    let w = s.sub(s.sub(along, u), v);
    let (least, greatest) = (s.min(s.min(u, v), w), s.max(s.max(u, v), w));
    let certain_misses = s.less(least, s.negate(errors.weight)) & s.less(errors.weight, greatest);

    let (determinant, distance) = (s.abs(along), s.flip_signs(distance, along));
    let before = s.less(distance, s.mul_sub(near, determinant, errors.before));
    let beyond = s.less(s.mul_add(far, determinant, errors.beyond), distance);
    let is_signed = s.less(
        s.mul(errors.determinant, s.splat(EDGE_ON_FACTOR)),
        determinant,
    );
    let lanes = !(certain_misses | (before | beyond) & is_signed) & 0xff;
    FilterCandidates {
        lanes,
        is_signed,
        least,
        greatest,
        determinant,
        distance,
        errors,
    }
}

/// Returns the mask of the lanes in which the exact test certainly finds a hit between `near` and
/// `far`.
#[inline(always)]
pub(super) fn find_certain_hits<S: Simd>(
    s: S,
    filter_candidates: &FilterCandidates<S>,
    near: f32,
    far: f32,
) -> u32 {
    const SLACK: f32 = 1e-6;
    let FilterCandidates {
        lanes,
        is_signed,
        least,
        greatest,
        determinant,
        distance,
        ref errors,
    } = *filter_candidates;
    let inside = s.less(errors.weight, least) | s.less(greatest, s.negate(errors.weight));
    let after = s.mul(
        s.splat(near.max(f32::MIN_POSITIVE) * (1.0 + SLACK)),
        s.add(determinant, errors.determinant),
    );
    let until = s.mul(
        s.splat(far * (1.0 - SLACK)),
        s.sub(determinant, errors.determinant),
    );
    let after = s.less(after, s.sub(distance, errors.distance));
    let until = s.less(s.add(distance, errors.distance), until);
    lanes & inside & is_signed & after & until
}
