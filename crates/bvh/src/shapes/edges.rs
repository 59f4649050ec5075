//! Edge functions with exact signs: the basis of the watertight tests of triangles and quads.
//!
//! Each corner is projected individually along the ray onto a plane. So two faces with a common
//! corner have the same projection of this corner, to the bit. The edge functions of a face are
//! differences of products of projected coordinates. Their signs are computed exactly. So at a
//! common edge both faces agree on which side the ray passes ("Watertight Ray/Triangle
//! Intersection", Woop, Benthin, Wald 2013, section 3).
//!
//! Projected coordinates are f64. f32 coordinates would make the products exact in f64. But on a
//! needle-shaped triangle their rounding would move the far corner by more than the needle's width.
//! A ray that leaves the needle would then hit it again.

use glam::DVec3;

use super::{PreparedRay, rounding_bound};
use crate::scalar::Real;

/// A corner of a face, projected along a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProjectedCorner {
    /// Position of the corner relative to the ray's origin, before the projection.
    offset: DVec3,
    /// Coordinates of the corner in the plane perpendicular to the ray, along
    /// [`PreparedRay::projection_axes`].
    x: f64,
    y: f64,
}

/// Intersection of a ray with a triangle, in f64 or in the stored scalar `T`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleHit<T = f32> {
    /// Distance along the ray.
    pub t: T,
    /// Barycentric weights of the second and the third corner.
    pub weights: [T; 2],
    /// Whether the ray runs against the normal of the right-hand rule.
    pub from_outside: bool,
}

impl From<&TriangleHit<f64>> for TriangleHit {
    #[inline(always)]
    fn from(
        &TriangleHit {
            t,
            weights: [v, w],
            from_outside,
        }: &TriangleHit<f64>,
    ) -> Self {
        Self {
            t: t as f32,
            weights: [v as f32, w as f32],
            from_outside,
        }
    }
}

/// Ratio of the determinant to S Δ below which a triangle counts as edge-on. The determinant is the
/// sum of the three edge functions. S is the sum of the absolute projected coordinates. Δ is the
/// greatest difference between two corners' distances along the ray.
///
/// **Above the ratio.** Let w = 2⁻⁵³, R the distance of the farthest corner from the origin, and s
/// the length of the projection vectors. A projected coordinate has an error of at most 4 w R s. So
/// the determinant has an error of 8 w R s S. The hit distance is the mean of the corners'
/// distances, weighted by the edge functions. So its error is 8 w R s S Δ/|determinant|. A
/// traversal tolerates an error of 4 u R, with u = 2⁻²⁴, since boxes are padded and exit distances
/// widened. A determinant of 2⁻²⁶ S Δ limits the error to 2⁻²³ R.
///
/// **Below the ratio.** The weights may be noise, so the hit distance is that of the ray's crossing
/// with an edge ([`find_entry_into_edge_on_face`]). The hit does not depend on the order of traversal if the ray
/// passes the padded box of each part of the face that contains the crossing:
///
/// - Let n be the absolute components of the unit direction, and m the greatest of them. The
///   projection vectors measure displacements along the two other coordinate axes, times m.
/// - The crossing is displaced from the ray along one of these axes j by at most c, the length of
///   the face's section along j through the ray. For a ray within the face, S c is at most three
///   times the determinant. Equality needs a face as long as wide, and a ray through a corner. So c
///   is at most 3 · 2⁻²⁶ Δ/m.
/// - A shift along the ray leaves a displacement of c m/(m + nⱼ) along the axes, which is
///   3 · 2⁻²⁶ Δ/(m + nⱼ).
/// - Each side of a box is padded by 2⁻²³ of the face's greatest extent
///   ([`crate::Aabb::to_padded`]), which is m Δ. This is more, because m (m + nⱼ) is at least 1/2.
pub(crate) const EDGE_ON_RATIO: f64 = 1.0 / 67_108_864.0;

impl ProjectedCorner {
    /// Projects a corner along the ray.
    #[inline(always)]
    pub fn new(prepared_ray: &PreparedRay, corner: DVec3) -> Self {
        let offset = corner - prepared_ray.origin;
        Self {
            offset,
            x: offset.dot(prepared_ray.projection_axes[0]),
            y: offset.dot(prepared_ray.projection_axes[1]),
        }
    }

