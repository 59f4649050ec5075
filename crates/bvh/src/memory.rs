//! Large arrays on large pages: a ray's way through hundreds of megabytes reads places far apart,
//! and with pages of four kilobytes nearly each of them is looked up in the system's tables before
//! it is read.
#![expect(
    unsafe_code,
    reason = "advice to the system about an array's memory; the block says why it changes nothing"
)]

use core::mem::MaybeUninit;

/// Arrays of fewer bytes stay as they are: that is two large pages, the first of which an array
/// rarely begins with.
const LEAST: usize = 4 << 20;

/// An empty list with room for so many, on large pages where they are many and the system has such:
/// for what is written once and read from all over. It is a list like any other, wherever the
/// advice is not taken.
pub fn huge_page_vec<T>(capacity: usize) -> Vec<T> {
    let mut list = Vec::with_capacity(capacity);
    advise(list.spare_capacity_mut());
    list
}

/// The same with so many of one value in it.
pub(crate) fn filled<T: Clone>(count: usize, value: T) -> Vec<T> {
    let mut list = huge_page_vec(count);
    list.resize(count, value);
    list
}

/// Asks for large pages below some memory that has not been written yet.
fn advise<T>(room: &mut [MaybeUninit<T>]) {
    if size_of_val(room) < LEAST {
        return;
    }
    #[cfg(target_os = "linux")]
    {
        use rustix::mm::{Advice, madvise};
        /// Of a large page. Those of smaller size that it is made of begin where it begins.
        const PAGE: usize = 2 << 20;
        let start = room.as_mut_ptr().cast::<u8>();
        let before = start.align_offset(PAGE);
        let bytes = size_of_val(room).saturating_sub(before) / PAGE * PAGE;
        // SAFETY: the bytes from there on lie within the array, which is borrowed alone. This
        // advice never changes what is read there. A system that does not take it says so, and
        // nothing depends on it.
        let _ = unsafe {
            madvise(
                start.add(before.min(size_of_val(room))).cast(),
                bytes,
                Advice::LinuxHugepage,
            )
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a list has the room that was asked for, whatever it is of and however large, and
    /// holds what is put there.
    #[test]
    fn lists_have_room_for_what_is_put_there() {
        for count in [0, 1, LEAST / 8 - 1, LEAST / 8, LEAST] {
            let mut list: Vec<u64> = huge_page_vec(count);
            assert!(list.is_empty() && list.capacity() >= count);
            let place = list.as_ptr();
            list.extend(0..count as u64);
            assert!(list.as_ptr() == place && list.iter().copied().eq(0..count as u64));
        }
        assert_eq!(huge_page_vec::<()>(usize::MAX).capacity(), usize::MAX);
    }

    /// Protects: the system is asked for large pages below large arrays, for whole ones of the
    /// array's own, and not below small ones.
    #[cfg(target_os = "linux")]
    #[test]
    fn large_arrays_ask_for_large_pages() {
        // Which pages are asked for is told by the kernel, of each range of memory that is alike.
        let asked = |list: &[u64], at: usize| {
            let Ok(ranges) = std::fs::read_to_string("/proc/self/smaps") else {
                return None;
            };
            let (place, mut here) = (list.as_ptr() as usize + at, false);
            for line in ranges.lines() {
                let range = line
                    .split_once(' ')
                    .and_then(|(range, _)| range.split_once('-'));
                if let Some((Ok(start), Ok(end))) = range.map(|(start, end)| {
                    (
                        usize::from_str_radix(start, 16),
                        usize::from_str_radix(end, 16),
                    )
                }) {
                    here = (start..end).contains(&place);
                } else if here && line.starts_with("VmFlags:") {
                    return Some(line.split(' ').any(|flag| flag == "hg"));
                }
            }
            None
        };
        if !std::path::Path::new("/sys/kernel/mm/transparent_hugepage").exists() {
            return;
        }
        let large = filled(8 << 20, 0_u64);
        assert_ne!(asked(&large, 32 << 20), Some(false));
        // No page may be asked for that is not all of the array's: the last number mostly lies on
        // such a one.
        let ends_on_a_page = (large.as_ptr_range().end as usize).is_multiple_of(2 << 20);
        assert_ne!(
            asked(&large, size_of_val(large.as_slice()) - 8),
            Some(!ends_on_a_page)
        );
    }
}
