//! The traversal stack: children still to be visited, with their entry distances.
#![expect(
    unsafe_code,
    reason = "uninitialised entries, so that no ray clears the stack; each block states why it is sound"
)]

use core::mem::MaybeUninit;

use super::{ChildRef, MaskLanes, STACK_SIZE, WIDTH};

/// A stack entry: the child in the lower half of the integer, its entry distance in the upper half.
/// Entries with nonnegative distances sort by distance like integers. Negative distances sort
/// wrongly, which makes the traversal slower but not incorrect.
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

/// Entries of the traversal stack. The traversal keeps the number of entries in a register. Beside
/// the entries in memory, that number would make every step wait.
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

    /// Pops entries until one has an entry distance of at most `last`. Returns the child of that
    /// entry; `None` if the stack becomes empty.
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

    /// Returns the storage for eight entries from `index` on, enough for all children of a node.
    /// The entries may be uninitialised.
    #[inline(always)]
    pub fn storage_of_node_entries(
        &mut self,
        index: usize,
    ) -> &mut [MaybeUninit<StackEntry>; WIDTH] {
        let Some(eight) = self.0[index..].first_chunk_mut() else {
            panic!(
                "internal error: a node is deeper in the tree than the 64 levels for which the traversal stack has entries; please report this"
            )
        };
        eight
    }

    /// Writes the children whose bits are set in `mask` to the stack, from index `base` on.
    /// Insertion sort orders them, the nearest last. Returns the new number of entries.
    #[inline(always)]
    pub fn push_sorted(
        &mut self,
        base: usize,
        children: &[ChildRef; WIDTH],
        entries: &[f32; WIDTH],
        mask: u32,
    ) -> usize {
        let (room, mut count) = (self.storage_of_node_entries(base), 0);
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

    /// Returns the children of the last two of `top` entries, the last one second.
    ///
    /// # Safety
    /// Both entries must have been written.
    #[inline(always)]
    pub unsafe fn top_two_children(&self, top: usize) -> [ChildRef; 2] {
        let Some(two) = self.0[..top].last_chunk::<2>() else {
            panic!(
                "internal error: two entries are read from a traversal stack that has fewer; please report this"
            )
        };
        // SAFETY: the caller guarantees that both were written.
        two.map(|waiting| unsafe { waiting.assume_init() }.child())
    }
}
