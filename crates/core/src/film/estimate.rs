//! What the replicates of a pixel say of its mean, and of how far that may be off.

use super::relative::{REACH, around};
use super::sums::WHOLE;
use super::{Film, Part, ReplicateBuffer};

/// The replicates of which anything is there, in ascending order.
pub(super) struct ReplicateStats<'a> {
    planes: Vec<&'a ReplicateBuffer>,
    /// Whether each replicate counts the same, however many samples it has. Where these numbers
    /// were decided by what other replicates saw, weights by numbers would be correlated with
    /// colours, and the mean off.
    even: bool,
}

impl<'a> ReplicateStats<'a> {
    pub fn new(planes: impl Iterator<Item = &'a ReplicateBuffer>, even: bool) -> Self {
        Self {
            planes: planes.collect(),
            even,
        }
    }

    /// Mean of a pixel's samples and how many there are; black without any. Sums are added in the
    /// order of replicates.
    #[inline]
    pub fn mean(&self, pixel: usize) -> ([f64; 3], f64) {
        let (mut sum, mut count, mut weights) = ([0.0; 3], 0_u64, 0.0);
        for plane in &self.planes {
            let (of, n) = (plane.total(pixel), plane.samples[pixel]);
            let weight = if self.even {
                1.0 / f64::from(n.max(1))
            } else {
                1.0
            };
            sum = core::array::from_fn(|i| sum[i] + weight * of[i]);
            weights += weight * f64::from(n);
            count += u64::from(n);
        }
        (sum.map(|s| s / weights.max(1.0)), count as f64)
    }

    /// Share of a pixel that something covers.
    pub fn coverage(&self, pixel: usize) -> f64 {
        self.share(pixel, |plane| &plane.covered)
    }

    /// Share of a pixel that is a ground's shadow.
    pub fn shadow(&self, pixel: usize) -> f64 {
        self.share(pixel, |plane| &plane.shadowed)
    }

    fn share(&self, pixel: usize, of: impl Fn(&ReplicateBuffer) -> &Vec<u32>) -> f64 {
        let (mut covered, mut weights) = (0.0, 0.0);
        for plane in &self.planes {
            let n = plane.samples[pixel];
            let weight = if self.even {
                1.0 / f64::from(n.max(1))
            } else {
                1.0
            };
            covered += weight * (f64::from(of(plane)[pixel]) / f64::from(WHOLE));
            weights += weight * f64::from(n);
        }
        covered / f64::max(weights, 1.0)
    }

    /// Means of a pixel's replicates that have any samples.
    pub fn each_mean(&self, pixel: usize, means: &mut Vec<[f64; 3]>) {
        means.clear();
        let there = self.planes.iter().filter(|plane| plane.samples[pixel] > 0);
        means.extend(there.map(|plane| {
            plane
                .total(pixel)
                .map(|sum| sum / f64::from(plane.samples[pixel]))
        }));
    }

    /// Standard errors of the means of so many pixels in rows of `width`, per channel: the roots of
    /// their variances. One that is less than what so few replicates claim of the mean variance of
    /// the pixel and its neighbours in 1 of 1000 cases is taken for luck, and what they claim in 5
    /// of 100 cases for it. Where light is rarely found, a pixel that met none of it, or the same
    /// in each replicate, would claim far too little, and nothing at all where no sample met any.
    /// If none of the neighbours met any, the whole picture takes their place for a black pixel,
    /// unless it is known to have nothing in it. With one threshold for both, intervals of even
    /// noise would hold in 97.5 of 100 pixels, or those of rare light in 83. A sample's variance is
    /// compared, not a mean's, since neighbours may have other numbers of samples.
    ///
    /// m ± t·error holds the true mean m in 95 % of pixels if t is the quantile of Student's
    /// distribution for R − 1 degrees of freedom ([`student_95`](crate::metrics::student_95)): 3.18
    /// for four replicates. Of fewer than two replicates nothing is known: −1.
    pub fn standard_errors(&self, pixels: usize, width: usize) -> Vec<[f32; 3]> {
        let means: Vec<Means> = (0..pixels).map(|pixel| self.means(pixel)).collect();
        let known = |means: &Means| means.replicates >= 2;
        let of_sample = |means: &Means| means.variance().map(|variance| variance * means.samples);
        let of_samples: Vec<[f64; 3]> = means
            .iter()
            .map(|means| {
                if known(means) {
                    of_sample(means)
                } else {
                    [0.0; 3]
                }
            })
            .collect();
        let counts: Vec<[f64; 3]> = means
            .iter()
            .map(|means| [f64::from(u8::from(known(means))); 3])
            .collect();
        let near =
            |of: &[[f64; 3]]| around(&around(of, REACH, width, 1), REACH, pixels / width, width);
        let of_picture: [f64; 3] = core::array::from_fn(|i| {
            let [sum, count] =
                [&of_samples, &counts].map(|of| of.iter().map(|of| of[i]).sum::<f64>());
            if count > 0.0 { sum / count } else { 0.0 }
        });
        let (sums, counts) = (near(&of_samples), near(&counts));
        let error = |(pixel, means): (usize, &Means)| {
            if !known(means) {
                return [-1.0; 3];
            }
            let [luck, floor] = least(means.replicates - 1).map(|share| share / means.samples);
            let own = means.variance();
            core::array::from_fn(|i| {
                let near = sums[pixel][i] / counts[pixel][i];
                let near = if near == 0.0 && self.may_be_lit(pixel, i) {
                    of_picture[i]
                } else {
                    near
                };
                (if own[i] < luck * near {
                    floor * near
                } else {
                    own[i]
                })
                .sqrt() as f32
            })
        };
        means.iter().enumerate().map(error).collect()
    }

