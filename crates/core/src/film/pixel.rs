//! What one pixel's replicates add to the error of a picture: its variance weighed in four ways,
//! and squared products of differences.

use super::again::SingleReplicateBound;

/// Ways to pair four replicates.
const PAIRINGS: [[usize; 4]; 3] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]];

/// What one pixel adds: its variance weighed in four ways, and squared products of differences.
#[derive(Clone, Copy, Default)]
pub(super) struct Pixel {
    /// Variance of the mean, weighed by what other replicates say, and by what all of them say.
    pub variance: f64,
    pub among: f64,
    /// Weighed by the mean of all four, and by that of the pair alone that it is of.
    pub own: f64,
    pub seen: f64,
    /// Squared products of two independent differences between replicates.
    pub product: f64,
    /// What it may be off by since light was seen once, in each pixel another way, and in all the
    /// same way.
    pub unsure: f64,
    pub prior: f64,
}

/// Weights by the means of two replicates.
pub(super) type Weigh = fn([f64; 3], [f64; 3]) -> [f64; 3];

impl Pixel {
    /// Adds what the means of four replicates say: each difference of two has twice the variance of
    /// a replicate, and an eighth of its square is the variance of a mean of four. It is weighed by
    /// the other two, by itself, by the mean of all four and by their products; by the first and
    /// the last no more than light that was seen once allows.
    pub fn add(
        &mut self,
        at: [[f64; 3]; 4],
        [across, within]: [Weigh; 2],
        among: [f64; 3],
        once: SingleReplicateBound,
        shares: [f64; 2],
    ) {
        let limited = |weights: [f64; 3]| -> [f64; 3] {
            core::array::from_fn(|i| weights[i].min(once.most[i]))
        };
        let off = |by: [f64; 3]| -> [f64; 3] {
            core::array::from_fn(|i| {
                if among[i] > once.most[i] {
                    once.most[i] * by[i]
                } else {
                    0.0
                }
            })
        };
        let (unsure, prior) = (off(once.deviation), off(once.prior));
        let among = limited(among);
        let mean: [f64; 3] =
            core::array::from_fn(|i| at.iter().map(|mean| mean[i]).sum::<f64>() / 4.0);
        let own = within(mean, mean);
        for [a, b, c, d] in PAIRINGS.map(|pairing| pairing.map(|r| at[r])) {
            let one: [f64; 3] = core::array::from_fn(|i| a[i] - b[i]);
            let two: [f64; 3] = core::array::from_fn(|i| c[i] - d[i]);
            let squares = |of_one: [f64; 3], of_two: [f64; 3]| -> f64 {
                let sum: f64 = (0..3)
                    .map(|i| of_one[i] * one[i] * one[i] + of_two[i] * two[i] * two[i])
                    .sum();
                shares[0] * sum / 16.0
            };
            self.variance += squares(limited(across(c, d)), limited(across(a, b)));
            self.own += squares(own, own);
            self.seen += squares(within(a, b), within(c, d));
            self.among += squares(among, among);
            self.unsure += squares(unsure, unsure);
            self.prior += squares(prior, prior);
            self.product += shares[1] * product(one, two, among, among);
        }
    }
}

/// Squared product of two differences, weighed.
pub(super) fn product(one: [f64; 3], two: [f64; 3], of_one: [f64; 3], of_two: [f64; 3]) -> f64 {
    let dot: f64 = (0..3)
        .map(|i| (of_one[i] * of_two[i]).sqrt() * one[i] * two[i])
        .sum();
    dot * dot
}
