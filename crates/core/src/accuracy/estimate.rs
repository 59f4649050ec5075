//! How far renders are from the truth, told from a reference that is itself not free of noise: its own variance is subtracted,
//! and what is left is divided into noise, which more samples lower, and bias, which they do not.

use serde::Serialize;

use crate::metrics::{RELATIVE_FLOOR, statistics};
use crate::picture::Picture;

/// A number with the interval that holds it in about 95 of 100 cases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Interval {
    /// The estimate, at least zero.
    pub value: f64,
    /// Lower end, at least zero.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Whether it can't be told from no error at all.
    pub fn is_lost_in_noise(&self) -> bool {
        self.low <= 0.0
    }

    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self { value: f(self.value), low: f(self.low), high: f(self.high) }
    }
}

/// Errors of one setting, in linear radiance, over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Root of the mean squared error against the truth.
    pub rmse: Interval,
    /// Mean of (I − R)² / (R² + 0.01), the reference's own share subtracted.
    pub relmse: Interval,
    /// The part of the RMSE that does not go away with more samples.
    pub bias: f64,
    /// The part that does: root of the mean variance between renders with other random numbers; none where one render of a setting by
    /// chance leaves it unknown.
    pub noise: Option<f64>,
    /// 99.9 % of the pixels have a smaller error in each channel; the reference's noise included.
    pub percentile_99_9: f64,
}

/// How far apart renders are that have the same random numbers: what a choice changes by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PairedDifference {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Mean of the squared difference over R² + 0.01.
    pub relative: f64,
}

/// The best picture that is known, with its standard error in each channel of each pixel.
#[derive(Clone, Debug)]
pub(super) struct Truth {
    /// The mean.
    pub picture: Picture,
    /// Standard errors, pixel by pixel.
    pub error: Vec<[f32; 3]>,
}

impl Truth {
    /// Root of the mean square of its standard errors.
    pub fn standard_error(&self) -> f64 {
        let sum: f64 = self.error.iter().flatten().map(|&e| f64::from(e) * f64::from(e)).sum();
        (sum / (3 * self.error.len()).max(1) as f64).sqrt()
    }

    /// Compares renders pair by pair, each pair with the same random numbers.
    pub(super) fn paired(&self, pairs: &[(&Picture, &Picture)]) -> PairedDifference {
        let (mut squares, mut relative, mut count) = (0.0, 0.0, 0_usize);
        for (a, b) in pairs {
            let values = a.rgb.iter().flatten().zip(b.rgb.iter().flatten()).zip(self.picture.rgb.iter().flatten());
            for ((a, b), r) in values {
                let [apart, r] = [f64::from(*a) - f64::from(*b), f64::from(*r)];
                squares += apart * apart;
                relative += apart * apart / (r * r + RELATIVE_FLOOR);
                count += 1;
            }
        }
        let n = count.max(1) as f64;
        PairedDifference { rmse: (squares / n).sqrt(), relative: relative / n }
    }

    /// Judges renders of one setting, each with random numbers of its own and of the truth's size; `by_chance` says whether there
    /// are any. At least one.
    pub fn judge(&self, renders: &[&Picture], by_chance: bool) -> Errors {
        let count = renders.len().max(1) as f64;
        let (mut plain, mut relative) = (Mean::default(), Mean::default());
        let (mut variance, mut worst) = (0.0, Vec::new());
        for pixel in 0..self.picture.pixels() {
            let (truth, own) = (self.picture.rgb[pixel], self.error[pixel]);
            let (mut square, mut weighted, mut largest) = (0.0, 0.0, 0.0_f32);
            for i in 0..3 {
                let reference = f64::from(truth[i]);
                let known = f64::from(own[i]) * f64::from(own[i]);
                let apart = |render: &&Picture| f64::from(render.rgb[pixel][i]) - reference;
                let all = renders.iter().map(|render| apart(render) * apart(render)).sum::<f64>() / count - known;
                square += all / 3.0;
                weighted += all / 3.0 / (reference * reference + RELATIVE_FLOOR);
                largest = renders.first().map_or(0.0, |first| apart(first).abs() as f32).max(largest);
                variance += spread(renders.iter().map(apart));
            }
            plain.add(square);
            relative.add(weighted);
            worst.push(largest);
        }
        let mse = plain.interval();
        let noise = match (by_chance, renders.len()) {
            (false, _) => Some(0.0),
            (true, 0 | 1) => None,
            (true, _) => Some(variance / (3 * self.picture.pixels()).max(1) as f64),
        };
        Errors {
            rmse: mse.map(f64::sqrt),
            relmse: relative.interval(),
            bias: (mse.value - noise.unwrap_or(0.0)).max(0.0).sqrt(),
            noise: noise.map(f64::sqrt),
            percentile_99_9: statistics(&worst).percentile_99_9,
        }
    }
}

/// Variance of values about their mean; zero of fewer than two.
fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count();
    if n < 2 {
        return 0.0;
    }
    let mean = values.clone().sum::<f64>() / n as f64;
    values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1) as f64
}

