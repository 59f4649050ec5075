//! Decoding of Radiance pictures (`.hdr`, `.pic`), written by any program and with scan lines in
//! any direction. The `image` crate decodes the scan lines, but accepts only a single signature and
//! a single direction.

use std::io::{Cursor, Read};

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder};
use raywright_core::scene::{ImageData, PixelData};

use super::{DecodedImage, check_size, decoder_fault};
use crate::Limits;
use crate::import::{Fault, ImportResult, sanitise_text};
use crate::text::strip_byte_order_mark;

/// Largest length of a header in bytes.
const MAX_HEADER_BYTES: usize = 1 << 16;

/// Whether bytes have the signature of the format: `#?` and the name of a program.
pub(super) fn is_radiance(bytes: &[u8]) -> bool {
    matches!(strip_byte_order_mark(bytes), [b'#', b'?', letter, ..] if letter.is_ascii_alphabetic())
}

/// A parsed Radiance header, and the encoded pixels after the header.
struct RadianceHeader<'b> {
    /// Number of scan lines.
    lines: u32,
    /// Number of pixels in each scan line.
    length: u32,
    /// Whether each scan line is a column of the picture, not a row.
    is_upright: bool,
    /// Whether the columns are stored from the right to the left.
    from_right: bool,
    /// Whether the rows are stored from the bottom to the top.
    from_bottom: bool,
    data: &'b [u8],
}

impl<'b> RadianceHeader<'b> {
    fn read(bytes: &'b [u8], limits: &Limits) -> ImportResult<Self> {
        let mut rest = strip_byte_order_mark(bytes);
        let end = rest.len().saturating_sub(MAX_HEADER_BYTES);
        while rest.len() > end
            && let Some(length) = rest.iter().position(|&byte| byte == b'\n')
        {
            let line = String::from_utf8_lossy(rest.get(..length).unwrap_or_default());
            rest = rest.get(length + 1..).unwrap_or_default();
            if let Some(format) = line.trim().strip_prefix("FORMAT=")
                && format.trim() != "32-bit_rle_rgbe"
            {
                let message = "is a Radiance picture of format `{}`, but only the format 32-bit_rle_rgbe is supported";
                return Err(Fault::invalid_input(
                    message.replace("{}", &sanitise_text(format.trim())),
                ));
            }
            if let Some(header) = Self::parse_resolution(&line, rest) {
                let [width, height] = header.read_size();
                check_size(u64::from(width), u64::from(height), limits)?;
                return Ok(header);
            }
        }
        Err(fault!(
            "is a broken picture (its header has no line with the size, such as `-Y 512 +X 1024`)"
        ))
    }

    /// Parses a line such as `-Y 512 +X 1024`: the axis across the scan lines, then the axis along
    /// the scan lines.
    fn parse_resolution(line: &str, data: &'b [u8]) -> Option<Self> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [across, lines, along, length] = *words.as_slice() else {
            return None;
        };
        let is_upright = match (across.get(1..)?, along.get(1..)?) {
            ("Y", "X") => false,
            ("X", "Y") => true,
            _ => return None,
        };
        let signs = [across.chars().next()?, along.chars().next()?];
        if !signs.iter().all(|sign| matches!(sign, '+' | '-')) {
            return None;
        }
        let [x, y] = if is_upright {
            signs
        } else {
            [signs[1], signs[0]]
        };
        let (lines, length) = (lines.parse().ok()?, length.parse().ok()?);
        Some(Self {
            lines,
            length,
            is_upright,
            from_right: x == '-',
            from_bottom: y == '+',
            data,
        })
    }

    fn read_size(&self) -> [u32; 2] {
        if self.is_upright {
            [self.lines, self.length]
        } else {
            [self.length, self.lines]
        }
    }
}

/// Reads width and height from the header.
///
/// # Errors
/// A fault of kind input for a broken header, of kind limit for an oversized picture.
pub(super) fn read_size(bytes: &[u8], limits: &Limits) -> ImportResult<[u32; 2]> {
    RadianceHeader::read(bytes, limits).map(|header| header.read_size())
}

