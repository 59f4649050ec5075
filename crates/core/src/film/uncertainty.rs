//! How far a picture probably is from the true one: what its replicates say of all its pixels
//! together.
//!
//! A pixel's replicates give the variance v of its mean, which is the squared error e² to be
//! expected there. Let xᵣ be how far the mean of its replicate r of R is from the truth. Then e² −
//! v = 2/(R(R − 1)) · Σ xᵣxₛ over the pairs r < s, whatever the distribution is: a rare bright
//! sample is in both e² and v, and what is left are products of independent numbers. Their variance
//! is 2 tr(C²)/(R(R − 1)) for channels of covariance C, and it has an unbiased estimate too, since
//! the differences of two pairs of replicates are independent: (d·d′)²/4 has the mean tr(C²).
//! Pixels are independent, since each has scrambles of its own, so both sum up over the picture,
//! and the sum is nearly normal if many pixels share in it.
//!
//! What relative errors are relative to is itself estimated, in three ways. By the mean of the
//! replicates themselves an error is off by about the inverse of their number: a bright sample is
//! in both, and noise makes dark pixels of others. So the means of pairs and that of all four say
//! what that of very many would (Quenouille, "Notes on Bias in Estimation", 1956), and this is the
//! value: right to a hundredth where noise is even. The other two are products of the pair of
//! replicates that the error at hand is not estimated from, and those of all four. Where light is
//! rarely found the first is too large, since the pair seldom found it too, and the second too
//! small. Half of what they are apart, or of what their geometric mean is from the value, whichever
//! is more, is a standard error of it. The first has noise as well, taken to be as large as the two
//! differ in each pixel. With fewer than four replicates there is no other pair; then the value is
//! a guess, and no interval is claimed for it.
//!
//! The variance is a sum of which few pixels may have most, as at a lamp's ends: then it is as sure
//! as a variance of fewer normal numbers, 2(Σq)²/Σq² for sums of q (Satterthwaite, "An Approximate
//! Distribution of Estimates of Variance Components", 1946), and Student's factor takes the normal
//! one's place. `benches/calibration.rs` says how often all that holds, and from how many pixels on
//! it may be trusted.
//!
//! Where lamps are small and many, a pixel that one replicate alone saw lit is no black one, and
//! few pixels would have all of the error if it were taken for one. `film::again` says when others
//! vouch for such light, and what its error is relative to then; the value is the geometric mean
//! there. Where light is not rare nobody needs to vouch for it: the means of replicates are right
//! to a hundredth in a room lit through a window, and the geometric mean is a tenth too small
//! there.
//!
//! Light that no sample has found is in neither. What can be noticed is that it may be there: paths
//! that were scattered and then went on by a mirror or through glass meet lamps and suns by chance
//! alone, and where many did and few met one, more of that light is to be expected than was seen.
//! The number that were found is a Poisson number, known to a sixth where it is forty.

use core::ops::{AddAssign, Range};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;

use super::again::{LeaveOneOut, SingleReplicateBound};
use super::estimate::ReplicateStats;
use super::pixel::{Pixel, product};
use super::relative::{REACH, across, among, weights, within};
use super::{Film, ReplicateBuffer};
use crate::metrics::student_95;

/// Squared errors relative to what other replicates have, and to what the pair in the error itself
/// has, may differ by this factor: then light is so rare that no way to make them relative is
/// right, unless it is seen again elsewhere.
const APART: f64 = 4.0;

/// Fewer pixels that carry the error say too little of it, if there are [`SHARE`] times as many
/// with noise, or light that they saw is hardly seen again: [`SEEN_AGAIN`] is then what [`APART`]
/// is for all pixels.
const FEWEST: f64 = 40.0;
const SHARE: f64 = 4.0;
const SEEN_AGAIN: f64 = 2.0;

/// What few pixels say of the error is not off by so much. In 1,600 pictures of 20 scenes the error
/// was never more than three times the upper end of the interval, but for those that were black.
const FAR: f64 = 10.0;

/// And fewer lamps met by chance alone too little of their light.
const FEWEST_FOUND: u64 = 40;

/// Where no more than one path in so many looks for such lamps, their light is too little to be
/// missed.
const ONE_IN: u64 = 500;

/// Replicates that an interval needs.
const ENOUGH: u32 = 4;

/// Rows that are looked at together.
const BAND: usize = 32;

/// A number with the interval that holds what it estimates in 95 of 100 renders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The most likely value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// How many pixels carry most of it: (Σv)²/Σv² of their variances (Kish, "Survey Sampling",
    /// 1965).
    pub carriers: f64,
}

