//! Barriers against compiler optimisations that would slow the traversal: automatic vectorisation
//! of a few scalars, and copies in registers that are needed elsewhere.
#![expect(
    unsafe_code,
    reason = "instructions of no bytes; each block says why it may"
)]

/// Returns the number unchanged, in its register. Without this barrier a compiler combines three or
/// four adjacent scalars into a vector. The packing costs as many instructions as it saves, and a
/// reader of one scalar waits for all.
#[inline(always)]
pub(crate) fn optimisation_barrier(value: f32) -> f32 {
    #[cfg(target_arch = "x86_64")]
    {
        let mut value = value;
        // SAFETY: nothing is executed.
        unsafe {
            core::arch::asm!("/* {0} */", inout(xmm_reg) value, options(pure, nomem, nostack, preserves_flags))
        };
        value
    }
    #[cfg(not(target_arch = "x86_64"))]
    core::hint::black_box(value)
}

/// Returns the reference unchanged, without the compiler's knowledge of its contents. So fields are
/// read when needed, as memory operands, instead of being kept in registers or spilled to the stack
/// as vectors.
#[inline(always)]
pub(super) fn in_memory<T>(place: &T) -> &T {
    #[cfg(target_arch = "x86_64")]
    {
        let mut place = core::ptr::from_ref(place);
        // SAFETY: no instruction is executed, so the pointer is unchanged.
        unsafe {
            core::arch::asm!("/* {0} */", inout(reg) place, options(nostack, preserves_flags));
            &*place
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    core::hint::black_box(place)
}
