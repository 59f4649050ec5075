//! Owen-scrambled Sobol points in four dimensions, with the same bits as `sobol_burley::sample_4d`
//! in less time.
//!
//! That function reads a point's index bit by bit. Each step depends on the previous step, and the
//! last branch is mostly mispredicted. Here a table of one kilobyte holds the sums of direction
//! vectors for four bits at a time.

use std::sync::LazyLock;

use raywright_bvh::{SimdTask, run_widest};
use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};

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

/// A point of a sequence: its index, below 2¹⁶, and the scramble that identifies the sequence.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SobolIndex {
    pub index: u32,
    pub scramble: u32,
}

/// Returns the four numbers in [0, 1) of a point.
#[inline]
pub(super) fn eval_point(sobol_point: SobolIndex) -> [f32; 4] {
    let [point] = compute_points(&SUMS, &[sobol_point]);
    point
}

/// Number of points computed side by side.
const LANES: usize = 16;

/// Appends the four numbers of many points in order, as [`eval_point`] computes them.
pub(super) fn eval_points(which: impl Iterator<Item = SobolIndex>, out: &mut Vec<[f32; 4]>) {
    let mut which = which.fuse();
    loop {
        let mut requested = [SobolIndex::default(); LANES];
        let mut count = 0;
        for (slot, sobol_point) in requested.iter_mut().zip(&mut which) {
            *slot = sobol_point;
            count += 1;
        }
        out.extend_from_slice(&run_widest(SobolTask(&SUMS, &requested))[..count]);
        if count < LANES {
            return;
        }
    }
}

struct SobolTask<'a>(&'a [[[u32; 4]; 16]; 4], &'a [SobolIndex; LANES]);

impl SimdTask for SobolTask<'_> {
    type Output = [[f32; 4]; LANES];
    #[inline(always)]
    fn run(self) -> Self::Output {
        compute_points(self.0, self.1)
    }
}

#[inline(always)]
fn compute_points<const N: usize>(
    sums: &[[[u32; 4]; 16]; 4],
    sobol_points: &[SobolIndex; N],
) -> [[f32; 4]; N] {
    let mut shuffled = [0; N];
    for (shuffled, sobol_point) in shuffled.iter_mut().zip(sobol_points) {
        // The scramble also permutes the order of the points; each dimension has a further
        // scramble.
        *shuffled = owen_scramble_rev(
            sobol_point.index.reverse_bits(),
            hash(sobol_point.scramble ^ 0x79c6_8e4a),
        );
    }
    let mut points = [[0; 4]; N];
    for (point, &shuffled) in points.iter_mut().zip(&shuffled) {
        let part =
            |k: usize| &sums[k][(shuffled >> (u32::BITS - BITS * (k as u32 + 1))) as usize % 16];
        let [a, b, c, d] = [part(0), part(1), part(2), part(3)];
        *point = core::array::from_fn(|i| a[i] ^ b[i] ^ c[i] ^ d[i]);
    }
    let mut out = [[0.0; 4]; N];
    for ((out, point), sobol_point) in out.iter_mut().zip(&points).zip(sobol_points) {
        const OWN: [u32; 4] = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8];
        let own = sobol_point.scramble.wrapping_mul(0x9c8f_2d3b);
        for i in 0..4 {
            out[i] =
                u32_to_f32_norm(owen_scramble_rev(point[i], hash(own ^ OWN[i])).reverse_bits());
        }
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
                eval_point(SobolIndex { index, scramble }),
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
                eval_point(SobolIndex {
                    index: 0xffff,
                    scramble
                })
                .map(f32::to_bits),
                sobol_burley::sample_4d(0xffff, 0, scramble).map(f32::to_bits)
            );
        }
    }

    /// Protects: points computed side by side equal single ones, for any number of points.
    #[test]
    fn points_side_by_side_are_those_alone() {
        for count in [0, 1, 15, 16, 17, 33, 1000] {
            let which = |i: u32| SobolIndex {
                index: i.wrapping_mul(7919) % (1 << 16),
                scramble: i.wrapping_mul(0x9e37_79b9),
            };
            let mut out = vec![[0.5; 4]];
            eval_points((0..count).map(which), &mut out);
            let alone: Vec<_> = (0..count)
                .map(|i| eval_point(which(i)).map(f32::to_bits))
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
