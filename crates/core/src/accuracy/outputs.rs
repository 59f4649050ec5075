//! Error that each output format adds to the picture of the scene's own setting. The codes of the
//! format are compared with the display values before quantisation.

use serde::Serialize;

use crate::bench::SampleQuantiles;
use crate::bench::clock::Stopwatch;
use crate::display::{Display, OutputFormat};
use crate::ladder::{Ladder, RungChoice, RungValue};
use crate::metrics::{DEFAULT_PIXELS_PER_DEGREE, flip};
use crate::picture::Picture;

/// Number of repetitions of the timed encoding.
const ROUNDS: usize = 5;

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

/// Measures every output format on tiles of a picture, each given with its inclusion probability.
/// `pixels` is the number of pixels of the whole picture. `in_use` is the format of the scene's own
/// setting.
pub(super) fn measure_output_formats(
    tiles: &[(f64, &Picture)],
    pixels: f64,
    display: Display,
    in_use: OutputFormat,
    stopwatch: Stopwatch,
) -> Vec<OutputFormatReport> {
    let shown = DisplayedTiles::new(tiles, display);
    let clipped = shown.clipped_share();
    // Codes hold neither alpha nor layers.
    let opaque: Vec<Picture> = tiles
        .iter()
        .map(|(_, tile)| Picture {
            alpha: None,
            layers: Vec::new(),
            ..(*tile).clone()
        })
        .collect();
    let tile_pixels: usize = opaque.iter().map(Picture::pixel_count).sum();
    let report = |choice: RungChoice| {
        let RungValue::Output(format) = choice.value() else {
            return None;
        };
        let exact = OutputFormatReport {
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
        if !format.has_codes() {
            return Some(exact);
        }
        let encoder = Display {
            output: format,
            ..display
        };
        let (codes, seconds) = time_encoding(&opaque, encoder, stopwatch);
        let CodeErrors {
            rmse,
            greatest,
            flip,
        } = shown.measure_code_errors(&codes, format);
        Some(OutputFormatReport {
            seconds: Some(seconds.scale(pixels / tile_pixels.max(1) as f64)),
            rmse,
            greatest,
            flip,
            clipped,
            ..exact
        })
    };
    Ladder::Output.choices().filter_map(report).collect()
}

/// Encodes tiles repeatedly. Returns the codes of each tile, and the seconds of a repetition,
/// summed over all threads.
fn time_encoding(
    tiles: &[Picture],
    encoder: Display,
    stopwatch: Stopwatch,
) -> (Vec<Vec<u8>>, SampleQuantiles) {
    let mut codes: Vec<Vec<u8>> = Vec::new();
    let seconds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            stopwatch(&mut || {
                codes = tiles.iter().map(|tile| encoder.to_codes(tile)).collect();
                codes.iter().map(|codes| codes.len() as u64).sum()
            })
        })
        .collect();
    (codes, SampleQuantiles::from_samples(&seconds))
}

/// Errors of decoded codes against display values before quantisation. See [`OutputFormatReport`].
struct CodeErrors {
    rmse: f64,
    greatest: f64,
    flip: f64,
}

/// Tiles of a picture as display values, 0 to 1, before quantisation. Each tile has a weight, the
/// inverse of its inclusion probability.
struct DisplayedTiles {
    tiles: Vec<(f64, Picture)>,
    /// Weighted number of pixels, an estimate of that of the whole picture.
    pixels: f64,
}

impl DisplayedTiles {
    /// Converts tiles, each given with its inclusion probability, to display values.
    fn new(tiles: &[(f64, &Picture)], display: Display) -> Self {
        let tiles: Vec<(f64, Picture)> = tiles
            .iter()
            .map(|(chance, picture)| (1.0 / chance, display.to_display_values(picture)))
            .collect();
        let pixels: f64 = tiles
            .iter()
            .map(|(weight, tile)| weight * tile.pixel_count() as f64)
            .sum();
        Self {
            tiles,
            pixels: pixels.max(1.0),
        }
    }

    /// Returns the share of the pixels, 0 to 1, with a channel at its maximum.
    fn clipped_share(&self) -> f64 {
        let clipped = |tile: &Picture| {
            tile.rgb
                .iter()
                .filter(|rgb| rgb.iter().any(|&v| v >= 1.0))
                .count() as f64
        };
        let sum: f64 = self
            .tiles
            .iter()
            .map(|(weight, tile)| weight * clipped(tile))
            .sum();
        sum / self.pixels
    }

    /// Returns the errors of the codes of a format, which are given for each tile.
    fn measure_code_errors(&self, codes: &[Vec<u8>], format: OutputFormat) -> CodeErrors {
        let (mut squares, mut flips, mut greatest) = (0.0, 0.0, 0.0_f64);
        for ((weight, shown), codes) in self.tiles.iter().zip(codes) {
            let stored = decode_display_codes(codes, format, shown);
            let differences = stored
                .rgb
                .iter()
                .zip(&shown.rgb)
                .flat_map(|(a, b)| (0..3).map(|i| f64::from(a[i]) - f64::from(b[i])));
            squares += weight * differences.clone().map(|d| d * d).sum::<f64>();
            greatest = differences.map(f64::abs).fold(greatest, f64::max);
            let map = flip(&stored, shown, DEFAULT_PIXELS_PER_DEGREE).unwrap_or_default();
            flips += weight * map.iter().map(|&v| f64::from(v)).sum::<f64>();
        }
        CodeErrors {
            rmse: (squares / (3.0 * self.pixels)).sqrt(),
            greatest,
            flip: flips / self.pixels,
        }
    }
}

/// Decodes the codes of an output format to a picture of display values, 0 to 1. The picture has
/// the width and height of `like`.
fn decode_display_codes(codes: &[u8], kind: OutputFormat, like: &Picture) -> Picture {
    let bytes = kind.bytes_per_channel() as usize;
    let maximum = if bytes == 1 { 255.0 } else { 65535.0 };
    let value = |code: &[u8]| {
        (code
            .iter()
            .fold(0_u32, |sum, &byte| sum << 8 | u32::from(byte)) as f64
            / maximum) as f32
    };
    let pixel = |codes: &[u8]| core::array::from_fn(|i| value(&codes[i * bytes..(i + 1) * bytes]));
    Picture {
        rgb: codes.chunks_exact(3 * bytes).map(pixel).collect(),
        ..like.clone()
    }
}
