//! Samples where the error is: after each round over the picture, which tiles are to have how many
//! more, until the error that was asked for is reached.
//!
//! What a tile has met must not decide how its own samples count: a tile that stops because it has
//! not met a rare bright path is too dark on average. Replicates therefore form two halves, each of
//! which decides how many samples the *other* takes, and every replicate counts the same in the
//! end, however many samples it has. What remains is that a round's picture decides when all ends.
//!
//! Squared errors of a tile with n samples sum up to v/n, and for a given number of samples in all
//! their sum is least where n is proportional to √v (Neyman, "On the Two Different Aspects of the
//! Representative Method", 1934). v is known from few replicates, so that it is smoothed over
//! neighbours and no tile falls behind for looking quiet; numbers of samples are those of a coarse
//! grid, at which points of a sequence are even.

use super::relative::weights;
use super::{Doubt, Film, Plan, ReplicateBuffer, Uncertainty};
use crate::denoise::denoise;
use crate::observer::Observer;

/// Samples of a replicate in the first round.
const FIRST: u32 = 4;

/// A round adds at most this share of the samples that there are.
const GROWTH: f64 = 1.25;

/// And, as long as the error is too large, at least this.
const LEAST_GROWTH: f64 = 1.0625;

/// No tile grows by more than this in a round: what it knows of itself may be wrong.
const TILE_GROWTH: u32 = 2;

/// Every tile takes at least this share of the samples that one with the mean variance takes.
const QUIET: f64 = 0.25;

/// How far a film has come towards an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Aim {
    /// It is below, as surely as the interval says.
    Reached,
    /// More samples are to be taken.
    Further,
    /// It is not, and no pixel may have more samples.
    Exhausted,
}

/// Why a picture went on although the error that was asked for seemed to be reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubtedAim {
    /// Least and most samples of a pixel that there were.
    pub samples: [u32; 2],
    /// The root relMSE that they claimed.
    pub error: f64,
    /// Why the claim could not be trusted.
    pub doubt: Doubt,
}

/// Samples of a replicate in the first round.
pub(super) fn first(plan: &Plan) -> u16 {
    FIRST.min(plan.samples_of(plan.replicates - 1)) as u16
}

/// The nearest number of samples from below that a tile may have: eight to the octave.
fn on_grid(samples: f64) -> u32 {
    let whole = samples.clamp(1.0, f64::from(u16::MAX)) as u32;
    whole >> whole.ilog2().saturating_sub(3) << whole.ilog2().saturating_sub(3)
}

impl Film {
    /// Decides after a whole round what the next one is to take for a root relMSE below `error`.
    /// Where the picture is to be denoised, that is the denoised one's.
    pub(crate) fn aim(&mut self, error: f64, observer: &dyn Observer) -> Aim {
        if self.is_replayed {
            return Aim::Exhausted;
        }
        let noisy = self.uncertainty();
        let denoised = if self.is_to_be_denoised() {
            denoise(self, observer).ok()
        } else {
            None
        };
        let is_reached = noisy.is_some_and(|noisy| match &denoised {
            Some(denoised) => denoised.reaches(error, &noisy),
            None => noisy.reaches(error),
        });
        if is_reached {
            return Aim::Reached;
        }
        let claimed = denoised.map(|denoised| denoised.error).or(noisy);
        if let Some((claimed, doubt)) =
            claimed.and_then(|claimed| Some((claimed.root_relmse.value, claimed.doubt?)))
            && claimed <= error
            && self.doubted.is_none()
        {
            let samples = self.samples(&self.whole());
            self.doubted = Some(DoubtedAim {
                samples: [*samples.start(), *samples.end()],
                error: claimed,
                doubt,
            });
        }
        // A squared error falls at least as fast as samples are added.
        let needed = |claimed: Uncertainty| {
            (claimed.root_relmse.high / error) * (claimed.root_relmse.high / error)
        };
        let lacking = claimed
            .filter(|claimed| claimed.doubt.is_none())
            .map_or(GROWTH, needed);
        let (done, _) = self.progress(&self.whole());
        // A claim in doubt is none to go by in adding samples, but it tells how many there will be
        // at least.
        self.expected =
            (done as f64 * claimed.map_or(lacking, |claimed| needed(claimed).max(lacking))) as u64;
        let growth = lacking.clamp(LEAST_GROWTH, GROWTH);
        let decided = [growth, GROWTH].into_iter().find_map(|growth| {
            let halves = [0, 1].map(|half| self.raised(half, growth));
            halves.iter().any(Option::is_some).then_some(halves)
        });
        let Some(halves) = decided else {
            return Aim::Exhausted;
        };
        let tiles = self.plan.tiles() as usize;
        for (half, goals) in (0..).zip(halves) {
            let Some(goals) = goals else { continue };
            for replicate in (half..self.plan.replicates).step_by(2) {
                let most = self.plan.samples_of(replicate);
                let all = &mut self.goals[replicate as usize * tiles..][..tiles];
                all.iter_mut()
                    .zip(&goals)
                    .for_each(|(goal, &n)| *goal = n.min(most) as u16);
            }
        }
        Aim::Further
    }

