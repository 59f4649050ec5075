//! Error that each output format adds to the picture of the scene's own setting. The codes of the
//! format are compared with the display values before quantisation.

use serde::Serialize;

use crate::bench::SampleQuantiles;
use crate::bench::clock::Stopwatch;
use crate::display::{Display, OutputFormat};
use crate::ladder::{Ladder, RungChoice, RungValue};
use crate::metrics::{DEFAULT_PIXELS_PER_DEGREE, flip, mean_and_quantiles, picture_errors};
use crate::picture::Picture;

/// Error that an output format (such as 8-bit codes) adds to a picture, with size and time of the
/// conversion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OutputFormatReport {
    /// Name of the format, as a rung (quality level) of the output ladder.
    pub rung: &'static str,
    /// Description of the format for users.
    pub about: &'static str,
    /// Whether the scene's own setting uses the format.
    pub in_use: bool,
    /// Bytes per pixel without alpha (coverage), before compression.
    pub bytes_per_pixel: u32,
    /// Time to convert the whole picture to codes, in seconds summed over all threads; `None` for a
    /// format without codes.
    pub seconds: Option<SampleQuantiles>,
    /// Root mean squared difference between decoded display values and display values before
    /// quantisation, both 0 to 1.
    pub rmse: f64,
    /// Greatest absolute difference between decoded display values and display values before
    /// quantisation, both 0 to 1.
    pub greatest: f64,
    /// Mean FLIP difference, 0 to 1, between decoded display values and display values before
    /// quantisation.
    pub flip: f64,
    /// Share of the pixels, 0 to 1, with a channel at its maximum. Their radiance cannot be
    /// recovered by a later change of exposure.
    pub clipped: f64,
}

/// Measures every output format on a picture without alpha and layers, of which codes hold neither.
/// Each encoding is timed `rounds` times. `in_use` is the format of the scene's own setting.
pub(super) fn measure_output_formats(
    picture: &Picture,
    display: Display,
    in_use: OutputFormat,
    (stopwatch, rounds): (Stopwatch, u64),
) -> Vec<OutputFormatReport> {
    let shown = display.to_display_values(picture);
    let is_clipped = |rgb: &&[f32; 3]| rgb.iter().any(|&value| value >= 1.0);
    let clipped = shown.rgb.iter().filter(is_clipped).count() as f64;
    let report = |choice: RungChoice| {
        let RungValue::Output(format) = choice.value() else {
            return None;
        };
        let mut report = OutputFormatReport {
            rung: choice.rung(),
            about: choice.rung_description(),
            in_use: format == in_use,
            bytes_per_pixel: 3 * format.bytes_per_channel(),
            seconds: None,
            rmse: 0.0,
            greatest: 0.0,
            flip: 0.0,
            clipped: 0.0,
        };
        if format.has_codes() {
            let encoder = Display {
                output: format,
                ..display
            };
            let mut codes = Vec::new();
            let mut encode = || {
                codes = encoder.to_codes(picture);
                codes.len() as u64
            };
            let seconds: Vec<f64> = (0..rounds).map(|_| stopwatch(&mut encode)).collect();
            let stored = decode_display_codes(&codes, format, &shown);
            // Both pictures have the same size, which is not zero.
            let errors = picture_errors(&stored, &shown).ok()?;
            let flip = flip(&stored, &shown, DEFAULT_PIXELS_PER_DEGREE).unwrap_or_default();
            report.seconds = Some(SampleQuantiles::from_samples(&seconds));
            (report.rmse, report.greatest) = (errors.rmse, errors.max_abs);
            report.flip = mean_and_quantiles(&flip).mean;
            report.clipped = clipped / shown.pixel_count() as f64;
        }
        Some(report)
    };
    Ladder::Output.choices().filter_map(report).collect()
}

/// Decodes the codes of an output format to a picture of display values, 0 to 1. The picture has
/// the width and height of `like`.
fn decode_display_codes(codes: &[u8], kind: OutputFormat, like: &Picture) -> Picture {
    let bytes = kind.bytes_per_channel() as usize;
    let maximum = if bytes == 1 { 255.0 } else { 65535.0 };
    let value = |code: &[u8]| {
        let code = code.iter().fold(0, |sum, &byte| sum << 8 | u32::from(byte));
        (f64::from(code) / maximum) as f32
    };
    let pixel = |codes: &[u8]| core::array::from_fn(|i| value(&codes[i * bytes..(i + 1) * bytes]));
    Picture {
        rgb: codes.chunks_exact(3 * bytes).map(pixel).collect(),
        ..like.clone()
    }
}
