//! How far a tile is from the truth, told from a reference that is itself not free of noise: its
//! own variance is subtracted, and what is left is divided into noise, which more samples lower,
//! and bias, which they do not.

use serde::Serialize;

use crate::display::Display;
use crate::film::MeanVariance;
use crate::metrics::{DEFAULT_PIXELS_PER_DEGREE, RELATIVE_FLOOR, flip};
use crate::picture::Picture;

/// Edge of the squares of pixels whose errors count as independent of each other.
pub(super) const BLOCK: usize = 8;

/// A number with the interval that holds it in about 95 of 100 cases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// A number that is known.
    pub fn exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// Whether it can't be told from no error at all.
    pub fn is_lost_in_noise(&self) -> bool {
        self.low <= 0.0
    }

    /// The interval of a function of it that does not fall.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            value: f(self.value),
            low: f(self.low),
            high: f(self.high),
        }
    }

    /// Of a value above zero and an error that already has its factor. It is one of factors: what
    /// is left of a sum of a few large parts reaches farther up than down.
    pub(super) fn of_factors(value: f64, error: f64) -> Self {
        let spread = libm::exp(error / value);
        Self {
            value,
            low: value / spread,
            high: value * spread,
        }
    }

    /// Of what can't be told from nothing.
    pub(super) fn from_zero(value: f64, error: f64) -> Self {
        let high = value.max(0.0) + error;
        Self {
            value: value.max(0.0),
            low: 0.0,
            high: if high.is_nan() { f64::INFINITY } else { high },
        }
    }

    /// Over another one whose error is independent.
    pub(super) fn over(&self, other: &Self) -> Self {
        let value = self.value / other.value;
        if self.is_lost_in_noise() || other.is_lost_in_noise() {
            return Self {
                value,
                low: self.low / other.high,
                high: self.high / other.low,
            };
        }
        let spread = libm::exp(libm::hypot(
            libm::log(self.high / self.value),
            libm::log(other.high / other.value),
        ));
        Self {
            value,
            low: value / spread,
            high: value * spread,
        }
    }

    /// Times another one above zero whose error is independent.
    pub(super) fn times(&self, other: &Self) -> Self {
        if other.low == other.high || self.value <= 0.0 {
            return Self {
                value: self.value * other.value,
                low: self.low * other.low,
                high: self.high * other.high,
            };
        }
        let far = |own: f64, value: f64, other: f64, middle: f64| {
            libm::hypot(libm::log(own / value), libm::log(other / middle))
        };
        let value = self.value * other.value;
        let low = value * libm::exp(-far(self.low, self.value, other.low, other.value));
        Self {
            value,
            low,
            high: value * libm::exp(far(self.high, self.value, other.high, other.value)),
        }
    }

    /// Half of its width, as a share of the value.
    pub fn relative(&self) -> f64 {
        0.5 * (self.high - self.low) / self.value
    }
}

/// Errors of one setting in the whole picture, in linear radiance, over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Root of the mean squared error against the truth.
    pub rmse: Interval,
    /// Mean of (I − R)² / (R² + 0.01), the reference's own share subtracted.
    pub relmse: Interval,
    /// The part of `relmse` that does not go away with more samples; none where one render leaves
    /// it unknown.
    pub bias: Option<Interval>,
    /// The picture's light over the reference's.
    pub light: Interval,
}

/// What is known of a tile.
#[derive(Clone, Debug)]
pub(super) struct TruthTile {
    /// The mean.
    pub picture: Picture,
    /// Variance of the mean, pixel by pixel.
    variance: Vec<[f64; 3]>,
    /// As displays show it.
    shown: Picture,
    /// Variance that a sum of relative errors of the tile has by the reference's noise alone.
    pub doubt: f64,
}

/// Errors of a setting in a tile, as sums over its pixels; those with several parts by block.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TileErrors {
    pub relative: Vec<f64>,
    pub squared: Vec<f64>,
    /// The part of `relative` that renders with other random numbers have in common; empty where
    /// there is one.
    pub bias: Vec<f64>,
    pub light: f64,
    pub flip: f64,
    /// Difference to renders with the same random numbers: squared, and relative; zero where there
    /// are none.
    pub alone: [f64; 2],
}

impl TruthTile {
    /// Of the means of a film's tile.
    pub fn new([width, height]: [u32; 2], means: &[MeanVariance], display: Display) -> Self {
        let rgb = means
            .iter()
            .map(|[mean, _]| mean.map(|m| m as f32))
            .collect();
        let picture = Picture {
            rgb,
            ..Picture::new(width, height)
        };
        let variance: Vec<[f64; 3]> = means.iter().map(|[_, variance]| *variance).collect();
        // A squared difference less the variance of one side has twice the square of that variance;
        // channels go together.
        let pixel = |(of, rgb): (&[f64; 3], &[f32; 3])| {
            (0..3).map(|i| of[i] * weight(rgb[i])).sum::<f64>().powi(2) * 8.0 / 3.0
        };
        let doubt = variance.iter().zip(&picture.rgb).map(pixel).sum();
        Self {
            shown: display.to_values(&picture),
            picture,
            variance,
            doubt,
        }
    }

