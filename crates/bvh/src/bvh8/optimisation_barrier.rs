//! What the compiler is not to make of numbers: a vector of some, or copies of others in registers
//! that then have no room.
#![expect(
    unsafe_code,
    reason = "instructions of no bytes; each block says why it may"
)]

/// The same number, in the register where it is. A compiler that finds three or four numbers side
/// by side puts them into one vector by as many instructions as that spares, and what reads one of
/// them waits for all.
#[inline(always)]
pub(crate) fn opaque(value: f32) -> f32 {
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

/// The same place, of which nothing is known before: what is read from it is read when it is
/// needed, in the way of an instruction's operand, and not kept in a register or written to the
/// stack as a vector.
#[inline(always)]
pub(super) fn in_memory<T>(place: &T) -> &T {
    #[cfg(target_arch = "x86_64")]
    {
        let mut place = core::ptr::from_ref(place);
        // SAFETY: nothing is executed, so the place is the same.
        unsafe {
            core::arch::asm!("/* {0} */", inout(reg) place, options(nostack, preserves_flags));
            &*place
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    core::hint::black_box(place)
}
