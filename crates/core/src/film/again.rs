//! Light that one replicate of a pixel saw and the others did not: whether it is seen again, and
//! what errors are relative to there.
//!
//! Such a pixel may be as bright as its mean says, as at the edge of a lamp smaller than it, or far
//! darker, as where a path met a lamp that hardly any meets. Its error relative to the truth is a
//! few in the first case and millions in the second, and its own samples can't tell. Other pixels
//! can: where one of a pixel's replicates is held out, and of the other three one alone saw light,
//! the one that was held out knows nothing of that choice, and it is as bright on average as such
//! pixels are. If that is what the three have for a mean, lamps are small; if it is nothing, light
//! is rare.
//!
//! Where lamps are small, how bright a pixel is that was lit once is known as well as a Poisson
//! number's mean from one event. What that says depends on what was expected before. Under
//! Jeffreys' prior ("An Invariant Form for the Prior Probability in Estimation Problems", 1946) the
//! brightness has a gamma distribution of shape 3/2 whose scale is the pixel's mean m, and 1/(T² +
//! δ²) a mean of √(2πm/δ)/m² and a mean square of √(2π)/4 · (m/δ)^(5/2)/m⁴ where m is far above δ.
//! If all brightnesses are as likely before, the shape is 2, and the mean ½ ln(1 + m/δ + (m/δ)²
//! e^(−2γ))/m², to a sixth. Scenes of small lamps lie between the two, a factor of three or four
//! apart: the first takes pixels for too dark that are lit once, and the second for too bright. The
//! geometric mean is the most that a pixel's error is weighed by. Both what one event leaves open
//! and where between the two the truth is, a twelfth of their squared distance as of an even
//! distribution, belong to the interval. None of it is fitted to a scene. Products of replicates,
//! which have nothing in common there, would say 1/δ², as if the pixel were black.

use core::f64::consts::TAU;
use core::ops::AddAssign;

use super::relative::FLOOR;

/// Euler's constant γ.
const EULER: f64 = 0.577_215_664_901_532_9;

/// Share of the light of three replicates that one alone saw.
const ALONE: f64 = 0.8;

/// Light that is seen again counts for no more than so many times what was expected: one that is
/// brighter still says nothing of the others.
const MOST: f64 = 4.0;

/// Share of what was seen that is to be seen again.
const ENOUGH: f64 = 0.5;

/// Pixels with such light, for their share to be known to a sixth or so.
const FEWEST: f64 = 40.0;

/// What is known of the square of a pixel's true colour where light was seen once.
#[derive(Clone, Copy)]
pub(super) struct SingleReplicateBound {
    /// Most that a squared error is weighed by.
    pub most: [f64; 3],
    /// How far such a weight may be off by one event, as a share of it: by chance, in each pixel
    /// another way.
    pub deviation: [f64; 3],
    /// And by what was expected before, in all pixels the same way.
    pub prior: [f64; 3],
}

impl Default for SingleReplicateBound {
    /// Where nothing vouches for such light.
    fn default() -> Self {
        Self {
            most: [f64::INFINITY; 3],
            deviation: [0.0; 3],
            prior: [0.0; 3],
        }
    }
}

impl SingleReplicateBound {
    /// By the means of four replicates.
    pub fn of(four: [[f64; 3]; 4]) -> Self {
        let mean: [f64; 3] =
            core::array::from_fn(|i| four.iter().map(|mean| mean[i]).sum::<f64>().max(0.0) / 4.0);
        let over = mean.map(|mean| mean / FLOOR.sqrt());
        // Where it is black the factor falls out, and must be a number.
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
            most: core::array::from_fn(|i| (jeffreys[i] * even[i]).sqrt()),
            deviation: over.map(|over| (over * over.sqrt() / (4.0 * TAU.sqrt())).sqrt()),
            prior: core::array::from_fn(|i| {
                libm::log(jeffreys[i] / even[i]).abs() / 12.0_f64.sqrt()
            }),
        }
    }
}

/// What the held out say of light that one replicate alone saw.
#[derive(Clone, Copy, Default)]
pub(super) struct LeaveOneOut {
    /// Replicates held out.
    held: f64,
    /// Weights, their squares, and what was seen again times the weights.
    weights: f64,
    squares: f64,
    seen: f64,
}

impl AddAssign for LeaveOneOut {
    fn add_assign(&mut self, other: Self) {
        self.held += other.held;
        self.weights += other.weights;
        self.squares += other.squares;
        self.seen += other.seen;
    }
}

impl LeaveOneOut {
    /// Adds what the means of four replicates say, each held out in turn. The brighter the light
    /// the more its error is in doubt, and the more it counts: by √m, as in
    /// [`SingleReplicateBound`]. Of pixels too dark to have a relative error of their own nothing
    /// is to be learned.
    pub fn add(&mut self, four: [[f64; 3]; 4]) {
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
                    held: 1.0,
                    weights: mean.sqrt(),
                    squares: mean,
                    seen: (bright[held] / mean).min(MOST) * mean.sqrt(),
                };
            }
        }
    }

    /// Whether enough is seen again, as surely as two standard errors say. What is seen again
    /// varies by about as much as it is, and the four of a pixel count as one.
    pub fn is_enough(&self) -> bool {
        let error = 2.0 * self.squares.sqrt();
        self.held >= 4.0 * FEWEST && self.seen - 2.0 * error >= ENOUGH * self.weights
    }
}
