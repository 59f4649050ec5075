//! Owen-scrambled Sobol points in four dimensions, with the same bits as `sobol_burley::sample_4d`
//! in less time.
//!
//! That function reads a point's index bit by bit. Each step depends on the previous step, and the
//! last branch is mostly mispredicted. Here a table of one kilobyte holds the sums of direction
//! vectors for four bits at a time.

use std::sync::LazyLock;

use raywright_bvh::{SimdTask, run_widest};
use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};

use super::SequenceKey;

/// Number of index bits that are looked up together.
const BITS: u32 = 4;

/// Sums modulo two (exclusive or) of direction vectors. The indices are the group of four index
/// bits (lowest bits first), the value of the group, and the dimension. Sums are bit-reversed, with
/// the lowest bit on the left, as the scrambling requires.
static SUMS: LazyLock<[[[u32; 4]; 16]; 4]> = LazyLock::new(|| {
    let sum = |k: usize, value: usize, dimension: u32| {
        sobol_rev(
            (value as u32) << (u32::BITS - BITS * (k as u32 + 1)),
            dimension,
        )
    };
    core::array::from_fn(|k| {
        core::array::from_fn(|value| [0, 1, 2, 3].map(|dimension| sum(k, value, dimension)))
    })
});

/// Returns the four numbers in [0, 1) of a point, given its index, below 2¹⁶, and the scramble that
/// identifies its sequence.
#[inline]
pub(super) fn eval_point(index: u32, scramble: u32) -> [f32; 4] {
    let sums = shuffle_indices(&[index], &[scramble]).map(sum_directions);
    let [point] = scramble_sums(&[scramble], &sums);
    point
}

/// Number of points computed side by side. Two registers of the widest kind hold their indices, so
/// that the products of one are computed while those of the other are waited for.
const LANES: usize = 32;

/// Appends the four numbers of many points in order, as [`eval_point`] computes them. A point is
/// given by the key of its sequence and its index.
pub(super) fn eval_points(
    which: impl Iterator<Item = (SequenceKey, u32)>,
    out: &mut Vec<[f32; 4]>,
) {
    let mut which = which.fuse();
    let (mut keys, mut indices) = ([SequenceKey::default(); LANES], [0; LANES]);
    loop {
        let mut count = 0;
        for ((key, index), point) in keys.iter_mut().zip(&mut indices).zip(&mut which) {
            (*key, *index) = point;
            count += 1;
        }
        // The table is read outside the tasks: inside, the compiler would read it by gather
        // instructions, which take longer than all the rest.
        let (scrambles, shuffled) = run_widest(ShuffleTask {
            keys: &keys,
            indices: &indices,
        });
        // Number by number: `map` of so long an array is not inlined.
        let mut sums = [[0; 4]; LANES];
        for (sums, &shuffled) in sums.iter_mut().zip(&shuffled) {
            *sums = sum_directions(shuffled);
        }
        out.extend_from_slice(&run_widest(ScrambleTask(&scrambles, &sums))[..count]);
        if count < LANES {
            return;
        }
    }
}

/// Task of [`run_widest`]: the scrambles of points, and their shuffled indices.
struct ShuffleTask<'a> {
    keys: &'a [SequenceKey; LANES],
    indices: &'a [u32; LANES],
}

impl SimdTask for ShuffleTask<'_> {
    type Output = ([u32; LANES], [u32; LANES]);
    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut scrambles = [0; LANES];
        for (scramble, key) in scrambles.iter_mut().zip(self.keys) {
            *scramble = key.scramble();
        }
        (scrambles, shuffle_indices(self.indices, &scrambles))
    }
}

struct ScrambleTask<'a>(&'a [u32; LANES], &'a [[u32; 4]; LANES]);

impl SimdTask for ScrambleTask<'_> {
    type Output = [[f32; 4]; LANES];
    #[inline(always)]
    fn run(self) -> Self::Output {
        scramble_sums(self.0, self.1)
    }
}

