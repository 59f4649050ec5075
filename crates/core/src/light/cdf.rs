//! Discrete sampling by weight. The cumulative distribution ends at exactly 1, and sampling never
//! selects an entry of zero weight.

/// Appends the cumulative distribution of `weights`, which ends at exactly 1. Returns the sum of
/// the weights. Negative weights and NaN count as zero. If all weights are zero, the last entry has
/// the probability 1: searches still end.
pub(super) fn push_cdf(cumulative: &mut Vec<f64>, weights: &[f64]) -> f64 {
    let total: f64 = weights.iter().filter(|&&w| w > 0.0).sum();
    let last = weights
        .iter()
        .rposition(|&w| w > 0.0)
        .unwrap_or_else(|| weights.len().saturating_sub(1));
    let mut sum = 0.0;
    for (i, &weight) in weights.iter().enumerate() {
        if weight > 0.0 {
            sum += weight / total;
        }
        // Rounding may take the sum past one, or leave a remainder beyond the last positive weight,
        // which must not go to entries of zero weight.
        let share: f64 = if i < last { sum } else { 1.0 };
        cumulative.push(share.min(1.0));
    }
    total
}

/// Appends the cumulative distribution of [`push_cdf`], rounded to `f32`. Sampling and density read
/// the same rounded numbers: densities are exact.
pub(super) fn push_rounded_cdf(cumulative: &mut Vec<f32>, weights: &[f64]) -> f64 {
    let mut shares = Vec::with_capacity(weights.len());
    let total = push_cdf(&mut shares, weights);
    cumulative.extend(shares.iter().map(|&share| share as f32));
    total
}

/// Returns the probability of the entry `index`, given the cumulative distribution.
pub(super) fn entry_probability<T: Copy + Into<f64>>(cumulative: &[T], index: usize) -> f64 {
    let before = if index == 0 {
        0.0
    } else {
        cumulative[index - 1].into()
    };
    cumulative[index].into() - before
}

/// Samples an entry of a cumulative distribution by a uniform number in [0, 1). Returns the entry,
/// its probability, and the number rescaled to [0, 1) within the entry.
pub(super) fn sample_index<T: Copy + Into<f64>>(cumulative: &[T], at: f64) -> (usize, f64, f64) {
    let at = at.min(1.0_f64.next_down());
    locate_in_entry(
        cumulative,
        cumulative.partition_point(|&c| c.into() <= at),
        at,
    )
}

/// Samples the same entry as [`sample_index`] of a short distribution. It compares all entries, which
/// takes less time than a search whose steps wait for each other.
pub(super) fn sample_short_index(cumulative: &[f32], at: f64) -> (usize, f64, f64) {
    let at = at.min(1.0_f64.next_down());
    locate_in_entry(cumulative, count_up_to(cumulative, floor_f32(at)), at)
}

/// Returns the part that holds the entry of [`sample_index`], given the last number of each part of
/// a distribution.
pub(super) fn find_part(ends: &[f32], at: f64) -> usize {
    count_up_to(ends, floor_f32(at.min(1.0_f64.next_down())))
}

/// Samples the same entry as [`sample_index`] of a distribution that is divided into parts of `len`
/// numbers, given the part of [`find_part`].
pub(super) fn sample_index_in_part(
    cumulative: &[f32],
    (part, len): (usize, usize),
    at: f64,
) -> (usize, f64, f64) {
    let at = at.min(1.0_f64.next_down());
    let start = part * len;
    let index = start + count_up_to(&cumulative[start..][..len], floor_f32(at));
    locate_in_entry(cumulative, index, at)
}

/// Returns the number of entries of a cumulative distribution that are at most `bound`.
fn count_up_to(cumulative: &[f32], bound: f32) -> usize {
    let are_below = cumulative.iter().map(|&c| u32::from(c <= bound));
    are_below.sum::<u32>() as usize
}

/// Returns the greatest number of single precision that is at most `at`.
fn floor_f32(at: f64) -> f32 {
    let near = at as f32;
    if f64::from(near) > at {
        near.next_down()
    } else {
        near
    }
}

/// Returns the number of intervals in the guide table of a distribution with `entries` entries. The
/// number is a power of two: the interval of a number is then exact. Each entry has two to four
/// intervals on average: most searches end at once.
pub(super) fn guide_table_len(entries: usize) -> usize {
    2 * entries.next_power_of_two()
}

/// Appends a guide table for [`sample_index_guided`] ("An Algorithm for Generating Random Variates
/// from Empirical Distributions", Chen, Asau 1974). The table divides [0, 1) into equal intervals.
/// For each interval it holds the entry where a search starts. The distribution has at most 256
/// entries.
pub(super) fn push_guide_table<T: Copy + Into<f64>>(guide: &mut Vec<u8>, cumulative: &[T]) {
    let parts = guide_table_len(cumulative.len());
    let entry = |part| cumulative.partition_point(|&c| c.into() <= part as f64 / parts as f64);
    guide.extend((0..parts).map(|part| entry(part) as u8));
}