    /// Computes the edge function of the edge from `self` to `to`, with exact sign. It is twice the
    /// signed area of the projected triangle of the ray and both corners. It is positive if the ray
    /// passes to the left of the edge, as seen from the ray's origin.
    #[inline(always)]
    fn edge_function(&self, to: &Self) -> f64 {
        difference_of_products(to.x, self.y, to.y, self.x)
    }
}

/// Intersects a ray with the triangle of three projected corners. Hits on edges and corners count.
/// A triangle whose projection has no area gives `None`: the ray then hits a neighbouring triangle.
#[inline(always)]
pub(crate) fn intersect_projected_triangle(
    prepared_ray: &PreparedRay,
    a: &ProjectedCorner,
    b: &ProjectedCorner,
    c: &ProjectedCorner,
) -> Option<TriangleHit<f64>> {
    let (u, v, w) = (b.edge_function(c), c.edge_function(a), a.edge_function(b));
    // Evaluated without short-circuit: the edge by which most triangles are missed is
    // unpredictable. −0 counts as 0.
    if ((u < 0.0) | (v < 0.0) | (w < 0.0)) & ((u > 0.0) | (v > 0.0) | (w > 0.0)) {
        return None;
    }
    // All edge functions have one sign, so their sum is zero only if all are zero.
    let determinant = u + v + w;
    let has_area = determinant.abs() > 0.0;
    if !has_area {
        return None;
    }
    let from_outside = determinant > 0.0;
    let [za, zb, zc] = [
        a.offset.dot(prepared_ray.direction),
        b.offset.dot(prepared_ray.direction),
        c.offset.dot(prepared_ray.direction),
    ];
    let sizes = a.x.abs() + a.y.abs() + b.x.abs() + b.y.abs() + c.x.abs() + c.y.abs();
    let depth = za.max(zb).max(zc) - za.min(zb).min(zc);
    let is_well_conditioned = determinant.abs() >= sizes * depth * EDGE_ON_RATIO;
    if !is_well_conditioned {
        let (along, [_, v, w]) =
            find_entry_into_edge_on_face([a.x, b.x, c.x], [a.y, b.y, c.y], [za, zb, zc]);
        return Some(TriangleHit {
            t: along * prepared_ray.inverse_length_squared,
            weights: [v, w],
            from_outside,
        });
    }
    let inverse = 1.0 / determinant;
    let (u, v, w) = (u * inverse, v * inverse, w * inverse);
    let along = za * u + zb * v + zc * w;
    Some(TriangleHit {
        t: along * prepared_ray.inverse_length_squared,
        weights: [v, w],
        from_outside,
    })
}

/// Finds where a ray enters an edge-on face, from the projected coordinates of the corners. `x` and
/// `y` are their coordinates across the ray, `z` those along it. Returns the `z` of the entry, and
/// the weights of the three corners.
///
/// The face is treated as flat: it lies in the plane of the ray and of the face's longer extent
/// across the ray. In that plane the face is wide, so each crossing of an edge is well-conditioned.
/// The crossing is off the ray by at most the rounding of a corner plus the face's shorter extent.
#[cold]
#[inline(never)]
fn find_entry_into_edge_on_face(x: [f64; 3], y: [f64; 3], z: [f64; 3]) -> (f64, [f64; 3]) {
    let extent = |[a, b, c]: [f64; 3]| a.max(b).max(c) - a.min(b).min(c);
    let across = if extent(x) >= extent(y) { x } else { y };
    let mut best = (f64::INFINITY, [1.0, 0.0, 0.0]);
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        let (p, q) = (across[from], across[to]);
        if p.max(q) < 0.0 || p.min(q) > 0.0 {
            continue;
        }
        let share = match () {
            () if p != q => p / (p - q),
            () if z[to] < z[from] => 1.0,
            () => 0.0,
        };
        let at = z[from] + (z[to] - z[from]) * share;
        if at < best.0 {
            best = (at, [0.0; 3]);
            (best.1[from], best.1[to]) = (1.0 - share, share);
        }
    }
    best
}