/// How far a picture is from the true one, as far as its own samples can tell: light that none of
/// them found can't be estimated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Uncertainty {
    /// Root of the mean squared error over pixels and channels, in radiance.
    pub rmse: Estimate,
    /// Root of the mean relative squared error, (I − R)²/(R² + 0.01).
    pub root_relmse: Estimate,
    /// Replicates of each pixel, at least.
    pub replicates: u32,
    /// Why the interval of the relative error may not mean what it says; none where it does.
    pub doubt: Option<Doubt>,
}

impl Uncertainty {
    /// Whether the relative error is below another, as surely as the interval says; where few
    /// pixels carry the error, whether it is far below.
    pub fn reaches(&self, error: f64) -> bool {
        let high = self.root_relmse.high;
        match self.doubt {
            None => high <= error,
            Some(Doubt::FewPixels) => high > 0.0 && FAR * high <= error,
            Some(_) => false,
        }
    }
}

/// Why an interval may not hold what it claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Doubt {
    /// There are fewer than four replicates.
    FewSamples,
    /// Lamps or small bright parts of the sky are met by way of mirrors or glass, which is by
    /// chance alone, and few were: most of such light may be unseen.
    LightByChance,
    /// A few pixels have most of the error, or in each of many a few samples; or lamps were looked
    /// for and all is black.
    FewPixels,
    /// The interval is so wide that it says nothing, as where few blocks of a denoised picture have
    /// most of its error.
    WideInterval,
}

/// What a pixel has, or the sum over some.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// Variance of the mean, weighed by what other replicates say, and by what all of them say.
    variance: f64,
    among: f64,
    /// Weighed by the mean of all, and by that of the pair alone that it is of.
    own: f64,
    seen: f64,
    /// Squared products of two independent differences between replicates.
    product: f64,
    /// Squares of what the light that it is relative to may be off by where it was seen once, and
    /// what it may be off by in all pixels alike.
    unsure: f64,
    prior: f64,
    /// Squares and roots of the variance, squares of how far the two ways to weigh it are apart,
    /// and of the products.
    square: f64,
    root: f64,
    apart: f64,
    product_square: f64,
}

impl AddAssign for Sum {
    fn add_assign(&mut self, other: Self) {
        self.variance += other.variance;
        self.among += other.among;
        self.own += other.own;
        self.seen += other.seen;
        self.product += other.product;
        self.unsure += other.unsure;
        self.prior += other.prior;
        self.square += other.square;
        self.root += other.root;
        self.apart += other.apart;
        self.product_square += other.product_square;
    }
}

impl Sum {
    /// Of one pixel.
    fn of(
        Pixel {
            variance,
            among,
            own,
            seen,
            product,
            unsure,
            prior,
        }: Pixel,
    ) -> Self {
        let difference = variance - among;
        let (square, apart, product_square) = (
            variance * variance,
            difference * difference,
            product * product,
        );
        let (unsure, root) = (unsure * unsure, variance.sqrt());
        Self {
            variance,
            among,
            own,
            seen,
            product,
            unsure,
            prior,
            square,
            root,
            apart,
            product_square,
        }
    }

    /// Whether too few pixels carry the error for all that may. How many have noise is told by the
    /// standard deviations, (Σ√v)²/Σv, of which pixels with little have a share, too.
    fn is_carried_by_few(&self) -> bool {
        let (carriers, noisy) = (
            self.square_of_sum() / self.square,
            self.root * self.root / self.variance,
        );
        carriers < FEWEST && (carriers < noisy / SHARE || self.variance > SEEN_AGAIN * self.seen)
    }

    /// Whether light is seldom seen by two replicates.
    fn is_rare(&self) -> bool {
        self.variance > APART * self.seen
    }

    /// Between both ways to weigh by products.
    fn middle(&self) -> f64 {
        (self.variance * self.among).sqrt()
    }

    /// What weights by means of two and of four replicates say of those by the mean of very many:
    /// what they are off by is nearly inverse to the number.
    fn of_means(&self) -> f64 {
        (2.0 * self.own - self.seen).max(self.own / 2.0)
    }

