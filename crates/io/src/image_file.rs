//! Decoding of image files: PNG, JPEG, WebP and KTX2 textures, Radiance HDR and OpenEXR environments.
//!
//! Only pixels are read: colour profiles, gamma chunks and camera orientation are ignored, as glTF 2.0 asks for (section 3.8.3).

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use raywright_core::scene::{ImageData, Pixels};

use crate::import::{Budget, Fault, Outcome};
use crate::{Limits, basis};

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
    const SIGNATURES: [(&[u8], Kind); 10] = [
        (b"\x89PNG\r\n\x1a\n", Kind::Png),
        (b"\xff\xd8\xff", Kind::Jpeg),
        (b"#?RADIANCE", Kind::Hdr),
        (b"#?RGBE", Kind::Hdr),
        (b"\x76\x2f\x31\x01", Kind::Exr),
        (basis::SIGNATURE, Kind::Ktx2),
        (b"GIF8", Kind::Foreign("GIF")),
        (b"BM", Kind::Foreign("BMP")),
        (b"DDS ", Kind::Foreign("DDS")),
        (b"II*\0", Kind::Foreign("TIFF")),
    ];
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return Kind::WebP;
    }
    SIGNATURES.iter().find(|(head, _)| bytes.starts_with(head)).map_or(Kind::Unknown, |&(_, kind)| kind)
}

/// Decodes a whole image file.
///
/// PNG, JPEG, WebP and KTX2 become [`Pixels::Codes`] (grey and palettes spread to RGBA, 16-bit samples rounded to 8 bits), HDR and EXR
/// become [`Pixels::Linear`].
///
/// # Errors
/// A fault of kind limit when the header asks for more than `limits` allow (nothing is allocated then); of kind input when
/// the format is not read here or the data is broken.
pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> Outcome<ImageData> {
    match sniff(bytes) {
        Kind::Png => decode_with(ImageFormat::Png, bytes, limits),
        Kind::Jpeg => decode_with(ImageFormat::Jpeg, bytes, limits),
        Kind::WebP => decode_with(ImageFormat::WebP, bytes, limits),
        Kind::Hdr => decode_with(ImageFormat::Hdr, bytes, limits),
        Kind::Exr => decode_exr(bytes, limits),
        Kind::Ktx2 => basis::decode(bytes, limits),
        Kind::Foreign(name) => Err(Fault::input(format!("is a {name} picture; PNG, JPEG, WebP, KTX2, HDR and EXR are read"))),
        Kind::Unknown => Err(Fault::input("is no picture that is read here (PNG, JPEG, WebP, KTX2, HDR, EXR)")),
    }
}

/// Whether bytes are a texture that will be read, or why a picture can do without them: a format that is not read here, or, `beside`
/// the scene in a file of its own, none that is known. Only the header is looked at, and the memory of the pixels is claimed.
///
/// # Errors
/// As [`decode`] where the format is read, as far as a header tells, and of kind limit when the budget does not last.
pub(crate) fn accept_texture(bytes: &[u8], beside: bool, limits: &Limits, budget: &mut Budget) -> Outcome<Result<(), String>> {
    let kind = sniff(bytes);
    if matches!(kind, Kind::Foreign(_)) || beside && kind == Kind::Unknown {
        return Ok(decode(bytes, limits).map(drop).map_err(|fault| fault.message));
    }
    claim(bytes, limits, budget)?;
    Ok(Ok(()))
}

/// Claims the memory that a picture will take, by its header.
///
/// # Errors
/// As [`decode`] as far as a header tells, and of kind limit when the budget does not last.
pub(crate) fn claim(bytes: &[u8], limits: &Limits, budget: &mut Budget) -> Outcome<()> {
    let [width, height] = size(bytes, limits)?;
    let pixel = match sniff(bytes) {
        Kind::Hdr | Kind::Exr => size_of::<[f32; 4]>(),
        _ => size_of::<[u8; 4]>(),
    };
    budget.memory(width as usize * height as usize, pixel)
}

/// Width and height that a header gives a picture.
fn size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    let size = |format| opened(format, bytes, limits).map(|decoder| decoder.dimensions()).map(|(width, height)| [width, height]);
    match sniff(bytes) {
        Kind::Png => size(ImageFormat::Png),
        Kind::Jpeg => size(ImageFormat::Jpeg),
        Kind::WebP => size(ImageFormat::WebP),
        Kind::Hdr => size(ImageFormat::Hdr),
        Kind::Exr => exr_size(bytes, limits),
        Kind::Ktx2 => basis::size(bytes, limits),
        // Decoding says what is wrong with it.
        Kind::Foreign(_) | Kind::Unknown => decode(bytes, limits).map(|image| [image.width, image.height]),
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
fn broken(error: image::ImageError) -> Fault {
    match error {
        image::ImageError::Limits(e) => Fault::limit(format!("is a picture that takes too much memory to read ({e})")),
        e => Fault::input(format!("is a broken picture ({e})")),
    }
}

/// The decoder of a picture that is not too large.
fn opened<'b>(format: ImageFormat, bytes: &'b [u8], limits: &Limits) -> Outcome<impl ImageDecoder + 'b> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    // The pixel count is checked below; this bounds what the decoder itself may allocate on the way.
    let mut own = image::Limits::default();
    own.max_alloc = Some(limits.image_pixels.saturating_mul(16));
    reader.limits(own);
    let decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    check_size(u64::from(width), u64::from(height), limits)?;
    Ok(decoder)
}

