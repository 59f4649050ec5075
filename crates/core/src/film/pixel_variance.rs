//! Contribution of one pixel to the error estimate of the picture: the variance of the pixel's
//! mean, relative to four estimates of its squared true colour, and squared products of differences
//! between replicates.

use glam::DVec3;

use super::leave_one_out::SingleReplicateBound;
use super::relative_error::{
    weights_from_four_replicates, weights_from_independent_pair, weights_from_same_pair,
};

/// The three ways to divide four replicates into two pairs: indices of the first pair, then of the
/// second pair.
const PAIRINGS: [[usize; 4]; 3] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]];

/// Contribution of a pixel to the error estimate of the picture, see
/// [`uncertainty`](super::uncertainty).
#[derive(Clone, Copy, Default)]
pub(super) struct PixelVariance {
    /// Variance of the pixel's mean, relative to the squared true colour. The squared difference of
    /// each pair of replicates is relative to the product of the opposite pair.
    pub variance: f64,
    /// The same variance, relative to the products of all four replicates.
    pub by_four: f64,
    /// The same variance, relative to the squared mean of all four replicates.
    pub by_mean: f64,
    /// The same variance; the squared difference of each pair is relative to the squared mean of
    /// the same pair.
    pub by_pair_mean: f64,
    /// Squared products of the differences of two disjoint pairs of replicates. Their sum over
    /// pixels gives the uncertainty of the variance.
    pub product: f64,
    /// Uncertainty of the weight where a single replicate found light, without the part of the
    /// prior. Independent from pixel to pixel.
    pub event_uncertainty: f64,
    /// Uncertainty of this weight because of the prior. Common to all pixels.
    pub prior_uncertainty: f64,
}

impl PixelVariance {
    /// Adds the absolute variance of the pixel's mean, in squared radiance. `at` holds the means of
    /// four replicates. `shares` are the factors on each of the three [`PAIRINGS`], in the variance
    /// and in the products.
    ///
    /// The difference of two replicates has twice the variance of one. An eighth of the squared
    /// difference therefore estimates the variance of the mean of four. An absolute variance needs
    /// no weights: all four variants are equal.
    pub fn add_absolute_variance(&mut self, at: [DVec3; 4], shares: [f64; 2]) {
        for [a, b, c, d] in PAIRINGS.map(|pairing| pairing.map(|r| at[r])) {
            let (one, two) = (a - b, c - d);
            let squares = shares[0] * (one * one + two * two).element_sum() / 16.0;
            let dot = (one * two).element_sum();
            self.variance += squares;
            self.by_mean += squares;
            self.by_pair_mean += squares;
            self.by_four += squares;
            self.product += shares[1] * (dot * dot);
        }
    }

    /// Adds the variance of the pixel's mean, relative to the squared true colour. `at` holds the
    /// means of four replicates. `shares` are the factors on each of the three [`PAIRINGS`], in the
    /// variance and in the products.
    ///
    /// Four variants weight the difference of two replicates: by the opposite pair, by the same
    /// pair, by the mean of all four, and by the products of all four. Where a single replicate
    /// found light, `once` bounds the first and the last weight.
    pub fn add_relative_variance(
        &mut self,
        at: [DVec3; 4],
        once: Option<SingleReplicateBound>,
        shares: [f64; 2],
    ) {
        let most = once.map_or(DVec3::INFINITY, |once| once.max_weight.into());
        let limited = |weights: DVec3| weights.min(most);
        let unlimited = weights_from_four_replicates(at);
        let among = limited(unlimited);
        let [unsure, prior] = once.map_or([DVec3::ZERO; 2], |once| {
            let is_limited = unlimited.cmpgt(most);
            [once.event_uncertainty, once.prior_uncertainty]
                .map(|by| DVec3::select(is_limited, most * DVec3::from(by), DVec3::ZERO))
        });
        let mean = (at[0] + at[1] + at[2] + at[3]) / 4.0;
        let own = weights_from_same_pair(mean, mean);
        for [a, b, c, d] in PAIRINGS.map(|pairing| pairing.map(|r| at[r])) {
            let (one, two) = (a - b, c - d);
            let squares = |of_one: DVec3, of_two: DVec3| -> f64 {
                let sum = (of_one * one * one + of_two * two * two).element_sum();
                shares[0] * sum / 16.0
            };
            self.variance += squares(
                limited(weights_from_independent_pair(c, d)),
                limited(weights_from_independent_pair(a, b)),
            );
            self.by_mean += squares(own, own);
            self.by_pair_mean +=
                squares(weights_from_same_pair(a, b), weights_from_same_pair(c, d));
            self.by_four += squares(among, among);
            self.event_uncertainty += squares(unsure, unsure);
            self.prior_uncertainty += squares(prior, prior);
            // Both differences of a product have the same weight, so the root of the product of
            // weights is that weight.
            let dot = (among * one * two).element_sum();
            self.product += shares[1] * (dot * dot);
        }
    }
}

/// Returns (Σᵢ √(uᵢ·vᵢ)·aᵢ·bᵢ)², summed over the channels i. The differences are a = `one` and b =
/// `two`, their weights u = `of_one` and v = `of_two`.
pub(super) fn squared_weighted_dot(
    one: [f64; 3],
    two: [f64; 3],
    of_one: [f64; 3],
    of_two: [f64; 3],
) -> f64 {
    let dot: f64 = (0..3)
        .map(|i| (of_one[i] * of_two[i]).sqrt() * one[i] * two[i])
        .sum();
    dot * dot
}
