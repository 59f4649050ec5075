//! Tests of all supported picture formats, and of refused pictures.

use super::*;
use crate::error_kind::ErrorKind;

fn png(
    colour: png::ColorType,
    depth: png::BitDepth,
    palette: Option<(&[u8], &[u8])>,
    data: &[u8],
) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, 2, 1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    // Half the usual gamma, which must have no effect.
    encoder.set_source_gamma(png::ScaledFloat::new(1.0));
    if let Some((colours, alphas)) = palette {
        encoder.set_palette(colours);
        encoder.set_trns(alphas);
    }
    encoder
        .write_header()
        .unwrap()
        .write_image_data(data)
        .unwrap();
    out
}

fn codes(bytes: &[u8]) -> Vec<[u8; 4]> {
    match decode(bytes, &Limits::default()).unwrap().image.pixels {
        PixelData::Codes(codes) => codes,
        PixelData::Linear(_) => panic!("codes"),
    }
}

/// Protects: every kind of PNG gives the same RGBA codes; 16 bits are rounded, gamma chunks
/// ignored.
#[test]
fn png_kinds_agree() {
    use png::{BitDepth::*, ColorType::*};
    let same = vec![[9, 9, 9, 255], [200, 200, 200, 255]];
    assert_eq!(codes(&png(Grayscale, Eight, None, &[9, 200])), same);
    assert_eq!(
        codes(&png(Rgb, Eight, None, &[9, 9, 9, 200, 200, 200])),
        same
    );
    assert_eq!(
        codes(&png(Rgba, Eight, None, &[9, 9, 9, 255, 200, 200, 200, 255])),
        same
    );
    assert_eq!(
        codes(&png(Grayscale, Sixteen, None, &[9, 9, 200, 200])),
        same
    );
    assert_eq!(
        codes(&png(GrayscaleAlpha, Eight, None, &[9, 255, 200, 7])),
        [[9, 9, 9, 255], [200, 200, 200, 7]]
    );
    let palette: (&[u8], &[u8]) = (&[1, 2, 3, 9, 9, 9, 200, 200, 200], &[0, 255, 255]);
    assert_eq!(
        codes(&png(Indexed, Two, Some(palette), &[0b01_10_00_00])),
        same
    );
    assert_eq!(
        codes(&png(Indexed, Two, Some(palette), &[0b00_10_00_00]))[0],
        [1, 2, 3, 0]
    );
}

/// Protects: an 8-bit palette gives the result of the general decoder: with alphas for all colours,
/// some or none, codes beyond the palette, filtered or interlaced rows, several pixels and a single
/// one. Broken and oversized pictures are refused.
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
        encoder
            .write_header()
            .unwrap()
            .write_image_data(&data)
            .unwrap();
        out
    };
    for (width, height) in [(1, 1), (31, 17), (256, 3)] {
        for alphas in [&[][..], &[0, 128, 7], &[9; 200], &[9; 201]] {
            let file = written(width, height, alphas);
            let general =
                decode_with_image_crate(ImageFormat::Png, &file, &Limits::default()).unwrap();
            let PixelData::Codes(expected) = general.pixels else {
                panic!("codes")
            };
            let own = decode_palette(&file, &Limits::default()).expect("a palette");
            assert_eq!((own.width, own.height), (width, height));
            let PixelData::Codes(found) = own.pixels else {
                panic!("codes")
            };
            assert!(
                found == expected,
                "{width} x {height}, {} alphas",
                alphas.len()
            );
            let few = Limits {
                image_pixels: u64::from(width * height) - 1,
                ..Limits::default()
            };
            assert!(decode_palette(&file, &few).is_none() && decode(&file, &few).is_err());
            let cut = &file[..file.len() - 24];
            assert_eq!(
                decode(cut, &Limits::default()).is_err(),
                decode_with_image_crate(ImageFormat::Png, cut, &Limits::default()).is_err()
            );
        }
    }
    assert!(
        decode_palette(
            &png(png::ColorType::Rgb, png::BitDepth::Eight, None, &[1; 6]),
            &Limits::default()
        )
        .is_none()
    );
}

