//! Test for light that a single replicate of a pixel found: whether other pixels confirm such
//! light, and the denominator of its relative error.
//!
//! A pixel that is lit in one replicate alone may truly be as bright as its mean, as at the edge of
//! a lamp smaller than the pixel. Or the pixel is far darker, as where a path hit a lamp that
//! hardly any path hits. The relative error is a few in the first case and millions in the second,
//! and the pixel's own samples cannot decide between both cases. Other pixels can, if one of their
//! four replicates is held out. Select the pixels where a single replicate of the remaining three
//! found light: the held-out replicate is independent of this selection, so its expected brightness
//! is the true mean of such pixels. If the held-out brightness equals the mean of the three
//! replicates, lamps are small; if it is zero, light is rare.
//!
//! Where lamps are small, the brightness of a pixel that was lit once is as uncertain as a Poisson
//! mean after one event, and its posterior depends on the prior. Under Jeffreys' prior ("An
//! Invariant Form for the Prior Probability in Estimation Problems", 1946) the brightness has a
//! gamma distribution of shape 3/2, with the pixel's mean m as its scale. Then 1/(T² + δ²) has a
//! mean of √(2πm/δ)/m² and a mean square of √(2π)/4 · (m/δ)^(5/2)/m⁴, where m is far above δ. Under
//! a uniform prior the shape is 2, and the mean is ½ ln(1 + m/δ + (m/δ)² e^(−2γ))/m², within a
//! sixth. Scenes of small lamps lie between the two priors, whose means differ by a factor of three
//! or four: Jeffreys' prior takes pixels that are lit once for too dark, the uniform prior for too
//! bright. The geometric mean of both bounds the weight of a pixel's error. The interval includes
//! the uncertainty of a single event and the uncertainty of the prior: a twelfth of the squared
//! distance between both, as for a uniform distribution. Nothing is fitted to a scene. Products of
//! replicates, which have no light in common in such a pixel, would give 1/δ², as if the pixel were
//! black.

use core::f64::consts::TAU;
use core::ops::AddAssign;

use super::relative::FLOOR;

/// Euler's constant γ.
const EULER: f64 = 0.577_215_664_901_532_9;

/// Share of the light of three replicates above which the brightest replicate counts as the only
/// lit replicate.
const ALONE: f64 = 0.8;

/// Bound on the light of a held-out replicate, in multiples of the expected light: a single very
/// bright replicate must not confirm the light of other pixels.
const MOST: f64 = 4.0;

/// Share of the light that must be confirmed.
const ENOUGH: f64 = 0.5;

/// Fewest pixels lit in a single replicate for which the confirmed share is determined, within
/// about a sixth.
const FEWEST: f64 = 40.0;

/// Bound on the weight of a pixel's squared error, for a pixel in which a single replicate found
/// light.
#[derive(Clone, Copy)]
pub(super) struct SingleReplicateBound {
    /// Largest weight of a squared error.
    pub max_weight: [f64; 3],
    /// Relative uncertainty of the weight because a single replicate found light; independent
    /// between pixels.
    pub event_uncertainty: [f64; 3],
    /// Relative uncertainty of the weight due to the prior, common to all pixels.
    pub prior_uncertainty: [f64; 3],
}

impl Default for SingleReplicateBound {
    /// Returns no bound, for light that is not confirmed.
    fn default() -> Self {
        Self {
            max_weight: [f64::INFINITY; 3],
            event_uncertainty: [0.0; 3],
            prior_uncertainty: [0.0; 3],
        }
    }
}

impl SingleReplicateBound {
    /// Returns the bound for a pixel from the mean radiances of its four replicates.
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

/// Statistics of held-out replicates, over pixels where a single one of the other replicates found
/// light.
#[derive(Clone, Copy, Default)]
pub(super) struct LeaveOneOutStats {
    /// Number of held-out replicates.
    held_out: f64,
    /// Sum of the weights of held-out replicates.
    weights: f64,
    /// Sum of the squared weights.
    squared_weights: f64,
    /// Weighted sum of the confirmed light.
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
    /// Adds the means of a pixel's four replicates, each held out in turn. The weight of a held-out
    /// replicate is √m for the mean m of the other three replicates, as in
    /// [`SingleReplicateBound`]: brighter light has a more uncertain error. Pixels too dark for a
    /// relative error are skipped.
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

    /// Whether the held-out replicates confirm enough light, by a margin of two standard errors.
    /// The confirmed light varies by about its own value, and the four held-out replicates of a
    /// pixel count as one.
    pub fn confirms_enough_light(&self) -> bool {
        let error = 2.0 * self.squared_weights.sqrt();
        self.held_out >= 4.0 * FEWEST && self.confirmed_light - 2.0 * error >= ENOUGH * self.weights
    }
}
