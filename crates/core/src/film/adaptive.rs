//! Adaptive sampling. After each round over the picture, the film chooses how many samples each
//! tile gets in the next round, until the requested error is reached.
//!
//! A tile must not choose its own sample count by its own samples. Otherwise, a tile that stops
//! before it has found a rare bright path would be too dark on average. Replicates (independent
//! renders of the picture, see [`film`](crate::film)) therefore form two halves, even and odd. The
//! samples of each half choose the sample counts of the opposite half. In the end every replicate
//! has the same weight, whatever its number of samples. A slight dependence remains: the picture of
//! a round determines whether the render ends.
//!
//! A tile with n samples has a squared error of v/n, where v is the variance of one sample. For a
//! given total of samples, the sum of these errors is least if n is proportional to √v (Neyman, "On
//! the Two Different Aspects of the Representative Method", 1934). An estimate of v from few
//! replicates is noisy. Estimates are therefore averaged over neighbouring tiles, and a tile of low
//! variance still gets a minimum of samples. Sample counts are rounded to numbers of points for
//! which the sample sequence is well distributed.

use super::relative_error::relative_error_weights;
use super::{EstimateDoubt, Film, FilmPlan, ReplicateBuffer, Uncertainty};
use crate::denoise::denoise;
use crate::observer::Observer;

/// Samples per pixel of a replicate in the first round.
const FIRST_ROUND_SAMPLES: u32 = 4;

/// Greatest factor by which a round increases the total number of samples.
const GROWTH: f64 = 1.25;

/// Least factor by which a round increases the total number of samples, while the error is too
/// large.
const LEAST_GROWTH: f64 = 1.0625;

/// Greatest factor by which a round increases the samples of a tile. The estimated variance of a
/// single tile may be wrong.
const TILE_GROWTH: u32 = 2;

/// Least number of samples of a tile, relative to a tile of mean variance.
const LEAST_TILE_WEIGHT: f64 = 0.25;

/// Samples of every pixel after which a nearly black picture ends. Unless its light is rarer than that, its
/// mean radiance is known, so that more samples leave its error unknown.
const SAMPLES_OF_BLACK: u32 = 256;

/// Progress of a film towards a requested error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ErrorProgress {
    /// The upper end of the confidence interval of the error is at most the requested error.
    Reached,
    /// More samples are needed.
    NeedsSamples,
    /// The error is too large, but every pixel has the greatest number of samples, or the picture is nearly
    /// black.
    Exhausted,
}

/// Doubtful error estimate, which did not stop adaptive sampling. The estimated error had reached
/// the requested error, but the render continued because of the doubt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubtfulErrorEstimate {
    /// Least and greatest number of samples per pixel when the doubtful estimate was made.
    pub samples: [u32; 2],
    /// The doubtful estimate: the root of the mean relative squared error (root relMSE).
    pub error: f64,
    /// Reason to doubt the estimate.
    pub doubt: EstimateDoubt,
}

/// Returns the samples per pixel of each replicate in the first round of adaptive sampling.
pub(super) fn first_round_samples(plan: &FilmPlan) -> u16 {
    FIRST_ROUND_SAMPLES.min(plan.replicate_samples(plan.replicates - 1)) as u16
}

/// Rounds a sample count down to an allowed count. There are eight allowed counts between a power
/// of two and the next.
fn round_down_to_allowed_count(samples: f64) -> u32 {
    let whole = samples.clamp(1.0, f64::from(u16::MAX)) as u32;
    whole >> whole.ilog2().saturating_sub(3) << whole.ilog2().saturating_sub(3)
}