/// Protects: the seven passes of an interlaced palette picture are put in their rows.
#[test]
fn interlaced_palettes_are_put_together() {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 10, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    let colours: Vec<u8> = (0..18).map(|i| i / 3).collect();
    encoder.set_palette(&colours[..]);
    encoder.set_filter(png::Filter::NoFilter);
    // A row of ten bytes has the same length as 2×3 pixels in the four passes that are not empty,
    // each row with its filter byte.
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&[0, 0, 4, 0, 1, 0, 5, 0, 2, 3])
        .unwrap();
    (file[19], file[23], file[28]) = (2, 3, 1);
    let checksum = crc32(&file[12..29]);
    file[29..33].copy_from_slice(&checksum.to_be_bytes());
    assert_eq!(
        codes(&file),
        [0, 1, 2, 3, 4, 5].map(|code| [code, code, code, 255])
    );
}

/// Protects: a palette whose length is not three bytes per colour, or of more than 256 colours, is
/// refused with its length at every depth; the decoder would panic.
#[test]
fn palettes_of_odd_lengths_are_refused() {
    use png::BitDepth::*;
    for depth in [One, Two, Four, Eight] {
        for length in [1, 2, 3, 4, 5, 6, 766, 767, 768, 769, 771] {
            let mut file = png(
                png::ColorType::Indexed,
                depth,
                Some((&[7; 6], &[9])),
                &[0, 0][..if depth == Eight { 2 } else { 1 }],
            );
            let start = file.windows(4).position(|kind| kind == b"PLTE").unwrap();
            let mut chunk = b"PLTE".to_vec();
            chunk.extend(vec![7; length]);
            let (size, checksum) = ((length as u32).to_be_bytes(), crc32(&chunk).to_be_bytes());
            file.splice(
                start - 4..start + 4 + 6 + 4,
                [&size[..], &chunk, &checksum].concat(),
            );
            match decode(&file, &Limits::default()) {
                Ok(_) => assert!(length % 3 == 0 && length <= 768, "{depth:?}, {length}"),
                Err(fault) => {
                    assert!(
                        length % 3 != 0 || length > 768,
                        "{depth:?}, {length}: {}",
                        fault.message
                    );
                    assert!(
                        fault
                            .message
                            .contains(&format!("palette has {length} bytes")),
                        "{}",
                        fault.message
                    );
                }
            }
        }
    }
}

/// Computes the checksum of a PNG chunk, bit by bit.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            if crc & 1 == 1 {
                crc >> 1 ^ 0xedb8_8320
            } else {
                crc >> 1
            }
        })
    })
}

/// Protects: both float formats keep values above white, and clamp invalid radiance.
#[test]
fn float_formats_stay_linear() {
    let values = [[0.5_f32, 2.0, 40.0], [0.25, 1.0, 0.0]];
    let mut hdr = Vec::new();
    let pixels: Vec<_> = values.iter().map(|&v| image::Rgb(v)).collect();
    image::codecs::hdr::HdrEncoder::new(&mut hdr)
        .encode(&pixels, 2, 1)
        .unwrap();
    let mut exr_file = std::io::Cursor::new(Vec::new());
    let channels = exr::image::SpecificChannels::rgb(|at: exr::math::Vec2<usize>| match at.0 {
        0 => (0.5_f32, 2.0_f32, 40.0_f32),
        _ => (0.25, 1.0, -3.0),
    });
    use exr::prelude::WritableImage;
    exr::image::Image::from_channels((2, 1), channels)
        .write()
        .to_buffered(&mut exr_file)
        .unwrap();
    for bytes in [hdr, exr_file.into_inner()] {
        let image = decode(&bytes, &Limits::default()).unwrap().image;
        let PixelData::Linear(got) = image.pixels else {
            panic!("linear values")
        };
        assert_eq!((image.width, image.height), (2, 1));
        assert_eq!(got, [[0.5, 2.0, 40.0, 1.0], [0.25, 1.0, 0.0, 1.0]]);
    }
}

