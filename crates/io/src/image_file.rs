//! Decoding of image files: PNG, JPEG, WebP and KTX2 textures, Radiance HDR and OpenEXR environments.
//!
//! Only pixels are read: colour profiles, gamma chunks and camera orientation are ignored, as glTF 2.0 asks for (section 3.8.3).

mod jpeg;
mod light;
mod open_exr;
mod png_file;
mod radiance;
mod webp;

use core::fmt;

use raywright_core::scene::ImageData;

use crate::import::{Budget, Fault, Outcome, ask_system};
use crate::{Limits, ktx2};

/// What a file's first bytes say it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Png,
    Jpeg,
    WebP,
    Hdr,
    Exr,
    Ktx2,
    /// Known, but not read here.
    Foreign(&'static str),
    Unknown,
}

/// Looks at the first bytes; names and media types in files lie.
pub(crate) fn sniff(bytes: &[u8]) -> Kind {
    const SIGNATURES: [(&[u8], Kind); 8] = [
        (b"\x89PNG\r\n\x1a\n", Kind::Png),
        (b"\xff\xd8\xff", Kind::Jpeg),
        (b"\x76\x2f\x31\x01", Kind::Exr),
        (ktx2::SIGNATURE, Kind::Ktx2),
        (b"GIF8", Kind::Foreign("GIF")),
        (b"BM", Kind::Foreign("BMP")),
        (b"DDS ", Kind::Foreign("DDS")),
        (b"II*\0", Kind::Foreign("TIFF")),
    ];
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return Kind::WebP;
    }
    if radiance::is_radiance(bytes) {
        return Kind::Hdr;
    }
    SIGNATURES.iter().find(|(head, _)| bytes.starts_with(head)).map_or(Kind::Unknown, |&(_, kind)| kind)
}

/// A picture, and what of it was not taken as it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Decoded {
    pub image: ImageData,
    /// What a user should know, each a sentence whose subject is the picture.
    pub remarks: Vec<String>,
}

impl From<ImageData> for Decoded {
    fn from(image: ImageData) -> Self {
        Self { image, remarks: Vec::new() }
    }
}

/// Decodes a whole image file.
///
/// PNG, JPEG, WebP and KTX2 become [`Pixels::Codes`] (grey and palettes spread to RGBA, 16-bit samples rounded to 8 bits), HDR and EXR
/// become [`Pixels::Linear`].
///
/// # Errors
/// A fault of kind limit when the header asks for more than `limits` allow (nothing is allocated then); of kind input when
/// the format is not read here or the data is broken.
pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> Outcome<Decoded> {
    let kind = sniff(bytes);
    if !matches!(kind, Kind::Foreign(_) | Kind::Unknown) {
        // What the decoder gives, and the same as it is kept.
        let [width, height] = size(bytes, limits)?;
        ask_system(2 * u64::from(width) * u64::from(height) * bytes_a_pixel(kind) as u64)?;
    }
    match kind {
        Kind::Png => match png_file::decode_palette(bytes, limits) {
            Some(image) => Ok(image.into()),
            None => png_file::decode(bytes, limits).map(Decoded::from),
        },
        Kind::Jpeg => jpeg::decode(bytes, limits).map(Decoded::from),
        Kind::WebP => webp::decode(bytes, limits).map(Decoded::from),
        Kind::Hdr => radiance::decode(bytes, limits),
        Kind::Exr => open_exr::decode(bytes, limits),
        Kind::Ktx2 => ktx2::decode(bytes, limits).map(Decoded::from),
        Kind::Foreign(name) => Err(Fault::input(format!("is a {name} picture; PNG, JPEG, WebP, KTX2, HDR and EXR are read"))),
        Kind::Unknown => Err(Fault::input("is no picture that is read here (PNG, JPEG, WebP, KTX2, HDR, EXR)")),
    }
}

/// Claims the memory that a picture will take, by its header.
///
/// # Errors
/// As [`decode`] as far as a header tells, and of kind limit when the budget does not last.
pub(crate) fn claim(bytes: &[u8], limits: &Limits, budget: &mut Budget) -> Outcome<()> {
    let [width, height] = size(bytes, limits)?;
    budget.memory(width as usize * height as usize, bytes_a_pixel(sniff(bytes)))
}

fn bytes_a_pixel(kind: Kind) -> usize {
    match kind {
        Kind::Hdr | Kind::Exr => size_of::<[f32; 4]>(),
        _ => size_of::<[u8; 4]>(),
    }
}

/// Width and height that a header gives a picture.
fn size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    match sniff(bytes) {
        Kind::Png => png_file::size(bytes, limits),
        Kind::Jpeg => jpeg::size(bytes, limits),
        Kind::WebP => webp::size(bytes, limits),
        Kind::Hdr => radiance::size(bytes, limits),
        Kind::Exr => open_exr::size(bytes, limits),
        Kind::Ktx2 => ktx2::size(bytes, limits),
        // Decoding says what is wrong with it.
        Kind::Foreign(_) | Kind::Unknown => decode(bytes, limits).map(|decoded| [decoded.image.width, decoded.image.height]),
    }
}

/// Checks a header's dimensions before anything is allocated for them.
pub(crate) fn check_size(width: u64, height: u64, limits: &Limits) -> Outcome<()> {
    if width == 0 || height == 0 {
        return Err(Fault::input("is a picture without pixels"));
    }
    if width.saturating_mul(height) > limits.image_pixels {
        return Err(Fault::limit(format!(
            "is a picture of {width} x {height} pixels; at most {} pixels are read",
            limits.image_pixels
        )));
    }
    Ok(())
}

/// What the decoder of a format says that is wrong.
fn broken(error: &dyn fmt::Display) -> Fault {
    Fault::input(format!("is a broken picture ({error})"))
}

/// Bytes that a decoder may take on the way: the pixels are counted before, and none has more than four numbers of four bytes.
fn most_bytes(limits: &Limits) -> usize {
    usize::try_from(limits.image_pixels.saturating_mul(16)).unwrap_or(usize::MAX)
}

/// Red, green, blue and alpha of pixels of one to four channels: grey, grey and alpha, colour, or all.
fn spread(samples: Vec<u8>, channels: usize) -> Vec<[u8; 4]> {
    match channels {
        1 => samples.iter().map(|&grey| [grey, grey, grey, 255]).collect(),
        2 => samples.as_chunks().0.iter().map(|&[grey, alpha]| [grey, grey, grey, alpha]).collect(),
        3 => samples.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect(),
        _ => samples.as_chunks().0.to_vec(),
    }
}

#[cfg(test)]
pub(crate) mod tests;
#[cfg(test)]
mod twins;
