//! Barriers against compiler optimisations that slow the traversal:
//!
//! - vectorisation of a few scalars,
//! - copies of fields in registers that the traversal needs,
//! - spills of registers across two cache lines.
#![expect(
    unsafe_code,
    reason = "empty inline assembly; each block states why it is sound"
)]

/// Returns the number unchanged, in its register. Without this barrier the compiler packs three or
/// four adjacent scalars into a vector. Packing costs as many instructions as it saves, and a read
/// of one scalar then waits for all of them.
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

/// Aligns a stack frame to cache lines: the frame of the function into which this function is
/// inlined. Otherwise the frame is aligned only to 16 bytes. Spilled registers are as wide as a
/// cache line. Depending on the callers' frames, each might straddle two lines, and a read of it
/// would wait for both halves of its store.
#[inline(always)]
pub(crate) fn align_stack() {
    #[repr(align(64))]
    struct CacheLine {
        _byte: u8,
    }
    // A variable: a constant expression would be placed in static memory.
    let line = CacheLine { _byte: 0 };
    keep_in_memory(&line);
}

/// Returns the reference unchanged. The compiler then no longer knows its target, so it reads each
/// field from memory where the field is used. Otherwise it would keep fields in registers, or spill
/// them to the stack as vectors.
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
