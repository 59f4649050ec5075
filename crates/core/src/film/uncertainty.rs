//! How far a picture probably is from the true one: what its replicates say of all its pixels together.
//!
//! A pixel's replicates give the variance v of its mean, which is the squared error e² to be expected there. Let xᵣ be how far the
//! mean of its replicate r of R is from the truth. Then e² − v = 2/(R(R − 1)) · Σ xᵣxₛ over the pairs r < s, whatever the
//! distribution is: a rare bright sample is in both e² and v, and what is left are products of independent numbers. Their variance is
//! 2 tr(C²)/(R(R − 1)) for channels of covariance C, and it has an unbiased estimate too, since the differences of two pairs of
//! replicates are independent: (d·d′)²/4 has the mean tr(C²). Pixels are independent, since each has scrambles of its own, so both sum
//! up over the picture, and the sum is nearly normal if many pixels share in it.
//!
//! What relative errors are relative to is itself estimated, from the pair of replicates that the error at hand is not estimated from.
//! With fewer than four replicates there is no such pair; then the value is a guess, and no interval is claimed for it. That noise is
//! as large as the error itself in pixels that carry it, so that for n such pixels the interval's variance is larger by 1/n: found by
//! calibration (`benches/calibration.rs`), which also says from how many on the interval may be trusted.
//!
//! Light that no sample has found is in neither. What can be noticed is that it may be there: paths that were scattered and then went on
//! by a mirror or through glass meet lamps by chance alone, and where many did and few met one, more of that light is to be expected
//! than was seen. The number that were found is a Poisson number, known to a sixth where it is forty.

use core::ops::{AddAssign, Range};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;

use super::Film;
use super::estimate::There;
use super::relative::{REACH, weight_of, weights};

/// 97.5 % of normal values are below.
const Z: f64 = 1.959_963_984_540_054;

/// Squared errors relative to what other replicates have, and to what the replicates in the error have, may differ by this factor. The
/// first are too large where light is rarely found, since others seldom found it too, and the second too small, since a bright sample
/// is in both: what is true lies in between.
const APART: f64 = 4.0;

/// Fewer pixels that carry the error say too little of it.
const FEWEST: f64 = 40.0;

/// And fewer lamps met by chance alone too little of their light.
const FEWEST_FOUND: u64 = 40;

/// Replicates that an interval needs.
const ENOUGH: u32 = 4;

/// Rows that are looked at together.
const BAND: usize = 32;

/// Ways to pair four replicates.
const PAIRINGS: [[usize; 4]; 3] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]];

/// A number with the interval that holds what it estimates in 95 of 100 renders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The most likely value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// How many pixels carry most of it: (Σv)²/Σv² of their variances (Kish, "Survey Sampling", 1965).
    pub carriers: f64,
}

/// How far a picture is from the true one, as far as its own samples can tell: light that none of them found can't be estimated.
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

/// Why an interval may not hold what it claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Doubt {
    /// There are fewer than four replicates.
    FewSamples,
    /// Lamps are met by way of mirrors or glass, which is by chance alone, and few were: most of such light may be unseen.
    LightByChance,
    /// A few pixels have most of the error, or in each of many a few samples.
    FewPixels,
}

/// Sums over pixels.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// Of variances of the mean, and of their squares.
    variance: f64,
    square: f64,
    /// Of squared products of two independent differences between replicates.
    product: f64,
    /// Of variances relative to what the replicates in them have.
    seen: f64,
}

impl AddAssign for Sum {
    fn add_assign(&mut self, other: Self) {
        self.variance += other.variance;
        self.square += other.square;
        self.product += other.product;
        self.seen += other.seen;
    }
}

impl Sum {
    /// Of the root of the mean over so many pixels and three channels.
    fn estimate(&self, pixels: f64, replicates: f64) -> Estimate {
        let mean_square = self.variance / (3.0 * pixels);
        let per_pair = 2.0 * replicates * (replicates - 1.0);
        // No more than pixels of equal variance would say.
        let least = 2.0 * replicates / ((replicates - 1.0) * pixels);
        let (width, carriers) = match self.variance * self.variance {
            square if square > 0.0 => {
                let carriers = square / self.square;
                (Z * ((self.product / per_pair / square).max(least) + 1.0 / carriers).sqrt(), carriers)
            }
            _ => (0.0, f64::INFINITY),
        };
        let root = |factor: f64| (mean_square * factor).sqrt();
        Estimate { value: root(1.0), low: root(libm::exp(-width)), high: root(libm::exp(width)), carriers }
    }
}

/// What one pixel adds: its variance, and squared products of differences.
#[derive(Clone, Copy, Default)]
struct Pixel {
    variance: f64,
    product: f64,
    seen: f64,
}

/// A few rows of pixels with what their replicates say, in radiance and relative.
struct Band {
    absolute: Vec<Pixel>,
    relative: Vec<Pixel>,
}

