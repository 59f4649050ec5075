//! Contribution of a pixel's replicates to the picture's error estimate: the variance under four
//! weightings, and squared products of differences.

use super::again::SingleReplicateBound;

/// Pairings of four replicates.
const PAIRINGS: [[usize; 4]; 3] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]];

/// Contribution of a pixel to the picture's error estimate.
#[derive(Clone, Copy, Default)]
pub(super) struct Pixel {
    /// Variance of the mean, weighted by the other pair of replicates, and by all four.
    pub variance: f64,
    pub among: f64,
    /// Variance weighted by the mean of all four, and by the mean of the pair itself.
    pub own: f64,
    pub seen: f64,
    /// Squared products of two independent differences between replicates.
    pub product: f64,
    /// Uncertainty of the weight where light was found once: independent between pixels, and common
    /// to all.
    pub unsure: f64,
    pub prior: f64,
}

/// Weights computed from the means of two replicates.
pub(super) type Weigh = fn([f64; 3], [f64; 3]) -> [f64; 3];

impl Pixel {
    /// Adds the means of four replicates. The difference of two has twice the variance of a
    /// replicate, and an eighth of its square estimates the variance of the mean of four. It is
    /// weighted by the other two, by the pair itself, by the mean of all four and by their
    /// products. The first and the last weight are bounded where light was found once.
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

/// Returns the squared, weighted product of two differences.
pub(super) fn product(one: [f64; 3], two: [f64; 3], of_one: [f64; 3], of_two: [f64; 3]) -> f64 {
    let dot: f64 = (0..3)
        .map(|i| (of_one[i] * of_two[i]).sqrt() * one[i] * two[i])
        .sum();
    dot * dot
}
