//! Decoding of image files: PNG, JPEG, WebP, KTX2, BMP, TGA, GIF and TIFF textures, Radiance HDR
//! and OpenEXR environments.
//!
//! Only pixels are read: colour profiles, gamma chunks and camera orientation are ignored, as glTF
//! 2.0 requires (section 3.8.3).

mod open_exr;
pub(crate) mod primaries;
mod radiance;
mod size;

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use raywright_core::fault;
use raywright_core::scene::{ImageData, PixelData};

use crate::import::{DecodeBudget, Fault, ImportResult, check_available_memory};
use crate::{Limits, ktx2};

pub(crate) use self::size::check_size;

/// Format of a picture by its signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ImageKind {
    /// A format of 8-bit codes that the `image` crate decodes.
    Codes(ImageFormat),
    Hdr,
    Exr,
    Ktx2,
    /// An unsupported format with this name.
    Foreign(&'static str),
    Unknown,
}

/// Supported formats, for messages.
const FORMATS: &str = "PNG, JPEG, WebP, KTX2, BMP, TGA, GIF, TIFF, HDR and EXR";

/// Detects the format from the first bytes, because file names and media types may be wrong.
pub(crate) fn detect_format(bytes: &[u8]) -> ImageKind {
    const SIGNATURES: [(&[u8], ImageKind); 9] = [
        (b"\x89PNG\r\n\x1a\n", ImageKind::Codes(ImageFormat::Png)),
        (b"\xff\xd8\xff", ImageKind::Codes(ImageFormat::Jpeg)),
        (b"\x76\x2f\x31\x01", ImageKind::Exr),
        (ktx2::SIGNATURE, ImageKind::Ktx2),
        (b"GIF8", ImageKind::Codes(ImageFormat::Gif)),
        (b"BM", ImageKind::Codes(ImageFormat::Bmp)),
        (b"DDS ", ImageKind::Foreign("DDS")),
        (b"II*\0", ImageKind::Codes(ImageFormat::Tiff)),
        (b"MM\0*", ImageKind::Codes(ImageFormat::Tiff)),
    ];
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return ImageKind::Codes(ImageFormat::WebP);
    }
    if radiance::is_radiance(bytes) {
        return ImageKind::Hdr;
    }
    SIGNATURES
        .iter()
        .find(|(head, _)| bytes.starts_with(head))
        .map(|&(_, kind)| kind)
        .or_else(|| is_tga(bytes).then_some(ImageKind::Codes(ImageFormat::Tga)))
        .unwrap_or(ImageKind::Unknown)
}

/// Whether the first bytes are a header of TGA, a format without a signature: kind of the palette,
/// kind of the picture and bits per pixel fit each other.
fn is_tga(bytes: &[u8]) -> bool {
    bytes.get(..18).is_some_and(|header| {
        matches!(
            (header[1], header[2], header[16]),
            (1, 1 | 9, 8 | 16) | (0 | 1, 2 | 10, 15 | 16 | 24 | 32) | (0 | 1, 3 | 11, 8 | 16)
        )
    })
}

/// Whether a JPEG lacks its end marker, as half a file does.
fn is_cut_off(jpeg: &[u8]) -> bool {
    let mut rest = jpeg.get(2..).unwrap_or_default();
    // Segments before the scan may hold whole pictures, such as thumbnails.
    while let [0xff, kind, high, low, ..] = *rest {
        if kind == 0xda {
            return !rest.windows(2).any(|pair| pair == [0xff, 0xd9]);
        }
        let length = match kind {
            0xff => 1,
            _ => 2 + usize::from(u16::from_be_bytes([high, low])),
        };
        rest = rest.get(length..).unwrap_or_default();
    }
    false
}

/// A decoded picture, with remarks about values that differ from the file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DecodedImage {
    pub image: ImageData,
    /// Remarks for the user about values that differ from the file. The subject of each sentence is
    /// the picture.
    pub remarks: Vec<String>,
    /// Number of infinite and NaN channel values, all of which were replaced.
    pub repaired_count: u64,
}

/// Returns the kind of remarks about a picture with this number of replaced channel values.
pub(crate) fn remark_kind(repaired: u64) -> fault::FaultKind {
    match repaired {
        0 => fault::FaultKind::Conversion,
        _ => fault::FaultKind::ImageNotLight,
    }
}

