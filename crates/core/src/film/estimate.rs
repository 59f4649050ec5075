//! What the replicates of a pixel say of its mean, and of how far that may be off.

use super::Plane;

/// Mean of a pixel's samples and how many there are; black without any. Sums are added in the order of replicates.
#[inline]
pub(super) fn mean(planes: &[&Plane], pixel: usize) -> ([f64; 3], f64) {
    let (mut sum, mut count) = ([0.0; 3], 0_u64);
    for plane in planes {
        let of = plane.total(pixel);
        sum = core::array::from_fn(|i| sum[i] + of[i]);
        count += u64::from(plane.samples[pixel]);
    }
    let n = count as f64;
    (sum.map(|s| s / n.max(1.0)), n)
}

/// Share of a pixel's samples that hit something.
pub(super) fn coverage(planes: &[&Plane], pixel: usize) -> f32 {
    let count = |of: fn(&Plane) -> &Vec<u16>| planes.iter().map(|plane| u32::from(of(plane)[pixel])).sum::<u32>();
    count(|plane| &plane.hits) as f32 / count(|plane| &plane.samples).max(1) as f32
}

/// How the means of a pixel's replicates lie about the pixel's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Means {
    /// Sum of their squared deviations, each as often as its replicate has samples.
    pub between: [f64; 3],
    /// Replicates that have any.
    pub replicates: u32,
    /// Samples in all.
    pub samples: f64,
}

impl Means {
    pub fn of(planes: &[&Plane], pixel: usize) -> Self {
        let (mean, samples) = mean(planes, pixel);
        let mut means = Self { between: [0.0; 3], replicates: 0, samples };
        for plane in planes.iter().filter(|plane| plane.samples[pixel] > 0) {
            let (sum, n) = (plane.total(pixel), f64::from(plane.samples[pixel]));
            let apart: [f64; 3] = core::array::from_fn(|i| sum[i] / n - mean[i]);
            means.between = core::array::from_fn(|i| means.between[i] + n * apart[i] * apart[i]);
            means.replicates += 1;
        }
        means
    }

    /// Standard error of the pixel's mean m, per channel: the root of Σ nᵣ(mᵣ − m)² / (n(R − 1)) over its R replicates with nᵣ
    /// samples of mean mᵣ. m ± t·error holds the true mean in 95 % of pixels if t is the quantile of Student's distribution
    /// with R − 1 degrees of freedom ([`student_95`](crate::metrics::student_95)): 3.18 for four replicates. Of fewer than two
    /// replicates nothing is known: −1.
    pub fn standard_error(&self) -> [f32; 3] {
        if self.replicates < 2 {
            return [-1.0; 3];
        }
        self.between.map(|b| (b / (self.samples * f64::from(self.replicates - 1))).sqrt() as f32)
    }
}
