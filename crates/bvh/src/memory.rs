//! Large arrays on huge pages. A traversal reads scattered addresses in hundreds of megabytes. With
//! pages of four kilobytes, nearly every read would also have to look up the page table.
#![expect(
    unsafe_code,
    reason = "advice to the system about an array's memory; the block states why no contents change"
)]

use core::mem::MaybeUninit;

/// Least size, in bytes, of an array on huge pages. It is two huge pages, since an array rarely
/// starts at the boundary of a page.
const MIN_BYTES: usize = 4 << 20;

/// Creates an empty `Vec` with the given capacity. If it is large, the system is advised to use
/// huge pages. Such memory suits data that is written once and read at random. On a system without
/// huge pages it is an ordinary `Vec`.
pub fn huge_page_vec<T>(capacity: usize) -> Vec<T> {
    let mut list = Vec::with_capacity(capacity);
    advise_huge_pages(list.spare_capacity_mut());
    list
}

/// Creates the `Vec` of [`huge_page_vec`], filled with `count` copies of `value`.
pub(crate) fn filled_huge_page_vec<T: Clone>(count: usize, value: T) -> Vec<T> {
    let mut list = huge_page_vec(count);
    list.resize(count, value);
    list
}

/// Advises the system to use huge pages for memory that has not been written yet.
fn advise_huge_pages<T>(room: &mut [MaybeUninit<T>]) {
    if size_of_val(room) < MIN_BYTES {
        return;
    }
    #[cfg(target_os = "linux")]
    {
        use rustix::mm::{Advice, madvise};
        /// Size of a huge page. An address aligned to it is aligned for smaller huge pages too.
        const PAGE: usize = 2 << 20;
        let start = room.as_mut_ptr().cast::<u8>();
        let before = start.align_offset(PAGE);
        let bytes = size_of_val(room).saturating_sub(before) / PAGE * PAGE;
        // SAFETY: the bytes lie within the array, which is borrowed mutably. This advice never
        // changes the contents. A system without huge pages returns an error, on which nothing
        // depends.
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

    /// Protects: a list has the requested capacity, for any element type and size, and keeps its
    /// contents.
    #[test]
    fn lists_have_room_for_what_is_put_there() {
        for count in [0, 1, MIN_BYTES / 8 - 1, MIN_BYTES / 8, MIN_BYTES] {
            let mut list: Vec<u64> = huge_page_vec(count);
            assert!(list.is_empty() && list.capacity() >= count);
            let place = list.as_ptr();
            list.extend(0..count as u64);
            assert!(list.as_ptr() == place && list.iter().copied().eq(0..count as u64));
        }
        assert_eq!(huge_page_vec::<()>(usize::MAX).capacity(), usize::MAX);
    }

    /// Protects: the system is advised to use huge pages for large arrays, only for pages entirely
    /// within the array, and not for small arrays.
    #[cfg(target_os = "linux")]
    #[test]
    fn large_arrays_ask_for_large_pages() {
        // The kernel reports the advice for each memory mapping.
        let requested = |list: &[u64], position: usize| {
            let Ok(ranges) = std::fs::read_to_string("/proc/self/smaps") else {
                return None;
            };
            let (index, mut here) = (list.as_ptr() as usize + position, false);
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
                    here = (start..end).contains(&index);
                } else if here && line.starts_with("VmFlags:") {
                    return Some(line.split(' ').any(|flag| flag == "hg"));
                }
            }
            None
        };
        if !std::path::Path::new("/sys/kernel/mm/transparent_hugepage").exists() {
            return;
        }
        let large = filled_huge_page_vec(8 << 20, 0_u64);
        assert_ne!(requested(&large, 32 << 20), Some(false));
        // A page that is only partly in the array must not be advised. The last element usually
        // lies on such a page.
        let ends_on_a_page = (large.as_ptr_range().end as usize).is_multiple_of(2 << 20);
        assert_ne!(
            requested(&large, size_of_val(large.as_slice()) - 8),
            Some(!ends_on_a_page)
        );
    }
}