fn decode_with(format: ImageFormat, bytes: &[u8], limits: &Limits) -> Outcome<ImageData> {
    let decoder = opened(format, bytes, limits)?;
    let (width, height) = decoder.dimensions();
    let picture = DynamicImage::from_decoder(decoder).map_err(broken)?;
    let pixels = match picture {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            Pixels::Linear(picture.into_rgba32f().pixels().map(|p| p.0.map(usable)).collect())
        }
        // The two most common kinds are copied as they are; the general way looks at every pixel's colour space.
        DynamicImage::ImageRgb8(picture) => {
            Pixels::Codes(picture.as_raw().as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect())
        }
        picture => Pixels::Codes(picture.into_rgba8().as_raw().as_chunks().0.to_vec()),
    };
    Ok(ImageData { width, height, pixels })
}

fn broken_exr(error: exr::error::Error) -> Fault {
    Fault::input(format!("is a broken EXR picture ({error})"))
}

/// Width and height of the largest part of an EXR file, all of whose headers are looked at.
fn exr_size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    let meta = exr::prelude::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken_exr)?;
    let mut largest = [0, 0];
    for header in &meta.headers {
        let (width, height) = (header.layer_size.0 as u64, header.layer_size.1 as u64);
        check_size(width, height, limits)?;
        if crate::output::can_abort(header.compression) {
            return Err(Fault::input("is an EXR picture with DWA compression, which is not read here; ZIP is"));
        }
        // Fewer than `image_pixels`, which no side exceeds.
        let size = [width as u32, height as u32];
        if u64::from(largest[0]) * u64::from(largest[1]) < width * height {
            largest = size;
        }
    }
    Ok(largest)
}

fn decode_exr(bytes: &[u8], limits: &Limits) -> Outcome<ImageData> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    exr_size(bytes, limits)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size, _| (size.0, vec![[0.0_f32; 4]; size.0 * size.1]),
            |(width, pixels): &mut (usize, Vec<[f32; 4]>), at, (r, g, b, a): (f32, f32, f32, f32)| {
                if let Some(slot) = pixels.get_mut(at.1 * *width + at.0) {
                    *slot = [r, g, b, a].map(usable);
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken_exr)?;
    let size = image.layer_data.size;
    let (width, height) = (u32::try_from(size.0), u32::try_from(size.1));
    match (width, height) {
        (Ok(width), Ok(height)) => {
            Ok(ImageData { width, height, pixels: Pixels::Linear(image.layer_data.channel_data.pixels.1) })
        }
        _ => Err(Fault::input("is a broken EXR picture (size)")),
    }
}

