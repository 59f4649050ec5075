//! Samplers simpler than Sobol points, for comparison: independent random numbers, and jittered
//! grids.

use crate::hash::splitmix64;

/// Number of random bits in a number in [0, 1), as for Sobol points.
const BITS: u32 = 23;

/// Returns four independent numbers in [0, 1) for the point `index` of a sequence. `scramble`
/// identifies the sequence.
#[inline]
pub(super) fn independent_point(index: u32, scramble: u32) -> [f32; 4] {
    hash_bits(index, scramble).map(bits_to_unit)
}

/// Returns four numbers in [0, 1) for the point `index` of a sequence: two stratified pairs (Cook,
/// "Stochastic Sampling in Computer Graphics", 1986). `scramble` identifies the sequence.
///
/// Points come in groups of sixteen. In each group, each of the two pairs has a point in every cell
/// of a 4 × 4 grid, jittered within the cell. The order of the cells is random, and differs between
/// the pairs.
#[inline]
pub(super) fn stratified_point(index: u32, scramble: u32) -> [f32; 4] {
    let grid = splitmix64(u64::from(scramble) << 32 | u64::from(index / 16) | 1 << 31);
    let jitter = hash_bits(index, scramble);
    let cells = [
        permute_cell(index % 16, grid as u32),
        permute_cell(index % 16, (grid >> 32) as u32),
    ];
    let places = [cells[0] % 4, cells[0] / 4, cells[1] % 4, cells[1] / 4];
    core::array::from_fn(|k| bits_to_unit(places[k] << (BITS - 2) | jitter[k] >> 2))
}

/// Returns four independent hashes of 23 bits.
#[inline]
fn hash_bits(index: u32, scramble: u32) -> [u32; 4] {
    let a = splitmix64(u64::from(scramble) << 32 | u64::from(index));
    let b = splitmix64(a);
    [a, a >> 32, b, b >> 32].map(|word| word as u32 >> (u32::BITS - BITS))
}

#[inline]
fn bits_to_unit(bits: u32) -> f32 {
    bits as f32 / (1 << BITS) as f32
}

/// Returns the image of `number` under a permutation of 0..16. `key` chooses the permutation. Each
/// step is itself a permutation.
#[inline]
fn permute_cell(number: u32, key: u32) -> u32 {
    (0..4).fold(number, |x, round| {
        let part = key >> (8 * round);
        let x = (x * (part & 15 | 1) + (part >> 4)) & 15;
        x ^ x >> 2
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: of every sixteen points each pair has one in each cell; the pairs visit the cells
    /// in different orders, and another sixteen in further orders.
    #[test]
    fn each_cell_has_one() {
        let mut orders = std::collections::BTreeSet::new();
        for (scramble, block) in [(0, 0), (7, 0), (7, 1), (u32::MAX, 4095)] {
            for pair in [0, 2] {
                let value_of = |i: u32| {
                    let point = stratified_point(16 * block + i, scramble);
                    (4.0 * point[pair]) as usize + 4 * (4.0 * point[pair + 1]) as usize
                };
                let order: Vec<usize> = (0..16).map(value_of).collect();
                let mut sorted = order.clone();
                sorted.sort_unstable();
                assert_eq!(
                    sorted,
                    (0..16).collect::<Vec<_>>(),
                    "{scramble} {block} {pair}"
                );
                orders.insert(order);
            }
        }
        assert_eq!(orders.len(), 8, "all in orders of their own");
    }

    /// Protects: numbers are uniform in [0, 1) and independent, by the means of numbers, squares
    /// and products: 1/2, 1/3 and 1/4; products across stratified pairs behave as for independent
    /// numbers.
    #[test]
    fn m11_numbers_are_even() {
        const COUNT: u32 = 1 << 16;
        for draw in [independent_point, stratified_point] {
            let (mut mean, mut square, mut product) = ([0.0; 4], [0.0; 4], 0.0);
            for index in 0..COUNT {
                let point = draw(index, 99).map(f64::from);
                assert!(point.iter().all(|x| (0.0..1.0).contains(x)), "{point:?}");
                for k in 0..4 {
                    mean[k] += point[k] / f64::from(COUNT);
                    square[k] += point[k] * point[k] / f64::from(COUNT);
                }
                product += point[0] * point[2] / f64::from(COUNT);
            }
            // Five standard errors of independent numbers.
            let allowed = |variance: f64| 5.0 * (variance / f64::from(COUNT)).sqrt();
            assert!(
                mean.iter().all(|m| (m - 0.5).abs() < allowed(1.0 / 12.0)),
                "{mean:?}"
            );
            assert!(
                square
                    .iter()
                    .all(|s| (s - 1.0 / 3.0).abs() < allowed(4.0 / 45.0)),
                "{square:?}"
            );
            assert!((product - 0.25).abs() < allowed(7.0 / 144.0), "{product}");
        }
    }

    /// Protects: independent points fall into cells by chance: of sixteen cells 16·(15/16)¹⁶ are
    /// empty on average.
    #[test]
    fn independent_points_are_not_stratified() {
        let empty = |scramble: u32| {
            let hit = (0..16).fold(0_u32, |hit, i| {
                let [x, y, ..] = independent_point(i, scramble);
                hit | 1 << ((4.0 * x) as u32 + 4 * (4.0 * y) as u32)
            });
            f64::from(hit.count_zeros() - 16)
        };
        let mean = (0..4096).map(empty).sum::<f64>() / 4096.0;
        assert!(
            (mean - 16.0 * (15.0_f64 / 16.0).powi(16)).abs() < 0.1,
            "{mean}"
        );
    }
}