/// Protects: invalid radiance or coverage never enters a float picture: negative and NaN values
/// become zero, infinite ones the largest half float, in each channel; their number is reported.
#[test]
fn floats_are_what_light_can_be() {
    use exr::prelude::WritableImage;
    let cases = [
        (-1.0, 0.0),
        (f32::NEG_INFINITY, 0.0),
        (f32::NAN, 0.0),
        (f32::INFINITY, 65504.0),
        (0.25, 0.25),
    ];
    for channel in 0..4 {
        let pixel = |at: exr::math::Vec2<usize>| {
            let mut pixel = [0.5_f32; 4];
            pixel[channel] = cases[at.0].0;
            let [r, g, b, a] = pixel;
            (r, g, b, a)
        };
        let mut file = Cursor::new(Vec::new());
        let image = exr::image::Image::from_channels(
            (cases.len(), 1),
            exr::image::SpecificChannels::rgba(pixel),
        );
        image.write().to_buffered(&mut file).unwrap();
        let DecodedImage { image, remarks, .. } =
            decode(&file.into_inner(), &Limits::default()).unwrap();
        let PixelData::Linear(got) = image.pixels else {
            panic!("linear")
        };
        let message =
            "1 infinite (replaced by 65504), 1 NaN (replaced by 0), 2 negative (replaced by 0)";
        assert!(
            remarks.len() == 1 && remarks[0].ends_with(message),
            "{remarks:?}"
        );
        for (pixel, (written, wanted_value)) in got.into_iter().zip(cases) {
            let mut expected = [0.5; 4];
            expected[channel] = wanted_value;
            assert_eq!(pixel, expected, "{written} in channel {channel}");
        }
    }
}

/// Protects: size is checked in the header, for every format; broken and unsupported data have
/// different errors.
#[test]
fn limits_and_faults() {
    let limits = Limits {
        image_pixels: 1,
        ..Limits::default()
    };
    let png = png(
        png::ColorType::Grayscale,
        png::BitDepth::Eight,
        None,
        &[9, 200],
    );
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n".to_vec();
    assert_eq!(decode(&png, &limits).unwrap_err().kind, ErrorKind::Limit);
    assert_eq!(
        decode(&hdr, &Limits::default()).unwrap_err().kind,
        ErrorKind::Limit
    );
    for end in 0..png.len() - 12 {
        assert_eq!(
            decode(&png[..end], &Limits::default()).unwrap_err().kind,
            ErrorKind::Input,
            "{end} bytes"
        );
    }
    for (bytes, word) in [
        (b"DDS ".as_slice(), "DDS"),
        (b"RIFF....WEBPVP8 ", "broken"),
        (b"hello", "not a picture"),
    ] {
        assert!(
            decode(bytes, &Limits::default())
                .unwrap_err()
                .message
                .contains(word)
        );
    }
}

/// Protects: formats are detected by signature, supported or not; a Radiance picture with the name
/// of any program.
#[test]
fn kinds_of_pictures_are_told() {
    let foreign = |bytes: &[u8]| match detect_format(bytes) {
        ImageKind::Foreign(name) => name,
        _ => "",
    };
    for (head, format) in [
        (b"\x89PNG\r\n\x1a\n".as_slice(), ImageFormat::Png),
        (b"\xff\xd8\xff\xe0", ImageFormat::Jpeg),
    ] {
        assert_eq!(detect_format(head), ImageKind::Codes(format));
    }
    assert!(
        matches!(detect_format(b"#?RADIANCE\n"), ImageKind::Hdr)
            && [
                b"#?RGBE\n".as_slice(),
                b"#?AutoPano 2\n",
                b"\xef\xbb\xbf#?x\n"
            ]
            .iter()
            .all(|head| detect_format(head) == ImageKind::Hdr)
    );
    assert!(
        matches!(detect_format(b"\x76\x2f\x31\x01"), ImageKind::Exr)
            && matches!(detect_format(b""), ImageKind::Unknown)
    );
    assert_eq!(
        detect_format(b"RIFF1234WEBPVP8"),
        ImageKind::Codes(ImageFormat::WebP)
    );
    assert!(matches!(
        detect_format(b"\xabKTX 20\xbb\r\n\x1a\n"),
        ImageKind::Ktx2
    ));
    assert_eq!(foreign(b"DDS "), "DDS");
    for (bytes, format) in [
        (b"GIF89a".as_slice(), ImageFormat::Gif),
        (b"BM6", ImageFormat::Bmp),
        (b"II*\0", ImageFormat::Tiff),
        (b"MM\0*", ImageFormat::Tiff),
    ] {
        assert_eq!(detect_format(bytes), ImageKind::Codes(format));
    }
}

