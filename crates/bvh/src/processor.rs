//! What depends on the processor that a program runs on: that memory will be wanted soon, and how wide its registers are.
#![expect(unsafe_code, reason = "instructions of the processor; each block says why it may")]

/// Arithmetic in plain loops over lists, of which a compiler makes as many numbers at a time as registers hold.
pub trait Loops {
    /// What comes of it.
    type Output;
    /// Does it. To be `#[inline(always)]`, with all that it calls in its loops: what is not inlined is compiled for every processor.
    fn run(self) -> Self::Output;
}

/// Does work with the widest registers that the processor has. The bits are those of [`Loops::run`] alone: nothing is fused, and each
/// number is computed as it would be by itself.
#[inline]
pub fn widest<L: Loops>(work: L) -> L::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("bmi2") {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw")
            {
                // SAFETY: the processor has what the function is compiled for.
                return unsafe { with_avx512(work) };
            }
            // SAFETY: as before.
            return unsafe { with_avx2(work) };
        }
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,bmi1,bmi2")]
fn with_avx512<L: Loops>(work: L) -> L::Output {
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2")]
fn with_avx2<L: Loops>(work: L) -> L::Output {
    work.run()
}

/// Has what lies at a place of a list brought near, so that reading it later does not wait for memory. It changes no result; beyond the
/// list's end, and where the processor has no such instruction, it does nothing.
#[inline(always)]
pub fn prefetch<T>(list: &[T], place: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(wanted) = list.get(place) {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has the instruction, and it reads nothing that the program could see.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(core::ptr::from_ref(wanted).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (list, place);
}
