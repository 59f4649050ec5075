//! Barriers against compiler optimisations that slow the traversal: vectorisation of a few scalars,
//! copies of fields in registers that the traversal needs, and spilled registers across cache
//! lines.
#![expect(
    unsafe_code,
    reason = "empty inline assembly; each block states why it is sound"
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

/// Aligns the stack frame of the function into which this is inlined to cache lines. Registers as
/// wide as a line are spilled to the frame, which is otherwise aligned to 16 bytes. Whether each
/// spilled register then straddles two lines depends on the frames of all callers. A read of such a
/// register waits for both halves of its store.
#[inline(always)]
pub(crate) fn align_stack() {
    #[repr(align(64))]
    struct Line {
        _byte: u8,
    }
    // A variable: a constant expression would be placed in static memory.
    let line = Line { _byte: 0 };
    keep_in_memory(&line);
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