/// A value that light can have: neither NaN nor infinite nor negative.
fn usable(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, f32::MAX) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::FaultKind;

    fn png(colour: png::ColorType, depth: png::BitDepth, palette: Option<(&[u8], &[u8])>, data: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, 2, 1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        // Half the usual gamma: must not matter.
        encoder.set_source_gamma(png::ScaledFloat::new(1.0));
        if let Some((colours, alphas)) = palette {
            encoder.set_palette(colours);
            encoder.set_trns(alphas);
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        out
    }

    fn codes(bytes: &[u8]) -> Vec<[u8; 4]> {
        match decode(bytes, &Limits::default()).unwrap().pixels {
            Pixels::Codes(codes) => codes,
            Pixels::Linear(_) => panic!("codes"),
        }
    }

    /// Every kind of PNG becomes the same RGBA codes; 16 bits are rounded, gamma chunks ignored.
    #[test]
    fn png_kinds_agree() {
        use png::{BitDepth::*, ColorType::*};
        let same = vec![[9, 9, 9, 255], [200, 200, 200, 255]];
        assert_eq!(codes(&png(Grayscale, Eight, None, &[9, 200])), same);
        assert_eq!(codes(&png(Rgb, Eight, None, &[9, 9, 9, 200, 200, 200])), same);
        assert_eq!(codes(&png(Rgba, Eight, None, &[9, 9, 9, 255, 200, 200, 200, 255])), same);
        assert_eq!(codes(&png(Grayscale, Sixteen, None, &[9, 9, 200, 200])), same);
        assert_eq!(codes(&png(GrayscaleAlpha, Eight, None, &[9, 255, 200, 7])), [[9, 9, 9, 255], [200, 200, 200, 7]]);
        let palette: (&[u8], &[u8]) = (&[1, 2, 3, 9, 9, 9, 200, 200, 200], &[0, 255, 255]);
        assert_eq!(codes(&png(Indexed, Two, Some(palette), &[0b01_10_00_00])), same);
        assert_eq!(codes(&png(Indexed, Two, Some(palette), &[0b00_10_00_00]))[0], [1, 2, 3, 0]);
    }

    /// The two float formats keep what is brighter than white, and clamp what light can't be.
    #[test]
    fn float_formats_stay_linear() {
        let values = [[0.5_f32, 2.0, 40.0], [0.25, 1.0, 0.0]];
        let mut hdr = Vec::new();
        let pixels: Vec<_> = values.iter().map(|&v| image::Rgb(v)).collect();
        image::codecs::hdr::HdrEncoder::new(&mut hdr).encode(&pixels, 2, 1).unwrap();
        let mut exr_file = std::io::Cursor::new(Vec::new());
        let channels = exr::image::SpecificChannels::rgb(|at: exr::math::Vec2<usize>| match at.0 {
            0 => (0.5_f32, 2.0_f32, 40.0_f32),
            _ => (0.25, 1.0, -3.0),
        });
        use exr::prelude::WritableImage;
        exr::image::Image::from_channels((2, 1), channels).write().to_buffered(&mut exr_file).unwrap();
        for bytes in [hdr, exr_file.into_inner()] {
            let image = decode(&bytes, &Limits::default()).unwrap();
            let Pixels::Linear(got) = image.pixels else { panic!("linear values") };
            assert_eq!((image.width, image.height), (2, 1));
            assert_eq!(got, [[0.5, 2.0, 40.0, 1.0], [0.25, 1.0, 0.0, 1.0]]);
        }
    }

    /// Protects: no number of a float picture gets in that light can't have, nor a coverage: negative ones and what is no number are
    /// zero, infinite ones the largest number, in each channel.
    #[test]
    fn floats_are_what_light_can_be() {
        use exr::prelude::WritableImage;
        let cases = [(-1.0, 0.0), (f32::NEG_INFINITY, 0.0), (f32::NAN, 0.0), (f32::INFINITY, f32::MAX), (0.25, 0.25)];
        for channel in 0..4 {
            let pixel = |at: exr::math::Vec2<usize>| {
                let mut pixel = [0.5_f32; 4];
                pixel[channel] = cases[at.0].0;
                let [r, g, b, a] = pixel;
                (r, g, b, a)
            };
            let mut file = Cursor::new(Vec::new());
            let image = exr::image::Image::from_channels((cases.len(), 1), exr::image::SpecificChannels::rgba(pixel));
            image.write().to_buffered(&mut file).unwrap();
            let Pixels::Linear(got) = decode(&file.into_inner(), &Limits::default()).unwrap().pixels else { panic!("linear") };
            for (pixel, (written, wanted)) in got.into_iter().zip(cases) {
                let mut expected = [0.5; 4];
                expected[channel] = wanted;
                assert_eq!(pixel, expected, "{written} in channel {channel}");
            }
        }
    }

    /// Size is checked in the header, for every format; broken and foreign data are told apart.
    #[test]
    fn limits_and_faults() {
        let limits = Limits { image_pixels: 1, ..Limits::default() };
        let png = png(png::ColorType::Grayscale, png::BitDepth::Eight, None, &[9, 200]);
        let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n".to_vec();
        assert_eq!(decode(&png, &limits).unwrap_err().kind, FaultKind::Limit);
        assert_eq!(decode(&hdr, &Limits::default()).unwrap_err().kind, FaultKind::Limit);
        for end in 0..png.len() - 12 {
            assert_eq!(decode(&png[..end], &Limits::default()).unwrap_err().kind, FaultKind::Input, "{end} bytes");
        }
        for (bytes, word) in [(b"GIF89a".as_slice(), "GIF"), (b"RIFF....WEBPVP8 ", "broken"), (b"hello", "no picture")] {
            assert!(decode(bytes, &Limits::default()).unwrap_err().message.contains(word));
        }
    }

    /// Protects: pictures are known by their first bytes, those that are read and those that are only named; and what a radiance
    /// picture says below zero, beyond or not at all is brought back to what light can be.
    #[test]
    fn kinds_of_pictures_are_told() {
        let foreign = |bytes: &[u8]| match sniff(bytes) {
            Kind::Foreign(name) => name,
            _ => "",
        };
        assert!(matches!(sniff(b"\x89PNG\r\n\x1a\n"), Kind::Png) && matches!(sniff(b"\xff\xd8\xff\xe0"), Kind::Jpeg));
        assert!(matches!(sniff(b"#?RADIANCE\n"), Kind::Hdr) && matches!(sniff(b"#?RGBE\n"), Kind::Hdr));
        assert!(matches!(sniff(b"\x76\x2f\x31\x01"), Kind::Exr) && matches!(sniff(b""), Kind::Unknown));
        assert!(matches!(sniff(b"RIFF1234WEBPVP8"), Kind::WebP));
        assert!(matches!(sniff(b"\xabKTX 20\xbb\r\n\x1a\n"), Kind::Ktx2));
        let others: [(&[u8], &str); 4] = [(b"GIF89a", "GIF"), (b"BM6", "BMP"), (b"DDS ", "DDS"), (b"II*\0", "TIFF")];
        for (bytes, name) in others {
            assert_eq!(foreign(bytes), name);
        }
        assert_eq!([-1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.5].map(usable), [0.0, 0.0, f32::MAX, 0.0, 0.5]);
    }
}
