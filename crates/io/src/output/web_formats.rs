//! Display pictures in the formats of web pages, JPEG and lossless WebP, written and read.

use std::io::{self, Cursor};

use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::codecs::webp::{WebPDecoder, WebPEncoder};
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageResult};
use raywright_core::display::{Display, OutputFormat};
use raywright_core::picture::Picture;

use super::exif;
use super::metadata::PictureMetadata;

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
    let exif = exif::encode_block(metadata);
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