impl Film {
    /// Sets the sample counts of the next round, after a complete round. Sampling continues until
    /// the root relMSE is below `error`. For a picture to be denoised, this is the error of the
    /// denoised picture.
    pub(crate) fn plan_next_round(&mut self, error: f64, observer: &dyn Observer) -> ErrorProgress {
        if self.is_replayed {
            return ErrorProgress::Exhausted;
        }
        let denoised = if self.is_to_be_denoised() {
            denoise(self, observer).ok()
        } else {
            None
        };
        let noisy = match &denoised {
            Some(denoised) => denoised.noisy_error,
            None => self.estimate_uncertainty(),
        };
        let is_reached = noisy.is_some_and(|noisy| match &denoised {
            Some(denoised) => denoised.reaches_error(error, &noisy),
            None => noisy.is_error_below(error),
        });
        if is_reached {
            return ErrorProgress::Reached;
        }
        let doubt = noisy.and_then(|noisy| noisy.doubt);
        let fewest = *self.sample_range(&self.full_part()).start();
        if doubt == Some(EstimateDoubt::NearlyBlack) && fewest >= SAMPLES_OF_BLACK {
            return ErrorProgress::Exhausted;
        }
        let uncertainty = denoised.map(|denoised| denoised.error).or(noisy);
        if let Some((claimed, doubt)) = uncertainty
            .and_then(|uncertainty| Some((uncertainty.root_relmse.value, uncertainty.doubt?)))
            && claimed <= error
            && self.rejected_stop.is_none()
        {
            let samples = self.sample_range(&self.full_part());
            self.rejected_stop = Some(DoubtfulErrorEstimate {
                samples: [*samples.start(), *samples.end()],
                error: claimed,
                doubt,
            });
        }
        // A squared error falls at least as fast as samples are added.
        let needed = |uncertainty: Uncertainty| {
            let bound = if self.is_to_be_denoised() {
                uncertainty.root_relmse.one_sided_bound()
            } else {
                uncertainty.root_relmse.high
            };
            (bound / error) * (bound / error)
        };
        let lacking = uncertainty
            .filter(|uncertainty| uncertainty.doubt.is_none())
            .map_or(GROWTH, needed);
        let (done, _) = self.progress(&self.full_part());
        // A doubtful estimate does not decide the added samples, but bounds their final number from
        // below.
        self.expected_samples = (done as f64
            * uncertainty.map_or(lacking, |uncertainty| needed(uncertainty).max(lacking)))
            as u64;
        let growth = lacking.clamp(LEAST_GROWTH, GROWTH);
        let decided = [growth, GROWTH].into_iter().find_map(|growth| {
            let halves = [0, 1].map(|half| self.increase_sample_counts(half, growth));
            halves.iter().any(Option::is_some).then_some(halves)
        });
        let Some(halves) = decided else {
            return ErrorProgress::Exhausted;
        };
        let tiles = self.plan.tile_count() as usize;
        for (half, goals) in (0..).zip(halves) {
            let Some(goals) = goals else { continue };
            for replicate in (half..self.plan.replicates).step_by(2) {
                let maximum = self.plan.replicate_samples(replicate);
                let all = &mut self.sample_goals[replicate as usize * tiles..][..tiles];
                all.iter_mut()
                    .zip(&goals)
                    .for_each(|(goal, &n)| *goal = n.min(maximum) as u16);
            }
        }
        ErrorProgress::NeedsSamples
    }

    /// Returns the record of the first doubtful error estimate at or below the requested error.
    /// `None` without such an estimate, and for films read from files.
    pub fn first_doubtful_estimate(&self) -> Option<DoubtfulErrorEstimate> {
        self.rejected_stop
    }

    /// Returns the new sample counts per pixel of all tiles, for one half of the replicates: 0
    /// selects even, 1 odd replicates. The new total is at most `growth` times the present total.
    /// `None` if no count increases.
    fn increase_sample_counts(&self, half: u32, growth: f64) -> Option<Vec<u32>> {
        let shares = self.compute_tile_weights(1 - half);
        let maximum = self.plan.replicate_samples(self.plan.replicates - 1);
        let tiles: Vec<(u32, f64, f64)> = (0..self.plan.tile_count())
            .zip(shares)
            .map(|(tile, share)| {
                (
                    self.sample_goal(tile, half),
                    share,
                    self.plan.tile_pixel_count(tile) as f64,
                )
            })
            .collect();
        let at = |scale: f64, now: u32, share: f64| {
            let limit = now.saturating_mul(TILE_GROWTH).min(maximum);
            now.max(round_down_to_allowed_count(scale * share).min(limit))
        };
        let total = |scale: f64| {
            tiles
                .iter()
                .map(|&(now, share, pixels)| pixels * f64::from(at(scale, now, share)))
                .sum::<f64>()
        };
        let allowed = growth * total(0.0);
        let (mut low, mut high) = (0.0, 2.0 * f64::from(maximum));
        if total(high) > allowed {
            for _ in 0..64 {
                let middle = f64::midpoint(low, high);
                if total(middle) <= allowed {
                    low = middle
                } else {
                    high = middle
                }
            }
        } else {
            low = high;
        }
        let raised: Vec<u32> = tiles
            .iter()
            .map(|&(now, share, _)| at(low, now, share))
            .collect();
        tiles
            .iter()
            .zip(&raised)
            .any(|(&(now, ..), &n)| n > now)
            .then_some(raised)
    }

