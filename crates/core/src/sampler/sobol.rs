//! Owen-scrambled Sobol points in four dimensions: the bits of `sobol_burley::sample_4d`, in less time.
//!
//! That function looks at a point's number bit by bit, each step waiting for the one before and the last one guessed wrong mostly. Sums of
//! the direction vectors of four bits at a time are a table of a kilobyte.

use std::sync::LazyLock;

use sobol_burley::parts::{Int4, hash, hash_int4, owen_scramble_int4_rev, owen_scramble_rev, sobol_int4_rev};

/// Bits of a point's number that are looked up at once.
const BITS: u32 = 4;

/// Sums modulo two of the direction vectors of four dimensions, for each value of each four of the sixteen bits, the lowest bits of the
/// number first. Numbers are written from the left, lowest bit first, as the scrambling wants them.
static SUMS: LazyLock<[[Int4; 16]; 4]> = LazyLock::new(|| {
    let part = |k: usize| core::array::from_fn(|value| sobol_int4_rev((value as u32) << (u32::BITS - BITS * (k as u32 + 1)), 0));
    core::array::from_fn(part)
});

/// Four numbers in [0, 1): a point of the sequence that a scramble names, for numbers below 2¹⁶.
#[inline]
pub(super) fn point(index: u32, scramble: u32) -> [f32; 4] {
    // The order of the points is scrambled by the name too, and each dimension by a number of its own.
    let shuffled = owen_scramble_rev(index.reverse_bits(), hash(scramble ^ 0x79c6_8e4a));
    let sums = &*SUMS;
    let part = |k: usize| sums[k][(shuffled >> (u32::BITS - BITS * (k as u32 + 1))) as usize % 16];
    let sum = (part(0) ^ part(1)) ^ (part(2) ^ part(3));
    let own: Int4 = [scramble.wrapping_mul(0x9c8f_2d3b); 4].into();
    let own = own ^ [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8].into();
    owen_scramble_int4_rev(sum, hash_int4(own)).reverse_bits().to_f32_norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: points are those of the crate to the bit, for every number of a sequence and whatever scramble.
    #[test]
    fn points_are_those_of_the_crate() {
        for index in 0..1_u32 << 16 {
            let scramble = index.wrapping_mul(0x9e37_79b9).rotate_left(index % 32);
            let [found, expected] = [point(index, scramble), sobol_burley::sample_4d(index, 0, scramble)];
            assert_eq!(found.map(f32::to_bits), expected.map(f32::to_bits), "point {index} of {scramble:#x}");
        }
        for scramble in [0, 1, u32::MAX, 0x79c6_8e4a] {
            assert_eq!(point(0xffff, scramble).map(f32::to_bits), sobol_burley::sample_4d(0xffff, 0, scramble).map(f32::to_bits));
        }
    }
}
