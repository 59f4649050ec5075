//! Lanes of AVX2 and of AVX-512. AVX2 has eight f64 in two registers. AVX-512 has eight f64 in one
//! register, and eight f32 in a register of 256 bits.
//!
//! Unsafe code here is of two kinds:
//!
//! - *Instructions*: a value of type [`Avx2`] or [`Avx512`] proves that the processor has the
//!   instructions. Its methods use no others.
//! - *Memory*: only arrays of exactly the right length are read.
#![expect(
    unsafe_code,
    reason = "intrinsics of the processor; each block states why it is sound"
)]

use core::arch::x86_64::*;

use super::{Simd, WIDTH};

/// Proof that the processor has AVX2, FMA and the extensions that accompany them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// Returns the token without a test.
    ///
    /// # Safety
    /// The processor must have the instructions.
    pub const unsafe fn new_unchecked() -> Self {
        Self(())
    }

    pub fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }
}

/// Proof that the processor has AVX-512 at all vector lengths, besides AVX2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512(Avx2);

impl Avx512 {
    /// Returns the token without a test.
    ///
    /// # Safety
    /// The processor must have the instructions.
    pub const unsafe fn new_unchecked() -> Self {
        Self(Avx2(()))
    }

    pub fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        if has { Avx2::detect().map(Self) } else { None }
    }
}

/// Defines operations of [`Simd`], each by an expression of intrinsics.
macro_rules! operations {
    ($(fn $name:ident($($argument:ident: $kind:ty),*) -> $out:ty { $body:expr })*) => { $(
        #[inline(always)]
        fn $name(self, $($argument: $kind),*) -> $out {
            // SAFETY: `self` proves that the processor has the instructions, and arrays have all
            // numbers that are read.
            unsafe { $body }
        }
    )* };
}

type F = __m256;

/// Defines the f32 operations of both instruction sets, by AVX2 and FMA.
macro_rules! floats {
    () => {
        type Floats = F;

        operations! {
            fn splat(value: f32) -> F { _mm256_set1_ps(value) }
            fn load(values: &[f32; WIDTH]) -> F { _mm256_loadu_ps(values.as_ptr()) }
            fn to_array(a: F) -> [f32; WIDTH] { core::mem::transmute::<F, [f32; WIDTH]>(a) }
            fn add(a: F, b: F) -> F { _mm256_add_ps(a, b) }
            fn sub(a: F, b: F) -> F { _mm256_sub_ps(a, b) }
            fn mul(a: F, b: F) -> F { _mm256_mul_ps(a, b) }
            fn div(a: F, b: F) -> F { _mm256_div_ps(a, b) }
            fn sqrt(a: F) -> F { _mm256_sqrt_ps(a) }
            fn trunc(a: F) -> F { _mm256_cvtepi32_ps(_mm256_cvttps_epi32(a)) }
            fn mul_add(a: F, b: F, c: F) -> F { _mm256_fmadd_ps(a, b, c) }
            fn mul_sub(a: F, b: F, c: F) -> F { _mm256_fmsub_ps(a, b, c) }
            fn max(a: F, b: F) -> F { _mm256_max_ps(a, b) }
            fn min(a: F, b: F) -> F { _mm256_min_ps(a, b) }
            fn abs(a: F) -> F { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
            fn negate(a: F) -> F { _mm256_xor_ps(_mm256_set1_ps(-0.0), a) }
            fn flip_signs(a: F, b: F) -> F { _mm256_xor_ps(a, _mm256_and_ps(_mm256_set1_ps(-0.0), b)) }
            fn select_less(pair: [F; 2], yes: F, no: F) -> F { _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_LT_OQ>(pair[0], pair[1])) }
            // Only the low three bits of an index are read.
            fn lookup(table: &[f32; WIDTH], index: F) -> F {
                _mm256_permutevar8x32_ps(_mm256_loadu_ps(table.as_ptr()), _mm256_cvttps_epi32(index))
            }
        }
    };
}

type D2 = [__m256d; 2];

impl Simd for Avx2 {
    type Doubles = D2;

    floats!();

    operations! {
        fn less(a: F, b: F) -> u32 { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u32 }
        fn at_most(a: F, b: F) -> u32 { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
        // The comparison sets the sign bit of each lane whose mask bit is set; the blend selects by
        // that sign.
        fn select(mask: u32, unset: F, set: F) -> F {{
            let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let chosen = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bits), bits);
            _mm256_blendv_ps(unset, set, _mm256_castsi256_ps(chosen))
        }}