/// Protects: the colours of a picture in each format without loss, and of both kinds of TGA; limits
/// hold in each, and half a file is an error, or as many rows as it has.
#[test]
fn older_formats_are_read() {
    let texels = [
        [255, 0, 0, 255],
        [0, 255, 0, 255],
        [0, 0, 255, 255],
        [9, 99, 199, 255],
    ];
    let picture = image::RgbaImage::from_raw(2, 2, texels.as_flattened().to_vec()).expect("pixels");
    let few = Limits {
        image_pixels: 3,
        ..Limits::default()
    };
    for format in [
        ImageFormat::Bmp,
        ImageFormat::Tga,
        ImageFormat::Gif,
        ImageFormat::Tiff,
    ] {
        let mut file = Cursor::new(Vec::new());
        picture.write_to(&mut file, format).expect("a file");
        let bytes = file.into_inner();
        assert_eq!(codes(&bytes), texels, "{format:?}");
        assert_eq!(
            decode(&bytes, &few).expect_err("too large").kind,
            ErrorKind::Limit
        );
        for end in 0..bytes.len() {
            let _ = decode(&bytes[..end], &Limits::default());
        }
    }
    // A palette of two colours, and grey, each from the bottom row upwards.
    let head = |kind: [u8; 3], colours: u8, depth: u8| {
        [
            &kind[..],
            &[
                0,
                0,
                colours,
                0,
                if colours > 0 { 24 } else { 0 },
                0,
                0,
                0,
                0,
                2,
                0,
                1,
                0,
                depth,
                0,
            ],
        ]
        .concat()
    };
    let mapped = [head([0, 1, 1], 2, 8), vec![255, 0, 0, 0, 0, 255, 1, 0]].concat();
    assert_eq!(codes(&mapped), [[255, 0, 0, 255], [0, 0, 255, 255]]);
    let grey = [head([0, 0, 3], 0, 8), vec![7, 200]].concat();
    assert_eq!(codes(&grey), [[7, 7, 7, 255], [200, 200, 200, 255]]);
    assert_eq!(
        detect_format(b"\0\0\x01\0\x01\0 icon of Windows"),
        ImageKind::Unknown
    );
}

/// Protects: a JPEG that ends early is read with a remark, wherever it ends after its header; bytes
/// after its end, and a whole picture in its header, are none.
#[test]
fn half_a_jpeg_is_told() {
    let picture = image::RgbImage::from_fn(200, 200, |x, y| {
        image::Rgb([x as u8, y as u8, (x * y) as u8])
    });
    let mut file = Cursor::new(Vec::new());
    picture
        .write_to(&mut file, ImageFormat::Jpeg)
        .expect("a file");
    let whole = file.into_inner();
    let remarks = |bytes: &[u8]| {
        decode(bytes, &Limits::default())
            .expect("a picture")
            .remarks
    };
    assert!(remarks(&whole).is_empty() && remarks(&[&whole[..], b"more"].concat()).is_empty());
    for end in [whole.len() / 2, whole.len() - 40, whole.len() - 2] {
        let half = &whole[..end];
        // An application's segment with an end marker, such as that of a thumbnail.
        let thumbnail = [&half[..2], &[0xff, 0xe1, 0, 4, 0xff, 0xd9], &half[2..]].concat();
        for bytes in [half, &thumbnail] {
            let found = remarks(bytes);
            assert!(
                found.len() == 1 && found[0].contains("without its end"),
                "{end}: {found:?}"
            );
        }
    }
}

/// Protects: EXR colours are converted from the primaries that the file states; colours of Rec. 709
/// keep their bits, colours outside are clipped, and unusable primaries are told.
#[test]
fn exr_primaries_are_heeded() {
    use raywright_core::picture::Picture;
    let pixels = [[0.25, 0.5, 0.75], [1.0, 0.0, 0.0]];
    let picture = Picture {
        rgb: pixels.to_vec(),
        ..Picture::new(2, 1)
    };
    let own = crate::output::encode_exr(&picture, &Default::default()).expect("a file");
    let name = b"chromaticities\0chromaticities\0";
    let start = own
        .windows(name.len())
        .position(|w| w == name)
        .expect("it states its own");
    let stating = |points: [f32; 8]| {
        let mut file = own.clone();
        let place = start + name.len() + 4;
        file[place..place + 32].copy_from_slice(&points.map(f32::to_le_bytes).concat());
        file
    };
    let read = |file: &[u8]| {
        let decoded = decode(file, &Limits::default()).expect("a picture");
        let PixelData::Linear(texels) = decoded.image.pixels else {
            panic!("linear")
        };
        (
            texels
                .iter()
                .map(|t| [t[0], t[1], t[2]])
                .collect::<Vec<_>>(),
            decoded.remarks,
        )
    };
    assert_eq!(read(&own), (pixels.to_vec(), Vec::new()));
    let (texels, remarks) = read(&stating([
        0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290,
    ]));
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-4);
    assert!(near(texels[0], [0.0667, 0.5291, 0.7842]), "{texels:?}");
    assert!(
        near(texels[1], [1.6605, 0.0, 0.0]) && remarks.is_empty(),
        "{texels:?}"
    );
    let (texels, remarks) = read(&stating([0.0; 8]));
    assert_eq!(texels, pixels);
    assert!(
        remarks.len() == 1 && remarks[0].contains("chromaticities"),
        "{remarks:?}"
    );
    // A comparison keeps what lies outside the gamut.
    let path = std::path::Path::new("a.exr");
    let file = stating([0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290]);
    let compared =
        crate::output::decode_picture(path, &file, &Limits::default()).expect("a picture");
    assert!(near(compared.picture.rgb[1], [1.6605, -0.1246, -0.0182]));
}

