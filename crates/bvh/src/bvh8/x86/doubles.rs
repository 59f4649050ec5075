//! Eight lanes of f64 by AVX2, in two registers, and by AVX-512 in one.

use core::arch::x86_64::*;

use super::super::WIDTH;
use super::super::doubles::Doubles;
use super::{Avx2, Avx512};

impl Doubles for Avx2 {
    type Doubles = [__m256d; 2];

    #[inline(always)]
    fn spread(self, value: f64) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_set1_pd(value); 2] }
    }
    #[inline(always)]
    fn widen(self, values: &[f32; WIDTH]) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX, and there are four numbers to read from places 0 and 4 of eight.
        unsafe { [_mm256_cvtps_pd(_mm_loadu_ps(values.as_ptr())), _mm256_cvtps_pd(_mm_loadu_ps(values.as_ptr().add(4)))] }
    }
    #[inline(always)]
    fn take(self, values: &[f64; WIDTH]) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX, and there are four numbers to read from places 0 and 4 of eight.
        unsafe { [_mm256_loadu_pd(values.as_ptr()), _mm256_loadu_pd(values.as_ptr().add(4))] }
    }
    #[inline(always)]
    fn size(self, a: Self::Doubles) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_andnot_pd(_mm256_set1_pd(-0.0), a[0]), _mm256_andnot_pd(_mm256_set1_pd(-0.0), a[1])] }
    }
    #[inline(always)]
    fn greatest(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_max_pd(a[0], b[0]), _mm256_max_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn least(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_min_pd(a[0], b[0]), _mm256_min_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn plus(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_add_pd(a[0], b[0]), _mm256_add_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn minus(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_sub_pd(a[0], b[0]), _mm256_sub_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn times(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn over(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_div_pd(a[0], b[0]), _mm256_div_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn root(self, a: Self::Doubles) -> Self::Doubles {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { [_mm256_sqrt_pd(a[0]), _mm256_sqrt_pd(a[1])] }
    }
    #[inline(always)]
    fn above(self, a: Self::Doubles, b: Self::Doubles) -> u32 {
        // SAFETY: `self` says that the processor has AVX.
        unsafe {
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(a[0], b[0])) as u32;
            low | (_mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(a[1], b[1])) as u32) << 4
        }
    }
    #[inline(always)]
    fn at_least(self, a: Self::Doubles, b: Self::Doubles) -> u32 {
        // SAFETY: `self` says that the processor has AVX.
        unsafe {
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GE_OQ>(a[0], b[0])) as u32;
            low | (_mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GE_OQ>(a[1], b[1])) as u32) << 4
        }
    }
    #[inline(always)]
    fn narrow(self, a: Self::Doubles) -> Self::Floats {
        // SAFETY: `self` says that the processor has AVX.
        unsafe { _mm256_set_m128(_mm256_cvtpd_ps(a[1]), _mm256_cvtpd_ps(a[0])) }
    }
    #[inline(always)]
    fn chosen(self, mask: u32, unset: Self::Floats, set: Self::Floats) -> Self::Floats {
        // SAFETY: `self` says that the processor has AVX2. A lane whose bit is set in the mask has its sign bit set after the
        // comparison, by which the blend chooses.
        unsafe {
            let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let chosen = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bits), bits);
            _mm256_blendv_ps(unset, set, _mm256_castsi256_ps(chosen))
        }
    }
    #[inline(always)]
    fn row(self, a: Self::Floats) -> [f32; WIDTH] {
        row(a)
    }
}

impl Doubles for Avx512 {
    type Doubles = __m512d;

    #[inline(always)]
    fn spread(self, value: f64) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_set1_pd(value) }
    }
    #[inline(always)]
    fn widen(self, values: &[f32; WIDTH]) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F, and there are eight numbers to read, at any address.
        unsafe { _mm512_cvtps_pd(_mm256_loadu_ps(values.as_ptr())) }
    }
    #[inline(always)]
    fn take(self, values: &[f64; WIDTH]) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F, and there are eight numbers to read, at any address.
        unsafe { _mm512_loadu_pd(values.as_ptr()) }
    }
    #[inline(always)]
    fn size(self, a: __m512d) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_abs_pd(a) }
    }
    #[inline(always)]
    fn greatest(self, a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_max_pd(a, b) }
    }
    #[inline(always)]
    fn least(self, a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_min_pd(a, b) }
    }
    #[inline(always)]
    fn plus(self, a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_add_pd(a, b) }
    }
    #[inline(always)]
    fn minus(self, a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_sub_pd(a, b) }
    }
    #[inline(always)]
    fn times(self, a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_mul_pd(a, b) }
    }
    #[inline(always)]
    fn over(self, a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_div_pd(a, b) }
    }
    #[inline(always)]
    fn root(self, a: __m512d) -> __m512d {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_sqrt_pd(a) }
    }
    #[inline(always)]
    fn above(self, a: __m512d, b: __m512d) -> u32 {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(a, b)) }
    }
    #[inline(always)]
    fn at_least(self, a: __m512d, b: __m512d) -> u32 {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_GE_OQ>(a, b)) }
    }
    #[inline(always)]
    fn narrow(self, a: __m512d) -> Self::Floats {
        // SAFETY: `self` says that the processor has AVX-512F.
        unsafe { _mm512_cvtpd_ps(a) }
    }
    #[inline(always)]
    fn chosen(self, mask: u32, unset: Self::Floats, set: Self::Floats) -> Self::Floats {
        // SAFETY: `self` says that the processor has AVX-512F and VL.
        unsafe { _mm256_mask_blend_ps(mask as u8, unset, set) }
    }
    #[inline(always)]
    fn row(self, a: Self::Floats) -> [f32; WIDTH] {
        row(a)
    }
}

/// The numbers of all lanes.
#[inline(always)]
fn row(a: __m256) -> [f32; WIDTH] {
    // SAFETY: eight numbers of f32 are what such a register is.
    unsafe { core::mem::transmute(a) }
}
