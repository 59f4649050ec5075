//! The traversal stack: children still to be visited, with their entry distances.
#![expect(
    unsafe_code,
    reason = "uninitialised entries, so that no ray clears the stack; each block states why it is sound"
)]

use core::mem::MaybeUninit;

use super::{ChildRef, MaskLanes, STACK_SIZE, WIDTH};

/// A stack entry: a child, with its entry distance in the upper half of the integer. Nonnegative
/// distances sort like integers. Negative distances do not, which costs time but no correctness.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct StackEntry(pub u64);

impl StackEntry {
    #[inline(always)]
    pub fn new(child: ChildRef, entry: f32) -> Self {
        Self(u64::from(entry.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    pub fn child(self) -> ChildRef {
        ChildRef(self.0 as u32)
    }

    #[inline(always)]
    pub fn entry_distance(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

/// Entries of the traversal stack. The traversal keeps their number in a register. If the number
/// were stored beside the entries, every step would wait for memory.
pub(super) struct TraversalStack([MaybeUninit<StackEntry>; STACK_SIZE]);

impl TraversalStack {
    #[inline(always)]
    pub fn new() -> Self {
        Self([MaybeUninit::uninit(); STACK_SIZE])
    }

    /// Writes the entry at an index.
    #[inline(always)]
    pub fn set_entry(&mut self, index: usize, stack_entry: StackEntry) {
        self.0[index].write(stack_entry);
    }

    /// Pops entries until an entry distance is at most `last`, and returns that child; `None` if no
    /// such entry is left.
    ///
    /// # Safety
    /// Every entry below `top` must have been written.
    #[inline(always)]
    pub unsafe fn pop(&self, top: &mut usize, last: f32) -> Option<ChildRef> {
        while *top > 0 {
            *top -= 1;
            // SAFETY: the caller guarantees that every entry below the top was written.
            let stack_entry = unsafe { self.0[*top].assume_init() };
            if stack_entry.entry_distance() <= last {
                return Some(stack_entry.child());
            }
        }
        None
    }

    /// Returns the storage for the eight entries of a node, possibly uninitialised.
    #[inline(always)]
    pub fn eight_entries(&mut self, index: usize) -> &mut [MaybeUninit<StackEntry>; WIDTH] {
        let Some(eight) = self.0[index..].first_chunk_mut() else {
            panic!(
                "a node is deeper in the tree than the traversal stack allows; trees are built at most 64 levels deep"
            )
        };
        eight
    }

    /// Writes the children whose bits are set in `mask` to the stack from index `base` on, sorted
    /// by insertion so that the nearest comes last. Returns the new top.
    #[inline(always)]
    pub fn push_sorted(
        &mut self,
        base: usize,
        children: &[ChildRef; WIDTH],
        entries: &[f32; WIDTH],
        mask: u32,
    ) -> usize {
        let (room, mut count) = (self.eight_entries(base), 0);
        for lane in MaskLanes(mask) {
            let stack_entry = StackEntry::new(children[lane], entries[lane]);
            let mut hole = count;
            while hole > 0 {
                // SAFETY: `hole` is at most `count`, below which every entry was written.
                let before = unsafe { room[(hole - 1) % WIDTH].assume_init() };
                if before.0 >= stack_entry.0 {
                    break;
                }
                room[hole % WIDTH].write(before);
                hole -= 1;
            }
            room[hole % WIDTH].write(stack_entry);
            count += 1;
        }
        base + count
    }

    /// Returns the children of the top two entries, the topmost last.
    ///
    /// # Safety
    /// Both entries must have been written.
    #[inline(always)]
    pub unsafe fn top_two_children(&self, top: usize) -> [ChildRef; 2] {
        let Some(two) = self.0[..top].last_chunk::<2>() else {
            panic!("the traversal stack has fewer than two entries")
        };
        // SAFETY: the caller guarantees that both were written.
        two.map(|waiting| unsafe { waiting.assume_init() }.child())
    }
}
