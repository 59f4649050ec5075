//! Uncertainty of a picture: an estimate of its error against the true picture, from the replicates
//! of all pixels.
//!
//! A pixel's replicates give the variance v of its mean, which estimates the squared error e². Let
//! xᵣ be the deviation of the mean of replicate r of R from the truth. Then e² − v = 2/(R(R − 1)) ·
//! Σ xᵣxₛ over the pairs r < s, for any distribution: a rare bright sample is part of both e² and
//! v, and the rest are products of independent numbers. Their variance is 2 tr(C²)/(R(R − 1)) for
//! channels of covariance C. It has an unbiased estimate, too, because the differences of two pairs
//! of replicates are independent: (d·d′)²/4 has the mean tr(C²). Pixels are independent, because
//! each has its own scrambles. So both estimates are summed over the picture, and the sum is nearly
//! normal if many pixels contribute.
//!
//! Where a bright sample is so rare that hardly any pixel has two of them, these products are too
//! small in most pictures, and far too large in few. The product of a pixel's variance with that of
//! its neighbours has the same mean and is steadier: where that sum is larger, it counts as far as
//! light is rare.
//!
//! The denominator of relative errors is itself estimated. A replicate's own bright sample is part
//! of error and denominator, so the difference of two replicates is relative to the other two, and
//! to the pixel's neighbours as far as their differences are noise
//! ([`Surroundings`](super::relative_error::Surroundings)). The remaining uncertainty of the true
//! colour makes two estimates, relative to the likeliest colour with and without the colour's
//! variance. The value is their geometric mean, and half of their distance its standard error. With
//! fewer than four replicates no other pair exists; then the value is a guess without an
//! interval.
//!
//! The variance is a sum that few pixels may dominate, as at a lamp's ends. Then it is as uncertain
//! as a variance of fewer normal numbers, 2(Σq)²/Σq² for sums of q (Satterthwaite, "An Approximate
//! Distribution of Estimates of Variance Components", 1946), and Student's factor replaces the
//! normal one. `benches/calibration.rs` measures how often the intervals hold, and from how many
//! pixels on they are reliable.
//!
//! Where lamps are small and many, a pixel that is lit in a single replicate is not as dark as its
//! neighbours. The leave-one-out test (`film::leave_one_out`) decides how much of the light is of
//! such lamps, and bounds the weight of its error.
//!
//! Light that no sample found is in none of these estimates. But its possibility can be detected:
//! paths that scatter and then continue by a lobe far narrower than the lights, of a mirror, glass
//! or gloss, hit lights by chance alone. The number k of hits is a Poisson number: 2√k + 3 more may
//! be missing, and each brings the squared radiance that the light samples of these paths show. The
//! estimate is doubtful if the relative error of so many hits exceeds the upper end of the interval.

use core::ops::Range;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;

use super::error_estimate::ErrorEstimate;
use super::estimate::ReplicateStats;
use super::leave_one_out::LeaveOneOutStats;
use super::relative_error::FLOOR;
use super::row_variances::VarianceSum;
use super::{Film, ReplicateBuffer};
use crate::counters::POWER_UNITS;

/// Factor by which an estimate carried by few pixels must be below the requested error. In 1,600
/// pictures of 20 scenes, black ones excepted, the error was never more than three times the upper
/// end of the interval.
const FEW_PIXELS_MARGIN: f64 = 10.0;

/// Mean radiance below which a picture is nearly black: a tenth of the root of the constant in the
/// denominator of relative errors, which then hides the error of any picture, whatever it shows.
const DARKEST: f64 = 0.01;

/// Least number of replicates for an interval.
const MIN_REPLICATES: u32 = 4;

/// Number of pixel rows in a parallel work item.
const BAND_ROWS: usize = 32;

/// Error of a picture, estimated from its own samples without a reference picture. Light that no
/// sample found cannot be included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[doc(alias("variance", "standard error"))]
pub struct Uncertainty {
    /// Root mean squared error over pixels and channels, in radiance.
    pub rmse: ErrorEstimate,
    /// Root of the mean relative squared error, (I − R)²/(R² + 0.01).
    pub root_relmse: ErrorEstimate,
    /// Least number of replicates of a pixel.
    pub replicates: u32,
    /// Reason to doubt the interval of the relative error; `None` for a reliable interval.
    pub doubt: Option<EstimateDoubt>,
}

impl Uncertainty {
    /// Whether the relative error is below `error`, by the upper end of the interval. If few pixels
    /// carry the error, the upper end has to be far below.
    pub fn is_error_below(&self, error: f64) -> bool {
        let high = self.root_relmse.high;
        match self.doubt {
            None => high <= error,
            Some(EstimateDoubt::FewPixels) => high > 0.0 && FEW_PIXELS_MARGIN * high <= error,
            Some(_) => false,
        }
    }
}

/// Reason not to rely on the confidence interval of an [`ErrorEstimate`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EstimateDoubt {
    /// The picture is so dark that its relative error is small whatever it shows.
    NearlyBlack,
    /// Fewer than four replicates.
    FewSamples,
    /// Lamps or bright parts of the sky are hit through mirrors, glass or gloss by chance alone, with
    /// few hits so far: the light that may be missing exceeds the interval.
    LightByChance,
    /// A few pixels have most of the error, or a few samples in each of many pixels; or shadow rays
    /// were traced to lamps and the picture is black.
    FewPixels,
    /// The interval is too wide to be useful: for example, a few blocks of a denoised picture have
    /// most of its error.
    WideInterval,
}

