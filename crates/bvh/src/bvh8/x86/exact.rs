//! The exact triangle test in AVX2, with the three corners side by side in f64.

use core::arch::x86_64::*;

use super::super::WIDTH;
use super::super::projected_ray::{ProjectedRay, UncertainSign, rotate_axes};
use super::super::triangle8::Triangle8;
use crate::shapes::{EDGE_ON_RATIO, TriangleHit};

/// Mask of the three lanes that hold corners.
const CORNERS: i32 = 7;
/// Factor on the bound for edge-on triangles, since its sums have another order here than in the
/// single-triangle test.
const SLACK: f64 = 1.0 + 1e-9;
/// Permutations of lanes: each lane gets the corner two places after its own, or the next corner.
const AFTER_NEXT: i32 = 0b11_01_00_10;
const NEXT: i32 = 0b11_00_10_01;

/// Copies the lanes of the three corners to an array.
///
/// # Safety
/// The processor must have AVX.
#[inline(always)]
unsafe fn to_array(v: __m256d) -> [f64; 3] {
    // SAFETY: the caller guarantees that the processor has AVX.
    unsafe {
        let (low, high) = (_mm256_castpd256_pd128(v), _mm256_extractf128_pd::<1>(v));
        [
            _mm_cvtsd_f64(low),
            _mm_cvtsd_f64(_mm_unpackhi_pd(low, low)),
            _mm_cvtsd_f64(high),
        ]
    }
}

#[inline(always)]
fn max_of_three([a, b, c]: [f64; 3]) -> f64 {
    let greater = if a > b { a } else { b };
    if greater > c { greater } else { c }
}

/// Intersects the triangle in a lane by the operations of [`crate::shapes::Triangle`]'s test, each
/// with the same result. Only the sums of a projected coordinate differ: their terms have another
/// order, without the term that is zero. So only the sign of a zero can differ, and if an edge
/// function is zero the single-triangle test decides. It also decides if rounding could change the
/// sign of an edge function, and if the triangle is edge-on.
///
/// # Safety
/// The processor must have AVX2. The function lacks that target feature so that it is inlined into
/// functions with it: the result of a call would be returned in memory.
#[inline(always)]
pub(super) unsafe fn intersect_triangle_in_lane(
    block: &Triangle8,
    lane: usize,
    projected_ray: &ProjectedRay,
) -> Result<Option<TriangleHit>, UncertainSign> {
    let lane = lane & (WIDTH - 1);
    // SAFETY: the caller guarantees that the processor has AVX2. No pointer is read.
    unsafe {
        let mut offset = [_mm256_setzero_pd(); 3];
        for ((offset, [a, b, c]), &origin) in offset
            .iter_mut()
            .zip(&block.corners)
            .zip(&projected_ray.origin)
        {
            let corners = _mm256_cvtps_pd(_mm_set_ps(0.0, c[lane], b[lane], a[lane]));
            *offset = _mm256_sub_pd(corners, _mm256_set1_pd(origin));
        }
        let [dx, dy, dz] = projected_ray.direction;
        let z = _mm256_add_pd(
            _mm256_add_pd(
                _mm256_mul_pd(offset[0], _mm256_set1_pd(dx)),
                _mm256_mul_pd(offset[1], _mm256_set1_pd(dy)),
            ),
            _mm256_mul_pd(offset[2], _mm256_set1_pd(dz)),
        );
        let (p, q, r) = rotate_axes(offset, projected_ray.major);
        let [a, b, c, d] = projected_ray.projection;
        let x = _mm256_add_pd(
            _mm256_mul_pd(q, _mm256_set1_pd(a)),
            _mm256_mul_pd(p, _mm256_set1_pd(b)),
        );
        let y = _mm256_add_pd(
            _mm256_mul_pd(r, _mm256_set1_pd(c)),
            _mm256_mul_pd(p, _mm256_set1_pd(d)),
        );
        let product = _mm256_mul_pd(
            _mm256_permute4x64_pd::<AFTER_NEXT>(x),
            _mm256_permute4x64_pd::<NEXT>(y),
        );
        let other = _mm256_mul_pd(
            _mm256_permute4x64_pd::<AFTER_NEXT>(y),
            _mm256_permute4x64_pd::<NEXT>(x),
        );
        let edges = _mm256_sub_pd(product, other);
        let sign = _mm256_set1_pd(-0.0);
        let enough = _mm256_mul_pd(
            _mm256_andnot_pd(sign, product),
            _mm256_set1_pd(f64::EPSILON * 0.5 * 8.0),
        );
        let sure = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(
            _mm256_andnot_pd(sign, edges),
            enough,
        )) & CORNERS;
        let below = _mm256_movemask_pd(edges);
        if below & sure != 0 && !below & sure != 0 {
            return Ok(None);
        }
        let [u, v, w] = to_array(edges);
        let determinant = u + v + w;
        let [za, zb, zc] = to_array(z);
        let [sa, sb, sc] = to_array(_mm256_add_pd(
            _mm256_andnot_pd(sign, x),
            _mm256_andnot_pd(sign, y),
        ));
        let depth = max_of_three([za, zb, zc]) + max_of_three([-za, -zb, -zc]);
        let told = determinant.abs() > (sa + sb + sc) * depth * (EDGE_ON_RATIO * SLACK);
        if sure != CORNERS || !told {
            return Err(UncertainSign);
        }
        let inverse = 1.0 / determinant;
        let (u, v, w) = (u * inverse, v * inverse, w * inverse);
        let along = za * u + zb * v + zc * w;
        let t = (along * projected_ray.inverse_length_squared) as f32;
        Ok(Some(TriangleHit {
            t,
            weights: [v as f32, w as f32],
            from_outside: determinant > 0.0,
        }))
    }
}