/// Error bound of the intersection test of a flat face with coordinates up to `scale`. The corners
/// of a thin triangle determine its plane less precisely. So the bound grows with the ratio of
/// `longest_squared`, the squared longest edge, to twice the area.
#[inline(always)]
pub(super) fn flat_face_error_bound(
    scale: f64,
    longest_squared: f64,
    inverse_twice_area: f64,
) -> f64 {
    rounding_bound(scale) * (longest_squared * inverse_twice_area).min(1.0 / f64::ROUNDOFF)
}

/// Computes a·b − c·d with exact sign, for products so close that the difference of the rounded
/// products could have the wrong sign. Fused multiply-add gives the rounding errors of both
/// products. The three terms are then summed without error, as far as the sign depends on it
/// (Kahan's method). The result is exact unless the error of a product underflows.
#[cold]
fn difference_of_close_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (p, q) = (a * b, c * d);
    let (p_error, q_error) = (a.mul_add(b, -p), c.mul_add(d, -q));
    // p − q is exact by Sterbenz' lemma. The difference of the two rounding errors is split into
    // its rounded value `high` and the remainder `low`.
    let high = p_error - q_error;
    let back = high - p_error;
    let low = (p_error - (high - back)) - (q_error + back);
    let sum = (p - q) + high;
    if sum == 0.0 { low } else { sum }
}

/// Whether three points are collinear. The result is exact if the differences of coordinates are
/// exact, as they are for f32 coordinates within nine orders of magnitude.
pub(super) fn are_collinear(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let (p, q) = (b - a, c - a);
    let minor = |a: f64, b: f64, c: f64, d: f64| difference_of_products(a, b, c, d);
    minor(p.y, q.z, p.z, q.y) == 0.0
        && minor(p.z, q.x, p.x, q.z) == 0.0
        && minor(p.x, q.y, p.y, q.x) == 0.0
}

