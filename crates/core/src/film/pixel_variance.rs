//! Contribution of one pixel to the error estimate of the picture: the variance of the pixel's
//! mean, relative to estimates of its squared true colour, and squared products of differences
//! between replicates.

use glam::DVec3;

use super::relative_error::Surroundings;

/// The three ways to divide four replicates into two pairs: indices of the first pair, then of the
/// second pair.
const PAIRINGS: [[usize; 4]; 3] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]];

/// Contribution of a pixel to the error estimate of the picture, see
/// [`uncertainty`](super::uncertainty).
#[derive(Clone, Copy, Default)]
pub(super) struct PixelVariance {
    /// Variance of the pixel's mean with four weights: relative to the likeliest true colour and its
    /// variance, relative to the likeliest colour alone, as the first but at most with the weight of
    /// a small lamp, and times the standard error of the first weight.
    pub variances: [f64; 4],
    /// Squared products of the differences of two disjoint pairs of replicates.
    pub product: f64,
    /// Products of the squared differences of two disjoint pairs: `product` where noise is grey.
    pub square_product: f64,
    /// Product of the variance with the variance of the pixel's neighbours, relative to their own
    /// colour: estimates `product` where a bright sample is so rare that hardly any pixel has two.
    pub neighbour_product: f64,
}

impl PixelVariance {
    /// Adds the absolute variance of the pixel's mean, in squared radiance; all weights are 1. The
    /// other arguments are those of [`Self::add_relative_variance`].
    pub fn add_absolute_variance(
        &mut self,
        at: [DVec3; 4],
        around: &Surroundings,
        shares: [f64; 2],
    ) {
        let weights = [DVec3::ONE, DVec3::ONE, DVec3::ONE, DVec3::ZERO];
        self.add(at, around, shares, |_, _| weights);
    }

    /// Adds the variance of the pixel's mean, relative to the squared true colour. `at` holds the
    /// means of four replicates, `around` what the neighbours say about the true colour. `shares`
    /// are the factors on each of the three [`PAIRINGS`], in the variance and in the products.
    /// `most` is the weight of a small lamp.
    pub fn add_relative_variance(
        &mut self,
        at: [DVec3; 4],
        around: &Surroundings,
        most: DVec3,
        shares: [f64; 2],
    ) {
        self.add(at, around, shares, |own, noise| {
            let [weight, likeliest, deviation] = around.weights(own, noise);
            [weight, likeliest, weight.min(most), deviation]
        });
    }

    /// Adds a variance. `weigh` returns the four weights of a squared difference, given the mean of
    /// replicates that are not part of it, and the variance of that mean over the variance of the
    /// mean of four.
    ///
    /// The difference of two replicates has twice the variance of one. An eighth of the squared
    /// difference therefore estimates the variance of the mean of four.
    fn add(
        &mut self,
        at: [DVec3; 4],
        around: &Surroundings,
        shares: [f64; 2],
        weigh: impl Fn(DVec3, f64) -> [DVec3; 4],
    ) {
        let [of_all, ..] = weigh(at.iter().sum::<DVec3>() / 4.0, 1.0);
        let before = self.variances[0];
        for [a, b, c, d] in PAIRINGS.map(|pairing| pairing.map(|r| at[r])) {
            let (one, two) = (a - b, c - d);
            let [of_one, of_two] = [c + d, a + b].map(|sum| weigh(sum / 2.0, 2.0));
            for ((variance, of_one), of_two) in self.variances.iter_mut().zip(of_one).zip(of_two) {
                let sum = (of_one * one * one + of_two * two * two).element_sum();
                *variance += shares[0] * sum / 16.0;
            }
            let [dot, square, other] =
                [one * two, one * one, two * two].map(|of| (of_all * of).element_sum());
            self.product += shares[1] * dot * dot;
            self.square_product += shares[1] * square * other;
        }
        let [of_near, ..] = weigh(around.mean, 0.0);
        let near = (of_near * around.noise).element_sum() * shares[0] / shares[1];
        self.neighbour_product += (self.variances[0] - before) * near;
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