impl Film {
    /// How far the picture so far is from the true one; none where chance has no part, and where pixels have fewer than two
    /// replicates.
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        if !self.plan.random {
            return None;
        }
        let planes = self.there();
        let fewest = (0..self.plan.pixels()).map(|pixel| planes.means(pixel).replicates).min()?;
        if fewest < 2 {
            return None;
        }
        let height = self.plan.crop.height as usize;
        let bands = (0..height.div_ceil(BAND)).into_par_iter();
        // In order, so that the sums do not depend on who is first.
        let bands: Vec<[Sum; 2]> =
            bands.map(|band| self.band(&planes, band * BAND..((band + 1) * BAND).min(height), fewest)).collect();
        let (mut absolute, mut relative) = (Sum::default(), Sum::default());
        for [a, r] in bands {
            absolute += a;
            relative += r;
        }
        let (pixels, replicates) = (self.plan.pixels() as f64, f64::from(fewest));
        let (rmse, root_relmse) = (absolute.estimate(pixels, replicates), relative.estimate(pixels, replicates));
        let by_chance = self.counters.unaided > 0 && self.counters.found < FEWEST_FOUND;
        let doubts = [
            (fewest < ENOUGH, Doubt::FewSamples),
            (by_chance, Doubt::LightByChance),
            (root_relmse.carriers < FEWEST || relative.variance > APART * relative.seen, Doubt::FewPixels),
        ];
        let doubt = doubts.into_iter().find_map(|(is, doubt)| is.then_some(doubt));
        Some(Uncertainty { rmse, root_relmse, replicates: fewest, doubt })
    }

    /// Sums over some rows, in radiance and relative.
    fn band(&self, planes: &There<'_>, rows: Range<usize>, replicates: u32) -> [Sum; 2] {
        let width = self.plan.crop.width as usize;
        // With the rows that pixels have neighbours in.
        let first = rows.start.saturating_sub(REACH);
        let last = (rows.end + REACH).min(self.plan.crop.height as usize);
        let mut means = vec![Vec::with_capacity((last - first) * width); replicates as usize];
        let mut each = Vec::new();
        for pixel in first * width..last * width {
            planes.each_mean(pixel, &mut each);
            means.iter_mut().zip(&each).for_each(|(means, &mean)| means.push(mean));
        }
        let mut band =
            Band { absolute: vec![Pixel::default(); means[0].len()], relative: vec![Pixel::default(); means[0].len()] };
        match means.chunks_exact(4).len() {
            0 => band.guess(&means, width),
            fours => {
                let shares = [4.0 / f64::from(replicates), 1.0].map(|share| share / (3 * fours) as f64);
                means.chunks_exact(4).for_each(|four| band.add(four, width, shares));
            }
        }
        let inner = (rows.start - first) * width..(rows.end - first) * width;
        [&band.absolute[inner.clone()], &band.relative[inner]].map(|pixels| {
            let mut sum = Sum::default();
            for &Pixel { variance, product, seen } in pixels {
                sum += Sum { variance, square: variance * variance, product, seen };
            }
            sum
        })
    }
}

impl Band {
    /// What four replicates say: each difference of two is weighed by the other two. `shares`: of what one way to pair them says, in
    /// the variance of the mean and in the mean of products.
    fn add(&mut self, four: &[Vec<[f64; 3]>], width: usize, shares: [f64; 2]) {
        for [a, b, c, d] in PAIRINGS.map(|pairing| pairing.map(|r| &four[r])) {
            let (of_first, of_second) = (weights(c, d, width), weights(a, b, width));
            for pixel in 0..a.len() {
                let one: [f64; 3] = core::array::from_fn(|i| a[pixel][i] - b[pixel][i]);
                let two: [f64; 3] = core::array::from_fn(|i| c[pixel][i] - d[pixel][i]);
                self.absolute[pixel].add(one, two, [1.0; 3], [1.0; 3], shares);
                let relative = &mut self.relative[pixel];
                relative.add(one, two, of_first[pixel], of_second[pixel], shares);
                for (difference, [x, y]) in [(one, [a, b]), (two, [c, d])] {
                    let squares = (0..3).map(|i| difference[i] * difference[i] * weight_of((x[pixel][i] + y[pixel][i]) / 2.0));
                    relative.seen += shares[0] * squares.sum::<f64>() / 16.0;
                }
            }
        }
    }

    /// What two or three say, weighed by themselves: differences of the first two, beside those of the next pixel.
    fn guess(&mut self, means: &[Vec<[f64; 3]>], width: usize) {
        let (a, b) = (&means[0], &means[1]);
        let weights = weights(a, b, width);
        for pixel in 0..a.len() {
            let beside = if (pixel + 1).is_multiple_of(width) { pixel.saturating_sub(1) } else { pixel + 1 };
            let one: [f64; 3] = core::array::from_fn(|i| a[pixel][i] - b[pixel][i]);
            let two: [f64; 3] = core::array::from_fn(|i| a[beside][i] - b[beside][i]);
            // A quarter of the squared difference is the variance of two replicates' mean.
            let shares = [4.0 / means.len() as f64, 0.0];
            self.absolute[pixel].add(one, one, [1.0; 3], [1.0; 3], shares);
            self.relative[pixel].add(one, one, weights[pixel], weights[pixel], shares);
            self.absolute[pixel].product = product(one, two, [1.0; 3], [1.0; 3]);
            self.relative[pixel].product = product(one, two, weights[pixel], weights[beside]);
        }
    }
}

impl Pixel {
    /// Adds the differences of two pairs of replicates with their weights: each has twice the variance of a replicate, an eighth of its
    /// square is the variance of a mean of four.
    fn add(&mut self, one: [f64; 3], two: [f64; 3], of_one: [f64; 3], of_two: [f64; 3], shares: [f64; 2]) {
        let squares: f64 = (0..3).map(|i| of_one[i] * one[i] * one[i] + of_two[i] * two[i] * two[i]).sum();
        self.variance += shares[0] * squares / 16.0;
        self.product += shares[1] * product(one, two, of_one, of_two);
    }
}

/// Squared product of two differences, weighed.
fn product(one: [f64; 3], two: [f64; 3], of_one: [f64; 3], of_two: [f64; 3]) -> f64 {
    let dot: f64 = (0..3).map(|i| (of_one[i] * of_two[i]).sqrt() * one[i] * two[i]).sum();
    dot * dot
}
