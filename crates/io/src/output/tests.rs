//! Pictures written and read back, hostile files, and the real reference pictures.

use std::path::PathBuf;

use raywright_core::picture::{Encoding, Layer};
use raywright_core::scene::{ToneMap, TransferCurve};

use super::*;
use crate::{ErrorKind, Limits};

fn metadata() -> Metadata {
    Metadata {
        software: "Raywright 0.1.0".into(),
        scene_hash: "00ff".into(),
        settings: "samples = 4, größe = 3×2".into(),
        seed: Some(7),
        command: "raywright render\0".into(),
    }
}

/// A picture with values of every kind of trouble: large, tiny, negative, subnormal.
fn trouble() -> Picture {
    let mut picture = Picture::new(3, 2);
    let values = [0.0, -0.0, 1e-40, 1e6, 65504.0, 65536.0, f32::MAX, f32::MIN_POSITIVE, -3.5, 1.0 / 3.0];
    for (i, rgb) in picture.rgb.iter_mut().enumerate() {
        *rgb = [values[i], values[(i + 3) % 10], values[9 - i]];
    }
    picture
}

fn decode(bytes: &[u8]) -> Result<StoredPicture, Error> {
    decode_picture(Path::new("test"), bytes, &Limits::default())
}

/// F08: every finite number, coverage and any layer name survive the OpenEXR file bit for bit, in one part.
#[test]
fn f08_exr_keeps_every_finite_number() {
    let mut picture = trouble();
    picture.alpha = Some(vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.0 / 3.0]);
    let long = "a_name_of_more_than_thirty_one_bytes.Z";
    for name in ["albedo.R", "depth.Z", "object.id", long] {
        let samples = (0..6_u8).map(|i| f32::from(i) * 1.1 - 1.0).collect();
        picture.layers.push(Layer { name: name.into(), samples });
    }
    picture.layers[1].samples[3] = f32::INFINITY;
    picture.layers.sort_by(|a, b| a.name.cmp(&b.name));
    let bytes = exr_bytes(&picture, &metadata()).unwrap();
    let read = decode(&bytes).unwrap();
    assert_eq!(read.encoding, Encoding::Linear);
    assert!(read.has_colour);
    assert_eq!(read.picture, picture);
    assert_eq!(read.picture.rgb[0][0].to_bits(), picture.rgb[0][0].to_bits());
    let headers = ::exr::prelude::MetaData::read_from_buffered(bytes.as_slice(), true).unwrap().headers;
    assert_eq!(headers.len(), 1, "parts");
}

/// F08: an infinite colour becomes the largest number of its sign, a NaN stays one.
#[test]
fn f08_exr_has_no_infinite_colour() {
    let mut picture = Picture::new(2, 1);
    picture.rgb[0] = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    let read = decode(&exr_bytes(&picture, &Metadata::default()).unwrap()).unwrap();
    assert_eq!(read.picture.rgb[0][..2], [f32::MAX, f32::MIN]);
    assert!(read.picture.rgb[0][2].is_nan());
}

/// The same picture gives the same file: no hash table's order, time or random number gets in.
#[test]
fn files_are_reproducible() {
    let picture = trouble();
    let first = exr_bytes(&picture, &metadata()).unwrap();
    // Each table has its own random order; eight all in the same order would be chance one in 120⁷.
    for _ in 0..8 {
        assert!(exr_bytes(&picture, &metadata()).unwrap() == first);
    }
    let png = || png_bytes(&picture, Display::PLAIN, &metadata()).unwrap();
    assert!(png() == png());
}

/// Both formats say where the picture comes from, in any language, and leave out what is not known.
#[test]
fn metadata_are_kept() {
    let picture = trouble();
    let png = decode(&png_bytes(&picture, Display::PLAIN, &metadata()).unwrap()).unwrap().texts;
    let exr = decode(&exr_bytes(&picture, &metadata()).unwrap()).unwrap().texts;
    for (png_name, exr_name, text) in metadata().entries() {
        assert_eq!(png.get(png_name), Some(&text), "{png_name}");
        assert_eq!(exr.get(exr_name), Some(&text), "{exr_name}");
    }
    assert_eq!(png.len(), 5);
    let bare = Metadata { seed: Some(0), ..Metadata::default() };
    assert_eq!(decode(&png_bytes(&picture, Display::PLAIN, &bare).unwrap()).unwrap().texts.len(), 1);
}

