//! PNG files.

use std::io::Cursor;

use png::{BitDepth, ColorType, Decoder, Reader, Transformations};
use raywright_core::scene::{ImageData, Pixels};

use super::{broken, check_size, most_bytes, spread};
use crate::Limits;
use crate::import::{Fault, Outcome};

/// The length of a palette, where that is not three bytes for each of up to 256 colours: the decoder (`png` 0.18.1), which
/// would have to refuse it, panics.
fn broken_palette(bytes: &[u8]) -> Option<usize> {
    let mut chunks = bytes.get(8..)?;
    while let Some((head, rest)) = chunks.split_first_chunk::<8>() {
        let [a, b, c, d, kind @ ..] = *head;
        let length = u32::from_be_bytes([a, b, c, d]) as usize;
        match &kind {
            b"PLTE" if !length.is_multiple_of(3) || length > 3 * 256 => return Some(length),
            b"IDAT" => return None,
            // Its checksum comes behind it.
            _ => chunks = rest.get(length..)?.get(4..)?,
        }
    }
    None
}

/// The decoder of a picture that is not too large; palettes and few bits are spread to eight a channel.
fn opened<'b>(bytes: &'b [u8], limits: &Limits) -> Outcome<Reader<Cursor<&'b [u8]>>> {
    if let Some(length) = broken_palette(bytes) {
        return Err(Fault::input(format!(
            "is a broken picture (its palette has {length} bytes, which is not three for each of up to 256 colours)"
        )));
    }
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: most_bytes(limits) });
    let info = decoder.read_header_info().map_err(fault)?;
    check_size(u64::from(info.width), u64::from(info.height), limits)?;
    decoder.set_transformations(Transformations::EXPAND);
    decoder.read_info().map_err(fault)
}

fn fault(error: png::DecodingError) -> Fault {
    match error {
        png::DecodingError::LimitsExceeded => Fault::limit("is a picture that takes too much memory to read"),
        error => broken(&error),
    }
}

/// Width and height.
pub(super) fn size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    let (width, height) = opened(bytes, limits)?.info().size();
    Ok([width, height])
}

/// Decodes a picture of any kind.
pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Outcome<ImageData> {
    let mut reader = opened(bytes, limits)?;
    let (width, height) = reader.info().size();
    let (colour, depth) = reader.output_color_type();
    let length = reader.output_buffer_size().ok_or_else(|| broken(&"size"))?;
    let mut samples = vec![0; length];
    reader.next_frame(&mut samples).map_err(fault)?;
    if depth == BitDepth::Sixteen {
        // To the nearest of 256, the higher byte first.
        samples = samples.as_chunks().0.iter().map(|&two| ((u32::from(u16::from_be_bytes(two)) + 128) / 257) as u8).collect();
    }
    let channels = match colour {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => return Err(broken(&"its palette is missing")),
    };
    Ok(ImageData { width, height, pixels: Pixels::Codes(spread(samples, channels)) })
}

/// Decodes a PNG with a palette of eight bits in less than half of the time that it takes by way of three colours a pixel. None for
/// every other picture, and for one that is broken or too large: the general way says why. Row by row, since a list of all codes is as
/// much memory again, which takes the system as long to provide as decoding takes.
pub(super) fn decode_palette(bytes: &[u8], limits: &Limits) -> Option<ImageData> {
    // Depth and kind of colour stand at fixed places of the first chunk.
    if bytes.get(24..26) != Some(&[BitDepth::Eight as u8, ColorType::Indexed as u8]) || broken_palette(bytes).is_some() {
        return None;
    }
    let own = png::Limits { bytes: most_bytes(limits) };
    let mut reader = Decoder::new_with_limits(Cursor::new(bytes), own).read_info().ok()?;
    let info = reader.info();
    let (width, height) = info.size();
    check_size(u64::from(width), u64::from(height), limits).ok()?;
    if info.interlaced {
        return None;
    }
    let colours = info.palette.as_ref()?.as_chunks().0;
    // As the decoder has it, what is beyond the palette is black, what is beyond the list of alphas opaque, and a list that is longer than the
    // palette is none.
    let alphas = info.trns.as_deref().filter(|alphas| alphas.len() <= colours.len()).unwrap_or_default();
    let colour = |code: usize| {
        let [r, g, b] = colours.get(code).copied().unwrap_or_default();
        [r, g, b, alphas.get(code).copied().unwrap_or(255)]
    };
    let colours: [[u8; 4]; 256] = core::array::from_fn(colour);
    let count = usize::try_from(u64::from(width) * u64::from(height)).ok()?;
    let mut pixels = Vec::with_capacity(count);
    while let Some(row) = reader.next_row().ok()? {
        pixels.extend(row.data().iter().map(|&code| colours[usize::from(code)]));
    }
    (pixels.len() == count).then_some(ImageData { width, height, pixels: Pixels::Codes(pixels) })
}
