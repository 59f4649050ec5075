//! Shares of the candidate changes that minimise the squared error of a pixel's surroundings, as
//! estimated from the replicates.
//!
//! Shares αᵢ of the candidates i change the squared error by 2 Σ αᵢbᵢ + Σ αᵢαⱼQᵢⱼ. Qᵢⱼ is the
//! product of the changes by the candidates i and j. bᵢ is a quarter of the difference of both halves
//! times the difference of candidate i's changes of both (see [`denoise`](super)). Both are divided by the squared colour, as in a relative error, and averaged over the neighbours
//! *without the pixel itself*. A pixel's own noise therefore does not choose the shares that lower
//! its error estimate. With the pixel, error estimates were too small by up to a half.

use core::array::from_fn;
use core::ops::Range;

use raywright_bvh::{SimdTask, run_widest};

use super::features::{FLOOR, jackknife_colours, replicate_statistics};
use super::{CANDIDATES, FourReplicates, PixelCandidates, REPLICATE_COUNT};

/// Distance in pixels within which neighbours contribute to the shares of a pixel.
const REACH: usize = 20;

/// Greatest number of rounds of coordinate descent. A round minimises the error over each share in
/// turn.
const DESCENT_ROUNDS: usize = 12;

/// Pairs of candidates, by index. The averaged product of a pair's changes is an entry of the
/// matrix Q.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

/// Number of averaged numbers per pixel, called moments: the terms b of the candidates, and the
/// entries of the matrix Q.
const MOMENTS: usize = CANDIDATES + PAIRS.len();

/// Number of pixels whose shares are computed side by side in SIMD lanes.
const LANES: usize = 8;

/// Moments of the candidates (the terms b and Q of the error) in some rows of pixels. Each row of
/// pixels holds the first moment of all its pixels, then the second moment of all its pixels, and
/// so on.
struct CandidateMoments {
    width: usize,
    first_row: usize,
    moments: Vec<f64>,
}

impl CandidateMoments {
    fn new(
        four: &FourReplicates<'_>,
        width: usize,
        pixels: &[PixelCandidates],
        rows: Range<usize>,
    ) -> Self {
        let mut of = vec![0.0; rows.len() * MOMENTS * width];
        for (y, row) in rows.clone().zip(of.chunks_exact_mut(MOMENTS * width)) {
            for x in 0..width {
                let position = y * width + x;
                let moments = candidate_moments(four.radiance(position), &pixels[position]);
                (0..MOMENTS).for_each(|k| row[k * width + x] = moments[k]);
            }
        }
        Self {
            width,
            first_row: rows.start,
            moments: of,
        }
    }

    /// Returns the moments of the picture's row `y`.
    #[inline(always)]
    fn moments_of_row(&self, y: usize) -> &[f64] {
        let length = MOMENTS * self.width;
        &self.moments[(y - self.first_row) * length..][..length]
    }
}

/// Returns the shares of the candidates for the pixels in `rows`.
pub(super) fn solve_candidate_shares(
    four: &FourReplicates<'_>,
    [width, height]: [usize; 2],
    pixels: &[PixelCandidates],
    rows: Range<usize>,
) -> Vec<[f32; CANDIDATES]> {
    let wide = rows.start.saturating_sub(REACH)..(rows.end + REACH).min(height);
    let moments = CandidateMoments::new(four, width, pixels, wide);
    run_widest(CandidateShareSolver {
        moments,
        height,
        rows,
    })
}

/// SIMD task: computes the shares for some rows of pixels from the moments of their surroundings.
struct CandidateShareSolver {
    moments: CandidateMoments,
    height: usize,
    rows: Range<usize>,
}

impl SimdTask for CandidateShareSolver {
    type Output = Vec<[f32; CANDIDATES]>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let width = self.moments.width;
        let near = |position: usize, end: usize| {
            position.saturating_sub(REACH)..(position + REACH + 1).min(end)
        };
        let mut out = vec![[0.0; CANDIDATES]; self.rows.len() * width];
        let padded = width.next_multiple_of(LANES);
        // Sums over the surrounding rows of each column, padded with zeros by the reach at both
        // ends.
        let mut columns = vec![0.0; padded + 2 * REACH];
        let mut sums = vec![[0.0; LANES]; MOMENTS * padded / LANES];
        for (y, out) in self.rows.zip(out.chunks_exact_mut(width)) {
            let around = near(y, self.height);
            for k in 0..MOMENTS {
                let kind = k * width..(k + 1) * width;
                let into = &mut columns[REACH..][..width];
                into.fill(0.0);
                for other in around.clone() {
                    add_row(into, &self.moments.moments_of_row(other)[kind.clone()]);
                }
                let sums = &mut sums.as_flattened_mut()[k * padded..][..padded];
                negate_row(&mut sums[..width], &self.moments.moments_of_row(y)[kind]);
                for step in 0..=2 * REACH {
                    add_row(sums, &columns[step..][..padded]);
                }
            }
            for (x, out) in (0..width).step_by(LANES).zip(out.chunks_mut(LANES)) {
                let mut means = [[0.0; LANES]; MOMENTS];
                let mut others = [1.0; LANES];
                for (i, others) in others.iter_mut().enumerate() {
                    let beside = near((x + i).min(width - 1), width);
                    *others = (beside.len() * around.len() - 1) as f64;
                }
                for k in 0..MOMENTS {
                    let of = &sums[(k * padded + x) / LANES];
                    for i in 0..LANES {
                        means[k][i] = of[i] / others[i];
                    }
                }
                let solved = solve_optimal_shares(&means);
                for (i, out) in out.iter_mut().enumerate() {
                    if others[i] > 0.0 {
                        for c in 0..CANDIDATES {
                            out[c] = solved[c][i];
                        }
                    }
                }
            }
        }
        out
    }
}

