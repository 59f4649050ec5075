//! Barriers against compiler optimisations that slow the traversal: vectorisation of a few scalars,
//! and copies of fields in registers that the traversal needs.
#![expect(
    unsafe_code,
    reason = "instructions of no bytes; each block says why it may"
)]

/// Returns the number unchanged, in its register. Without this barrier, the compiler combines three
/// or four adjacent scalars into a vector. The packing costs as many instructions as it saves, and
/// a read of one scalar waits for all of them.
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

/// Returns the reference unchanged, and hides from the compiler what it points to. So fields are
/// read from memory where they are used, instead of being kept in registers or spilled to the stack
/// as vectors.
#[inline(always)]
pub(super) fn keep_in_memory<T>(place: &T) -> &T {
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
