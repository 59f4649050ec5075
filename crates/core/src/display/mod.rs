//! Conversion of linear radiance to display values: exposure, tone map, transfer curve,
//! quantisation to codes.
//!
//! Every number has a defined result. Negative radiance is black. Infinite radiance is as bright as
//! the tone map permits. A pixel with a NaN shows [`NAN_MARKER`]. The steps are computed in `f64`
//! and rounded once, to `f32` before the transfer curve. Elementary functions have fixed
//! implementations: every machine gives the same bits.

mod agx;
mod codes;
#[doc(hidden)]
pub mod curve;
#[doc(hidden)]
pub mod exposure;
mod matrix;
mod output;
mod tone;

use rayon::prelude::*;
use raywright_bvh::scalar::Real;
use serde::{Deserialize, Serialize};

use crate::picture::Picture;
use crate::scene::{RenderSettings, ToneMap, TransferCurve};
pub(crate) use codes::CodeTable;
pub use output::OutputFormat;
use tone::ToneOperator;

/// Display values of a pixel with a NaN channel: pure magenta.
#[doc(hidden)]
pub const NAN_MARKER: [f32; 3] = [1.0, 0.0, 1.0];

/// Settings of the conversion of linear radiance to display values: exposure, tone map, transfer
/// curve, output format and background.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Display {
    /// Tone map from radiance to display-linear values in 0..1.
    pub tone_map: ToneMap,
    /// Transfer curve from display-linear to stored values.
    pub curve: TransferCurve,
    /// Exposure in stops: radiance is multiplied by 2 to this power before the tone map.
    pub exposure_stops: f64,
    /// Format of the codes in files.
    #[serde(default)]
    pub output: OutputFormat,
    /// Display values of the background, 0 to 1. Pixels without coverage show exactly these values.
    /// `None` leaves the background transparent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<[f64; 3]>,
}

impl Display {
    /// Settings for pictures whose values are already display-linear: the sRGB curve without
    /// exposure and without tone map.
    pub const PLAIN: Self = Self {
        tone_map: ToneMap::None,
        curve: TransferCurve::Srgb,
        exposure_stops: 0.0,
        output: OutputFormat::Eight,
        background: None,
    };

    /// Returns the background in linear values: its display values decoded as sRGB. Exposure and
    /// tone map are not inverted: some display values correspond to no radiance.
    pub fn linear_background(&self) -> Option<[f64; 3]> {
        self.background.map(|background| {
            background.map(|value| curve::decode_transfer(TransferCurve::Srgb, value))
        })
    }

    /// Returns the display settings in a scene's render section.
    pub fn from_render(render: &RenderSettings) -> Self {
        Self {
            tone_map: render.tone_map,
            curve: render.gamma,
            exposure_stops: render.exposure,
            ..Self::default()
        }
    }

    /// Builds the tables with which single pixels are converted.
    pub fn build_map(self) -> DisplayMap {
        DisplayMap {
            tone: ToneOperator::new(self.tone_map),
            curve: self.curve,
            exposure_factor: Real::powf(2.0_f64, self.exposure_stops),
            codes: CodeTable::new(self.curve),
            background: self.background,
        }
    }

    /// Whether the displayed picture has transparency: the picture has coverage (alpha), and these
    /// settings have no background.
    pub fn has_alpha(&self, picture: &Picture) -> bool {
        picture.alpha.is_some() && self.background.is_none()
    }

    /// Returns the codes of a picture, row by row from the top: three codes per pixel, or four with
    /// alpha.
    ///
    /// - [`OutputFormat::Sixteen`] has two bytes per code, the high byte first.
    /// - [`OutputFormat::Float`] has no codes; 16-bit codes are returned.
    ///
    /// The alpha is unassociated, as PNG requires: colours are divided by the coverage before the
    /// tone map.
    pub fn to_codes(self, picture: &Picture) -> Vec<u8> {
        let map = self.build_map();
        let values = |i: usize| map.composite_pixel(picture, i);
        match (self.output, self.has_alpha(picture)) {
            (OutputFormat::Eight, false) => {
                encode_rows(picture, |i, _| match picture.coverage(i) {
                    [1.0, _] => map.codes(picture.rgb[i]),
                    _ => values(i).0.map(curve::quantise_8_bit),
                })
            }
            (OutputFormat::Eight, true) => encode_rows(picture, |i, _| match picture.coverage(i) {
                [surfaces, 0.0] => append_alpha(
                    map.codes(picture.surface_colour(i).unwrap_or_default()),
                    alpha_code(surfaces.into()),
                ),
                _ => append_alpha(
                    values(i).0.map(curve::quantise_8_bit),
                    alpha_code(values(i).1),
                ),
            }),
            (OutputFormat::Dithered, false) => {
                encode_rows(picture, |i, place| dither_pixel(values(i).0, place))
            }
            (OutputFormat::Dithered, true) => encode_rows(picture, |i, place| {
                append_alpha(dither_pixel(values(i).0, place), alpha_code(values(i).1))
            }),
            (_, false) => encode_rows(picture, |i, _| {
                to_big_endian(values(i).0.map(output::quantise_16_bit))
            }),
            (_, true) => encode_rows(picture, |i, _| {
                let (colour, alpha) = values(i);
                let [r0, r1, g0, g1, b0, b1] = to_big_endian(colour.map(output::quantise_16_bit));
                let [a0, a1] = output::quantise_16_bit(alpha.clamp(0.0, 1.0)).to_be_bytes();
                [r0, r1, g0, g1, b0, b1, a0, a1]
            }),
        }
    }