impl From<ImageData> for DecodedImage {
    fn from(image: ImageData) -> Self {
        Self {
            image,
            remarks: Vec::new(),
            repaired_count: 0,
        }
    }
}

/// Decodes a whole image file.
///
/// - HDR and EXR become [`PixelData::Linear`].
/// - Other formats become [`PixelData::Codes`]. Grey and palettes are expanded to RGBA, and 16-bit
///   samples are rounded to 8 bits. Of an animation, the first picture is taken.
///
/// # Errors
///
/// A fault of kind limit for a header beyond `limits`, before any allocation; of kind input for an
/// unsupported format and for broken data.
pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> ImportResult<DecodedImage> {
    let kind = detect_format(bytes);
    if !matches!(kind, ImageKind::Foreign(_) | ImageKind::Unknown) {
        // Memory for two pictures: the buffer of the decoder, and the stored picture.
        let [width, height] = read_size(bytes, limits)?;
        check_available_memory(
            2 * u64::from(width) * u64::from(height) * bytes_per_pixel(kind) as u64,
            limits,
        )?;
    }
    match kind {
        ImageKind::Codes(format) => {
            let palette = (format == ImageFormat::Png)
                .then(|| decode_palette(bytes, limits))
                .flatten();
            let image = match palette {
                Some(image) => image,
                None => decode_with_image_crate(format, bytes, limits)?,
            };
            let mut decoded = DecodedImage::from(image);
            if format == ImageFormat::Jpeg && is_cut_off(bytes) {
                let remark = "is a JPEG without its end: a part of the picture is missing";
                decoded.remarks.push(remark.to_owned());
            }
            Ok(decoded)
        }
        ImageKind::Hdr => radiance::decode(bytes, limits),
        ImageKind::Exr => open_exr::decode(bytes, limits),
        ImageKind::Ktx2 => ktx2::decode(bytes, limits).map(DecodedImage::from),
        ImageKind::Foreign(name) => Err(fault!(
            "is a {name} picture, but only {FORMATS} are supported"
        )),
        ImageKind::Unknown => Err(fault!("is not a picture in a supported format ({FORMATS})")),
    }
}

/// Reserves the memory of the decoded picture, whose size is read from the header.
///
/// # Errors
/// As [`decode`], for all faults that a header shows; of kind limit when the budget is exceeded.
pub(crate) fn reserve_picture_memory(
    bytes: &[u8],
    limits: &Limits,
    budget: &mut DecodeBudget,
) -> ImportResult<()> {
    let [width, height] = read_size(bytes, limits)?;
    budget.reserve_memory(
        width as usize * height as usize,
        bytes_per_pixel(detect_format(bytes)),
    )
}

fn bytes_per_pixel(kind: ImageKind) -> usize {
    match kind {
        ImageKind::Hdr | ImageKind::Exr => size_of::<[f32; 4]>(),
        _ => size_of::<[u8; 4]>(),
    }
}

/// Reads width and height from a header.
fn read_size(bytes: &[u8], limits: &Limits) -> ImportResult<[u32; 2]> {
    match detect_format(bytes) {
        ImageKind::Codes(format) => {
            open_decoder(format, bytes, limits).map(|decoder| decoder.dimensions().into())
        }
        ImageKind::Hdr => radiance::read_size(bytes, limits),
        ImageKind::Exr => open_exr::read_size(bytes, limits),
        ImageKind::Ktx2 => ktx2::read_size(bytes, limits),
        // For these formats, decoding returns the error.
        ImageKind::Foreign(_) | ImageKind::Unknown => {
            decode(bytes, limits).map(|decoded| [decoded.image.width, decoded.image.height])
        }
    }
}

/// Converts an error of the `image` crate to a fault.
fn decoder_fault(error: image::ImageError) -> Fault {
    match error {
        image::ImageError::Limits(e) => Fault::over_limit(format!(
            "is a picture that needs more memory than the limit allows ({e})"
        )),
        e => fault!("is a broken picture ({e})"),
    }
}