/// Returns the indices of points, bit-reversed, after the scramble has permuted their order.
#[inline(always)]
fn shuffle_indices<const N: usize>(indices: &[u32; N], scrambles: &[u32; N]) -> [u32; N] {
    let mut shuffled = [0; N];
    for (shuffled, (index, scramble)) in shuffled.iter_mut().zip(indices.iter().zip(scrambles)) {
        *shuffled = owen_scramble_rev(index.reverse_bits(), hash(scramble ^ 0x79c6_8e4a));
    }
    shuffled
}

/// Returns the bit-reversed sums of the direction vectors that the bits of a shuffled index select.
#[inline(always)]
fn sum_directions(shuffled: u32) -> [u32; 4] {
    let sums = &*SUMS;
    let part = |k: usize| &sums[k][(shuffled >> (u32::BITS - BITS * (k as u32 + 1))) as usize % 16];
    let [a, b, c, d] = [part(0), part(1), part(2), part(3)];
    [
        a[0] ^ b[0] ^ c[0] ^ d[0],
        a[1] ^ b[1] ^ c[1] ^ d[1],
        a[2] ^ b[2] ^ c[2] ^ d[2],
        a[3] ^ b[3] ^ c[3] ^ d[3],
    ]
}

/// Returns the numbers of points in [0, 1), given the scrambles of their sequences and the sums of
/// their direction vectors. Each dimension has a scramble of its own.
#[inline(always)]
fn scramble_sums<const N: usize>(scrambles: &[u32; N], sums: &[[u32; 4]; N]) -> [[f32; 4]; N] {
    const OWN: [u32; 4] = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8];
    let mut of_dimensions = [[0; 4]; N];
    for (of_dimensions, scramble) in of_dimensions.iter_mut().zip(scrambles) {
        let own = scramble.wrapping_mul(0x9c8f_2d3b);
        for (scramble, dimension) in of_dimensions.iter_mut().zip(OWN) {
            *scramble = own ^ dimension;
        }
    }
    let mut out = [[0.0; 4]; N];
    // As one list of numbers: the compiler fills whole registers.
    let numbers = sums.as_flattened().iter().zip(of_dimensions.as_flattened());
    for (number, (&sum, &scramble)) in out.as_flattened_mut().iter_mut().zip(numbers) {
        *number = u32_to_f32_norm(owen_scramble_rev(sum, hash(scramble)).reverse_bits());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: points equal those of the crate to the bit, for every index of a sequence and any
    /// scramble.
    #[test]
    fn points_are_those_of_the_crate() {
        for index in 0..1_u32 << 16 {
            let scramble = index.wrapping_mul(0x9e37_79b9).rotate_left(index % 32);
            let [found, expected] = [
                eval_point(index, scramble),
                sobol_burley::sample_4d(index, 0, scramble),
            ];
            assert_eq!(
                found.map(f32::to_bits),
                expected.map(f32::to_bits),
                "point {index} of {scramble:#x}"
            );
        }
        for scramble in [0, 1, u32::MAX, 0x79c6_8e4a] {
            assert_eq!(
                eval_point(0xffff, scramble).map(f32::to_bits),
                sobol_burley::sample_4d(0xffff, 0, scramble).map(f32::to_bits)
            );
        }
    }

    /// Protects: points computed side by side equal single ones, for any number of points.
    #[test]
    fn points_side_by_side_are_those_alone() {
        for count in [0, 1, 31, 32, 33, 65, 1000] {
            let which = |i: u32| {
                let key = SequenceKey {
                    vertex: u64::from(i) << 40 | u64::from(i),
                    branch: u64::from(i % 3) << 33,
                };
                (key, i.wrapping_mul(7919) % (1 << 16))
            };
            let mut out = vec![[0.5; 4]];
            eval_points((0..count).map(which), &mut out);
            let alone: Vec<_> = (0..count)
                .map(which)
                .map(|(key, index)| eval_point(index, key.scramble()).map(f32::to_bits))
                .collect();
            assert_eq!(
                out[1..]
                    .iter()
                    .map(|point| point.map(f32::to_bits))
                    .collect::<Vec<_>>(),
                alone,
                "{count}"
            );
            assert_eq!(out[0], [0.5; 4]);
        }
    }
}