/// Protects: a picture reserves the memory of its decoded form before decoding: four bytes per
/// pixel of codes, sixteen of radiance. Exactly that budget is enough; one byte less is refused.
#[test]
fn pictures_claim_what_they_become() {
    let png = png(
        png::ColorType::Grayscale,
        png::BitDepth::Eight,
        None,
        &[9, 200],
    );
    let mut hdr = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut hdr)
        .encode(&[image::Rgb([0.5_f32; 3]); 2], 2, 1)
        .unwrap();
    for (bytes, needed) in [(png, 2 * 4), (hdr, 2 * 16)] {
        let claimed = |memory_bytes: u64| {
            let limits = Limits {
                memory_bytes,
                ..Limits::default()
            };
            reserve_picture_memory(&bytes, &limits, &mut DecodeBudget::new(&limits))
        };
        assert!(claimed(needed).is_ok(), "{needed}");
        assert_eq!(
            claimed(needed - 1).expect_err("a byte too few").kind,
            ErrorKind::Limit,
            "{needed}"
        );
    }
}

/// Encodes a Radiance picture without run-length encoding, after a header.
fn radiance(header: &str, pixels: &[[u8; 4]]) -> Vec<u8> {
    [header.as_bytes(), pixels.as_flattened()].concat()
}

/// Returns the red channel of each pixel, row by row.
fn reds(bytes: &[u8]) -> (u32, u32, Vec<f32>) {
    let image = decode(bytes, &Limits::default())
        .unwrap_or_else(|fault| panic!("{}", fault.message))
        .image;
    let PixelData::Linear(pixels) = image.pixels else {
        panic!("linear")
    };
    (
        image.width,
        image.height,
        pixels.iter().map(|pixel| pixel[0]).collect(),
    )
}

/// Protects: a Radiance picture is read with any program's signature, with comments, factors,
/// without a format line, with both kinds of line ends, and with the older run-length encoding;
/// broken headers are refused with their cause.
#[test]
fn radiance_headers_of_all_programs() {
    let one = [128, 64, 32, 129];
    for header in [
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
        "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
        "#?RGBE\n# a comment\nEXPOSURE= 2.5\nGAMMA=1\n\n-Y 1 +X 2\n",
        "#?AutoPano\r\n\r\n-Y 1 +X 2\r\n",
        "#?x\nVIEW= -vtv\n-Y 1 +X 2\n",
    ] {
        assert_eq!(
            reds(&radiance(header, &[one, one])),
            (2, 1, vec![1.0; 2]),
            "{header}"
        );
    }
    let runs = radiance("#?RGBE\n\n-Y 1 +X 6\n", &[one, [1, 1, 1, 5]]);
    assert_eq!(reds(&runs), (6, 1, vec![1.0; 6]));
    for (header, word) in [
        (
            "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n",
            "32-bit_rle_xyze",
        ),
        ("#?RADIANCE\n\n-Z 1 +X 1\n", "no line with the size"),
        ("#?RADIANCE\n\n-Y 1 -Y 1\n", "no line with the size"),
        ("#?RADIANCE", "no line with the size"),
        ("#?RADIANCE\n\n-Y 0 +X 9\n", "width or height is 0"),
        ("#?RADIANCE\n\n-Y 9 +X 9\n", "broken"),
    ] {
        let message = decode(&radiance(header, &[one]), &Limits::default())
            .expect_err(header)
            .message;
        assert!(message.contains(word), "{header}: {message}");
    }
}

