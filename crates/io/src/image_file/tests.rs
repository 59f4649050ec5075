//! Pictures of every kind that is read, and those that are refused.

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

/// Protects: every kind of PNG becomes the same RGBA codes; 16 bits are rounded, gamma chunks ignored.
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

/// Protects: a palette of eight bits gives what the other decoder says, with alphas for all colours, some or none, codes beyond the
/// palette, rows that are filtered or interlaced, several pixels and one; and what is broken or too large is refused as ever.
#[test]
fn palettes_agree_with_the_general_decoder() {
    let colours: Vec<u8> = (0..200 * 3).map(|i| (i * 37 % 256) as u8).collect();
    let written = |width: u32, height: u32, alphas: &[u8]| {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, width, height);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(&colours[..]);
        if !alphas.is_empty() {
            encoder.set_trns(alphas);
        }
        encoder.set_filter(png::Filter::Paeth);
        let data: Vec<u8> = (0..width * height).map(|i| (i * 7 % 251) as u8).collect();
        encoder.write_header().unwrap().write_image_data(&data).unwrap();
        out
    };
    for (width, height) in [(1, 1), (31, 17), (256, 3)] {
        for alphas in [&[][..], &[0, 128, 7], &[9; 200], &[9; 201]] {
            let file = written(width, height, alphas);
            let general = decode_with(ImageFormat::Png, &file, &Limits::default()).unwrap();
            let Pixels::Codes(expected) = general.pixels else { panic!("codes") };
            let own = decode_palette(&file, &Limits::default()).expect("a palette");
            assert_eq!((own.width, own.height), (width, height));
            let Pixels::Codes(found) = own.pixels else { panic!("codes") };
            assert!(found == expected, "{width} x {height}, {} alphas", alphas.len());
            let few = Limits { image_pixels: u64::from(width * height) - 1, ..Limits::default() };
            assert!(decode_palette(&file, &few).is_none() && decode(&file, &few).is_err());
            let cut = &file[..file.len() - 24];
            assert_eq!(decode(cut, &Limits::default()).is_err(), decode_with(ImageFormat::Png, cut, &Limits::default()).is_err());
        }
    }
    assert!(decode_palette(&png(png::ColorType::Rgb, png::BitDepth::Eight, None, &[1; 6]), &Limits::default()).is_none());
}

/// Protects: the rows of an interlaced palette, which come in seven passes, land where they belong.
#[test]
fn interlaced_palettes_are_put_together() {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 10, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    let colours: Vec<u8> = (0..18).map(|i| i / 3).collect();
    encoder.set_palette(&colours[..]);
    encoder.set_filter(png::Filter::NoFilter);
    // A row of ten is also what two by three have in the four passes that they have a share in, each row with the number of its filter
    // before it.
    encoder.write_header().unwrap().write_image_data(&[0, 0, 4, 0, 1, 0, 5, 0, 2, 3]).unwrap();
    (file[19], file[23], file[28]) = (2, 3, 1);
    let checksum = crc32(&file[12..29]);
    file[29..33].copy_from_slice(&checksum.to_be_bytes());
    assert_eq!(codes(&file), [0, 1, 2, 3, 4, 5].map(|code| [code, code, code, 255]));
}

/// Protects: a palette of one byte more or less than three for each colour, or of more than 256 colours, is refused with its length, at every
/// depth; the decoder panics over it.
#[test]
fn palettes_of_odd_lengths_are_refused() {
    use png::BitDepth::*;
    for depth in [One, Two, Four, Eight] {
        for length in [1, 2, 3, 4, 5, 6, 766, 767, 768, 769, 771] {
            let mut file =
                png(png::ColorType::Indexed, depth, Some((&[7; 6], &[9])), &[0, 0][..if depth == Eight { 2 } else { 1 }]);
            let start = file.windows(4).position(|kind| kind == b"PLTE").unwrap();
            let mut chunk = b"PLTE".to_vec();
            chunk.extend(vec![7; length]);
            let (size, checksum) = ((length as u32).to_be_bytes(), crc32(&chunk).to_be_bytes());
            file.splice(start - 4..start + 4 + 6 + 4, [&size[..], &chunk, &checksum].concat());
            match decode(&file, &Limits::default()) {
                Ok(_) => assert!(length % 3 == 0 && length <= 768, "{depth:?}, {length}"),
                Err(fault) => {
                    assert!(length % 3 != 0 || length > 768, "{depth:?}, {length}: {}", fault.message);
                    assert!(fault.message.contains(&format!("palette has {length} bytes")), "{}", fault.message);
                }
            }
        }
    }
}

/// The checksum of a PNG chunk, bit by bit.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

/// Protects: the two float formats keep what is brighter than white, and clamp what light can't be.
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

/// Protects: size is checked in the header, for every format; broken and foreign data are told apart.
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

/// Protects: a picture claims the memory of what it becomes before it is decoded: four bytes a pixel of codes, sixteen of light; at
/// exactly as much it is taken, a byte below refused.
#[test]
fn pictures_claim_what_they_become() {
    let png = png(png::ColorType::Grayscale, png::BitDepth::Eight, None, &[9, 200]);
    let mut hdr = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut hdr).encode(&[image::Rgb([0.5_f32; 3]); 2], 2, 1).unwrap();
    for (bytes, needed) in [(png, 2 * 4), (hdr, 2 * 16)] {
        let claimed = |memory_bytes: u64| {
            let limits = Limits { memory_bytes, ..Limits::default() };
            claim(&bytes, &limits, &mut Budget::new(&limits))
        };
        assert!(claimed(needed).is_ok(), "{needed}");
        assert_eq!(claimed(needed - 1).expect_err("a byte too few").kind, FaultKind::Limit, "{needed}");
    }
}