    /// Returns the weight of each tile for the distribution of samples, in 0..1 with a greatest
    /// weight of 1. Weights are estimated from one half of the replicates.
    fn compute_tile_weights(&self, half: u32) -> Vec<f64> {
        let variances = self.smooth_over_tiles(&self.estimate_tile_variances(half));
        let mean = variances.iter().sum::<f64>() / variances.len() as f64;
        let roots = variances
            .iter()
            .map(|variance| variance.sqrt().max(LEAST_TILE_WEIGHT * mean.sqrt()));
        let largest = roots.clone().fold(f64::MIN_POSITIVE, f64::max);
        // Without variance, all tiles have equal weight.
        roots
            .map(|root| if mean > 0.0 { root / largest } else { 1.0 })
            .collect()
    }

    /// Returns for each tile the relative variance of one sample, averaged over the tile's pixels.
    /// The first two replicates of one half give the estimate.
    fn estimate_tile_variances(&self, half: u32) -> Vec<f64> {
        let pair: Vec<&ReplicateBuffer> = self
            .buffers
            .iter()
            .skip(half as usize)
            .step_by(2)
            .take(2)
            .flatten()
            .collect();
        let [first, second] = pair[..] else {
            return vec![0.0; self.plan.tile_count() as usize];
        };
        let means = |buffer: &ReplicateBuffer| -> Vec<[f64; 3]> {
            let value_of = |pixel: usize| {
                buffer
                    .pixel_total(pixel)
                    .map(|sum| sum / f64::from(buffer.samples[pixel].max(1)))
            };
            (0..self.plan.pixel_count()).map(value_of).collect()
        };
        let (a, b) = (means(first), means(second));
        let mut sums = vec![0.0; self.plan.tile_count() as usize];
        for (pixel, weights) in relative_error_weights(&a, &b, self.plan.crop.width as usize)
            .into_iter()
            .enumerate()
        {
            let samples = f64::from(first.samples[pixel]) + f64::from(second.samples[pixel]);
            // The mean of two replicates has a variance of a quarter of their squared difference.
            let square = |i: usize| (a[pixel][i] - b[pixel][i]) * (a[pixel][i] - b[pixel][i]);
            let of_sample = samples * (0..3).map(|i| weights[i] * square(i) / 4.0).sum::<f64>();
            let tile = self.plan.tile_of_pixel(pixel);
            sums[tile as usize] += of_sample / self.plan.tile_pixel_count(tile) as f64;
        }
        sums
    }

    /// Returns for each tile the weighted mean of its value and the values of its eight neighbours.
    /// The tile itself weighs most, its corner neighbours least.
    fn smooth_over_tiles(&self, values: &[f64]) -> Vec<f64> {
        let columns = self.plan.tile_columns() as usize;
        let near =
            |position: usize, end: usize| position.saturating_sub(1)..(position + 2).min(end);
        let at = |tile: usize| {
            let (x, y) = (tile % columns, tile / columns);
            let (mut sum, mut weights) = (0.0, 0.0);
            for (row, column) in near(y, values.len() / columns)
                .flat_map(|row| near(x, columns).map(move |column| (row, column)))
            {
                let weight = if row == y { 2.0 } else { 1.0 } * if column == x { 2.0 } else { 1.0 };
                sum += weight * values[row * columns + column];
                weights += weight;
            }
            sum / weights
        };
        (0..values.len()).map(at).collect()
    }
}