/// Protects: all eight pixel orders of a Radiance picture give the same picture of three columns
/// and two rows.
#[test]
fn radiance_pixels_in_every_order() {
    let expected: Vec<f32> = (1..=6_u8).map(f32::from).collect();
    for (size, order) in [
        ("-Y 2 +X 3", [1, 2, 3, 4, 5, 6]),
        ("-Y 2 -X 3", [3, 2, 1, 6, 5, 4]),
        ("+Y 2 +X 3", [4, 5, 6, 1, 2, 3]),
        ("+Y 2 -X 3", [6, 5, 4, 3, 2, 1]),
        ("+X 3 -Y 2", [1, 4, 2, 5, 3, 6]),
        ("-X 3 -Y 2", [3, 6, 2, 5, 1, 4]),
        ("+X 3 +Y 2", [4, 1, 5, 2, 6, 3]),
        ("-X 3 +Y 2", [6, 3, 5, 2, 4, 1]),
    ] {
        let pixels = order.map(|value| [value, 0, 0, 136]);
        assert_eq!(
            reds(&radiance(&format!("#?RADIANCE\n\n{size}\n"), &pixels)),
            (3, 2, expected.clone()),
            "{size}"
        );
    }
}

/// Encodes an EXR file of parts, each with channels whose pixels count up from a number, and with
/// its windows given by position and size.
fn exr_parts(
    parts: &[(&str, &[(&str, f32)])],
    data: ([i32; 2], [usize; 2]),
    display: ([i32; 2], [usize; 2]),
) -> Vec<u8> {
    use exr::prelude::*;
    let count = data.1[0] * data.1[1];
    let layer = |(name, channels): &(&str, &[(&str, f32)])| {
        let channel = |&(name, first): &(&str, f32)| {
            AnyChannel::new(
                name,
                FlatSamples::F32((0..count).map(|i| first + i as f32).collect()),
            )
        };
        let attributes = LayerAttributes {
            layer_name: Some((*name).into()),
            layer_position: Vec2(data.0[0], data.0[1]),
            ..LayerAttributes::default()
        };
        let channels = AnyChannels::sort(channels.iter().map(channel).collect());
        Layer::new(
            (data.1[0], data.1[1]),
            attributes,
            Encoding::UNCOMPRESSED,
            channels,
        )
    };
    let window = IntegerBounds::new(
        Vec2(display.0[0], display.0[1]),
        Vec2(display.1[0], display.1[1]),
    );
    let mut file = Cursor::new(Vec::new());
    let layers: Layers<_> = parts.iter().map(layer).collect();
    Image::from_layers(ImageAttributes::new(window), layers)
        .write()
        .to_buffered(&mut file)
        .expect("a file");
    file.into_inner()
}

