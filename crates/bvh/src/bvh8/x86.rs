//! The kernels of AVX2 and AVX-512: eight lanes of f32 in one register, and four exact tests at once in f64.
//!
//! Here, in what this uses, in `processor.rs` and in `memory.rs` is the only unsafe code of the project, here of three kinds. *Instructions*: a token of
//! type [`Avx2`] or [`Avx512`] exists only where the processor was seen to have them, and methods of a token use no others. *Memory*:
//! loads and stores go through pointers made from arrays of just that many numbers. *The stack*: its room is written before it is read.
#![expect(unsafe_code, reason = "intrinsics of the processor; each block says why it may")]

mod exact;

use core::arch::x86_64::*;

use super::flat::{blocks, rows};
use super::gathered::gathered;
use super::packet::{self, PacketResult, PacketState, PacketVisitor};
use super::projected_ray::{ProjectedRay, TriangleHit, Unsure};
use super::row::RayF64;
use super::stack::{Stack, Waiting};
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traversal_simd::{TraversalSimd, settled};
use super::traverse::{HitVisitor, traverse};
use super::triangle8::Triangle8;
use super::{Bvh8, Child, WIDTH};
use crate::math::simd::{Avx2, Avx512};
use crate::shapes::PreparedRay;

/// Entries of a set of instructions: methods of its token, each of which calls a function that is compiled for them.
macro_rules! entries {
    ($token:ident, $features:literal: $(
        $(#[doc = $about:literal])*
        $visibility:vis fn $name:ident<$G:ident: $Bound:ident>($s:ident $(, $argument:ident: $kind:ty)*) { $body:expr } -> $out:ty;
    )*) => { $(
        $(#[doc = $about])*
        #[inline(always)]
        #[allow(clippy::too_many_arguments, reason = "in registers")]
        $visibility fn $name<$G: $Bound>(self $(, $argument: $kind)*) -> $out {
            #[inline(never)]
            #[target_feature(enable = $features)]
            #[allow(clippy::too_many_arguments, reason = "in registers")]
            fn enter<$G: $Bound>($s: $token $(, $argument: $kind)*) -> $out {
                $body
            }
            // SAFETY: `self` exists, so the processor has what the function needs.
            unsafe { enter(self $(, $argument)*) }
        }
    )* };
}

/// What a query asks of the whole tree.
macro_rules! traversals {
    ($token:ident, $features:literal) => {
        entries! { $token, $features:
            /// The walk with these instructions.
            pub(super) fn walk<A: HitVisitor>(
                s, bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, near: f32, answer: &mut A
            ) { traverse::<_, _, false>(s, bvh, &TraversalRay::new([ox, oy, oz], [dx, dy, dz], near), None, answer) } -> bool;
            /// The same for a ray in the space of an instance.
            pub(super) fn walk_mapped<A: HitVisitor>(s, bvh: &Bvh8, setup: &TraversalRay, probe: PreparedRay, answer: &mut A) {
                traverse::<_, _, true>(s, bvh, setup, Some(&probe), answer)
            } -> bool;
            /// The rows that every query tests.
            pub(super) fn rows<A: HitVisitor>(
                s, bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, answer: &mut A
            ) { rows(s, bvh, &RayF64::new([ox, oy, oz], [dx, dy, dz]), answer) } -> bool;
            /// The same for a ray in the space of an instance.
            pub(super) fn rows_mapped<A: HitVisitor>(s, bvh: &Bvh8, line: &RayF64, answer: &mut A) { rows(s, bvh, line, answer) } -> bool;
            /// Blocks and the rest where there are no nodes.
            pub(super) fn blocks<A: HitVisitor>(s, bvh: &Bvh8, aim: &LeafRay, probe: Option<&PreparedRay>, answer: &mut A) {
                blocks(s, bvh, aim, probe, answer)
            } -> bool;
            /// Rays from one point.
            pub(super) fn pencil<M: PacketVisitor>(s, bvh: &Bvh8, pencil: &mut PacketState, meets: &mut M) {
                packet::walk(s, bvh, pencil, meets)
            } -> PacketResult;
        }
    };
}

/// What a traversal asks of a leaf, apart from it, whose registers that would take.
macro_rules! leaves {
    ($token:ident, $features:literal) => {
        entries! { $token, $features:
            fn settle<A: HitVisitor>(
                s, block: &Triangle8, at: [usize; 2], aim: &LeafRay, probe: Option<&PreparedRay>, answer: &mut A
            ) { settled(s, block, at, aim, probe, answer) } -> bool;
            fn gathered<A: HitVisitor>(
                s, bvh: &Bvh8, leaf: Child, aim: &LeafRay, probe: Option<&PreparedRay>, line: &mut Option<RayF64>, answer: &mut A
            ) { gathered(s, bvh, leaf, aim, probe, line, answer) } -> bool;
        }
    };
}

impl Avx2 {
    traversals!(Avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
}

impl Avx512 {
    traversals!(Avx512, "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt");
}

/// What both have in common.
macro_rules! of_both {
    () => {
        #[inline(always)]
        fn prefetch<T>(self, place: *const T) {
            // SAFETY: a prefetch reads nothing that the program sees, whatever the place.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(place.cast()) }
        }
        #[inline(always)]
        fn crossing(self, block: &Triangle8, lane: usize, sight: &ProjectedRay) -> Result<Option<TriangleHit>, Unsure> {
            // SAFETY: `self` says that the processor has AVX2.
            unsafe { exact::crossing(block, lane, sight) }
        }
    };
}

impl TraversalSimd for Avx2 {
    of_both!();

    leaves!(Avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
}

impl TraversalSimd for Avx512 {
    of_both!();

    leaves!(Avx512, "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt");

    #[inline(always)]
    fn two(self, children: &[Child; WIDTH], entries: __m256, mask: u32) -> [Waiting; 2] {
        // SAFETY: `self` says that the processor has AVX-512F and VL and AVX2.
        unsafe {
            let first = _mm256_castsi256_si128(pack(children, entries, mask)[0]);
            [Waiting(_mm_cvtsi128_si64(first) as u64), Waiting(_mm_extract_epi64::<1>(first) as u64)]
        }
    }
    #[inline(always)]
    fn push(self, stack: &mut Stack, top: usize, children: &[Child; WIDTH], entries: __m256, mask: u32) -> usize {
        let room = stack.eight(top);
        // SAFETY: `self` says that the processor has AVX-512F and VL and AVX2. `Waiting` is a transparent u64; there is room for eight
        // entries, all of which are written, four at a time.
        unsafe {
            let ([low, high], place) = (pack(children, entries, mask), room.as_mut_ptr().cast::<__m256i>());
            let (first, last) = (_mm256_permute2x128_si256::<0x20>(low, high), _mm256_permute2x128_si256::<0x31>(low, high));
            _mm256_storeu_si256(place, first);
            _mm256_storeu_si256(place.add(1), last);
        }
        top + mask.count_ones() as usize
    }
    #[inline(always)]
    fn push_sorted(self, stack: &mut Stack, base: usize, children: &[Child; WIDTH], entries: __m256, mask: u32) -> usize {
        if mask.count_ones() > 4 {
            let top = self.push(stack, base, children, entries, mask);
            // SAFETY: they were just written.
            unsafe { stack.sort(base, top) };
            return top;
        }
        let room = stack.eight(base);
        // SAFETY: `self` says that the processor has AVX-512F and VL and AVX2. `Waiting` is a transparent u64, and there is room for eight
        // entries, the first four of which are written.
        unsafe {
            let [low, high] = pack(children, entries, mask);
            let four = _mm256_permute2x128_si256::<0x20>(low, high);
            _mm256_storeu_si256(room.as_mut_ptr().cast::<__m256i>(), falling(four));
        }
        base + mask.count_ones() as usize
    }
}

/// Four numbers, the greatest first: by a network, since which of the children of a node are nearer no predictor can guess.
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx2")]
fn falling(four: __m256i) -> __m256i {
    let four = ordered::<0b1010>(four, _mm256_shuffle_epi32::<0b01_00_11_10>(four));
    let four = ordered::<0b1100>(four, _mm256_permute4x64_epi64::<0b01_00_11_10>(four));
    ordered::<0b0100>(four, _mm256_permute4x64_epi64::<0b11_01_10_00>(four))
}

/// Of each lane and its partner the lesser one where a bit is set, the greater one elsewhere.
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx2")]
fn ordered<const LESSER: u8>(four: __m256i, partners: __m256i) -> __m256i {
    _mm256_mask_min_epu64(_mm256_max_epu64(four, partners), LESSER, four, partners)
}

/// The children of a mask with their distances as the stack has them: the first, the second, the fifth and the sixth in one register, the
/// others in the second. At 256 bits, since some processors run all vectors slower while there are wider ones.
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx2")]
fn pack(children: &[Child; WIDTH], entries: __m256, mask: u32) -> [__m256i; 2] {
    // SAFETY: there are eight children to read, each a transparent u32, at any address.
    let children = unsafe { _mm256_loadu_si256(children.as_ptr().cast()) };
    let children = _mm256_maskz_compress_epi32(mask as u8, children);
    let distances = _mm256_maskz_compress_epi32(mask as u8, _mm256_castps_si256(entries));
    [_mm256_unpacklo_epi32(children, distances), _mm256_unpackhi_epi32(children, distances)]
}

#[cfg(test)]
mod tests;
