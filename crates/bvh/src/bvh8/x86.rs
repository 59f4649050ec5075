//! Traversal operations in AVX2 and AVX-512.
//!
//! All unsafe code of the project lies in this crate: in `math/simd`, `processor.rs`, `memory.rs`
//! and `heap.rs`, and in the modules `x86`, `kernel`, `stack`, `traverse`, `packet` and
//! `optimisation_barrier` of `bvh8`. This module has three kinds of unsafe code:
//!
//! - *Instructions*: a token of type [`Avx2`] or [`Avx512`] proves that the processor has the
//!   instructions. Methods of a token use no others.
//! - *Memory*: loads and stores use pointers to arrays of exactly the right length.
//! - *The stack*: entries are written before they are read.
#![expect(
    unsafe_code,
    reason = "intrinsics of the processor; each block states why it is sound"
)]

mod exact;

use core::arch::x86_64::*;

use super::kernel::{define_entry_points, define_leaf_tests};
use super::leaf::{intersect_sphere_leaf, intersect_triangles};
use super::projected_ray::{ProjectedRay, UncertainSign};
use super::query::{HitVisitor, TraversalMode, TraversalQuery};
use super::stack::{StackEntry, TraversalStack};
use super::traversal_ray::LeafRay;
use super::traversal_simd::TraversalSimd;
use super::triangle8::Triangle8;
use super::{Bvh8, ChildRef, WIDTH};
use crate::math::simd::{Avx2, Avx512, Simd};
use crate::shapes::{PreparedRay, TriangleHit};

impl TraversalSimd for Avx2 {
    define_leaf_tests!(
        Avx2,
        target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt"),
        exact::intersect_triangle_in_lane
    );
}

impl TraversalSimd for Avx512 {
    define_leaf_tests!(
        Avx512,
        target_feature(
            enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
        ),
        exact::intersect_triangle_in_lane
    );

    #[inline(always)]
    fn two_stack_entries(
        self,
        children: &[ChildRef; WIDTH],
        entries: __m256,
        mask: u32,
    ) -> [StackEntry; 2] {
        // SAFETY: `self` proves that the processor has AVX-512F and VL and AVX2.
        unsafe {
            let first = _mm256_castsi256_si128(pack_children(children, entries, mask)[0]);
            [
                StackEntry(_mm_cvtsi128_si64(first) as u64),
                StackEntry(_mm_extract_epi64::<1>(first) as u64),
            ]
        }
    }
    #[inline(always)]
    fn push_children(
        self,
        stack: &mut TraversalStack,
        top: usize,
        children: &[ChildRef; WIDTH],
        entries: __m256,
        mask: u32,
    ) -> usize {
        let room = stack.storage_of_node_entries(top);
        // SAFETY: `self` proves that the processor has AVX-512F and VL and AVX2. `StackEntry` is a
        // transparent u64. The slice has room for eight entries, all of which are written, four at
        // a time.
        unsafe {
            let ([low, high], place) = (
                pack_children(children, entries, mask),
                room.as_mut_ptr().cast::<__m256i>(),
            );
            let (first, last) = (
                _mm256_permute2x128_si256::<0x20>(low, high),
                _mm256_permute2x128_si256::<0x31>(low, high),
            );
            _mm256_storeu_si256(place, first);
            _mm256_storeu_si256(place.add(1), last);
        }
        top + mask.count_ones() as usize
    }
    #[inline(always)]
    fn push_children_sorted(
        self,
        stack: &mut TraversalStack,
        base: usize,
        children: &[ChildRef; WIDTH],
        entries: __m256,
        mask: u32,
    ) -> usize {
        if mask.count_ones() > 4 {
            return stack.push_sorted(base, children, &self.to_array(entries), mask);
        }
        let room = stack.storage_of_node_entries(base);
        // SAFETY: `self` proves that the processor has AVX-512F and VL and AVX2. `StackEntry` is a
        // transparent u64. The slice has room for eight entries, the first four of which are
        // written.
        unsafe {
            let [low, high] = pack_children(children, entries, mask);
            let four = _mm256_permute2x128_si256::<0x20>(low, high);
            _mm256_storeu_si256(room.as_mut_ptr().cast::<__m256i>(), sort_descending(four));
        }
        base + mask.count_ones() as usize
    }
}

/// Sorts four integers in descending order by a sorting network, which has no branches. Branches
/// would often be mispredicted, since the order of a node's children is unpredictable.
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx2")]
fn sort_descending(four: __m256i) -> __m256i {
    let four = min_max_with_partner::<0b1010>(four, _mm256_shuffle_epi32::<0b01_00_11_10>(four));
    let four =
        min_max_with_partner::<0b1100>(four, _mm256_permute4x64_epi64::<0b01_00_11_10>(four));
    min_max_with_partner::<0b0100>(four, _mm256_permute4x64_epi64::<0b11_01_10_00>(four))
}

/// Returns, in each lane, the minimum or the maximum of the numbers that `four` and `partners` have
/// in that lane. The minimum is selected by the lane's bit in `LESSER`.
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx2")]
fn min_max_with_partner<const LESSER: u8>(four: __m256i, partners: __m256i) -> __m256i {
    _mm256_mask_min_epu64(_mm256_max_epu64(four, partners), LESSER, four, partners)
}

/// Packs the children whose bits are set in `mask`, with their entry distances, into stack entries.
/// One register holds the first, second, fifth and sixth of these children, the other register the
/// remaining ones. Both have 256 bits, since some processors lower their clock for wider vectors.
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx2")]
fn pack_children(children: &[ChildRef; WIDTH], entries: __m256, mask: u32) -> [__m256i; 2] {
    // SAFETY: eight children are read, each a transparent u32, at any alignment.
    let children = unsafe { _mm256_loadu_si256(children.as_ptr().cast()) };
    let children = _mm256_maskz_compress_epi32(mask as u8, children);
    let distances = _mm256_maskz_compress_epi32(mask as u8, _mm256_castps_si256(entries));
    [
        _mm256_unpacklo_epi32(children, distances),
        _mm256_unpackhi_epi32(children, distances),
    ]
}

#[cfg(test)]
mod tests;