/// Decodes a picture. `EXPOSURE` and similar factors on all pixels are ignored; the exposure is the
/// viewer's choice.
///
/// # Errors
/// As [`read_size`], and of kind input for broken data.
pub(super) fn decode(bytes: &[u8], limits: &Limits) -> ImportResult<DecodedImage> {
    let header = RadianceHeader::read(bytes, limits)?;
    let start = format!(
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n",
        header.lines, header.length
    );
    let decoder = HdrDecoder::new(Cursor::new(start).chain(header.data)).map_err(decoder_fault)?;
    debug_assert_eq!(decoder.dimensions(), (header.length, header.lines));
    let scan_lines = DynamicImage::from_decoder(decoder)
        .map_err(decoder_fault)?
        .into_rgb32f();
    let ([width, height], mut unusable) = (header.read_size(), InvalidRadianceCounts::default());
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        let row = if header.from_bottom {
            height - 1 - y
        } else {
            y
        };
        for x in 0..width {
            let column = if header.from_right { width - 1 - x } else { x };
            let [x, y] = if header.is_upright {
                [row, column]
            } else {
                [column, row]
            };
            let [r, g, b] = scan_lines
                .get_pixel(x, y)
                .0
                .map(|value| unusable.repair_channel_value(value));
            pixels.push([r, g, b, 1.0]);
        }
    }
    Ok(DecodedImage {
        image: ImageData {
            width,
            height,
            pixels: PixelData::Linear(pixels),
        },
        remarks: unusable.summary().into_iter().collect(),
        repaired_count: unusable.repaired_count(),
    })
}

// Repair of float pixels that are invalid as radiance, with counts of the replaced values.

/// Value that replaces infinity: the largest number of half precision. Most infinities in pictures
/// result from an overflow of half precision.
const INFINITE: f32 = 65504.0;
/// Largest accepted value. With this limit, the sum over all pixels fits single precision.
pub(super) const GREATEST: f32 = 1e30;

/// Numbers of channel values that are invalid as radiance: infinite, NaN, negative or too large.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct InvalidRadianceCounts {
    infinite: u64,
    too_great: u64,
    undefined: u64,
    negative: u64,
}

impl InvalidRadianceCounts {
    /// Returns `value` if it is valid as radiance, otherwise the nearest valid value (0 for NaN).
    /// Replaced values are counted.
    pub fn repair_channel_value(&mut self, value: f32) -> f32 {
        if (0.0..=GREATEST).contains(&value) {
            return value;
        }
        let (count, instead) = match value {
            _ if value.is_nan() => (&mut self.undefined, 0.0),
            _ if value < 0.0 => (&mut self.negative, 0.0),
            f32::INFINITY => (&mut self.infinite, INFINITE),
            _ => (&mut self.too_great, GREATEST),
        };
        *count += 1;
        instead
    }

    /// Returns the number of replaced infinite and NaN values. Negative and excessive values are
    /// not counted: most negative values are rounding errors, and clamping excessive values changes
    /// nothing visible.
    pub fn repaired_count(&self) -> u64 {
        self.infinite + self.undefined
    }

    /// Returns a summary of the replaced values for a warning; `None` if no value was replaced.
    pub fn summary(&self) -> Option<String> {
        let kinds = [
            (self.infinite, format!("infinite (replaced by {INFINITE})")),
            (
                self.too_great,
                format!("above {GREATEST:e} (replaced by this value)"),
            ),
            (self.undefined, "NaN (replaced by 0)".to_owned()),
            (self.negative, "negative (replaced by 0)".to_owned()),
        ];
        let found: Vec<String> = kinds
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, label)| format!("{count} {label}"))
            .collect();
        (!found.is_empty()).then(|| {
            format!(
                "has pixel values that are invalid as radiance: {}",
                found.join(", ")
            )
        })
    }
}