#[inline(always)]
fn add_row(to: &mut [f64], values: &[f64]) {
    let values = &values[..to.len()];
    for i in 0..to.len() {
        to[i] += values[i];
    }
}

#[inline(always)]
fn negate_row(to: &mut [f64], values: &[f64]) {
    let values = &values[..to.len()];
    for i in 0..to.len() {
        to[i] = -values[i];
    }
}

/// Returns the moments of a pixel's candidates: the terms b, then the products Q of all pairs. The
/// moments are summed over channels and divided by the squared colour plus its variance.
fn candidate_moments(
    radiance: [[f64; 3]; REPLICATE_COUNT],
    pixel: &PixelCandidates,
) -> [f64; MOMENTS] {
    let [mean, variance, _] = replicate_statistics(radiance);
    let [_, base] = jackknife_colours(mean, pixel);
    let over = |value: [f64; 3]| -> f64 {
        (0..3)
            .map(|i| value[i] / (base[i].max(0.0) * base[i].max(0.0) + FLOOR + variance[i]))
            .sum()
    };
    let added = pixel.changes.map(|added| added.map(f64::from));
    from_fn(|k| match k.checked_sub(CANDIDATES) {
        None => over(pixel.error_terms[k].map(f64::from)),
        Some(pair) => {
            let [a, b] = PAIRS[pair].map(|c| added[c]);
            over(from_fn(|i| a[i] * b[i]))
        }
    })
}

/// Returns for several pixels the shares α in 0..1 that minimise 2 Σ αᵢbᵢ + Σ αᵢαⱼQᵢⱼ. Coordinate
/// descent starts with all shares at one.
#[inline(always)]
fn solve_optimal_shares(moments: &[[f64; LANES]; MOMENTS]) -> [[f32; LANES]; CANDIDATES] {
    // For each candidate, the other two, with the index of their common product among the moments.
    const OTHERS: [[[usize; 2]; 2]; CANDIDATES] =
        [[[1, 6], [2, 7]], [[0, 6], [2, 8]], [[0, 7], [1, 8]]];
    let mut shares = [[1.0; LANES]; CANDIDATES];
    for _ in 0..DESCENT_ROUNDS {
        let before = shares;
        for c in 0..CANDIDATES {
            let [[one, of_one], [two, of_two]] = OTHERS[c];
            for i in 0..LANES {
                let others =
                    moments[of_one][i] * shares[one][i] + moments[of_two][i] * shares[two][i];
                let own = moments[CANDIDATES + c][i];
                let own = if own > 1e-12 { own } else { 1e-12 };
                let share = (-moments[c][i] - others) / own;
                let share = if share < 0.0 { 0.0 } else { share };
                shares[c][i] = if share > 1.0 { 1.0 } else { share };
            }
        }
        if shares == before {
            break;
        }
    }
    let mut out = [[0.0; LANES]; CANDIDATES];
    for c in 0..CANDIDATES {
        for i in 0..LANES {
            let share = shares[c][i];
            out[c][i] = if share.is_nan() { 0.0 } else { share as f32 };
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: shares minimise the error: −b/Q for one candidate, a sum of one for two equal
    /// candidates, and zero for a harmful one.
    #[test]
    fn shares_make_the_error_least() {
        let solve = |moments: [f64; MOMENTS]| {
            solve_optimal_shares(&moments.map(|moment| [moment; LANES]))
                .map(|shares| shares[LANES - 1])
        };
        assert_eq!(
            solve([-0.5, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0])[0],
            0.25
        );
        assert_eq!(solve([0.5, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0])[0], 0.0);
        assert_eq!(
            solve([-4.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0])[0],
            1.0,
            "no more than all"
        );
        let [a, b, _] = solve([-1.0, -1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
        assert_eq!(a + b, 1.0);
        assert!(solve([f64::NAN; 9]).iter().all(|&share| share == 0.0));
    }

    /// Protects: a pixel does not affect its own shares, only those of its neighbours.
    #[test]
    fn a_pixel_does_not_choose_for_itself() {
        use crate::film::tests::{ReplicateSample, film_of};
        let film = film_of([12, 9], |pixel, replicate| ReplicateSample {
            radiance: [0.5 + 0.01 * ((pixel * 7 + replicate * 3) % 11) as f64; 3],
            emission: [0.0; 3],
            albedo: [0.5; 3],
        });
        let four = film.merge_into_four_replicates().expect("all that is read");
        let value_of = |k: usize| 0.02 * ((k * 5) % 7) as f32 - 0.06;
        let pixel = |k: usize| PixelCandidates {
            base_colour: [0.5; 3],
            changes: [[value_of(k); 3]; 3],
            error_terms: [[-value_of(k + 3) * 0.02; 3]; 3],
        };
        let mut pixels: Vec<PixelCandidates> = (0..12 * 9).map(pixel).collect();
        let before = solve_candidate_shares(&four, [12, 9], &pixels, 0..9);
        pixels[40].error_terms = [[-0.01; 3]; 3];
        pixels[40].changes = [[0.2; 3]; 3];
        let after = solve_candidate_shares(&four, [12, 9], &pixels, 0..9);
        let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
        assert!(
            close(before[40], after[40]),
            "{:?} became {:?}",
            before[40],
            after[40]
        );
        assert!(!close(before[41], after[41]), "{:?}", after[41]);
    }
}
