//! Reading of pictures, for comparison and for tests: PNG of 8 and 16 bits, JPEG, WebP, OpenEXR
//! with any channels.

mod open_exr;

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Info, Transformations};
use raywright_core::picture::{Encoding, Picture};

use super::metadata::{PictureMetadata, decode_exif_texts};
use super::png::WebPictureDecoder;
use crate::error::Error;
use crate::folder::read_picture_file;
use crate::limits::{Limits, format_bytes};

pub(crate) use open_exr::check_dwa_blocks;

use open_exr::decode_exr;

/// A picture as stored in a file: pixels, encoding and texts.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredPicture {
    /// Name of the format.
    pub format_name: &'static str,
    /// Pixel values: floating-point numbers from an OpenEXR file, in the primaries of Rec. 709;
    /// display values in 0..1 from any other format.
    pub picture: Picture,
    /// Whether the pixel values are linear or encoded for display.
    pub encoding: Encoding,
    /// Whether the file has colour: channels `R`, `G`, `B`, or `Y` alone. Otherwise `rgb` is black
    /// and all channels of the file are layers.
    pub has_colour: bool,
    /// Texts of the file by name. Texts from Exif have the names that OpenEXR files use.
    pub texts: BTreeMap<String, String>,
}

impl StoredPicture {
    /// Returns the metadata about the picture's origin; empty for a picture of another program.
    pub fn metadata(&self) -> PictureMetadata {
        PictureMetadata::from_texts(&self.texts)
    }
}

/// Upper bound, for all supported formats, of the number of picture bytes that a file byte can
/// encode (DEFLATE reaches 1032). With this bound, a small file cannot claim a large picture.
const MAX_EXPANSION: u64 = 4096;

/// First bytes of every PNG file.
pub(super) const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
pub(super) const EXR: &[u8] = b"\x76\x2f\x31\x01";

/// Reads a PNG, JPEG, WebP or OpenEXR file; the format is detected by its first bytes. Of an
/// animation, the first picture is read. Of an OpenEXR file with several parts of equal size, all
/// parts are read, and the name of the part and a dot precede the names of its channels.
///
/// # Errors
/// Of kind [`File`](crate::ErrorKind::File) for an unreadable file,
/// [`Input`](crate::ErrorKind::Input) for broken or unsupported content,
/// [`Limit`](crate::ErrorKind::Limit) beyond the limits.
#[doc(alias("ImageReader", "image::open"))]
pub fn read_picture(path: &Path, limits: &Limits) -> Result<StoredPicture, Error> {
    decode_picture(path, &read_picture_file(path, limits)?, limits)
}

/// Decodes the picture in the bytes of a file; `path` is for messages only.
///
/// # Errors
/// As [`read_picture`], without the kind for unreadable files.
pub(crate) fn decode_picture(
    path: &Path,
    bytes: &[u8],
    limits: &Limits,
) -> Result<StoredPicture, Error> {
    let decoded = if bytes.starts_with(PNG) {
        decode_png(bytes, limits)
    } else if bytes.starts_with(EXR) {
        decode_exr(bytes, limits)
    } else if let Some(file) = WebPictureDecoder::open(bytes) {
        file.map_err(PictureFailure::from)
            .and_then(|file| decode_web_picture(file, limits))
    } else {
        Err(PictureFailure::Wrong(
            "the file is not a PNG, JPEG, WebP or OpenEXR picture".to_owned(),
        ))
    };
    decoded.map_err(|failure| match failure {
        PictureFailure::Wrong(message) => Error::invalid_input(path.display(), message),
        PictureFailure::TooLarge(message) => Error::over_limit(path.display(), message),
    })
}

/// Reason why a picture cannot be decoded; the caller adds the name of the file.
enum PictureFailure {
    Wrong(String),
    TooLarge(String),
}

impl From<png::DecodingError> for PictureFailure {
    fn from(cause: png::DecodingError) -> Self {
        Self::Wrong(format!("the PNG cannot be read: {cause}"))
    }
}

impl From<image::ImageError> for PictureFailure {
    fn from(cause: image::ImageError) -> Self {
        Self::Wrong(format!("the picture cannot be read: {cause}"))
    }
}

impl From<exr::error::Error> for PictureFailure {
    fn from(cause: exr::error::Error) -> Self {
        Self::Wrong(format!("the OpenEXR file cannot be read: {cause}"))
    }
}