/// A PNG holds exactly the codes of the display, straight coverage included, and declares the curve that made them.
#[test]
fn png_holds_the_codes_of_the_display() {
    let mut picture = trouble();
    for alpha in [None, Some(vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.0])] {
        picture.alpha = alpha;
        for (curve, gamma, srgb) in
            [(TransferCurve::Srgb, 45455, true), (TransferCurve::Gamma22, 45455, false), (TransferCurve::None, 100_000, false)]
        {
            let display = Display { tone_map: ToneMap::Aces, curve, exposure_stops: -0.5 };
            let bytes = png_bytes(&picture, display, &metadata()).unwrap();
            let decoder = ::png::Decoder::new(std::io::Cursor::new(&bytes));
            let reader = decoder.read_info().unwrap();
            assert_eq!(reader.info().srgb.is_some(), srgb, "{curve:?}");
            assert_eq!(reader.info().gama_chunk.map(|g| g.into_scaled()), Some(gamma), "{curve:?}");
            let read = decode(&bytes).unwrap();
            assert_eq!(read.encoding, Encoding::Display);
            let mut values: Vec<f32> = Vec::new();
            for (i, rgb) in read.picture.rgb.iter().enumerate() {
                values.extend(rgb);
                values.extend(read.picture.alpha.as_ref().map(|alpha| alpha[i]));
            }
            let codes: Vec<u8> = values.iter().map(|v| (v * 255.0).round() as u8).collect();
            assert_eq!(codes, display.to_codes(&picture), "{curve:?}");
        }
    }
}

/// 16-bit, grey, palette and coverage PNGs are read to the values they store.
#[test]
fn other_kinds_of_png_are_read() {
    let encode = |colour, depth, data: &[u8], palette: Option<Vec<u8>>| {
        let mut bytes = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if let Some(palette) = palette {
            encoder.set_palette(palette);
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        decode(&bytes).unwrap().picture
    };
    use ::png::{BitDepth as B, ColorType as C};
    let sixteen = encode(C::Grayscale, B::Sixteen, &[0x80, 0x01, 0xff, 0xff], None);
    assert_eq!(sixteen.rgb, [[32769.0 / 65535.0; 3], [1.0; 3]]);
    let two_bit = encode(C::Grayscale, B::Two, &[0b0110_0000], None);
    assert_eq!(two_bit.rgb, [[85.0 / 255.0; 3], [170.0 / 255.0; 3]]);
    let grey = encode(C::GrayscaleAlpha, B::Eight, &[255, 51, 0, 255], None);
    assert_eq!((grey.rgb, grey.alpha), (vec![[1.0; 3], [0.0; 3]], Some(vec![0.2, 1.0])));
    let palette = encode(C::Indexed, B::Eight, &[1, 0], Some(vec![255, 0, 0, 0, 51, 255]));
    assert_eq!(palette.rgb, [[0.0, 0.2, 1.0], [1.0, 0.0, 0.0]]);
}

/// Writing through the file system: format by name, the final name only, and a folder that is not there said beforehand.
#[test]
fn pictures_are_written_by_name() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "b.EXR"] {
        let path = folder.path().join(name);
        check_target(&path).unwrap();
        write_picture(&path, &trouble(), Display::PLAIN, &metadata()).unwrap();
        assert_eq!(read_picture(&path, &Limits::default()).unwrap().picture.width, 3);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    let kind = |path: PathBuf| check_target(&path).unwrap_err().kind();
    assert_eq!(kind(folder.path().join("a.jpg")), ErrorKind::Usage);
    assert_eq!(kind(folder.path().join("a")), ErrorKind::Usage);
    assert_eq!(kind(folder.path().join("missing/a.png")), ErrorKind::File);
    assert_eq!(kind(folder.path().join("a.png/b.png")), ErrorKind::File);
    std::fs::create_dir(folder.path().join("c.png")).unwrap();
    assert_eq!(kind(folder.path().join("c.png")), ErrorKind::File);
    assert!(check_target(Path::new("no_folder_in_the_name.png")).is_ok());
}

/// An interrupted render goes beside the final name, with the format's ending kept.
#[test]
fn partial_names_keep_folder_and_ending() {
    assert_eq!(partial_name(Path::new("out/a.b.png")), Path::new("out/a.b.partial.png"));
    assert_eq!(partial_name(Path::new("a")), Path::new("a.partial"));
}

/// Pictures that cannot be a file are refused, not written wrongly.
#[test]
fn impossible_pictures_are_refused() {
    for picture in [Picture::new(0, 4), Picture { rgb: Vec::new(), ..Picture::new(2, 2) }] {
        assert!(png_bytes(&picture, Display::PLAIN, &Metadata::default()).is_err());
        assert!(exr_bytes(&picture, &Metadata::default()).is_err());
    }
    let mut twice = Picture::new(1, 1);
    twice.layers = vec![Layer { name: "x".into(), samples: vec![0.0] }; 2];
    assert!(exr_bytes(&twice, &Metadata::default()).is_err());
}

/// No truncation and no changed byte of a valid file makes the reader panic or take memory unasked.
#[test]
fn damaged_files_give_errors() {
    let mut picture = trouble();
    picture.alpha = Some(vec![0.5; 6]);
    let files = [exr_bytes(&picture, &metadata()).unwrap(), png_bytes(&picture, Display::PLAIN, &metadata()).unwrap()];
    for bytes in files {
        assert!(decode(&bytes).is_ok());
        for length in 0..bytes.len() - 1 {
            let _ = decode(&bytes[..length]);
        }
        for place in 0..bytes.len() {
            for value in [0, 1, 0x7f, 0x80, 0xff, bytes[place] ^ 1, bytes[place] ^ 0x10] {
                let mut damaged = bytes.clone();
                damaged[place] = value;
                let _ = decode(&damaged);
            }
        }
    }
    assert_eq!(decode(b"GIF89a").unwrap_err().kind(), ErrorKind::Input);
    assert_eq!(decode(b"").unwrap_err().kind(), ErrorKind::Input);
}

