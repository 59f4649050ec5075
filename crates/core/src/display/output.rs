//! Output formats of a picture: codes of eight bits (rounded or dithered) or sixteen bits, or
//! linear floats.

use serde::{Deserialize, Serialize};

/// Format of stored channel values: codes of 8 or 16 bits, or linear floating-point numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutputFormat {
    /// Display values rounded to the nearest of 256 codes.
    #[default]
    Eight,
    /// Display values rounded up or down to one of 256 codes by dithering. The mean over
    /// neighbouring pixels is correct, and gradients show no steps.
    Dithered,
    /// Display values rounded to the nearest of 65 536 codes.
    Sixteen,
    /// Linear radiance as floating-point numbers, unbounded.
    Float,
}

impl OutputFormat {
    /// Returns the number of bytes of a channel before compression.
    pub const fn bytes_per_channel(self) -> u32 {
        match self {
            Self::Eight | Self::Dithered => 1,
            Self::Sixteen => 2,
            Self::Float => 4,
        }
    }

    /// Whether the format stores codes of display values, not radiance.
    pub const fn has_codes(self) -> bool {
        !matches!(self, Self::Float)
    }
}

/// Returns the 16-bit code of a display value in 0..1: floor(65535 v + ½).
pub(super) fn quantise_16_bit(value: f64) -> u16 {
    (65535.0 * value + 0.5) as u16
}

/// Returns the dithered 8-bit code of a display value v in 0..1: floor(255 v + d). The dither d
/// depends on column, row and channel, and its values are spread evenly over [0, 1). A value that
/// equals a code keeps this code; the mean code of any other value is correct.
///
/// d is interleaved gradient noise (Jimenez, "Next Generation Post Processing in Call of Duty:
/// Advanced Warfare", 2014). Its values differ strongly from pixel to pixel: the dither is too fine
/// to be visible. The noise is shifted from channel to channel to reduce the brightness error of
/// greys.
pub(super) fn dither_8_bit(value: f64, [x, y]: [u32; 2], channel: usize) -> u8 {
    const SHIFT: f64 = 5.588_238;
    let x = f64::from(x) + SHIFT * channel as f64;
    let slope = 0.067_110_56 * x + 0.005_837_15 * f64::from(y);
    let ramp = 52.982_918_9 * (slope - slope.floor());
    (255.0 * value + (ramp - ramp.floor())) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: dither is unbiased: over any 32 by 32 pixels the mean code of a value equals the
    /// value within a tenth of a code, in each channel; values that are codes stay unchanged.
    #[test]
    fn f07_dither_has_the_right_mean() {
        for (channel, value) in
            (0..3).flat_map(|channel| (0..=50).map(move |k| (channel, f64::from(k) / 50.0)))
        {
            for corner in [[0, 0], [1000, 77], [65_500, 65_500]] {
                let places = (0..32 * 32).map(|i| [corner[0] + i % 32, corner[1] + i / 32]);
                let codes: Vec<u8> = places
                    .map(|place| dither_8_bit(value, place, channel))
                    .collect();
                let mean = codes.iter().map(|&code| f64::from(code)).sum::<f64>() / 1024.0;
                assert!(
                    (mean - 255.0 * value).abs() < 0.1,
                    "{value} in {channel} at {corner:?}: {mean}"
                );
                let exact = 255.0 * value;
                assert!(
                    codes
                        .iter()
                        .all(|&code| (f64::from(code) - exact).abs() < 1.0),
                    "{value}: one of the two nearest"
                );
            }
        }
        for code in 0..=255_u8 {
            let value = f64::from(code) / 255.0;
            assert!(
                (0..100).all(
                    |i| dither_8_bit(value + 1e-9 * f64::from(code < 255), [i, 3 * i], 1) == code
                ),
                "{code}"
            );
        }
    }

    /// Protects: sixteen bits are rounded to the nearest code, ends included.
    #[test]
    fn sixteen_bits_are_the_nearest() {
        let found = [
            0.0,
            0.49 / 65535.0,
            0.51 / 65535.0,
            0.5,
            1.0 - 0.51 / 65535.0,
            1.0,
        ]
        .map(quantise_16_bit);
        assert_eq!(found, [0, 0, 1, 32768, 65534, 65535]);
    }
}