    /// Returns the display values of a picture, in 0..1 and not quantised. The result has neither
    /// coverage nor layers.
    pub fn to_display_values(self, picture: &Picture) -> Picture {
        let map = self.build_map();
        let rgb = picture
            .rgb
            .par_iter()
            .map(|&rgb| map.display_values(rgb))
            .collect();
        Picture {
            width: picture.width,
            height: picture.height,
            rgb,
            window: picture.window,
            ..Picture::default()
        }
    }
}

/// Returns the bytes of all pixels, row by row. `bytes` converts a pixel, given its index and its
/// column and row. Rows are converted in parallel.
fn encode_rows<const N: usize>(
    picture: &Picture,
    bytes: impl Fn(usize, [u32; 2]) -> [u8; N] + Sync,
) -> Vec<u8> {
    let width = picture.width.max(1) as usize;
    let mut all = vec![[0_u8; N]; picture.rgb.len()];
    all.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            *out = bytes(y * width + x, [x as u32, y as u32]);
        }
    });
    all.into_flattened()
}

fn append_alpha([r, g, b]: [u8; 3], a: u8) -> [u8; 4] {
    [r, g, b, a]
}

fn alpha_code(alpha: f64) -> u8 {
    curve::quantise_8_bit(alpha.clamp(0.0, 1.0))
}

/// Returns the dithered 8-bit codes of a pixel's display values. `place` is the pixel's column and
/// row.
fn dither_pixel(values: [f64; 3], place: [u32; 2]) -> [u8; 3] {
    core::array::from_fn(|channel| output::dither_8_bit(values[channel], place, channel))
}

fn to_big_endian(codes: [u16; 3]) -> [u8; 6] {
    let [[r0, r1], [g0, g1], [b0, b1]] = codes.map(u16::to_be_bytes);
    [r0, r1, g0, g1, b0, b1]
}

/// Converter of single pixels from radiance to display values and codes, by the settings of a
/// [`Display`]. It holds the tables of these settings.
#[derive(Clone, Debug)]
pub struct DisplayMap {
    tone: ToneOperator,
    curve: TransferCurve,
    exposure_factor: f64,
    codes: CodeTable,
    background: Option<[f64; 3]>,
}

impl DisplayMap {
    /// Returns the display values in 0..1 of linear radiance; [`NAN_MARKER`] if a channel is NaN.
    pub fn display_values(&self, rgb: [f32; 3]) -> [f32; 3] {
        self.display_values_f64(rgb).map(|value| value as f32)
    }

    /// Returns the 8-bit codes of linear radiance: floor(255 v + ½) for the display value v.
    #[inline]
    pub fn codes(&self, rgb: [f32; 3]) -> [u8; 3] {
        match self.display_linear(rgb) {
            Some(linear) => linear.map(|y| self.codes.code(y)),
            None => NAN_MARKER.map(|v| curve::quantise_8_bit(f64::from(v))),
        }
    }

    /// Returns the display values and the alpha of a pixel. Without a background, the alpha is the
    /// pixel's coverage. With a background, the pixel is composited over it and its alpha is 1.
    ///
    /// Compositing mixes display values, not radiance, as web pages and most editors do. A
    /// transparent picture on a page therefore looks like a picture with the page's colour as
    /// background.
    ///
    /// A ground's shadow is a factor on radiance; the transfer curve converts it to a factor on
    /// display values. The conversion is exact for white, and for a curve that is a power. With
    /// sRGB, deep shadows on greys differ by up to eight codes.
    fn composite_pixel(&self, picture: &Picture, pixel: usize) -> ([f64; 3], f64) {
        let [surfaces, shadow] = picture.coverage(pixel).map(f64::from);
        let (clear, colour) = (
            1.0 - surfaces,
            self.display_values_f64(picture.surface_colour(pixel).unwrap_or_default()),
        );
        let left = if shadow > 0.0 {
            curve::encode_transfer(self.curve, ((clear - shadow) / clear).clamp(0.0, 1.0))
        } else {
            1.0
        };
        let behind = clear * left;
        match self.background {
            Some(background) => (
                core::array::from_fn(|i| surfaces * colour[i] + behind * background[i]),
                1.0,
            ),
            None if shadow > 0.0 => (
                colour.map(|value| value * surfaces / (1.0 - behind)),
                1.0 - behind,
            ),
            None => (colour, surfaces),
        }
    }

    /// Returns the display values in 0..1 of linear radiance, without rounding to `f32`.
    fn display_values_f64(&self, rgb: [f32; 3]) -> [f64; 3] {
        match self.display_linear(rgb) {
            Some(linear) => linear.map(|y| curve::encode_transfer(self.curve, f64::from(y))),
            None => NAN_MARKER.map(f64::from),
        }
    }

    /// Returns linear radiance after exposure and tone map, clipped to 0..1; `None` if a channel is
    /// NaN.
    #[inline]
    fn display_linear(&self, rgb: [f32; 3]) -> Option<[f32; 3]> {
        let exposed = rgb.map(|x| f64::from(x) * self.exposure_factor);
        if exposed.iter().any(|x| x.is_nan()) {
            return None;
        }
        // Negative radiance counts as zero. The upper bound keeps the fractions of tone maps
        // finite.
        let clamped = exposed.map(|x| x.clamp(0.0, f64::from(f32::MAX)));
        Some(self.tone.apply(clamped).map(|y| y.clamp(0.0, 1.0) as f32))
    }
}

#[cfg(test)]
mod tests;