impl Film {
    /// Estimates the error of the picture so far; `None` without random sampling, or if a pixel has
    /// fewer than two replicates.
    pub fn estimate_uncertainty(&self) -> Option<Uncertainty> {
        self.estimate_with_rarity(&self.replicate_stats())
            .map(|(uncertainty, _)| uncertainty)
    }

    /// Estimates the error from all replicates as if they were independent, and returns whether light
    /// is rare or the true colours are uncertain: a filter that spreads such light would hide its
    /// error, although the error of the noisy picture is known. Replicates of one net differ a little
    /// more than independent ones. Four of them tell rare light and have an interval, two nets don't.
    pub(crate) fn estimate_by_replicates(&self) -> Option<(Uncertainty, bool)> {
        let (mut uncertainty, is_rare) = self.estimate_with_rarity(&self.stats_of_groups(1))?;
        uncertainty.replicates /= self.plan.replicates_per_net();
        Some((uncertainty, is_rare))
    }

    /// Estimates the error, and returns whether light is rare or the true colours are uncertain.
    fn estimate_with_rarity(&self, planes: &ReplicateStats<'_>) -> Option<(Uncertainty, bool)> {
        if !self.plan.random {
            return None;
        }
        let fewest = (0..self.plan.pixel_count())
            .map(|pixel| planes.replicate_count(pixel))
            .min()?;
        if fewest < 2 {
            return None;
        }
        let (mut sums, mut leave_one_out) =
            ([VarianceSum::default(); 2], LeaveOneOutStats::default());
        for (of_band, again_in_band) in
            self.compute_by_bands(|rows| self.sum_variances_of_rows(planes, rows, fewest))
        {
            sums.iter_mut()
                .zip(of_band)
                .for_each(|(sum, of)| *sum += of);
            leave_one_out += again_in_band;
        }
        let [absolute, relative] = sums;
        let is_rare = relative.is_light_rare();
        let (pixels, replicates) = (self.plan.pixel_count() as f64, f64::from(fewest));
        let rmse = absolute.estimate_root_mean(0.0, pixels, replicates);
        let lamps = leave_one_out.fraction_of_lamps();
        let root_relmse = relative.estimate_root_mean(lamps, pixels, replicates);
        let doubts = [
            (
                relative.variance() > 0.0 && self.mean_brightness() < DARKEST,
                EstimateDoubt::NearlyBlack,
            ),
            (
                self.missing_chance_error() > root_relmse.high,
                EstimateDoubt::LightByChance,
            ),
            (
                relative.is_dominated_by_few_pixels()
                    || is_rare && !leave_one_out.excludes_lamps()
                    || relative.variance() == 0.0 && self.is_black_despite_lights(),
                EstimateDoubt::FewPixels,
            ),
            (root_relmse.is_meaningless(), EstimateDoubt::WideInterval),
            // Least, since more samples may leave any other.
            (fewest < MIN_REPLICATES, EstimateDoubt::FewSamples),
        ];
        let doubt = doubts
            .into_iter()
            .find_map(|(is, doubt)| is.then_some(doubt));
        Some((
            Uncertainty {
                rmse,
                root_relmse,
                replicates: fewest,
                doubt,
            },
            is_rare || relative.are_weightings_apart(),
        ))
    }

    /// Computes a value for each band of pixel rows in parallel. Returns the values in order, so
    /// that their sum does not depend on the order of completion.
    fn compute_by_bands<T: Send>(&self, compute: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
        let height = self.plan.crop.height as usize;
        (0..height.div_ceil(BAND_ROWS))
            .into_par_iter()
            .map(|band| compute(band * BAND_ROWS..((band + 1) * BAND_ROWS).min(height)))
            .collect()
    }

    /// Returns the root relMSE of the light that may be missing because paths hit it by chance alone.
    fn missing_chance_error(&self) -> f64 {
        let [paths, all, found, samples] = [
            self.counters.narrow,
            self.counters.narrow_power,
            self.counters.narrow_found,
            self.counters.samples,
        ]
        .map(|count| count as f64);
        if all == 0.0 {
            return 0.0;
        }
        // Where every path hits the light, no hit is missing.
        let share = (found / all).min(1.0);
        let hits = (3.0 + 2.0 * (share * paths).sqrt()).min(paths) * (1.0 - share);
        let pixels = self.plan.pixel_count() as f64;
        // A hit adds its radiance to one sample of one pixel.
        let error = hits * all / paths / POWER_UNITS * pixels / (samples * samples);
        (error / (self.mean_brightness().powi(2) + FLOOR)).sqrt()
    }

    /// Returns the mean magnitude of the replicates' radiance over pixels and channels.
    fn mean_brightness(&self) -> f64 {
        let (planes, pixels) = (self.replicate_stats(), self.plan.pixel_count());
        let mut means = Vec::new();
        let mut brightness_of = |pixel| {
            planes.collect_replicate_means(pixel, &mut means);
            let sum: f64 = means.iter().flatten().map(|mean| mean.abs()).sum();
            sum / means.len() as f64
        };
        let total: f64 = (0..pixels).map(&mut brightness_of).sum();
        total / (3 * pixels) as f64
    }

    /// Whether shadow rays were traced to lamps or the sky, and no sample found any light.
    pub(super) fn is_black_despite_lights(&self) -> bool {
        let is_black = |buffer: &ReplicateBuffer| {
            (0..self.plan.pixel_count()).all(|pixel| buffer.pixel_total(pixel) == [0.0; 3])
        };
        self.counters.shadow > 0 && self.buffers.iter().flatten().all(is_black)
    }
}
