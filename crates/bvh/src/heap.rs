//! A global allocator that counts the bytes that the program holds, and limits them. An allocation
//! may be refused where no code checks for failure, in this project or in another crate. The
//! allocator then calls a handler, which can print a message before the program ends.
#![expect(
    unsafe_code,
    reason = "the allocator trait is unsafe; every call passes its arguments unchanged to the system allocator"
)]

use core::alloc::{GlobalAlloc, Layout};
use core::cell::Cell;
use core::sync::atomic::{AtomicUsize, Ordering};
use std::alloc::System;
use std::sync::OnceLock;

/// The system allocator with a count of the held bytes and the limit of [`limit_heap`]. Programs
/// install it with `#[global_allocator]`. With any other allocator, the library works without a
/// limit.
#[derive(Clone, Copy, Debug, Default)]
pub struct CountingHeap;

/// Bytes that the program holds now, and their limit.
static HELD_BYTES: AtomicUsize = AtomicUsize::new(0);
static LIMIT: AtomicUsize = AtomicUsize::new(usize::MAX);

/// Handler that ends the program. It is called for a refused allocation outside
/// [`allocate_fallibly`].
static REFUSAL_HANDLER: OnceLock<fn(AllocationRefusal) -> !> = OnceLock::new();

thread_local! {
    /// Whether this thread is running code of [`allocate_fallibly`], or the refusal handler. A
    /// refused allocation then returns null.
    static FALLIBLE: Cell<bool> = const { Cell::new(false) };
}

/// Reason for a refused allocation: the limit of [`limit_heap`], or the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AllocationRefusal {
    /// The program would exceed the limit of [`limit_heap`].
    Limit,
    /// The system can't provide the memory.
    System {
        /// Requested bytes.
        bytes: usize,
    },
}

/// Sets the limit of the program's memory to `bytes` more than the program holds now; `None`
/// removes the limit.
pub fn limit_heap(bytes: Option<u64>) {
    let more = bytes.map_or(usize::MAX, |bytes| {
        usize::try_from(bytes).unwrap_or(usize::MAX)
    });
    LIMIT.store(
        HELD_BYTES.load(Ordering::Relaxed).saturating_add(more),
        Ordering::Relaxed,
    );
}

/// Returns how many further bytes the limit of [`limit_heap`] allows; without a limit, more than
/// any system has.
pub fn remaining_heap_bytes() -> u64 {
    let held = HELD_BYTES.load(Ordering::Relaxed);
    LIMIT.load(Ordering::Relaxed).saturating_sub(held) as u64
}

/// Sets the handler for refused allocations outside [`allocate_fallibly`]. Only the first call has
/// an effect. Without a handler the program aborts. Allocations of the handler itself have no
/// limit.
pub fn set_heap_refusal_handler(end: fn(AllocationRefusal) -> !) {
    // Only the first handler is kept.
    let _ = REFUSAL_HANDLER.set(end);
}

/// Runs code that checks for failed allocations itself, such as by `try_reserve`. Within it a
/// refused allocation returns null, and the handler of [`set_heap_refusal_handler`] is not called.
pub fn allocate_fallibly<T>(allocate: impl FnOnce() -> T) -> T {
    let before = FALLIBLE.replace(true);
    let out = allocate();
    FALLIBLE.set(before);
    out
}

/// Adds `bytes` to the count of held bytes, if the sum is within the limit. Returns whether it is.
fn claim_bytes(bytes: usize) -> bool {
    let before = HELD_BYTES.fetch_add(bytes, Ordering::Relaxed);
    let is_allowed = before.saturating_add(bytes) <= LIMIT.load(Ordering::Relaxed);
    if !is_allowed {
        release_bytes(bytes);
    }
    is_allowed
}

/// Subtracts `bytes` from the count of held bytes.
fn release_bytes(bytes: usize) {
    HELD_BYTES.fetch_sub(bytes, Ordering::Relaxed);
}

/// Calls the refusal handler, which ends the program. Returns null in code of
/// [`allocate_fallibly`], or without a handler.
fn refuse_allocation(refusal: AllocationRefusal) -> *mut u8 {
    // The thread-local variable of an ending thread no longer exists.
    let is_fallible = FALLIBLE
        .try_with(|fallible| fallible.replace(true))
        .unwrap_or(true);
    if let Some(end) = REFUSAL_HANDLER.get().filter(|_| !is_fallible) {
        limit_heap(None);
        end(refusal);
    }
    let _ = FALLIBLE.try_with(|fallible| fallible.set(is_fallible));
    core::ptr::null_mut()
}

/// Runs `allocate`, a call of the system allocator that adds `bytes` to the held bytes, if the
/// limit allows.
fn allocate_counted(bytes: usize, allocate: impl FnOnce() -> *mut u8) -> *mut u8 {
    if !claim_bytes(bytes) {
        return refuse_allocation(AllocationRefusal::Limit);
    }
    let place = allocate();
    if place.is_null() {
        release_bytes(bytes);
        return refuse_allocation(AllocationRefusal::System { bytes });
    }
    place
}

// SAFETY: every block comes from the system allocator, called with unchanged arguments. A null
// pointer means failure, as the trait requires, and a block that could not grow is unchanged.
// Nothing here unwinds, and counting allocates nothing.
unsafe impl GlobalAlloc for CountingHeap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise about the layout is the promise that the system allocator
        // requires.
        allocate_counted(layout.size(), || unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        allocate_counted(layout.size(), || unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: the block came from the system allocator, with this layout.
        unsafe { System.dealloc(place, layout) };
        release_bytes(layout.size());
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the block came from the system allocator, with this layout, and the caller's
        // promise about the size is passed on.
        let place = allocate_counted(size.saturating_sub(layout.size()), || unsafe {
            System.realloc(place, layout, size)
        });
        if !place.is_null() {
            release_bytes(layout.size().saturating_sub(size));
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: every allocation and deallocation method counts its bytes. Code that checks for
    /// failures gets null above the limit, and a block that could not grow keeps its contents.
    #[test]
    fn what_is_held_is_counted_and_limited() {
        let heap = CountingHeap;
        let layout = Layout::from_size_align(1000, 8).expect("a layout");
        let held = || HELD_BYTES.load(Ordering::Relaxed);
        // The allocator under test is not the global allocator of the tests, so it counts nothing
        // else.
        assert_eq!(held(), 0);
        allocate_fallibly(|| {
            // SAFETY: the layouts are not empty, and each block is freed with its own layout.
            unsafe {
                let place = heap.alloc_zeroed(layout);
                assert!(!place.is_null() && *place == 0 && held() == 1000);
                limit_heap(Some(500));
                assert_eq!(remaining_heap_bytes(), 500);
                assert!(core::hint::black_box(heap.alloc(layout)).is_null() && held() == 1000);
                place.write(7);
                assert!(
                    heap.realloc(place, layout, 1501).is_null() && held() == 1000 && *place == 7
                );
                let place = heap.realloc(place, layout, 1500);
                assert!(!place.is_null() && held() == 1500 && *place == 7);
                let grown = Layout::from_size_align(1500, 8).expect("a layout");
                let place = heap.realloc(place, grown, 100);
                assert!(held() == 100);
                heap.dealloc(place, Layout::from_size_align(100, 8).expect("a layout"));
                limit_heap(None);
                let vast = Layout::from_size_align(isize::MAX as usize - 7, 8).expect("a layout");
                // Hidden from the compiler, which would remove an unused allocation and assume its
                // success.
                assert!(core::hint::black_box(heap.alloc(vast)).is_null());
            }
        });
        assert_eq!(held(), 0);
    }
}