    /// Pixels of each block.
    pub fn blocks(&self) -> Vec<f64> {
        let [columns, rows] = [self.picture.width, self.picture.height].map(|edge| {
            let edge = edge as usize;
            (0..edge.div_ceil(BLOCK))
                .map(|at| BLOCK.min(edge - at * BLOCK) as f64)
                .collect::<Vec<_>>()
        });
        rows.iter()
            .flat_map(|height| columns.iter().map(move |width| width * height))
            .collect()
    }

    /// Sum of the squares of its standard errors.
    pub fn variance(&self) -> f64 {
        self.variance.iter().flatten().sum::<f64>() / 3.0
    }

    /// Sum of its light.
    pub fn light(&self) -> f64 {
        light(&self.picture)
    }

    /// Judges renders of one setting, each with random numbers of its own; `by_chance` says whether
    /// there are any. At least one. `beside` are renders of another setting with the same random
    /// numbers.
    pub fn judge(
        &self,
        renders: &[Picture],
        by_chance: bool,
        beside: &[Picture],
        display: Display,
    ) -> TileErrors {
        let (count, width) = (renders.len().max(1) as f64, self.picture.width as usize);
        let columns = width.div_ceil(BLOCK);
        let blocks = columns * (self.picture.height as usize).div_ceil(BLOCK);
        let is_bias_known = !by_chance || renders.len() > 1;
        let mut errors = TileErrors {
            relative: vec![0.0; blocks],
            squared: vec![0.0; blocks],
            ..TileErrors::default()
        };
        errors.bias = vec![0.0; if is_bias_known { blocks } else { 0 }];
        for (pixel, (truth, known)) in self.picture.rgb.iter().zip(&self.variance).enumerate() {
            let block = pixel / width / BLOCK * columns + pixel % width / BLOCK;
            for i in 0..3 {
                let (reference, share) = (f64::from(truth[i]), weight(truth[i]));
                let apart = |render: &Picture| f64::from(render.rgb[pixel][i]) - reference;
                let mean = renders.iter().map(apart).sum::<f64>() / count;
                let spread = renders
                    .iter()
                    .map(|render| (apart(render) - mean).powi(2))
                    .sum::<f64>()
                    / count;
                let square = mean * mean + spread - known[i];
                if !square.is_finite() {
                    continue;
                }
                errors.squared[block] += square / 3.0;
                errors.relative[block] += square * share;
                if is_bias_known {
                    // The mean of several has noise of its own, which their spread says.
                    let noise = if by_chance {
                        spread / (count - 1.0)
                    } else {
                        0.0
                    };
                    errors.bias[block] += (mean * mean - noise - known[i]) * share;
                }
                for (render, other) in renders.iter().zip(beside) {
                    let apart = f64::from(render.rgb[pixel][i]) - f64::from(other.rgb[pixel][i]);
                    let square = apart * apart / renders.len().min(beside.len()) as f64;
                    errors.alone = [
                        errors.alone[0] + square / 3.0,
                        errors.alone[1] + square * share,
                    ];
                }
            }
        }
        errors.light = renders.iter().map(light).sum::<f64>() / count;
        // Both have one size, which is not zero.
        let first = renders.first().map(|first| display.to_values(first));
        let map = first.and_then(|first| flip(&first, &self.shown, DEFAULT_PIXELS_PER_DEGREE).ok());
        errors.flip = map.unwrap_or_default().iter().map(|&v| f64::from(v)).sum();
        errors
    }
}

/// What a channel's squared error is multiplied by, a third of the inverse of what it is relative
/// to.
pub(super) fn weight(reference: f32) -> f64 {
    let reference = f64::from(reference);
    1.0 / (3.0 * (reference * reference + RELATIVE_FLOOR))
}

/// Variance of a pixel's mean as errors are judged.
pub(super) fn relative_variance([mean, variance]: &MeanVariance) -> f64 {
    (0..3).map(|i| variance[i] * weight(mean[i] as f32)).sum()
}

/// Sum of a picture's light, of finite channels.
pub(super) fn light(picture: &Picture) -> f64 {
    picture
        .rgb
        .iter()
        .flatten()
        .filter(|v| v.is_finite())
        .map(|&v| f64::from(v))
        .sum()
}

#[cfg(test)]
mod tests;
