//! The exact test of triangles in four lanes of f64, by AVX2.

use core::arch::x86_64::*;

use super::super::WIDTH;
use super::super::block::Block;
use super::super::simd::Exact;
use crate::scalar::Robust;
use crate::shapes::{EDGE_ON, Probe};

/// Four lanes of a row in f64.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn four(row: &[f32; WIDTH], half: usize) -> __m256d {
    // SAFETY: there are four numbers to read from place 0 or 4 of eight.
    unsafe { _mm256_cvtps_pd(_mm_loadu_ps(row.as_ptr().add(4 * (half & 1)))) }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn put(row: &mut [f32; WIDTH], half: usize, values: __m256d) {
    // SAFETY: there is room for four numbers at place 0 or 4 of eight.
    unsafe { _mm_storeu_ps(row.as_mut_ptr().add(4 * (half & 1)), _mm256_cvtpd_ps(values)) }
}

/// x·a + y·b + z·c in the order of the scalar product, each operation rounded.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn dot(p: [__m256d; 3], d: glam::DVec3) -> __m256d {
    let x = _mm256_mul_pd(p[0], _mm256_set1_pd(d.x));
    let y = _mm256_mul_pd(p[1], _mm256_set1_pd(d.y));
    let z = _mm256_mul_pd(p[2], _mm256_set1_pd(d.z));
    _mm256_add_pd(_mm256_add_pd(x, y), z)
}

/// Below which a determinant is that of a triangle seen edge-on, by the operations of its test.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn edge_on([x, y, z]: [[__m256d; 3]; 3]) -> __m256d {
    let sign = _mm256_set1_pd(-0.0);
    let mut sizes = _mm256_andnot_pd(sign, x[0]);
    for one in [y[0], x[1], y[1], x[2], y[2]] {
        sizes = _mm256_add_pd(sizes, _mm256_andnot_pd(sign, one));
    }
    let most = _mm256_max_pd(_mm256_max_pd(z[0], z[1]), z[2]);
    let depth = _mm256_sub_pd(most, _mm256_min_pd(_mm256_min_pd(z[0], z[1]), z[2]));
    _mm256_mul_pd(_mm256_mul_pd(sizes, depth), _mm256_set1_pd(EDGE_ON))
}

/// The operations of [`crate::shapes::Triangle`]'s test in their order, four lanes at once. A lane in which rounding could have
/// taken the sign of an edge function goes through that test itself, as does one that is seen edge-on.
#[inline(never)]
#[target_feature(enable = "avx2,fma")]
pub(super) fn exact(block: &Block, lanes: u32, probe: &Probe<Robust>) -> Exact {
    let mut exact = Exact::NOTHING;
    let zero = _mm256_setzero_pd();
    let sign = _mm256_set1_pd(-0.0);
    let tiny = _mm256_set1_pd(f64::EPSILON * 0.5 * 8.0);
    let o = probe.origin;
    let origin = [_mm256_set1_pd(o.x), _mm256_set1_pd(o.y), _mm256_set1_pd(o.z)];
    for half in 0..2 {
        let asked = lanes >> (4 * half) & 15;
        if asked == 0 {
            continue;
        }
        let mut x = [zero; 3];
        let mut y = [zero; 3];
        let mut z = [zero; 3];
        for corner in 0..3 {
            let offset = [
                _mm256_sub_pd(four(&block.corners[0][corner], half), origin[0]),
                _mm256_sub_pd(four(&block.corners[1][corner], half), origin[1]),
                _mm256_sub_pd(four(&block.corners[2][corner], half), origin[2]),
            ];
            x[corner] = dot(offset, probe.across[0]);
            y[corner] = dot(offset, probe.across[1]);
            z[corner] = dot(offset, probe.direction);
        }
        let products = [_mm256_mul_pd(x[2], y[1]), _mm256_mul_pd(x[0], y[2]), _mm256_mul_pd(x[1], y[0])];
        let u = _mm256_sub_pd(products[0], _mm256_mul_pd(y[2], x[1]));
        let v = _mm256_sub_pd(products[1], _mm256_mul_pd(y[0], x[2]));
        let w = _mm256_sub_pd(products[2], _mm256_mul_pd(y[1], x[0]));
        let mut unsure = zero;
        let (mut below, mut above) = (zero, zero);
        for (edge, product) in [u, v, w].into_iter().zip(products) {
            let (size, enough) = (_mm256_andnot_pd(sign, edge), _mm256_mul_pd(_mm256_andnot_pd(sign, product), tiny));
            unsure = _mm256_or_pd(unsure, _mm256_cmp_pd::<_CMP_NGE_UQ>(size, enough));
            below = _mm256_or_pd(below, _mm256_cmp_pd::<_CMP_LT_OQ>(edge, zero));
            above = _mm256_or_pd(above, _mm256_cmp_pd::<_CMP_GT_OQ>(edge, zero));
        }
        let determinant = _mm256_add_pd(_mm256_add_pd(u, v), w);
        let size = _mm256_andnot_pd(sign, determinant);
        unsure = _mm256_or_pd(unsure, _mm256_cmp_pd::<_CMP_NGE_UQ>(size, edge_on([x, y, z])));
        let seen = _mm256_cmp_pd::<_CMP_GT_OQ>(_mm256_andnot_pd(sign, determinant), zero);
        let hits = _mm256_andnot_pd(_mm256_and_pd(below, above), seen);
        let inverse = _mm256_div_pd(_mm256_set1_pd(1.0), determinant);
        let (u, v, w) = (_mm256_mul_pd(u, inverse), _mm256_mul_pd(v, inverse), _mm256_mul_pd(w, inverse));
        let along = _mm256_add_pd(_mm256_mul_pd(z[0], u), _mm256_mul_pd(z[1], v));
        let along = _mm256_add_pd(along, _mm256_mul_pd(z[2], w));
        put(&mut exact.t, half, _mm256_mul_pd(along, _mm256_set1_pd(probe.inverse_length_squared)));
        put(&mut exact.weights[0], half, v);
        put(&mut exact.weights[1], half, w);
        let outside = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(determinant, zero)) as u32;
        exact.hits |= ((_mm256_movemask_pd(hits) as u32 & asked) << (4 * half)) as u8;
        exact.from_outside |= (outside << (4 * half)) as u8;
        let mut unsure = _mm256_movemask_pd(unsure) as u32 & asked;
        while unsure != 0 {
            exact.test(block, 4 * half + unsure.trailing_zeros() as usize, probe);
            unsure &= unsure - 1;
        }
    }
    exact
}