/// Protects: an EXR picture is read from luminance with or without alpha, and from the colours of a
/// layer; of several pictures the first is taken, one outside layers before any layer, with a
/// remark; channels without colours are listed in the error.
#[test]
fn exr_channels_by_any_name() {
    let whole = ([0; 2], [1, 1]);
    let value_of = |parts: &[(&str, &[(&str, f32)])]| {
        decode(&exr_parts(parts, whole, whole), &Limits::default())
    };
    const RGB: [(&str, f32); 3] = [("R", 1.0), ("G", 2.0), ("B", 3.0)];
    let layers = [
        ("a.B", 7.0),
        ("a.G", 6.0),
        ("a.R", 5.0),
        ("b.A", 0.5),
        ("b.B", 3.0),
        ("b.G", 2.0),
        ("b.R", 1.0),
    ];
    type ExrPart<'a> = (&'a str, &'a [(&'a str, f32)]);
    let cases: [(&[ExrPart<'_>], [f32; 4], &str); 8] = [
        (&[("", &[("Y", 2.0)])], [2.0, 2.0, 2.0, 1.0], ""),
        (&[("", &[("Y", 2.0), ("A", 0.5)])], [2.0, 2.0, 2.0, 0.5], ""),
        (
            &[("", &[("r", 1.0), ("g", 2.0), ("b", 3.0)])],
            [1.0, 2.0, 3.0, 1.0],
            "",
        ),
        (
            &[("", &layers[3..])],
            [1.0, 2.0, 3.0, 0.5],
            "in the layer `b`, which is used",
        ),
        (
            &[("", &layers)],
            [5.0, 6.0, 7.0, 1.0],
            "2 layers with pictures; the first, `a`, is used",
        ),
        (
            &[(
                "",
                &[
                    ("R", 1.0),
                    ("G", 2.0),
                    ("B", 3.0),
                    ("a.R", 5.0),
                    ("a.G", 5.0),
                    ("a.B", 5.0),
                ],
            )],
            [1.0, 2.0, 3.0, 1.0],
            "",
        ),
        (
            &[("depth", &[("Z", 9.0)]), ("beauty", &RGB)],
            [1.0, 2.0, 3.0, 1.0],
            "",
        ),
        (
            &[("first", &RGB), ("second", &[("Y", 9.0)])],
            [1.0, 2.0, 3.0, 1.0],
            "2 parts with pictures; the first `first`",
        ),
    ];
    for (parts, expected, words) in cases {
        let decoded =
            value_of(parts).unwrap_or_else(|fault| panic!("{parts:?}: {}", fault.message));
        assert_eq!(
            decoded.image.pixels,
            PixelData::Linear(vec![expected]),
            "{parts:?}"
        );
        let text = decoded.remarks.join("; ");
        assert!(
            if words.is_empty() {
                text.is_empty()
            } else {
                text.contains(words)
            },
            "{parts:?}: {text}"
        );
    }
    for channels in [
        &[("Y", 1.0), ("RY", 0.0), ("BY", 0.0)][..],
        &[("Z", 1.0)],
        &[("R", 1.0), ("G", 1.0)],
    ] {
        let message = value_of(&[("", channels)]).expect_err("no colours").message;
        assert!(
            message.contains("without supported colour channels")
                && message.contains(channels[0].0),
            "{message}"
        );
    }
}

/// Protects: an EXR picture is its display window: black without data, without the data outside,
/// wherever either window begins. Data entirely outside the window, and a display window beyond the
/// limits, are refused.
#[test]
fn exr_windows_are_heeded() {
    let value_of = |data, display| {
        decode(
            &exr_parts(&[("", &[("Y", 1.0)])], data, display),
            &Limits::default(),
        )
    };
    type ExrWindow = ([i32; 2], [usize; 2]);
    let cases: [(ExrWindow, ExrWindow, &[f32]); 6] = [
        (
            ([1, 0], [1, 2]),
            ([0, 0], [3, 2]),
            &[0.0, 1.0, 0.0, 0.0, 2.0, 0.0],
        ),
        (([0, 0], [2, 1]), ([0, 0], [2, 2]), &[1.0, 2.0, 0.0, 0.0]),
        (([0, 1], [2, 1]), ([0, 0], [2, 2]), &[0.0, 0.0, 1.0, 2.0]),
        (([-1, -1], [4, 3]), ([0, 0], [2, 1]), &[6.0, 7.0]),
        (([6, 5], [2, 2]), ([5, 5], [2, 2]), &[0.0, 1.0, 0.0, 3.0]),
        (([9, -7], [2, 2]), ([9, -7], [2, 2]), &[1.0, 2.0, 3.0, 4.0]),
    ];
    for (data, display, expected) in cases {
        let image = value_of(data, display)
            .unwrap_or_else(|fault| panic!("{}", fault.message))
            .image;
        let PixelData::Linear(pixels) = image.pixels else {
            panic!("linear")
        };
        assert_eq!([image.width as usize, image.height as usize], display.1);
        assert_eq!(
            pixels.iter().map(|pixel| pixel[1]).collect::<Vec<_>>(),
            expected,
            "{data:?} in {display:?}"
        );
        assert!(
            pixels
                .iter()
                .all(|pixel| (pixel[3] == 1.0) == (pixel[1] > 0.0)),
            "{pixels:?}"
        );
    }
    assert_eq!(
        value_of(([5, 5], [1, 1]), ([0, 0], [2, 2]))
            .expect_err("nothing")
            .kind,
        ErrorKind::Input
    );
    assert_eq!(
        value_of(([0, 0], [1, 1]), ([0, 0], [1 << 15, 1 << 15]))
            .expect_err("too large")
            .kind,
        ErrorKind::Limit
    );
}
