//! Tests of the order of a node's children on the stack. No hit depends on this order, but the time
//! of every ray does.
#![expect(unsafe_code, reason = "entries of the stack are read without a check")]

use super::*;
use crate::math::simd::Portable;

/// Returns the stack, from the bottom up, after the children of a mask were pushed onto two
/// entries.
fn waiting<S: TraversalSimd>(s: S, entries: [f32; WIDTH], mask: u32) -> Vec<(u32, f32)> {
    let children = core::array::from_fn(|lane| ChildRef(100 + lane as u32));
    let mut stack = TraversalStack::new();
    [7, 8]
        .into_iter()
        .for_each(|index| stack.set_entry(index - 7, StackEntry::new(ChildRef(index as u32), 0.5)));
    let top = s.push_children_sorted(&mut stack, 2, &children, s.load(&entries), mask);
    // SAFETY: every entry below the top was written.
    (0..top)
        .map(|index| unsafe { stack.storage_of_node_entries(index)[0].assume_init() })
        .map(|one| (one.child().0, one.entry_distance()))
        .collect()
}

/// Protects: the nearest child is visited first for any set of entered children, in the code of
/// every processor, and earlier entries are unchanged. A wrong order would find the same hits, but
/// later.
#[test]
fn the_nearest_waits_on_top() {
    let orders = [
        [0, 1, 2, 3, 4, 5, 6, 7],
        [7, 6, 5, 4, 3, 2, 1, 0],
        [3, 7, 0, 5, 1, 6, 2, 4],
        [4, 0, 6, 2, 7, 1, 5, 3],
    ];
    for entries in orders.map(|order: [u8; WIDTH]| order.map(|place| 1.0 + f32::from(place))) {
        for mask in (0_u32..256).filter(|mask| mask.count_ones() > 1) {
            let mut expected: Vec<(u32, f32)> = (0..WIDTH)
                .filter(|lane| mask >> lane & 1 != 0)
                .map(|lane| (100 + lane as u32, entries[lane]))
                .collect();
            expected.sort_by(|a, b| b.1.total_cmp(&a.1));
            expected.splice(0..0, [(7, 0.5), (8, 0.5)]);
            assert_eq!(waiting(Portable, entries, mask), expected);
            if let Some(avx2) = Avx2::detect() {
                assert_eq!(waiting(avx2, entries, mask), expected);
            }
            if let Some(avx512) = Avx512::detect() {
                assert_eq!(
                    waiting(avx512, entries, mask),
                    expected,
                    "{mask:08b} of {entries:?}"
                );
            }
        }
    }
}