    /// Of the root of the mean over so many pixels and three channels, by the sum over them.
    fn estimate(&self, sum: f64, pixels: f64, replicates: f64) -> Estimate {
        if self.variance <= 0.0 {
            return Estimate {
                value: 0.0,
                low: 0.0,
                high: 0.0,
                carriers: f64::INFINITY,
            };
        }
        let mean_square = sum / (3.0 * pixels);
        // No more than equal variances of all channels would say.
        let least = 2.0 * replicates / (3.0 * (replicates - 1.0) * pixels);
        let products =
            (self.product / (2.0 * replicates * (replicates - 1.0)) / (self.among * self.among))
                .max(least);
        let weights = self.apart / self.square_of_sum();
        let apart = [self.variance / self.among, self.middle() / sum]
            .map(|ratio| libm::log(ratio).abs() / 2.0);
        let relative_to = apart[0].max(apart[1]);
        let (chance, prior) = (
            self.unsure / (self.variance * self.among),
            self.prior / self.middle(),
        );
        // What is off in all pixels alike may be so in one direction, and adds up; the squares of
        // different causes do.
        let alike = relative_to + prior;
        let spread = products + weights + chance + alike * alike;
        // Whole degrees of freedom, rounded to fewer; those of many where no pixel says anything.
        let freedom = 2.0 * self.product * self.product / self.product_square;
        let factor = student_95(if freedom.is_finite() {
            freedom as u32
        } else {
            u32::MAX
        });
        let width = factor * spread.sqrt();
        let root = |factor: f64| (mean_square * factor).sqrt();
        let carriers = self.square_of_sum() / self.square;
        Estimate {
            value: root(1.0),
            low: root(libm::exp(-width)),
            high: root(libm::exp(width)),
            carriers,
        }
    }

    fn square_of_sum(&self) -> f64 {
        self.variance * self.variance
    }
}

/// A few rows of pixels with what their replicates say, in radiance and relative.
struct Band {
    absolute: Vec<Pixel>,
    relative: Vec<Pixel>,
    /// Relative where light that one replicate alone saw is seen again.
    vouched: Vec<Pixel>,
}

impl Film {
    /// How far the picture so far is from the true one; none where chance has no part, and where
    /// pixels have fewer than two replicates.
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        self.uncertainty_and_rarity()
            .map(|(uncertainty, _)| uncertainty)
    }

    /// And whether light is rare, both ways to weigh it far apart, even if others vouch for it:
    /// then a filter that spreads it hides what it is off by.
    pub(crate) fn uncertainty_and_rarity(&self) -> Option<(Uncertainty, bool)> {
        if !self.plan.random {
            return None;
        }
        let planes = self.there();
        let fewest = (0..self.plan.pixels())
            .map(|pixel| planes.means(pixel).replicates)
            .min()?;
        if fewest < 2 {
            return None;
        }
        let height = self.plan.crop.height as usize;
        let bands = (0..height.div_ceil(BAND)).into_par_iter();
        // In order, so that the sums do not depend on who is first.
        let bands: Vec<([Sum; 3], LeaveOneOut)> = bands
            .map(|band| {
                self.band(
                    &planes,
                    band * BAND..((band + 1) * BAND).min(height),
                    fewest,
                )
            })
            .collect();
        let (mut sums, mut again) = ([Sum::default(); 3], LeaveOneOut::default());
        for (of_band, again_in_band) in bands {
            sums.iter_mut()
                .zip(of_band)
                .for_each(|(sum, of)| *sum += of);
            again += again_in_band;
        }
        let [absolute, relative, vouched] = sums;
        let (is_rare, is_vouched) = (relative.is_rare(), again.is_enough());
        let is_few = if is_vouched {
            vouched.is_carried_by_few()
        } else {
            relative.is_carried_by_few()
        };
        let (pixels, replicates) = (self.plan.pixels() as f64, f64::from(fewest));
        let rmse = absolute.estimate(absolute.variance, pixels, replicates);
        let root_relmse = if is_rare && is_vouched {
            vouched.estimate(vouched.middle(), pixels, replicates)
        } else {
            relative.estimate(relative.of_means(), pixels, replicates)
        };
        let doubts = [
            (fewest < ENOUGH, Doubt::FewSamples),
            (self.is_lit_by_chance(), Doubt::LightByChance),
            (
                is_few || is_rare && !is_vouched || relative.variance == 0.0 && self.is_unlit(),
                Doubt::FewPixels,
            ),
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
            is_rare && vouched.is_rare(),
        ))
    }

    /// Whether lamps or suns are met by way of mirrors or glass alone, and too few were to tell how
    /// much of their light there is.
    pub(crate) fn is_lit_by_chance(&self) -> bool {
        let is_common = self.counters.unaided.saturating_mul(ONE_IN) > self.counters.samples;
        is_common && self.counters.found < FEWEST_FOUND
    }

    /// Whether rays went to lamps or to the sky, and no sample found any light.
    pub(super) fn is_unlit(&self) -> bool {
        let is_black = |plane: &ReplicateBuffer| {
            (0..self.plan.pixels()).all(|pixel| plane.total(pixel) == [0.0; 3])
        };
        self.counters.shadow > 0 && self.planes.iter().flatten().all(is_black)
    }

    /// Sums over some rows, in radiance and relative in both ways, and what is seen again there.
    fn band(
        &self,
        planes: &ReplicateStats<'_>,
        rows: Range<usize>,
        replicates: u32,
    ) -> ([Sum; 3], LeaveOneOut) {
        let width = self.plan.crop.width as usize;
        // With the rows that pixels have neighbours in.
        let first = rows.start.saturating_sub(REACH);
        let last = (rows.end + REACH).min(self.plan.crop.height as usize);
        let mut means = vec![Vec::with_capacity((last - first) * width); replicates as usize];
        let mut each = Vec::new();
        for pixel in first * width..last * width {
            planes.each_mean(pixel, &mut each);
            means
                .iter_mut()
                .zip(&each)
                .for_each(|(means, &mean)| means.push(mean));
        }
        let [absolute, relative, vouched] =
            [(); 3].map(|()| vec![Pixel::default(); means[0].len()]);
        let mut band = Band {
            absolute,
            relative,
            vouched,
        };
        match means.chunks_exact(4).len() {
            0 => band.guess(&means, width),
            fours => {
                let shares =
                    [4.0 / f64::from(replicates), 1.0].map(|share| share / (3 * fours) as f64);
                means
                    .chunks_exact(4)
                    .for_each(|four| band.add(four, shares));
            }
        }
        let inner = (rows.start - first) * width..(rows.end - first) * width;
        let mut again = LeaveOneOut::default();
        for four in means.chunks_exact(4) {
            inner
                .clone()
                .for_each(|pixel| again.add([0, 1, 2, 3].map(|r: usize| four[r][pixel])));
        }
        let sums = [&band.absolute, &band.relative, &band.vouched].map(|pixels| {
            let mut sum = Sum::default();
            pixels[inner.clone()]
                .iter()
                .for_each(|&pixel| sum += Sum::of(pixel));
            sum
        });
        (sums, again)
    }
}

