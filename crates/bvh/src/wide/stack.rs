//! What a walk has still to visit: children with the distances at which the ray enters them.

use super::{Child, STACK, WIDTH};

/// A child with a distance, that one in the upper half: where no distance is below zero, whole numbers have the order of the
/// distances. Where some are, the order is another one, but no less right.
#[derive(Clone, Copy, Default)]
#[repr(transparent)]
pub(super) struct Waiting(pub u64);

impl Waiting {
    #[inline(always)]
    pub fn new(child: Child, entry: f32) -> Self {
        Self(u64::from(entry.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    pub fn child(self) -> Child {
        Child(self.0 as u32)
    }

    #[inline(always)]
    pub fn entry(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

/// A stack whose room is written before it is read, so that nothing has to be cleared for a ray.
pub(super) type Stack = arrayvec::ArrayVec<Waiting, STACK>;

/// The last entries, from `base` on, with the nearest on top.
#[inline(always)]
pub(super) fn sort(stack: &mut [Waiting], base: usize) {
    for place in base + 1..stack.len() {
        let entry = stack[place];
        let mut hole = place;
        while hole > base && stack[hole - 1].0 < entry.0 {
            stack[hole] = stack[hole - 1];
            hole -= 1;
        }
        stack[hole] = entry;
    }
}

/// Puts the children of a mask on the stack.
#[inline(always)]
pub(super) fn push(stack: &mut Stack, children: &[Child; WIDTH], entries: &[f32; WIDTH], mut mask: u32) {
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
        mask &= mask - 1;
        stack.push(Waiting::new(children[lane], entries[lane]));
    }
}