/// Samples the same entry as [`sample_index`], in less time by a guide table.
pub(super) fn sample_index_guided<T: Copy + Into<f64>>(
    cumulative: &[T],
    guide: &[u8],
    at: f64,
) -> (usize, f64, f64) {
    let at = at.min(1.0_f64.next_down());
    let mut index = usize::from(guide[(at * guide.len() as f64) as usize]);
    while cumulative[index].into() <= at {
        index += 1;
    }
    locate_in_entry(cumulative, index, at)
}

fn locate_in_entry<T: Copy + Into<f64>>(
    cumulative: &[T],
    index: usize,
    at: f64,
) -> (usize, f64, f64) {
    let share = entry_probability(cumulative, index);
    let before = cumulative[index].into() - share;
    (
        index,
        share,
        ((at - before) / share).clamp(0.0, 1.0_f64.next_down()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::splitmix64;

    /// Protects: comparing all entries, or every sixteenth and then sixteen, yields the entry of a binary
    /// search, to the bit: at the ends of entries, beside them, and for entries of zero weight.
    #[test]
    fn short_searches_lead_to_the_same_entry() {
        for seed in 0..40 {
            let weight = |i: u64| match splitmix64(seed << 32 | i) % 7 {
                0 if seed % 2 == 0 => 0.0,
                n => n as f64,
            };
            let weights: Vec<f64> = (0..512).map(weight).collect();
            let mut cumulative = Vec::new();
            push_rounded_cdf(&mut cumulative, &weights);
            let ends: Vec<f32> = cumulative.iter().skip(15).step_by(16).copied().collect();
            let edges = cumulative.iter().map(|&c| f64::from(c));
            let around = edges.flat_map(|c| [c.next_down(), c, c.next_up(), c + 1e-9]);
            for at in around
                .chain([0.0, 1.0])
                .filter(|at| (0.0..=1.0).contains(at))
            {
                let expected = sample_index(&cumulative, at);
                assert_eq!(sample_short_index(&cumulative, at), expected, "{seed} {at}");
                let found = sample_index_in_part(&cumulative, (find_part(&ends, at), 16), at);
                assert_eq!(found, expected, "{seed} {at}");
            }
        }
    }

    /// Protects: a guide table yields the entry, probability and position of a binary search, to
    /// the bit: for uniform weights, one sun among faint ones, rows of zeros and zeros alone, at
    /// the ends of entries, of parts and of [0, 1).
    #[test]
    fn guides_lead_to_the_same_entry() {
        let number = |i: u64| (splitmix64(i) >> 11) as f64 / (1_u64 << 53) as f64;
        let weights: [fn(u64) -> f64; 6] = [
            |_| 1.0,
            |i| (splitmix64(i) % 97) as f64,
            |i| if i % 50 == 30 { 1e6 } else { 1.0 },
            |i| if i / 3 % 2 == 0 { 0.0 } else { 1.0 },
            |i| 0.5_f64.powi(i as i32),
            |_| 0.0,
        ];
        for (kind, weight) in weights.iter().enumerate() {
            for count in [1, 2, 3, 63, 64, 65, 128, 255, 256] {
                let mut sums = Vec::new();
                push_cdf(&mut sums, &(0..count).map(weight).collect::<Vec<_>>());
                let rounded: Vec<f32> = sums.iter().map(|&sum| sum as f32).collect();
                let (mut guide, mut rough) = (Vec::new(), Vec::new());
                push_guide_table(&mut guide, &sums);
                push_guide_table(&mut rough, &rounded);
                let edges = sums
                    .iter()
                    .copied()
                    .chain(rounded.iter().map(|&sum| sum.into()));
                let parts = (0..guide.len()).map(|part| part as f64 / guide.len() as f64);
                let near = edges
                    .chain(parts)
                    .flat_map(|at| [at.next_down(), at, at.next_up()]);
                for at in near
                    .chain((0..1_000).map(number))
                    .filter(|&at| (0.0..=1.0).contains(&at))
                {
                    assert_eq!(
                        sample_index_guided(&sums, &guide, at),
                        sample_index(&sums, at),
                        "{kind}, {count} entries at {at:e}"
                    );
                    assert_eq!(
                        sample_index_guided(&rounded, &rough, at),
                        sample_index(&rounded, at),
                        "{kind}, {count} entries in f32 at {at:e}"
                    );
                }
            }
        }
    }
}
