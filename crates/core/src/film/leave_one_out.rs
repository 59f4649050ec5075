//! Pixels that only one of their four replicates found lit: a test whether such pixels are truly
//! lit, and the denominator of their relative error if they are.
//!
//! A pixel lit in one replicate alone may truly be as bright as its mean: it may show the edge of a
//! lamp smaller than the pixel. Or it may be as dark as its neighbours, because one path hit a lamp
//! that hardly any path hits. Its relative error is a few in the first case and millions in the
//! second. The pixel's own samples cannot distinguish these cases.
//!
//! Many pixels together can. Hold out one of the four replicates of each pixel, and select the
//! pixels in which only one of the remaining three replicates is brighter than the neighbours. The
//! held-out replicate is independent of this selection: its expected excess over the neighbours is
//! the true excess of the selected pixels. If it equals the mean excess of the three replicates,
//! lamps are small. If it is zero, bright samples are rare.
//!
//! Consider small lamps. The true brightness T of a pixel lit once is as uncertain as a Poisson
//! mean after one event, and its posterior depends on the prior. Let m be the pixel's mean and δ²
//! the constant 0.01 in the denominator T² + δ² of relative squared errors.
//!
//! - Jeffreys' prior ("An Invariant Form for the Prior Probability in Estimation Problems", 1946):
//!   T has a gamma distribution of shape 3/2 and scale m. If m is far above δ, then 1/(T² + δ²) has
//!   the mean √(2πm/δ)/m².
//! - Uniform prior: the shape is 2, and the mean is ½ ln(1 + m/δ + (m/δ)² e^(−2γ))/m², within a
//!   sixth. Here γ is Euler's constant.
//!
//! Jeffreys' prior takes pixels lit once for too dark, the uniform prior for too bright; their
//! means differ by a factor of three or four. The geometric mean of both means bounds the weight of
//! a pixel's error. Nothing is fitted to a scene.

use core::f64::consts::TAU;
use core::ops::AddAssign;

use glam::DVec3;

use super::relative_error::FLOOR;

/// Euler's constant γ.
const EULER: f64 = 0.577_215_664_901_532_9;

/// Fraction of the light of three replicates above which the brightest of them counts as the only
/// lit replicate.
const ALONE: f64 = 0.8;

/// Greatest light of a held-out replicate that counts, in multiples of the expected light: a single
/// very bright replicate must not confirm the light of other pixels.
const MOST: f64 = 4.0;

/// Greatest fraction of the light of small lamps at which light is that of bright samples.
const NEARLY_NONE: f64 = 0.2;

/// Returns the weight (inverse denominator) of the squared error of a pixel that a single replicate
/// found lit, per channel, given the mean radiances of its four replicates: for small lamps, no
/// weight is greater.
pub(super) fn weight_of_small_lamp(four: [DVec3; 4]) -> DVec3 {
    let mean = (four.iter().sum::<DVec3>() / 4.0).max(DVec3::ZERO);
    let weigh = |mean: f64| {
        let over = mean / FLOOR.sqrt();
        // For a black pixel the factor cancels, but must be a number.
        let [jeffreys, even] = [
            1.0 + (TAU * over).sqrt(),
            libm::log1p(over + over * over * libm::exp(-2.0 * EULER)) / 2.0,
        ]
        .map(|factor| 1.0 / (mean * mean / factor.max(f64::MIN_POSITIVE) + FLOOR));
        (jeffreys * even).sqrt()
    };
    DVec3::from(mean.to_array().map(weigh))
}

/// Statistics over held-out replicates of pixels in which only one of the remaining three
/// replicates found light.
#[derive(Clone, Copy, Default)]
pub(super) struct LeaveOneOutStats {
    /// Sum of the weights of the held-out replicates.
    weights: f64,
    /// Sum of the squared weights of the held-out replicates.
    squared_weights: f64,
    /// Weighted sum of the ratio of held-out light to expected light.
    confirmed_light: f64,
}

impl AddAssign for LeaveOneOutStats {
    fn add_assign(&mut self, other: Self) {
        self.weights += other.weights;
        self.squared_weights += other.squared_weights;
        self.confirmed_light += other.confirmed_light;
    }
}

impl LeaveOneOutStats {
    /// Adds a pixel, given the mean radiances of its four replicates and of its neighbours. Each
    /// replicate is held out in turn.
    ///
    /// A held-out replicate has the weight √m, with the mean excess m of the other three replicates
    /// over the neighbours: the error of brighter light is more uncertain. Pixels too dark for a
    /// relative error are skipped.
    pub fn add_pixel(&mut self, four: [[f64; 3]; 4], neighbours: DVec3) {
        let bright = four.map(|mean| (DVec3::from(mean) - neighbours).element_sum() / 3.0);
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
                    weights: mean.sqrt(),
                    squared_weights: mean,
                    confirmed_light: (bright[held] / mean).min(MOST) * mean.sqrt(),
                };
            }
        }
    }

    /// Returns the fraction of the light that is confirmed, at least and at most, by a margin of two
    /// standard errors. The confirmed light varies by about its own value.
    fn confirmed_fraction(&self) -> [f64; 2] {
        let error = 2.0 * self.squared_weights.sqrt();
        [-error, error].map(|error| (self.confirmed_light + error) / self.weights)
    }

    /// Returns the fraction of the light that is certainly of small lamps.
    pub fn fraction_of_lamps(&self) -> f64 {
        let [least, _] = self.confirmed_fraction();
        if self.weights > 0.0 {
            least.clamp(0.0, 1.0)
        } else {
            0.0
        }
    }

    /// Whether the light is certainly that of rare bright samples.
    pub fn excludes_lamps(&self) -> bool {
        let [_, most] = self.confirmed_fraction();
        most <= NEARLY_NONE
    }
}