/// A small file that claims a large picture is refused before memory is taken, and limits are limits.
#[test]
fn sizes_are_checked_before_memory_is_taken() {
    let bytes = png_bytes(&trouble(), Display::PLAIN, &Metadata::default()).unwrap();
    let mut claims = bytes.clone();
    claims[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    let crc = crc32(&claims[12..29]);
    claims[29..33].copy_from_slice(&crc.to_be_bytes());
    let error = decode(&claims).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Input);
    assert!(error.to_string().contains("16384 × 16384"), "{error}");
    for file in [bytes, exr_bytes(&trouble(), &Metadata::default()).unwrap()] {
        for limits in [Limits { image_pixels: 5, ..Limits::default() }, Limits { memory_bytes: 71, ..Limits::default() }] {
            assert_eq!(decode_picture(Path::new("x"), &file, &limits).unwrap_err().kind(), ErrorKind::Limit);
        }
        assert!(
            decode_picture(Path::new("x"), &file, &Limits { image_pixels: 6, memory_bytes: 72, ..Limits::default() }).is_ok()
        );
    }
}

/// The checksum of a PNG chunk, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

/// A folder of the shared reference pictures; none, and a line that says so, where they are not at hand.
fn reference(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    #[expect(clippy::print_stderr, reason = "a skipped test says so")]
    {
        eprintln!("skipped: shared data not found ({})", folder.display());
    }
    None
}

/// The documented shader's own display picture comes out of its linear one, code for code; what is left are values on the
/// border of two codes, which its single-precision power moved.
#[test]
fn reference_display_pictures_are_reproduced() {
    let Some(folder) = reference("whitted") else { return };
    let display = Display { tone_map: ToneMap::Aces, curve: TransferCurve::Gamma22, exposure_stops: 0.0 };
    for (linear, shown) in [
        ("t0_640x360/linear.exr", "t0_640x360/final.png"),
        ("t2p5_640x360/linear.exr", "t2p5_640x360/final.png"),
        ("t12_256x256/linear.exr", "t12_256x256/final.png"),
        ("bounces_t2p5_320x180/linear_b4.exr", "bounces_t2p5_320x180/final_b4.png"),
    ] {
        let linear = read_picture(&folder.join(linear), &Limits::default()).unwrap().picture;
        let expected = Display { curve: TransferCurve::None, ..Display::PLAIN }
            .to_codes(&read_picture(&folder.join(shown), &Limits::default()).unwrap().picture);
        let codes = display.to_codes(&linear);
        let different: Vec<usize> = (0..codes.len()).filter(|&i| codes[i] != expected[i]).collect();
        assert!(different.len() * 10_000 <= codes.len(), "{shown}: {} of {}", different.len(), codes.len());
        for i in different {
            let step = 255.0 * exact_display_value(linear.rgb[i / 3][i % 3]);
            assert!((step.fract() - 0.5).abs() < 2e-4, "{shown}: code {} of {step} is no rounding matter", codes[i]);
        }
    }
}

/// The reference's display transform, with the platform's own power.
fn exact_display_value(x: f32) -> f64 {
    let x = f64::from(x);
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0).powf(1.0 / 2.2)
}

/// Every reference picture can be read, its colour or its named channels included.
#[test]
fn every_reference_picture_is_read() {
    let Some(root) = reference("") else { return };
    let (mut folders, mut exr, mut png) = (vec![root], 0, 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let Ok(format) = Format::of(&path) else { continue };
            let read = read_picture(&path, &Limits::default()).unwrap_or_else(|error| panic!("{error}"));
            let aov = path.file_stem().is_some_and(|stem| stem == "aov");
            assert_eq!(read.has_colour, !aov, "{}", path.display());
            assert_eq!(aov, !read.picture.layers.is_empty(), "{}", path.display());
            if format == Format::Exr { exr += 1 } else { png += 1 }
        }
    }
    assert!(exr >= 40 && png >= 20, "{exr} {png}");
    let aov = read_picture(&reference("whitted/t0_640x360").unwrap().join("aov.exr"), &Limits::default()).unwrap().picture;
    let names: Vec<&str> = aov.layers.iter().map(|layer| layer.name.as_str()).collect();
    assert_eq!(names, ["material", "normal.X", "normal.Y", "normal.Z", "object", "t"]);
    // The camera looks at the middle of the scene from 6.5 away and 2.8 above; the sky is at the top.
    let distance = aov.layer("t").unwrap();
    assert_eq!(distance.samples[0], -1.0);
    assert!((1.0..8.0).contains(&distance.samples[180 * 640 + 320]));
}
