//! WebP files; of several pictures, the first.

use std::io::Cursor;

use image_webp::WebPDecoder;
use raywright_core::scene::{ImageData, Pixels};

use super::{broken, check_size, most_bytes, spread};
use crate::Limits;
use crate::import::Outcome;

/// The decoder of a picture that is not too large.
fn opened<'b>(bytes: &'b [u8], limits: &Limits) -> Outcome<WebPDecoder<Cursor<&'b [u8]>>> {
    let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(|error| broken(&error))?;
    let (width, height) = decoder.dimensions();
    check_size(u64::from(width), u64::from(height), limits)?;
    decoder.set_memory_limit(most_bytes(limits));
    Ok(decoder)
}

/// Width and height.
pub(super) fn size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    let (width, height) = opened(bytes, limits)?.dimensions();
    Ok([width, height])
}

/// Decodes a picture.
pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Outcome<ImageData> {
    let mut decoder = opened(bytes, limits)?;
    let (width, height) = decoder.dimensions();
    let length = decoder.output_buffer_size().ok_or_else(|| broken(&"size"))?;
    let mut samples = vec![0; length];
    decoder.read_image(&mut samples).map_err(|error| broken(&error))?;
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    Ok(ImageData { width, height, pixels: Pixels::Codes(spread(samples, channels)) })
}