    /// Whether a pixel is black, and not for having nothing in it as far as hits are counted.
    fn may_be_lit(&self, pixel: usize, channel: usize) -> bool {
        let is_empty = |plane: &ReplicateBuffer| {
            plane
                .covered
                .get(pixel)
                .is_some_and(|&covered| covered == 0)
                || plane.first_hits.get(pixel).is_some_and(|&n| n == 0)
        };
        let is_black = |plane: &ReplicateBuffer| plane.total(pixel)[channel] == 0.0;
        self.planes.iter().all(|plane| is_black(plane))
            && !self.planes.iter().all(|plane| is_empty(plane))
    }

    /// How the means of a pixel's replicates lie about the pixel's.
    pub fn means(&self, pixel: usize) -> Means {
        let (mean, samples) = self.mean(pixel);
        let there = || self.planes.iter().filter(|plane| plane.samples[pixel] > 0);
        let mut means = Means {
            between: [0.0; 3],
            replicates: there().count() as u32,
            samples,
        };
        for plane in there() {
            let (sum, n) = (plane.total(pixel), f64::from(plane.samples[pixel]));
            let apart: [f64; 3] = core::array::from_fn(|i| sum[i] / n - mean[i]);
            let weight = if self.even {
                samples / f64::from(means.replicates)
            } else {
                n
            };
            means.between =
                core::array::from_fn(|i| means.between[i] + weight * apart[i] * apart[i]);
        }
        means
    }
}

/// Mean of a pixel with its variance, per channel.
pub(crate) type MeanVariance = [[f64; 3]; 2];

impl Film {
    /// Means of a tile's pixels with the variances that their replicates say, without correction
    /// for luck: right on average. None where fewer than two replicates have all of it.
    pub(crate) fn means_of(&self, tile: u32) -> Option<Vec<MeanVariance>> {
        let whole = self.whole();
        let is_done = |replicate: &u32| {
            self.lacking(&Part {
                tiles: tile..tile + 1,
                replicates: *replicate..*replicate + 1,
                ..whole.clone()
            }) == 0
        };
        let planes: Vec<ReplicateBuffer> = whole
            .replicates
            .clone()
            .filter(is_done)
            .map(|replicate| self.state(tile, replicate))
            .collect();
        let stats = ReplicateStats::new(planes.iter(), false);
        let pixel = |pixel| {
            let (mean, means) = (stats.mean(pixel).0, stats.means(pixel));
            [
                mean,
                if self.plan().random {
                    means.variance()
                } else {
                    [0.0; 3]
                },
            ]
        };
        let is_known = planes.len() >= 2 || !self.plan().random && !planes.is_empty();
        is_known.then(|| {
            (0..self.plan().pixels_of(tile) as usize)
                .map(pixel)
                .collect()
        })
    }

    /// Edge of all tiles in pixels.
    pub(crate) fn tile_size(&self) -> u32 {
        self.plan().tile_size()
    }
}

/// Shares of the true variance below which one that was estimated from so many degrees of freedom
/// lies in 1 of 1000 and in 5 of 100 cases: quantiles of χ² over its mean. From a table up to
/// three; beyond by Wilson and Hilferty ("The Distribution of Chi-Square", 1931), which there is
/// right to a hundredth.
fn least(freedom: u32) -> [f64; 2] {
    const FEW: [[f64; 2]; 4] = [
        [0.0, 0.0],
        [0.000_002, 0.003_932],
        [0.001_001, 0.051_293],
        [0.008_099, 0.117_282],
    ];
    FEW.get(freedom as usize).copied().unwrap_or_else(|| {
        let spread = 2.0 / (9.0 * f64::from(freedom));
        [3.090_232, 1.644_854].map(|quantile| (1.0 - spread - quantile * spread.sqrt()).powi(3))
    })
}

/// How the means of a pixel's replicates lie about the pixel's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Means {
    /// Sum of their squared deviations, each as often as its replicate has samples, or all the same
    /// times.
    pub between: [f64; 3],
    /// Replicates that have any.
    pub replicates: u32,
    /// Samples in all.
    pub samples: f64,
}

impl Means {
    /// Variance of the pixel's mean m, per channel: Σ nᵣ(mᵣ − m)² / (n(R − 1)) over its R
    /// replicates with nᵣ samples of mean mᵣ.
    pub fn variance(&self) -> [f64; 3] {
        self.between
            .map(|b| b / (self.samples * f64::from(self.replicates - 1)))
    }
}
