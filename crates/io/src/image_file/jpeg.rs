//! JPEG files.

use raywright_core::scene::{ImageData, Pixels};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::{broken, check_size, spread};
use crate::Limits;
use crate::import::Outcome;

/// As lenient as other programs; sizes are checked here.
fn options() -> DecoderOptions {
    DecoderOptions::default().set_strict_mode(false).set_max_width(usize::MAX).set_max_height(usize::MAX)
}

/// Width and height, and the colours that pixels are to have: grey stays grey, and all that is no red, green and blue becomes that.
fn header(bytes: &[u8], limits: &Limits) -> Outcome<([u32; 2], ColorSpace)> {
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options());
    decoder.decode_headers().map_err(|error| broken(&error))?;
    let (Some((width, height)), Some(colours)) = (decoder.dimensions(), decoder.input_colorspace()) else {
        return Err(broken(&"its header says no size"));
    };
    check_size(width as u64, height as u64, limits)?;
    let kept = matches!(colours, ColorSpace::RGB | ColorSpace::RGBA | ColorSpace::Luma | ColorSpace::LumaA);
    // Neither side has more than 65535 pixels.
    Ok(([width as u32, height as u32], if kept { colours } else { ColorSpace::RGB }))
}

/// Width and height.
pub(super) fn size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    header(bytes, limits).map(|(size, _)| size)
}

/// Decodes a picture.
pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Outcome<ImageData> {
    let ([width, height], colours) = header(bytes, limits)?;
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options().jpeg_set_out_colorspace(colours));
    let samples = decoder.decode().map_err(|error| broken(&error))?;
    let channels = colours.num_components();
    if samples.len() != width as usize * height as usize * channels {
        return Err(broken(&"size"));
    }
    Ok(ImageData { width, height, pixels: Pixels::Codes(spread(samples, channels)) })
}
