//! What only an instruction of the processor's own says: that memory will be wanted soon.
#![expect(unsafe_code, reason = "an intrinsic of the processor; the block says why it may")]

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