/// Computes a·b − c·d with exact sign.
#[inline(always)]
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (p, q) = (a * b, c * d);
    let difference = p - q;
    // The error is at most u·(|p| + |q| + |difference|), and |q| is at most |p| + |difference|. So
    // a multiple of |p| bounds the error.
    if difference.abs() >= p.abs() * (f64::ROUNDOFF * 8.0) {
        return difference;
    }
    difference_of_close_products(a, b, c, d)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::{
        EDGE_ON_RATIO, ProjectedCorner, difference_of_products, find_entry_into_edge_on_face,
        intersect_projected_triangle,
    };
    use crate::ray::Ray;
    use crate::shapes::PreparedRay;

    /// Next 64 random bits (SplitMix64).
    fn next(state: &mut u64) -> u64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Protects: an edge-on face is hit at the crossing of an edge where the ray enters the face,
    /// for any noise across the face; and if an edge lies on the ray, at the nearer end of that
    /// edge.
    #[test]
    fn faces_edge_on_are_met_where_they_begin() {
        let noise = [1e-17, -2e-17, 1e-18];
        // The edge from (−1, 10) to (1, 20) crosses the ray at 15. The path through (3, 40) crosses
        // at 17.5.
        let (x, z) = ([-1.0, 1.0, 3.0], [10.0, 20.0, 40.0]);
        assert_eq!(
            find_entry_into_edge_on_face(x, noise, z),
            (15.0, [0.5, 0.5, 0.0])
        );
        assert_eq!(
            find_entry_into_edge_on_face(noise, x, z),
            (15.0, [0.5, 0.5, 0.0])
        );
        assert_eq!(
            find_entry_into_edge_on_face([1.0, 3.0, -1.0], noise, [20.0, 40.0, 10.0]),
            (15.0, [0.5, 0.0, 0.5])
        );
        assert_eq!(
            find_entry_into_edge_on_face([0.0, 0.0, 2.0], noise, [7.0, 5.0, 1.0]),
            (5.0, [0.0, 1.0, 0.0])
        );
    }

    /// Protects: the crossing that stands for the hit of an edge-on face lies so near the ray that
    /// the ray passes any box of the crossing, padded by 2⁻²³ of the face's greatest extent. The
    /// faces are barely edge-on and as long as wide, and the ray passes a corner.
    #[test]
    fn crossings_of_faces_edge_on_are_within_the_padding() {
        let state = &mut 11;
        let mut unit = || (next(state) >> 11) as f64 * f64::EPSILON / 2.0;
        for case in 0..20_000 {
            // The greatest component is the first; the two others are zero, equal to it, or random.
            let mut component = |kind: u32| match kind {
                0 => 0.0,
                1 => 1.0,
                _ => unit(),
            };
            let direction = DVec3::new(1.0, component(case % 3), component(case / 3 % 3));
            let steepness = direction.normalize().x;
            let size = 2.999 * EDGE_ON_RATIO / steepness;
            let (share, nearest) = (unit(), unit());
            let corners = [
                [-share * size, -size, nearest],
                [0.0, 0.0, nearest + 1.0],
                [(1.0 - share) * size, -size, nearest + unit()],
            ];
            let corners = corners.map(|[a, b, along]| {
                let (a, b) = if case % 2 == 0 { (a, b) } else { (b, a) };
                direction.normalize() * along + DVec3::new(0.0, a, b)
            });
            let ray = PreparedRay::new(Ray::<f64>::new(DVec3::ZERO, direction));
            let [a, b, c] = corners.map(|corner| ProjectedCorner::new(&ray, corner));
            let Some(hit) = intersect_projected_triangle(&ray, &a, &b, &c) else {
                continue;
            };
            let [v, w] = hit.weights;
            let crossing = corners[0] * (1.0 - v - w) + corners[1] * v + corners[2] * w;
            let extent = |axis: usize| {
                let [a, b, c] = corners.map(|corner| corner[axis]);
                a.max(b).max(c) - a.min(b).min(c)
            };
            let padding = extent(0).max(extent(1)).max(extent(2)) / 8_388_608.0;
            let displacement = |t: f64| (crossing - direction * t).abs().max_element();
            let (mut low, mut high) = (hit.t - 1e-6, hit.t + 1e-6);
            for _ in 0..100 {
                let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                if displacement(a) < displacement(b) {
                    high = b
                } else {
                    low = a
                }
            }
            assert!(
                displacement(low) <= padding,
                "{corners:?} {direction}: {} of {padding}",
                displacement(low)
            );
        }
    }

    /// Protects: the sign of a·b − c·d under any cancellation, and its value to a third, compared
    /// with 128-bit integers. The cases are equal products, products that differ in their last
    /// bits, and differences at the threshold between both formulas.
    #[test]
    fn p21_differences_of_products_are_those_of_whole_numbers() {
        let state = &mut 7;
        let (mut equal, mut close, mut rounded_away) = (0, 0, 0);
        for _ in 0..2_000_000 {
            let odd = |state: &mut u64, bits: u32| {
                (next(state) >> (64 - bits) | 1 | 1 << (bits - 1)) as i64
            };
            let bits = 24 + (next(state) % 29) as u32;
            let (x, y) = (odd(state, bits), odd(state, bits));
            // (x + m)(y − n) is close to x·y if m·y ≈ n·x: steps in a ratio of small integers, or
            // none.
            let step = (next(state) % 4) as i64;
            let other = (step as f64 * y as f64 / x as f64).round() as i64;
            let jitter = (next(state) % 3) as i64 - 1;
            let (c, d) = if next(state).is_multiple_of(8) {
                (y, x)
            } else {
                (x + step, y - other + jitter)
            };
            let exact = i128::from(x) * i128::from(y) - i128::from(c) * i128::from(d);
            let found = difference_of_products(x as f64, y as f64, c as f64, d as f64);
            assert_eq!(
                found.partial_cmp(&0.0),
                Some(exact.cmp(&0)),
                "{x}·{y} − {c}·{d} = {exact}, not {found}"
            );
            let wrong = (found - exact as f64).abs();
            assert!(
                wrong <= exact.unsigned_abs() as f64 * 0.34,
                "{x}·{y} − {c}·{d} = {exact}, not {found}"
            );
            let products = x as f64 * y as f64 - c as f64 * d as f64;
            equal += u32::from(exact == 0);
            rounded_away += u32::from(exact != 0 && products == 0.0);
            close +=
                u32::from(exact != 0 && products.abs() <= x as f64 * y as f64 * 8.0 * f64::EPSILON);
        }
        assert!(
            equal > 1000 && close > 1000 && rounded_away > 1000,
            "{equal} {close} {rounded_away}"
        );
    }
}