/// A mean over pixels with its own standard error, pixels taken as independent of each other.
#[derive(Default)]
struct Mean {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    /// One that is not finite is left out.
    fn add(&mut self, value: f64) {
        if value.is_finite() {
            self.count += 1.0;
            self.sum += value;
            self.squares += value * value;
        }
    }

    fn interval(&self) -> Interval {
        let n = self.count.max(1.0);
        let mean = self.sum / n;
        let error = ((self.squares / n - mean * mean).max(0.0) / n).sqrt();
        Interval { value: mean.max(0.0), low: (mean - 2.0 * error).max(0.0), high: (mean + 2.0 * error).max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::mix;

    const SIZE: [u32; 2] = [64, 64];

    /// A picture of 0.5 with normal noise and an offset.
    fn noisy(seed: u64, sigma: f64, offset: f64) -> Picture {
        let uniform = |k: usize, i: usize| mix(seed ^ mix((16 * k + i) as u64)) as f64 / 2_f64.powi(64);
        let mut picture = Picture::new(SIZE[0], SIZE[1]);
        for (k, value) in picture.rgb.iter_mut().flatten().enumerate() {
            // Twelve uniform numbers less six: variance 1.
            let sum: f64 = (0..12).map(|i| uniform(k, i)).sum();
            *value = (0.5 + offset + sigma * (sum - 6.0)) as f32;
        }
        picture
    }

    fn truth(sigma: f64) -> Truth {
        let picture = noisy(99, sigma, 0.0);
        Truth { error: vec![[sigma as f32; 3]; picture.pixels()], picture }
    }

    fn near(value: f64, expected: f64, share: f64) {
        assert!((value - expected).abs() <= share * expected, "{value}, not {expected}");
    }

    /// Protects: the reference's own noise is not counted, and what is left is parted into bias and noise: an offset of 0.03 with
    /// noise of 0.04 is an error of 0.05, seen from a reference that is itself 0.05 off.
    #[test]
    fn a_noisy_reference_is_seen_through() {
        let renders: Vec<Picture> = (1..=8).map(|seed| noisy(seed, 0.04, 0.03)).collect();
        let errors = truth(0.05).judge(&renders.iter().collect::<Vec<_>>(), true);
        near(errors.rmse.value, 0.05, 0.03);
        near(errors.noise.expect("eight renders"), 0.04, 0.01);
        near(errors.bias, 0.03, 0.07);
        // A reference that noisy decides by its own noise how much a pixel weighs; one of a hundredth does not.
        let relative = truth(0.005).judge(&renders.iter().collect::<Vec<_>>(), true).relmse;
        near(relative.value, 0.0025 / 0.26, 0.03);
        assert!(errors.rmse.low < 0.05 && errors.rmse.high > 0.05 && errors.rmse.high < 0.055, "{errors:?}");
        near(truth(0.05).standard_error(), 0.05, 1e-6);
    }

    /// Protects: what has no error is told from a small one, also where the reference has more noise than that.
    #[test]
    fn no_error_is_lost_in_noise() {
        let perfect = truth(0.05).judge(&[&noisy(1, 0.0, 0.0)], false);
        assert!(perfect.rmse.is_lost_in_noise() && perfect.rmse.high < 0.01, "{perfect:?}");
        let wrong = truth(0.05).judge(&[&noisy(1, 0.0, 0.02)], false);
        assert!(!wrong.rmse.is_lost_in_noise(), "{wrong:?}");
        near(wrong.bias, 0.02, 0.15);
        assert_eq!(wrong.noise, Some(0.0));
        assert_eq!(truth(0.0).judge(&[&noisy(1, 0.1, 0.0)], true).noise, None);
    }

    /// Protects: of 4,096 pixels the worst four do not count in the 99.9th percentile, the fifth does.
    #[test]
    fn a_percentile_shows_fireflies() {
        let with = |count: usize| {
            let mut picture = noisy(1, 0.0, 0.0);
            picture.rgb[..count].iter_mut().for_each(|rgb| rgb[1] = 9.5);
            truth(0.0).judge(&[&picture], false).percentile_99_9
        };
        assert!(with(4) < 1.0 && with(6) == 9.0, "{} {}", with(4), with(6));
    }

    /// Protects: a difference of pairs is free of the noise that both have.
    #[test]
    fn pairs_share_their_noise() {
        let pair: [Vec<Picture>; 2] = [0.0, 0.01].map(|offset| (1..4).map(|seed| noisy(seed, 0.5, offset)).collect());
        let pairs = |a: usize, b: usize| pair[a].iter().zip(&pair[b]).collect::<Vec<_>>();
        let apart = truth(0.0).paired(&pairs(1, 0));
        near(apart.rmse, 0.01, 1e-4);
        near(apart.relative, 1e-4 / 0.26, 1e-4);
        assert_eq!(truth(0.0).paired(&pairs(0, 0)), PairedDifference { rmse: 0.0, relative: 0.0 });
    }
}