        fn splat_f64(value: f64) -> D2 { [_mm256_set1_pd(value); 2] }
        fn load_f64(v: &[f64; WIDTH]) -> D2 { [_mm256_loadu_pd(v.as_ptr()), _mm256_loadu_pd(v.as_ptr().add(4))] }
        fn to_array_f64(a: D2) -> [f64; WIDTH] { core::mem::transmute::<D2, [f64; WIDTH]>(a) }
        fn widen(v: &[f32; WIDTH]) -> D2 {
            [_mm256_cvtps_pd(_mm_loadu_ps(v.as_ptr())), _mm256_cvtps_pd(_mm_loadu_ps(v.as_ptr().add(4)))]
        }
        fn narrow(a: D2) -> F { _mm256_set_m128(_mm256_cvtpd_ps(a[1]), _mm256_cvtpd_ps(a[0])) }
        fn add_f64(a: D2, b: D2) -> D2 { [_mm256_add_pd(a[0], b[0]), _mm256_add_pd(a[1], b[1])] }
        fn sub_f64(a: D2, b: D2) -> D2 { [_mm256_sub_pd(a[0], b[0]), _mm256_sub_pd(a[1], b[1])] }
        fn mul_f64(a: D2, b: D2) -> D2 { [_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1])] }
        fn div_f64(a: D2, b: D2) -> D2 { [_mm256_div_pd(a[0], b[0]), _mm256_div_pd(a[1], b[1])] }
        fn sqrt_f64(a: D2) -> D2 { [_mm256_sqrt_pd(a[0]), _mm256_sqrt_pd(a[1])] }
        fn max_f64(a: D2, b: D2) -> D2 { [_mm256_max_pd(a[0], b[0]), _mm256_max_pd(a[1], b[1])] }
        fn min_f64(a: D2, b: D2) -> D2 { [_mm256_min_pd(a[0], b[0]), _mm256_min_pd(a[1], b[1])] }
        fn abs_f64(a: D2) -> D2 { [_mm256_andnot_pd(_mm256_set1_pd(-0.0), a[0]), _mm256_andnot_pd(_mm256_set1_pd(-0.0), a[1])] }
        fn greater_f64(a: D2, b: D2) -> u32 { sign_mask(_mm256_cmp_pd::<_CMP_GT_OQ>(a[0], b[0]), _mm256_cmp_pd::<_CMP_GT_OQ>(a[1], b[1])) }
        fn at_least_f64(a: D2, b: D2) -> u32 { sign_mask(_mm256_cmp_pd::<_CMP_GE_OQ>(a[0], b[0]), _mm256_cmp_pd::<_CMP_GE_OQ>(a[1], b[1])) }
        fn select_at_most_f64(pair: [D2; 2], yes: D2, no: D2) -> D2 {
            [
                _mm256_blendv_pd(no[0], yes[0], _mm256_cmp_pd::<_CMP_LE_OQ>(pair[0][0], pair[1][0])),
                _mm256_blendv_pd(no[1], yes[1], _mm256_cmp_pd::<_CMP_LE_OQ>(pair[0][1], pair[1][1])),
            ]
        }
    }
}

/// Returns the mask of the negative numbers among eight f64, by their sign bits.
#[inline]
#[target_feature(enable = "avx")]
fn sign_mask(low: __m256d, high: __m256d) -> u32 {
    _mm256_movemask_pd(low) as u32 | (_mm256_movemask_pd(high) as u32) << 4
}

type D = __m512d;

impl Simd for Avx512 {
    type Doubles = D;

    floats!();

    operations! {
        fn less(a: F, b: F) -> u32 { u32::from(_mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, b)) }
        fn at_most(a: F, b: F) -> u32 { u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b)) }
        fn select(mask: u32, unset: F, set: F) -> F { _mm256_mask_blend_ps(mask as u8, unset, set) }

        fn splat_f64(value: f64) -> D { _mm512_set1_pd(value) }
        fn load_f64(values: &[f64; WIDTH]) -> D { _mm512_loadu_pd(values.as_ptr()) }
        fn to_array_f64(a: D) -> [f64; WIDTH] { core::mem::transmute::<D, [f64; WIDTH]>(a) }
        fn widen(values: &[f32; WIDTH]) -> D { _mm512_cvtps_pd(_mm256_loadu_ps(values.as_ptr())) }
        fn narrow(a: D) -> F { _mm512_cvtpd_ps(a) }
        fn add_f64(a: D, b: D) -> D { _mm512_add_pd(a, b) }
        fn sub_f64(a: D, b: D) -> D { _mm512_sub_pd(a, b) }
        fn mul_f64(a: D, b: D) -> D { _mm512_mul_pd(a, b) }
        fn div_f64(a: D, b: D) -> D { _mm512_div_pd(a, b) }
        fn sqrt_f64(a: D) -> D { _mm512_sqrt_pd(a) }
        fn max_f64(a: D, b: D) -> D { _mm512_max_pd(a, b) }
        fn min_f64(a: D, b: D) -> D { _mm512_min_pd(a, b) }
        fn abs_f64(a: D) -> D { _mm512_abs_pd(a) }
        fn greater_f64(a: D, b: D) -> u32 { u32::from(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(a, b)) }
        fn at_least_f64(a: D, b: D) -> u32 { u32::from(_mm512_cmp_pd_mask::<_CMP_GE_OQ>(a, b)) }
        fn select_at_most_f64(pair: [D; 2], yes: D, no: D) -> D { _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(pair[0], pair[1]), no, yes) }
    }
}