/// Returns the length in bytes of a PNG's palette if the length is invalid: not three bytes for
/// each of up to 256 colours. The decoder (`png` 0.18.1) should refuse such a palette, but panics.
fn invalid_palette_length(bytes: &[u8]) -> Option<usize> {
    let mut chunks = bytes.get(8..)?;
    while let Some((head, rest)) = chunks.split_first_chunk::<8>() {
        let [a, b, c, d, kind @ ..] = *head;
        let length = u32::from_be_bytes([a, b, c, d]) as usize;
        match &kind {
            b"PLTE" if !length.is_multiple_of(3) || length > 3 * 256 => return Some(length),
            b"IDAT" => return None,
            // A checksum follows the data.
            _ => chunks = rest.get(length..)?.get(4..)?,
        }
    }
    None
}

/// Opens the decoder of a picture within the limits.
fn open_decoder<'b>(
    format: ImageFormat,
    bytes: &'b [u8],
    limits: &Limits,
) -> ImportResult<impl ImageDecoder + 'b> {
    if format == ImageFormat::Png
        && let Some(length) = invalid_palette_length(bytes)
    {
        return Err(fault!(
            "is a broken picture (its palette has {length} bytes instead of three for each of up to 256 colours)"
        ));
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    // `max_alloc` bounds the decoder's own allocations; the pixel count is checked below.
    let mut own = image::Limits::default();
    own.max_alloc = Some(limits.image_pixels.saturating_mul(16));
    reader.limits(own);
    let decoder = reader.into_decoder().map_err(decoder_fault)?;
    let (width, height) = decoder.dimensions();
    check_size(u64::from(width), u64::from(height), limits)?;
    Ok(decoder)
}

fn decode_with_image_crate(
    format: ImageFormat,
    bytes: &[u8],
    limits: &Limits,
) -> ImportResult<ImageData> {
    let decoder = open_decoder(format, bytes, limits)?;
    let (width, height) = decoder.dimensions();
    let picture = DynamicImage::from_decoder(decoder).map_err(decoder_fault)?;
    let pixels = match picture {
        // RGB with 8 bits is converted directly, because the general conversion examines the colour
        // space of every pixel.
        DynamicImage::ImageRgb8(picture) => PixelData::Codes(
            picture
                .as_raw()
                .as_chunks()
                .0
                .iter()
                .map(|&[r, g, b]| [r, g, b, 255])
                .collect(),
        ),
        picture => PixelData::Codes(picture.into_rgba8().as_raw().as_chunks().0.to_vec()),
    };
    Ok(ImageData {
        width,
        height,
        pixels,
    })
}

/// Decodes a PNG with an 8-bit palette, in less than half the time of the decoder's expansion to
/// RGB. Returns `None` for every other picture. `None` is also returned for a broken or oversized
/// picture; the general decoder then reports the error. Rows are converted one by one: a buffer of
/// all codes would double the memory, and its allocation takes as long as the decoding.
fn decode_palette(bytes: &[u8], limits: &Limits) -> Option<ImageData> {
    // Depth and colour type are at fixed offsets of the first chunk.
    if bytes.get(24..26) != Some(&[png::BitDepth::Eight as u8, png::ColorType::Indexed as u8])
        || invalid_palette_length(bytes).is_some()
    {
        return None;
    }
    let own = png::Limits {
        bytes: usize::try_from(limits.image_pixels)
            .ok()?
            .saturating_mul(16),
    };
    let mut reader = png::Decoder::new_with_limits(Cursor::new(bytes), own)
        .read_info()
        .ok()?;
    let info = reader.info();
    let (width, height) = info.size();
    check_size(u64::from(width), u64::from(height), limits).ok()?;
    if info.interlaced {
        return None;
    }
    let colours = info.palette.as_ref()?.as_chunks().0;
    // As in the decoder: codes beyond the palette are black, codes beyond the list of alphas are
    // opaque, and a list longer than the palette is ignored.
    let alphas = info
        .trns
        .as_deref()
        .filter(|alphas| alphas.len() <= colours.len())
        .unwrap_or_default();
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
    (pixels.len() == count).then_some(ImageData {
        width,
        height,
        pixels: PixelData::Codes(pixels),
    })
}

#[cfg(test)]
pub(crate) mod tests;