    /// The first time that the error which was asked for seemed to be reached but was in doubt;
    /// none where it was not, and of films from files.
    pub fn doubted_aim(&self) -> Option<DoubtedAim> {
        self.doubted
    }

    /// Samples of each tile in the replicates of one half, with all of them at most `growth` times
    /// what they are; none where that is what there is.
    fn raised(&self, half: u32, growth: f64) -> Option<Vec<u32>> {
        let shares = self.shares(1 - half);
        let most = self.plan.samples_of(self.plan.replicates - 1);
        let tiles: Vec<(u32, f64, f64)> = (0..self.plan.tiles())
            .zip(shares)
            .map(|(tile, share)| {
                (
                    self.goal(tile, half),
                    share,
                    self.plan.pixels_of(tile) as f64,
                )
            })
            .collect();
        let at = |scale: f64, now: u32, share: f64| {
            let limit = now.saturating_mul(TILE_GROWTH).min(most);
            now.max(on_grid(scale * share).min(limit))
        };
        let total = |scale: f64| {
            tiles
                .iter()
                .map(|&(now, share, pixels)| pixels * f64::from(at(scale, now, share)))
                .sum::<f64>()
        };
        let allowed = growth * total(0.0);
        let (mut low, mut high) = (0.0, 2.0 * f64::from(most));
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

    /// What the tiles' samples are to be proportional to by what the replicates of one half say,
    /// with a largest one of 1.
    fn shares(&self, half: u32) -> Vec<f64> {
        let variances = self.smoothed(&self.variances(half));
        let mean = variances.iter().sum::<f64>() / variances.len() as f64;
        let roots = variances
            .iter()
            .map(|variance| variance.sqrt().max(QUIET * mean.sqrt()));
        let largest = roots.clone().fold(f64::MIN_POSITIVE, f64::max);
        // Where nothing varies, all are the same.
        roots
            .map(|root| if mean > 0.0 { root / largest } else { 1.0 })
            .collect()
    }

    /// Relative variance of one sample in the mean over each tile's pixels, by the first two
    /// replicates of one half.
    fn variances(&self, half: u32) -> Vec<f64> {
        let pair: Vec<&ReplicateBuffer> = self
            .planes
            .iter()
            .skip(half as usize)
            .step_by(2)
            .take(2)
            .flatten()
            .collect();
        let [first, second] = pair[..] else {
            return vec![0.0; self.plan.tiles() as usize];
        };
        let means = |plane: &ReplicateBuffer| -> Vec<[f64; 3]> {
            let of = |pixel: usize| {
                plane
                    .total(pixel)
                    .map(|sum| sum / f64::from(plane.samples[pixel].max(1)))
            };
            (0..self.plan.pixels()).map(of).collect()
        };
        let (a, b) = (means(first), means(second));
        let mut sums = vec![0.0; self.plan.tiles() as usize];
        for (pixel, weights) in weights(&a, &b, self.plan.crop.width as usize)
            .into_iter()
            .enumerate()
        {
            let samples = f64::from(first.samples[pixel]) + f64::from(second.samples[pixel]);
            // The mean of both has a quarter of the squared difference for a variance.
            let square = |i: usize| (a[pixel][i] - b[pixel][i]) * (a[pixel][i] - b[pixel][i]);
            let of_sample = samples * (0..3).map(|i| weights[i] * square(i) / 4.0).sum::<f64>();
            let tile = self.plan.tile_of(pixel);
            sums[tile as usize] += of_sample / self.plan.pixels_of(tile) as f64;
        }
        sums
    }

    /// Means over each tile and its neighbours, nearer ones with larger weights.
    fn smoothed(&self, of: &[f64]) -> Vec<f64> {
        let columns = self.plan.columns() as usize;
        let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        let at = |tile: usize| {
            let (x, y) = (tile % columns, tile / columns);
            let (mut sum, mut weights) = (0.0, 0.0);
            for (row, column) in near(y, of.len() / columns)
                .flat_map(|row| near(x, columns).map(move |column| (row, column)))
            {
                let weight = if row == y { 2.0 } else { 1.0 } * if column == x { 2.0 } else { 1.0 };
                sum += weight * of[row * columns + column];
                weights += weight;
            }
            sum / weights
        };
        (0..of.len()).map(at).collect()
    }
}
