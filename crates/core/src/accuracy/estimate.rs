//! Estimated errors of a rendered tile. The reference, with which the tile is compared, has noise
//! too; its variance is subtracted from the squared errors. Errors are divided into noise and bias.
//! Noise falls with more samples, bias does not.

use serde::Serialize;

use crate::display::Display;
use crate::film::PixelMeanAndVariance;
use crate::metrics::{DEFAULT_PIXELS_PER_DEGREE, RELATIVE_FLOOR, flip};
use crate::picture::Picture;

/// Edge in pixels of the square blocks of a tile over which errors are summed. The sums of
/// different blocks count as statistically independent.
pub(super) const BLOCK: usize = 8;

/// Estimated value of a measured quantity, with its confidence interval of about 95 %. The error of
/// a single render has its own type, [`ErrorEstimate`](crate::film::ErrorEstimate).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ConfidenceInterval {
    /// Estimated value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl ConfidenceInterval {
    /// Returns the interval of a number without uncertainty.
    pub fn from_exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// Whether the interval contains zero. The value may then be noise alone.
    pub fn includes_zero(&self) -> bool {
        self.low <= 0.0
    }

    /// Returns the interval after applying a non-decreasing function to the value and to both ends.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            value: f(self.value),
            low: f(self.low),
            high: f(self.high),
        }
    }

    /// Returns the interval of a positive value with the uncertainty `error`. Its ends are the
    /// value divided and multiplied by exp(`error`/`value`). The interval is wider above the value
    /// than below it, like the distribution of a sum with a few dominant terms.
    pub(super) fn from_relative_error(value: f64, error: f64) -> Self {
        let spread = libm::exp(error / value);
        Self {
            value,
            low: value / spread,
            high: value * spread,
        }
    }

    /// Returns an interval from zero to the value plus its uncertainty `error`, for a value that
    /// may be noise alone.
    pub(super) fn from_value_within_noise(value: f64, error: f64) -> Self {
        let high = value.max(0.0) + error;
        Self {
            value: value.max(0.0),
            low: 0.0,
            high: if high.is_nan() { f64::INFINITY } else { high },
        }
    }

    /// Returns the interval of this value divided by `other`. The uncertainties of the two values
    /// are independent.
    pub(super) fn divide(&self, other: &Self) -> Self {
        let value = self.value / other.value;
        if self.includes_zero() || other.includes_zero() {
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

    /// Returns the interval of this value multiplied by a positive `other`. The uncertainties of
    /// the two values are independent.
    pub(super) fn multiply(&self, other: &Self) -> Self {
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

    /// Returns the relative uncertainty of the value: half the width of the interval divided by the
    /// value.
    pub fn relative_half_width(&self) -> f64 {
        0.5 * (self.high - self.low) / self.value
    }
}

/// Errors of a setting over the whole picture: differences in linear radiance from the reference,
/// averaged over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(into = "RootErrors")]
pub struct SettingErrors {
    /// Root mean squared error; the reference's variance is subtracted.
    pub rmse: ConfidenceInterval,
    /// Mean of (I − R)² / (R² + 0.01) for picture I and reference R; the reference's variance is
    /// subtracted.
    pub relmse: ConfidenceInterval,
    /// Part of `relmse` that more samples do not reduce. `None` if it is unknown because the
    /// setting was rendered only once.
    pub bias: Option<ConfidenceInterval>,
    /// Ratio of the summed radiance of the picture to that of the reference.
    pub light: ConfidenceInterval,
}

/// Errors of a setting as files report them: the roots of the mean squares.
#[derive(Serialize)]
struct RootErrors {
    rmse: ConfidenceInterval,
    root_relmse: ConfidenceInterval,
    bias: Option<ConfidenceInterval>,
    light: ConfidenceInterval,
}

impl From<SettingErrors> for RootErrors {
    fn from(errors: SettingErrors) -> Self {
        Self {
            rmse: errors.rmse,
            root_relmse: errors.relmse.map(f64::sqrt),
            bias: errors.bias.map(|bias| bias.map(f64::sqrt)),
            light: errors.light,
        }
    }
}

/// The reference in one tile: mean radiances, their variances, and display values.
#[derive(Clone, Debug)]
pub(super) struct ReferenceTile {
    /// Mean radiance of each pixel.
    pub picture: Picture,
    /// Variance of the mean radiance, for each pixel and channel.
    variance: Vec<[f64; 3]>,
    /// Mean radiance converted to display values, for FLIP.
    display_picture: Picture,
    /// Variance of the tile's sum of relative squared errors that is due to the noise of the
    /// reference.
    pub error_variance: f64,
}

/// Errors of a setting in one tile. Each vector holds a sum per block of 8 × 8 pixels; the other
/// fields are sums over the tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TileErrors {
    /// Relative squared errors, averaged over channels, summed over each block.
    pub relative: Vec<f64>,
    /// Squared errors in linear radiance, averaged over channels, summed over each block.
    pub squared: Vec<f64>,
    /// Squared bias, summed over each block and already contained in `relative`. It is the error
    /// that renders with different random numbers have in common. Empty for a single render with
    /// random numbers.
    pub bias: Vec<f64>,
    /// Sum of the radiance over pixels and channels, averaged over renders.
    pub light: f64,
    /// Sum of the FLIP differences of the first render.
    pub flip: f64,
    /// Squared and relative squared difference from renders of a second setting with the same
    /// random numbers, summed over pixels. Zero without a second setting.
    pub paired_difference: [f64; 2],
}

impl ReferenceTile {
    /// Builds the tile from the mean radiance and its variance for each pixel, row by row.
    pub fn new(
        [width, height]: [u32; 2],
        means: &[PixelMeanAndVariance],
        display: Display,
    ) -> Self {
        let rgb = means
            .iter()
            .map(|[mean, _]| mean.map(|m| m as f32))
            .collect();
        let picture = Picture {
            rgb,
            ..Picture::new(width, height)
        };
        let variance: Vec<[f64; 3]> = means.iter().map(|[_, variance]| *variance).collect();
        // For noise alone, a squared difference minus the reference's variance v has the variance
        // 2v². The channels of a pixel count as fully correlated.
        let pixel = |(value, rgb): (&[f64; 3], &[f32; 3])| {
            (0..3)
                .map(|i| value[i] * relative_error_weight(rgb[i]))
                .sum::<f64>()
                .powi(2)
                * 8.0
                / 3.0
        };
        let doubt = variance.iter().zip(&picture.rgb).map(pixel).sum();
        Self {
            display_picture: display.to_display_values(&picture),
            picture,
            variance,
            error_variance: doubt,
        }
    }

    /// Returns the number of pixels in each block of the tile, row by row.
    pub fn block_pixel_counts(&self) -> Vec<f64> {
        let [columns, rows] = [self.picture.width, self.picture.height].map(|edge| {
            let edge = edge as usize;
            (0..edge.div_ceil(BLOCK))
                .map(|position| BLOCK.min(edge - position * BLOCK) as f64)
                .collect::<Vec<_>>()
        });
        rows.iter()
            .flat_map(|height| columns.iter().map(move |width| width * height))
            .collect()
    }

    /// Returns the variance of each pixel's mean radiance, averaged over channels and summed over
    /// pixels.
    pub fn summed_variance(&self) -> f64 {
        self.variance.iter().flatten().sum::<f64>() / 3.0
    }

    /// Returns the sum of the reference's radiance over pixels and channels.
    pub fn total_radiance(&self) -> f64 {
        total_radiance(&self.picture)
    }

    /// Computes the errors of one setting in this tile, averaged over `renders`. Each render has
    /// other random numbers.
    ///
    /// - `by_chance`: whether the setting uses random numbers.
    /// - `beside`: renders of a second setting with the same random numbers, in the same order; may
    ///   be empty.
    /// - `display`: conversion to display values, for FLIP.
    pub fn measure_tile_errors(
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
                let (reference, share) = (f64::from(truth[i]), relative_error_weight(truth[i]));
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
                    // The mean of several renders has noise too, estimated from the variance
                    // between the renders.
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
                    errors.paired_difference = [
                        errors.paired_difference[0] + square / 3.0,
                        errors.paired_difference[1] + square * share,
                    ];
                }
            }
        }
        errors.light = renders.iter().map(total_radiance).sum::<f64>() / count;
        // Both pictures have the same size, which is not zero.
        let first = renders
            .first()
            .map(|first| display.to_display_values(first));
        let map = first
            .and_then(|first| flip(&first, &self.display_picture, DEFAULT_PIXELS_PER_DEGREE).ok());
        errors.flip = map.unwrap_or_default().iter().map(|&v| f64::from(v)).sum();
        errors
    }
}

/// Returns 1/(3(R² + 0.01)) for the reference value R of a channel. The sum over the three channels
/// of this weight times the squared error is a pixel's relative squared error.
pub(super) fn relative_error_weight(reference: f32) -> f64 {
    let reference = f64::from(reference);
    1.0 / (3.0 * (reference * reference + RELATIVE_FLOOR))
}

/// Returns the relative variance of a pixel's mean radiance: variance / (mean² + 0.01), averaged
/// over channels.
pub(super) fn relative_variance([mean, variance]: &PixelMeanAndVariance) -> f64 {
    (0..3)
        .map(|i| variance[i] * relative_error_weight(mean[i] as f32))
        .sum()
}

/// Returns the sum of a picture's radiance over pixels and channels; values that are not finite are
/// ignored.
pub(super) fn total_radiance(picture: &Picture) -> f64 {
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