/// Checks the size of a picture before any allocation, against the limits and the length of the
/// file.
fn check_size(
    width: u64,
    height: u64,
    bytes_a_pixel: u64,
    file_bytes: usize,
    limits: &Limits,
) -> Result<(), PictureFailure> {
    let pixels = width.saturating_mul(height);
    if pixels > limits.image_pixels {
        let limit = limits.image_pixels;
        return Err(PictureFailure::TooLarge(format!(
            "the picture has {width} × {height} pixels, more than the limit of {limit} pixels"
        )));
    }
    let bytes = pixels.saturating_mul(bytes_a_pixel);
    if bytes > limits.memory_bytes {
        let (bytes, limit) = (format_bytes(bytes), format_bytes(limits.memory_bytes));
        return Err(PictureFailure::TooLarge(format!(
            "the decoded picture needs {bytes} of memory, more than the limit of {limit}"
        )));
    }
    if bytes / MAX_EXPANSION > file_bytes as u64 {
        return Err(PictureFailure::Wrong(format!(
            "the header states {width} × {height} pixels, more than a file of {file_bytes} bytes can hold"
        )));
    }
    Ok(())
}

/// Decodes a PNG of any colour type, with 8 or 16 bits a channel.
fn decode_png(bytes: &[u8], limits: &Limits) -> Result<StoredPicture, PictureFailure> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    let info = decoder.read_header_info()?;
    let (width, height) = (info.width, info.height);
    check_size(width.into(), height.into(), 12, bytes.len(), limits)?;
    let mut reader = decoder.read_info()?;
    let length = reader.output_buffer_size().ok_or_else(|| {
        PictureFailure::TooLarge(
            "the decoded picture is larger than the memory that this machine can address"
                .to_owned(),
        )
    })?;
    let mut buffer = vec![0; length];
    let frame = reader.next_frame(&mut buffer)?;
    let samples = unit_samples(&buffer, frame.bit_depth);
    let (step, has_alpha) = match frame.color_type {
        ColorType::Grayscale => (1, false),
        ColorType::GrayscaleAlpha => (2, true),
        ColorType::Rgb => (3, false),
        ColorType::Rgba => (4, true),
        ColorType::Indexed => {
            return Err(PictureFailure::Wrong(
                "the PNG cannot be read: its palette is missing".to_owned(),
            ));
        }
    };
    let colour = |pixel: &[f32]| {
        if step < 3 {
            [pixel[0]; 3]
        } else {
            [pixel[0], pixel[1], pixel[2]]
        }
    };
    let rgb = samples.chunks_exact(step).map(colour).collect();
    let alpha = has_alpha.then(|| {
        samples
            .chunks_exact(step)
            .map(|pixel| pixel[step - 1])
            .collect()
    });
    let picture = Picture {
        width,
        height,
        rgb,
        alpha,
        ..Picture::default()
    };
    Ok(StoredPicture {
        format_name: "PNG",
        picture,
        encoding: Encoding::Display,
        has_colour: true,
        texts: png_texts(reader.info()),
    })
}

/// Converts the samples of a PNG, of 8 or 16 bits, to values in 0..1.
fn unit_samples(buffer: &[u8], depth: BitDepth) -> Vec<f32> {
    if depth == BitDepth::Sixteen {
        buffer
            .chunks_exact(2)
            .map(|b| (f64::from(u16::from_be_bytes([b[0], b[1]])) / 65535.0) as f32)
            .collect()
    } else {
        buffer
            .iter()
            .map(|&b| (f64::from(b) / 255.0) as f32)
            .collect()
    }
}

/// Returns the uncompressed texts of a PNG, by keyword.
pub(super) fn png_texts(info: &Info<'_>) -> BTreeMap<String, String> {
    let latin = info
        .uncompressed_latin1_text
        .iter()
        .map(|chunk| (chunk.keyword.clone(), chunk.text.clone()));
    let utf8 = info
        .utf8_text
        .iter()
        .filter_map(|chunk| Some((chunk.keyword.clone(), chunk.get_text().ok()?)));
    latin.chain(utf8).collect()
}

/// Decodes a JPEG or WebP picture.
fn decode_web_picture(
    file: WebPictureDecoder<'_>,
    limits: &Limits,
) -> Result<StoredPicture, PictureFailure> {
    let (notation, (width, height)) = (file.format_name(), file.dimensions());
    // A few bytes of lossless WebP can encode any number of equal pixels, so that only the memory
    // limit applies.
    check_size(width.into(), height.into(), 16 + 4, usize::MAX, limits)?;
    let (image, exif) = file.decode()?;
    let share = |code: u8| (f64::from(code) / 255.0) as f32;
    let has_alpha = image.color().has_alpha();
    let codes = image.into_rgba8();
    let rgb = codes
        .pixels()
        .map(|pixel| [0, 1, 2].map(|i| share(pixel.0[i])))
        .collect();
    let alpha = has_alpha.then(|| codes.pixels().map(|pixel| share(pixel.0[3])).collect());
    let picture = Picture {
        width,
        height,
        rgb,
        alpha,
        ..Picture::default()
    };
    Ok(StoredPicture {
        format_name: notation,
        picture,
        encoding: Encoding::Display,
        has_colour: true,
        texts: decode_exif_texts(&exif),
    })
}
