//! Display pictures: PNG of 8 or 16 bits, JPEG, and lossless WebP.

use std::io::{self, Cursor};

use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::codecs::webp::{WebPDecoder, WebPEncoder};
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageResult};
use png::{BitDepth, ColorType, Compression, Encoder, ScaledFloat, SrgbRenderingIntent};
use raywright_core::display::{Display, OutputFormat};
use raywright_core::picture::Picture;
use raywright_core::scene::TransferCurve;

use super::metadata::{PictureMetadata, encode_exif_block};

/// Encodes the picture as PNG, converted for display.
///
/// - RGB with 8 bits, or with 16 bits if the settings require 16; RGBA with coverage (straight
///   alpha).
/// - An sRGB curve is declared by the sRGB chunk, any other curve by gAMA alone.
/// - Metadata are tEXt chunks, or iTXt chunks for text beyond plain ASCII.
/// - Pixels with a NaN have the codes of [`raywright_core::display::NAN_MARKER`].
///
/// # Errors
///
/// A picture with inconsistent buffers.
pub fn encode_png(
    picture: &Picture,
    display: Display,
    metadata: &PictureMetadata,
) -> io::Result<Vec<u8>> {
    super::check_buffer_sizes(picture)?;
    let (size, has_alpha) = ([picture.width, picture.height], display.has_alpha(picture));
    encode_codes(
        &display.to_codes(picture),
        size,
        has_alpha,
        display,
        metadata,
    )
}

/// Encodes the codes of a picture of this size as PNG.
pub(super) fn encode_codes(
    codes: &[u8],
    size: [u32; 2],
    has_alpha: bool,
    display: Display,
    metadata: &PictureMetadata,
) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let encoder = create_encoder(&mut bytes, size, has_alpha, display, metadata)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(codes)?;
    writer.finish()?;
    Ok(bytes)
}

/// Returns an encoder with all settings of a picture of this size.
pub(super) fn create_encoder<'a, W: io::Write>(
    out: W,
    [width, height]: [u32; 2],
    has_alpha: bool,
    display: Display,
    metadata: &PictureMetadata,
) -> io::Result<Encoder<'a, W>> {
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(if has_alpha {
        ColorType::Rgba
    } else {
        ColorType::Rgb
    });
    encoder.set_depth(if display.output.bytes_per_channel() == 1 {
        BitDepth::Eight
    } else {
        BitDepth::Sixteen
    });
    encoder.set_compression(Compression::Fast);
    // The specification requires this gamma beside an sRGB chunk too, for decoders without sRGB.
    let gamma_times_100_000 = if display.curve == TransferCurve::None {
        100_000
    } else {
        45_455
    };
    encoder.set_source_gamma(ScaledFloat::from_scaled(gamma_times_100_000));
    if display.curve == TransferCurve::Srgb {
        encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    }
    for (keyword, _, text) in metadata.entries() {
        let added = if text.is_ascii() {
            encoder.add_text_chunk(keyword.to_owned(), text)
        } else {
            encoder.add_itxt_chunk(keyword.to_owned(), text)
        };
        added.map_err(io::Error::other)?;
    }
    Ok(encoder)
}

/// Encodes the picture as JPEG, converted for display. Colour has full resolution; `quality` ranges
/// from 1 to 100. JPEG cannot store coverage.
///
/// # Errors
/// A picture with coverage or with inconsistent buffers.
pub(crate) fn encode_jpeg(
    picture: &Picture,
    quality: u8,
    display: Display,
    metadata: &PictureMetadata,
) -> io::Result<Vec<u8>> {
    if display.has_alpha(picture) {
        return Err(io::Error::other(
            "a JPEG cannot store transparency; write a .png, or choose a colour with --background",
        ));
    }
    let mut bytes = Vec::new();
    encode_display_picture(
        JpegEncoder::new_with_quality(&mut bytes, quality),
        picture,
        display,
        metadata,
    )?;
    Ok(bytes)
}

/// Encodes the picture as lossless WebP, converted for display, with its coverage as straight alpha
/// if present.
///
/// # Errors
/// A picture with inconsistent buffers.
pub(crate) fn encode_webp(
    picture: &Picture,
    display: Display,
    metadata: &PictureMetadata,
) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    encode_display_picture(
        WebPEncoder::new_lossless(&mut bytes),
        picture,
        display,
        metadata,
    )?;
    Ok(bytes)
}

fn encode_display_picture(
    mut encoder: impl ImageEncoder,
    picture: &Picture,
    display: Display,
    metadata: &PictureMetadata,
) -> io::Result<()> {
    super::check_buffer_sizes(picture)?;
    let exif = encode_exif_block(metadata);
    if !exif.is_empty() {
        encoder.set_exif_metadata(exif).map_err(io::Error::other)?;
    }
    // Both formats have 8-bit codes.
    let output = if display.output.bytes_per_channel() == 1 {
        display.output
    } else {
        OutputFormat::Eight
    };
    let codes = Display { output, ..display }.to_codes(picture);
    let kind = if display.has_alpha(picture) {
        ExtendedColorType::Rgba8
    } else {
        ExtendedColorType::Rgb8
    };
    encoder
        .write_image(&codes, picture.width, picture.height, kind)
        .map_err(io::Error::other)
}

/// A JPEG or WebP file with a parsed header.
pub(super) enum WebPictureDecoder<'b> {
    Jpeg(JpegDecoder<Cursor<&'b [u8]>>),
    WebP(WebPDecoder<Cursor<&'b [u8]>>),
}

impl<'b> WebPictureDecoder<'b> {
    /// Parses the header of a JPEG or WebP file; `None` for any other signature.
    pub fn open(bytes: &'b [u8]) -> Option<ImageResult<Self>> {
        let cursor = Cursor::new(bytes);
        if bytes.starts_with(b"\xff\xd8\xff") {
            return Some(JpegDecoder::new(cursor).map(Self::Jpeg));
        }
        let is_webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
        is_webp.then(|| WebPDecoder::new(cursor).map(Self::WebP))
    }

    /// Name of the format.
    pub fn format_name(&self) -> &'static str {
        if matches!(self, Self::Jpeg(_)) {
            "JPEG"
        } else {
            "WebP"
        }
    }

    /// Width and height in pixels.
    pub fn dimensions(&self) -> (u32, u32) {
        match self {
            Self::Jpeg(decoder) => decoder.dimensions(),
            Self::WebP(decoder) => decoder.dimensions(),
        }
    }

    /// Decodes the first picture of the file. Returns the picture and the bytes of its Exif block,
    /// which may be empty.
    pub fn decode(self) -> ImageResult<(DynamicImage, Vec<u8>)> {
        fn decode_with_exif(
            mut decoder: impl ImageDecoder,
        ) -> ImageResult<(DynamicImage, Vec<u8>)> {
            let exif = decoder.exif_metadata()?.unwrap_or_default();
            Ok((DynamicImage::from_decoder(decoder)?, exif))
        }
        match self {
            Self::Jpeg(decoder) => decode_with_exif(decoder),
            Self::WebP(decoder) => decode_with_exif(decoder),
        }
    }
}
