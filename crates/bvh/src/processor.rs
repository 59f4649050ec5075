//! Use of the processor's features at run time: prefetch instructions, and loops in its widest SIMD
//! registers.
#![expect(
    unsafe_code,
    reason = "instructions of the processor; each block states why it is sound"
)]

#[cfg(target_arch = "x86_64")]
use core::sync::atomic::{AtomicU8, Ordering};

#[cfg(target_arch = "x86_64")]
use crate::bvh8::align_stack;
use crate::math::lanes::SimdFloats;
#[cfg(target_arch = "x86_64")]
use crate::math::simd::{Avx2, Avx512};
use crate::math::simd::{Portable, Simd};

/// Arithmetic in plain loops over arrays, which the compiler vectorises for each instruction set.
pub trait SimdTask {
    /// Result of the arithmetic.
    type Output;
    /// Runs the loops. The implementation, and every function that the loops call, must be
    /// `#[inline(always)]`: code that is not inlined is compiled for the baseline processor.
    fn run(self) -> Self::Output;
}

/// Runs a task with the widest registers of the processor. The results have the same bits as a
/// direct call of [`SimdTask::run`]: no product is fused with a sum, and each number is computed
/// independently.
#[inline]
pub fn run_widest<L: SimdTask>(work: L) -> L::Output {
    #[cfg(target_arch = "x86_64")]
    match RegisterWidth::of_processor() {
        // SAFETY: the processor has the features that the function is compiled for.
        RegisterWidth::Avx512 => return unsafe { run_with_avx512(work) },
        // SAFETY: as before.
        RegisterWidth::Avx2 => return unsafe { run_with_avx2(work) },
        RegisterWidth::Baseline => {}
    }
    work.run()
}

/// Arithmetic on numbers in SIMD lanes, which is compiled for each instruction set.
pub trait LaneTask {
    /// Result of the arithmetic.
    type Output;
    /// Computes the result. `zero` holds a zero in each lane. The implementation, and every function that it
    /// calls, must be `#[inline(always)]`, and closures are not inlined reliably: code that is not
    /// inlined is compiled for the baseline processor.
    fn run<S: Simd>(self, zero: SimdFloats<S>) -> Self::Output;
}

/// A task with the token of its instruction set.
struct TaskWithSimd<T, S>(T, S);

impl<T: LaneTask, S: Simd> SimdTask for TaskWithSimd<T, S> {
    type Output = T::Output;
    #[inline(always)]
    fn run(self) -> T::Output {
        self.0.run(SimdFloats::splat(self.1, 0.0))
    }
}

/// Runs a task with the widest registers of the processor.
#[inline]
pub fn run_in_lanes<T: LaneTask>(work: T) -> T::Output {
    run_in_lanes_of(RegisterWidth::Avx512, work)
}

/// Runs a task with registers of at most a width, as far as the processor has them. The results have
/// the same bits for each width.
#[inline]
pub fn run_in_lanes_of<T: LaneTask>(width: RegisterWidth, work: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    match width.min(RegisterWidth::of_processor()) {
        RegisterWidth::Avx512 => {
            // SAFETY: the processor has the features.
            return unsafe { run_with_avx512(TaskWithSimd(work, Avx512::new_unchecked())) };
        }
        RegisterWidth::Avx2 => {
            // SAFETY: as before.
            return unsafe { run_with_avx2(TaskWithSimd(work, Avx2::new_unchecked())) };
        }
        RegisterWidth::Baseline => {}
    }
    let _ = width;
    TaskWithSimd(work, Portable).run()
}

/// Registers for tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum RegisterWidth {
    /// Those that every processor of the target has.
    Baseline = 1,
    /// AVX2.
    Avx2,
    /// AVX-512 at all vector lengths.
    Avx512,
}

#[cfg(target_arch = "x86_64")]
impl RegisterWidth {
    /// Returns the width that was found at the first call. Each of the ten features would take a
    /// test at every call, a twentieth of a short task.
    #[inline(always)]
    fn of_processor() -> Self {
        static FOUND: AtomicU8 = AtomicU8::new(0);
        match FOUND.load(Ordering::Relaxed) {
            1 => Self::Baseline,
            2 => Self::Avx2,
            3 => Self::Avx512,
            _ => {
                let found = Self::detect();
                FOUND.store(found as u8, Ordering::Relaxed);
                found
            }
        }
    }

    #[cold]
    fn detect() -> Self {
        if Avx512::detect().is_some() {
            Self::Avx512
        } else if Avx2::detect().is_some() {
            Self::Avx2
        } else {
            Self::Baseline
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,bmi1,bmi2")]
fn run_with_avx512<L: SimdTask>(work: L) -> L::Output {
    align_stack();
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2")]
fn run_with_avx2<L: SimdTask>(work: L) -> L::Output {
    align_stack();
    work.run()
}

/// Prefetches an element of a list, so that a later read does not wait for memory. Does nothing for
/// an index beyond the list's end, and on processors without the instruction.
#[inline(always)]
pub fn prefetch<T>(list: &[T], index: usize) {
    if let Some(element) = list.get(index) {
        prefetch_line(element);
    }
}

/// Prefetches the cache line at an address, which may be invalid.
#[inline(always)]
pub(crate) fn prefetch_line<T>(place: *const T) {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has the instruction, and its effect is invisible to the
        // program.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(place.cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = place;
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sums<'a>(&'a [f32; 64], &'a [f32; 64]);

    impl SimdTask for Sums<'_> {
        type Output = [f32; 64];
        #[inline(always)]
        fn run(self) -> [f32; 64] {
            core::array::from_fn(|i| (self.0[i] * self.1[i] + self.0[63 - i]).sqrt() / self.1[i])
        }
    }

    /// Protects: wide registers give the bits of scalar code, since no product is fused with a sum,
    /// and no root or quotient is approximate.
    #[test]
    fn wide_registers_change_no_bit() {
        let mut differs = 0;
        for turn in 0..100_u32 {
            let value_of = |k: u32, i: usize| {
                f32::from_bits(
                    0x3f80_0000 | (turn * 64 + i as u32 + k).wrapping_mul(0x9e37_79b9) >> 9,
                )
            };
            let (a, b) = (
                core::array::from_fn(|i| value_of(0, i)),
                core::array::from_fn(|i| value_of(7777, i)),
            );
            let (found, alone) = (run_widest(Sums(&a, &b)), Sums(&a, &b).run());
            assert_eq!(found.map(f32::to_bits), alone.map(f32::to_bits));
            let exact = |i: usize| {
                ((f64::from(a[i]) * f64::from(b[i]) + f64::from(a[63 - i])) as f32).sqrt() / b[i]
            };
            differs += (0..64)
                .filter(|&i| exact(i).to_bits() != alone[i].to_bits())
                .count();
        }
        assert!(
            differs > 500,
            "only {differs} values change if products are fused, too few for this test"
        );
    }

    /// Protects: prefetching beyond the end, or in an empty list, is harmless.
    #[test]
    fn what_is_not_there_may_be_asked_for() {
        prefetch(&[1, 2, 3], 2);
        prefetch(&[1, 2, 3], usize::MAX);
        prefetch::<u8>(&[], 0);
        prefetch(&[()], 0);
    }
}
