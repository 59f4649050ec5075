//! What a walk has still to visit: children with the distances at which the ray enters them.
#![expect(unsafe_code, reason = "room for entries that nothing has to clear for a ray; each block says why it may")]

use core::mem::MaybeUninit;

use super::{Child, STACK, WIDTH};

/// A child with a distance, that one in the upper half: where no distance is below zero, whole numbers have the order of the
/// distances. Where some are, the order is another one, but no less right.
#[derive(Clone, Copy)]
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

/// The two entries of a mask of two bits.
#[inline(always)]
pub(super) fn two(children: &[Child; WIDTH], entries: &[f32; WIDTH], mask: u32) -> [Waiting; 2] {
    let (a, b) = (mask.trailing_zeros() as usize & 7, (mask & mask.wrapping_sub(1)).trailing_zeros() as usize & 7);
    [Waiting::new(children[a], entries[a]), Waiting::new(children[b], entries[b])]
}

/// Room for a stack. How many entries are in use is the walk's to know: beside the entries it would stay in memory, and
/// every step would wait for it.
pub(super) struct Stack([MaybeUninit<Waiting>; STACK]);

impl Stack {
    #[inline(always)]
    pub fn new() -> Self {
        Self([MaybeUninit::uninit(); STACK])
    }

    /// Writes an entry.
    #[inline(always)]
    pub fn set(&mut self, place: usize, waiting: Waiting) {
        self.0[place].write(waiting);
    }

    /// Reads an entry.
    ///
    /// # Safety
    /// It was written.
    #[inline(always)]
    pub unsafe fn get(&self, place: usize) -> Waiting {
        // SAFETY: the caller says that it was written.
        unsafe { self.0[place].assume_init() }
    }

    /// Room for the eight entries of a node, written or not.
    #[inline(always)]
    pub fn eight(&mut self, place: usize) -> &mut [MaybeUninit<Waiting>; WIDTH] {
        let Some(eight) = self.0[place..].first_chunk_mut() else { panic!("the builder keeps to the depth") };
        eight
    }

    /// Sorts the entries from `base` up to `top`, the nearest last.
    ///
    /// # Safety
    /// They were written.
    #[inline(always)]
    pub unsafe fn sort(&mut self, base: usize, top: usize) {
        for place in base + 1..top {
            // SAFETY: `place` is below `top`.
            let entry = unsafe { self.get(place) };
            let mut hole = place;
            while hole > base {
                // SAFETY: `hole` is above `base` and at most `place`.
                let before = unsafe { self.get(hole - 1) };
                if before.0 >= entry.0 {
                    break;
                }
                self.set(hole, before);
                hole -= 1;
            }
            self.set(hole, entry);
        }
    }

    /// Writes the children of a mask from `top` on. Returns the new top.
    #[inline(always)]
    pub fn push(&mut self, mut top: usize, children: &[Child; WIDTH], entries: &[f32; WIDTH], mut mask: u32) -> usize {
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
            mask &= mask - 1;
            self.set(top, Waiting::new(children[lane], entries[lane]));
            top += 1;
        }
        top
    }
}
