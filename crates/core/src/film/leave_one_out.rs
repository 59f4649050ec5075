//! Pixels that only one of their four replicates found lit: a test whether such pixels are truly
//! lit, and the denominator of their relative error.
//!
//! A pixel lit in one replicate alone may truly be as bright as its mean: it may show the edge of a
//! lamp smaller than the pixel. Or it may be far darker, because one path hit a lamp that hardly
//! any path hits. Its relative error is a few in the first case and millions in the second. The
//! pixel's own samples cannot distinguish these cases.
//!
//! Many pixels together can. Hold out one of the four replicates of each pixel, and select the
//! pixels in which only one of the remaining three replicates found light. The held-out replicate
//! is independent of this selection: its expected brightness is the true mean of the selected
//! pixels. If the held-out brightness equals the mean of the three replicates, lamps are small. If
//! it is zero, light is rare.
//!
//! Consider small lamps. The true brightness T of a pixel lit once is as uncertain as a Poisson
//! mean after one event, and its posterior depends on the prior. Let m be the pixel's mean and δ²
//! the constant 0.01 in the denominator T² + δ² of relative squared errors.
//!
//! - Jeffreys' prior ("An Invariant Form for the Prior Probability in Estimation Problems", 1946):
//!   T has a gamma distribution of shape 3/2 and scale m. If m is far above δ, then 1/(T² + δ²) has
//!   the mean √(2πm/δ)/m² and the mean square √(2π)/4 · (m/δ)^(5/2)/m⁴.
//! - Uniform prior: the shape is 2, and the mean is ½ ln(1 + m/δ + (m/δ)² e^(−2γ))/m², within a
//!   sixth. Here γ is Euler's constant.
//!
//! Jeffreys' prior takes pixels lit once for too dark, the uniform prior for too bright; their
//! means differ by a factor of three or four. The geometric mean of both means bounds the weight of
//! a pixel's error. Two uncertainties widen the interval of the error: that of a single event, and
//! that of the prior. The latter is a twelfth of the squared distance between both priors, as for a
//! uniform distribution. Nothing is fitted to a scene.
//!
//! Products of replicates could not serve as denominators. In such a pixel they are zero, and would
//! give 1/δ², as if the pixel were black.

use core::f64::consts::TAU;
use core::ops::AddAssign;

use super::relative_error::FLOOR;

/// Euler's constant γ.
const EULER: f64 = 0.577_215_664_901_532_9;

/// Fraction of the light of three replicates above which the brightest of them counts as the only
/// lit replicate.
const ALONE: f64 = 0.8;

/// Greatest light of a held-out replicate that counts, in multiples of the expected light: a single
/// very bright replicate must not confirm the light of other pixels.
const MOST: f64 = 4.0;

/// Fraction of the light that held-out replicates must confirm.
const ENOUGH: f64 = 0.5;

/// Fewest pixels lit in a single replicate for which the confirmed fraction is known within about a
/// sixth.
const FEWEST: f64 = 40.0;

/// Bound on the weight (inverse denominator) of a pixel's squared error, for a pixel that a single
/// replicate found lit.
#[derive(Clone, Copy)]
pub(super) struct SingleReplicateBound {
    /// Greatest weight of the squared error, per channel.
    pub max_weight: [f64; 3],
    /// Relative uncertainty of the weight because a single replicate found light. Independent from
    /// pixel to pixel.
    pub event_uncertainty: [f64; 3],
    /// Relative uncertainty of the weight because of the prior. Common to all pixels.
    pub prior_uncertainty: [f64; 3],
}

impl Default for SingleReplicateBound {
    /// Returns an infinite bound, for light that is not confirmed.
    fn default() -> Self {
        Self {
            max_weight: [f64::INFINITY; 3],
            event_uncertainty: [0.0; 3],
            prior_uncertainty: [0.0; 3],
        }
    }
}

impl SingleReplicateBound {
    /// Returns the bound for a pixel, given the mean radiances of its four replicates.
    pub fn from_means(four: [[f64; 3]; 4]) -> Self {
        let mean: [f64; 3] =
            core::array::from_fn(|i| four.iter().map(|mean| mean[i]).sum::<f64>().max(0.0) / 4.0);
        let over = mean.map(|mean| mean / FLOOR.sqrt());
        // For a black pixel the factor cancels, but must be a number.
        let weigh = |i: usize, factor: f64| {
            1.0 / (mean[i] * mean[i] / factor.max(f64::MIN_POSITIVE) + FLOOR)
        };
        let jeffreys: [f64; 3] = core::array::from_fn(|i| weigh(i, 1.0 + (TAU * over[i]).sqrt()));
        let even: [f64; 3] = core::array::from_fn(|i| {
            weigh(
                i,
                libm::log1p(over[i] + over[i] * over[i] * libm::exp(-2.0 * EULER)) / 2.0,
            )
        });
        Self {
            max_weight: core::array::from_fn(|i| (jeffreys[i] * even[i]).sqrt()),
            event_uncertainty: over.map(|over| (over * over.sqrt() / (4.0 * TAU.sqrt())).sqrt()),
            prior_uncertainty: core::array::from_fn(|i| {
                libm::log(jeffreys[i] / even[i]).abs() / 12.0_f64.sqrt()
            }),
        }
    }
}

/// Statistics over held-out replicates of pixels in which only one of the remaining three
/// replicates found light.
#[derive(Clone, Copy, Default)]
pub(super) struct LeaveOneOutStats {
    /// Number of held-out replicates.
    held_out: f64,
    /// Sum of the weights of the held-out replicates.
    weights: f64,
    /// Sum of the squared weights of the held-out replicates.
    squared_weights: f64,
    /// Weighted sum of the ratio of held-out light to expected light.
    confirmed_light: f64,
}

impl AddAssign for LeaveOneOutStats {
    fn add_assign(&mut self, other: Self) {
        self.held_out += other.held_out;
        self.weights += other.weights;
        self.squared_weights += other.squared_weights;
        self.confirmed_light += other.confirmed_light;
    }
}

impl LeaveOneOutStats {
    /// Adds a pixel, given the mean radiances of its four replicates. Each replicate is held out in
    /// turn.
    ///
    /// A held-out replicate has the weight √m, with the mean m of the other three replicates, as in
    /// [`SingleReplicateBound`]: the error of brighter light is more uncertain. Pixels too dark for
    /// a relative error are skipped.
    pub fn add_pixel(&mut self, four: [[f64; 3]; 4]) {
        let bright = four.map(|mean| (mean[0] + mean[1] + mean[2]) / 3.0);
        for held in 0..4 {
            let others = (0..4)
                .filter(|&other| other != held)
                .map(|other| bright[other]);
            let (sum, largest) = others.fold((0.0, 0.0), |(sum, largest): (f64, f64), of| {
                (sum + of, largest.max(of))
            });
            let mean = sum / 3.0;
            if mean > FLOOR.sqrt() && largest >= ALONE * sum {
                *self += Self {
                    held_out: 1.0,
                    weights: mean.sqrt(),
                    squared_weights: mean,
                    confirmed_light: (bright[held] / mean).min(MOST) * mean.sqrt(),
                };
            }
        }
    }

    /// Whether the held-out replicates confirm the fraction [`ENOUGH`] of the light, by a margin of
    /// two standard errors. The confirmed light varies by about its own value. The four held-out
    /// replicates of a pixel count as one.
    pub fn confirms_enough_light(&self) -> bool {
        let error = 2.0 * self.squared_weights.sqrt();
        self.held_out >= 4.0 * FEWEST && self.confirmed_light - 2.0 * error >= ENOUGH * self.weights
    }
}