impl Band {
    /// What four replicates say. `shares`: of what one way to pair them says, in the variance of
    /// the mean and in the mean of products.
    fn add(&mut self, four: &[Vec<[f64; 3]>], shares: [f64; 2]) {
        let pixels = self
            .absolute
            .iter_mut()
            .zip(&mut self.relative)
            .zip(&mut self.vouched);
        for (pixel, ((absolute, relative), vouched)) in pixels.enumerate() {
            let at = [0, 1, 2, 3].map(|r: usize| four[r][pixel]);
            absolute.add(
                at,
                [|_, _| [1.0; 3]; 2],
                [1.0; 3],
                SingleReplicateBound::default(),
                shares,
            );
            relative.add(
                at,
                [across, within],
                among(at),
                SingleReplicateBound::default(),
                shares,
            );
            vouched.add(
                at,
                [across, within],
                among(at),
                SingleReplicateBound::of(at),
                shares,
            );
        }
    }

    /// What two or three say, weighed by themselves: differences of the first two, beside those of
    /// the next pixel.
    fn guess(&mut self, means: &[Vec<[f64; 3]>], width: usize) {
        let (a, b) = (&means[0], &means[1]);
        let weights = weights(a, b, width);
        for pixel in 0..a.len() {
            let beside = if (pixel + 1).is_multiple_of(width) {
                pixel.saturating_sub(1)
            } else {
                pixel + 1
            };
            let one: [f64; 3] = core::array::from_fn(|i| a[pixel][i] - b[pixel][i]);
            let two: [f64; 3] = core::array::from_fn(|i| a[beside][i] - b[beside][i]);
            // A quarter of the squared difference is the variance of two replicates' mean.
            let share = 2.0 / means.len() as f64 / 4.0;
            let of = |weights: [f64; 3], beside: [f64; 3]| {
                let variance = share * (0..3).map(|i| weights[i] * one[i] * one[i]).sum::<f64>();
                Pixel {
                    variance,
                    among: variance,
                    own: variance,
                    seen: variance,
                    product: product(one, two, weights, beside),
                    unsure: 0.0,
                    prior: 0.0,
                }
            };
            self.absolute[pixel] = of([1.0; 3], [1.0; 3]);
            self.relative[pixel] = of(weights[pixel], weights[beside]);
        }
    }
}
