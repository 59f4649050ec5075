//! A heap that counts what the whole program holds and keeps it below a limit: an array that nobody
//! asks about beforehand, of ours or of another crate, is refused with a message too, and no
//! refusal aborts the program.
#![expect(
    unsafe_code,
    reason = "an allocator is unsafe by its trait; every call goes to the system's with the arguments as they came"
)]

use core::alloc::{GlobalAlloc, Layout};
use core::cell::Cell;
use core::sync::atomic::{AtomicUsize, Ordering};
use std::alloc::System;
use std::sync::OnceLock;

/// The system's heap, counted. A program makes it its own with `#[global_allocator]`; libraries
/// work on any heap.
#[derive(Clone, Copy, Debug, Default)]
pub struct CountingHeap;

/// Bytes that are held, and the most that may be.
static HELD: AtomicUsize = AtomicUsize::new(0);
static LIMIT: AtomicUsize = AtomicUsize::new(usize::MAX);

/// Who ends the program where memory is refused.
static REFUSAL: OnceLock<fn(Refusal) -> !> = OnceLock::new();

thread_local! {
    /// Whether whoever allocates looks at whether there is memory, or is already ending the
    /// program.
    static FALLIBLE: Cell<bool> = const { Cell::new(false) };
}

/// Why memory is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The program would hold more than [`limit_heap`] allows.
    Limit,
    /// The system does not give so many bytes.
    System {
        /// What was asked for.
        bytes: usize,
    },
}

/// Lets the program hold so many bytes more than now; none: as many as the system gives.
pub fn limit_heap(bytes: Option<u64>) {
    let more = bytes.map_or(usize::MAX, |bytes| {
        usize::try_from(bytes).unwrap_or(usize::MAX)
    });
    LIMIT.store(
        HELD.load(Ordering::Relaxed).saturating_add(more),
        Ordering::Relaxed,
    );
}

/// Says once who ends the program where memory is refused that nobody looks out for. Without it the
/// program aborts. What it allocates itself has no limit.
pub fn on_heap_refusal(end: fn(Refusal) -> !) {
    // The first one stays.
    let _ = REFUSAL.set(end);
}

/// Asks for memory with a look at whether it was given: a refusal is the caller's to tell.
pub fn allocate_fallibly<T>(allocate: impl FnOnce() -> T) -> T {
    let before = FALLIBLE.replace(true);
    let out = allocate();
    FALLIBLE.set(before);
    out
}

/// Counts so many bytes more, if they are allowed.
fn claim(bytes: usize) -> bool {
    let before = HELD.fetch_add(bytes, Ordering::Relaxed);
    let is_allowed = before.saturating_add(bytes) <= LIMIT.load(Ordering::Relaxed);
    if !is_allowed {
        release(bytes);
    }
    is_allowed
}

fn release(bytes: usize) {
    HELD.fetch_sub(bytes, Ordering::Relaxed);
}

/// Ends the program, or leaves that to whoever looks at the pointer that is null.
fn refuse(refusal: Refusal) -> *mut u8 {
    // A thread that ends has no such variable any more.
    let is_fallible = FALLIBLE
        .try_with(|fallible| fallible.replace(true))
        .unwrap_or(true);
    if let Some(end) = REFUSAL.get().filter(|_| !is_fallible) {
        limit_heap(None);
        end(refusal);
    }
    let _ = FALLIBLE.try_with(|fallible| fallible.set(is_fallible));
    core::ptr::null_mut()
}

/// Allocates so many bytes more by a call of the system's allocator.
fn counted(bytes: usize, allocate: impl FnOnce() -> *mut u8) -> *mut u8 {
    if !claim(bytes) {
        return refuse(Refusal::Limit);
    }
    let place = allocate();
    if place.is_null() {
        release(bytes);
        return refuse(Refusal::System { bytes });
    }
    place
}

// SAFETY: every block is the system allocator's, which is called with the arguments as they came; a
// null pointer says that there is none, as the trait has it, and a block that could not grow is as
// it was. Nothing here unwinds, and counting allocates nothing.
unsafe impl GlobalAlloc for CountingHeap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise about the layout is the one that the system's allocator asks
        // for.
        counted(layout.size(), || unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        counted(layout.size(), || unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: the block came from the system's allocator, with this layout.
        unsafe { System.dealloc(place, layout) };
        release(layout.size());
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the block came from the system's allocator, with this layout, and the caller's
        // promise about the size is the same.
        let place = counted(size.saturating_sub(layout.size()), || unsafe {
            System.realloc(place, layout, size)
        });
        if !place.is_null() {
            release(layout.size().saturating_sub(size));
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: what is held is counted through every way to get and give back memory, and what is
    /// above the limit is refused to whoever looks, with the block that was to grow as it was.
    #[test]
    fn what_is_held_is_counted_and_limited() {
        let heap = CountingHeap;
        let layout = Layout::from_size_align(1000, 8).expect("a layout");
        let held = || HELD.load(Ordering::Relaxed);
        // This heap is not the tests' own: nobody else is counted.
        assert_eq!(held(), 0);
        allocate_fallibly(|| {
            // SAFETY: the layouts are not empty; blocks are given back with the layout that they
            // have.
            unsafe {
                let place = heap.alloc_zeroed(layout);
                assert!(!place.is_null() && *place == 0 && held() == 1000);
                limit_heap(Some(500));
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
                // Out of sight of the compiler, which leaves out a block that nobody uses and takes
                // it for given.
                assert!(core::hint::black_box(heap.alloc(vast)).is_null());
            }
        });
        assert_eq!(held(), 0);
    }
}
