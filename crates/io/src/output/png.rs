//! PNG output of 8 or 16 bits.

use std::io;

use png::{BitDepth, ColorType, Compression, Encoder, ScaledFloat, SrgbRenderingIntent};
use raywright_core::display::Display;
use raywright_core::picture::Picture;
use raywright_core::scene::TransferCurve;

use super::metadata::PictureMetadata;

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
    let mut bytes = Vec::new();
    let encoder = create_encoder(
        &mut bytes,
        [picture.width, picture.height],
        display.has_alpha(picture),
        display,
        metadata,
    )?;
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer
        .write_image_data(&display.to_codes(picture))
        .map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)?;
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
