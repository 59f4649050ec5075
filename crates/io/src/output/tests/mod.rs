//! Tests of pictures written and read back; submodules test files of other programs, hostile files,
//! and the shared reference pictures.

mod reading;
mod reference;

use crate::output::read::decode_picture;
use std::path::PathBuf;

use raywright_core::display::OutputFormat;
use raywright_core::picture::{Encoding, PictureLayer};
use raywright_core::scene::{ToneMap, TransferCurve};

use super::*;
use crate::{ErrorKind, Limits};

fn metadata() -> PictureMetadata {
    PictureMetadata {
        software: "Raywright 0.1.0".into(),
        scene_hash: "00ff".into(),
        settings: "samples = 4, größe = 3×2".into(),
        seed: Some(7),
        command: "raywright render\0".into(),
        error: "root_relmse=0.05 samples=4".into(),
    }
}

/// A picture with extreme values: large, tiny, negative, subnormal.
fn trouble() -> Picture {
    let mut picture = Picture::new(3, 2);
    let values = [
        0.0,
        -0.0,
        1e-40,
        1e6,
        65504.0,
        65536.0,
        f32::MAX,
        f32::MIN_POSITIVE,
        -3.5,
        1.0 / 3.0,
    ];
    for (i, rgb) in picture.rgb.iter_mut().enumerate() {
        *rgb = [values[i], values[(i + 3) % 10], values[9 - i]];
    }
    picture
}

fn decode(bytes: &[u8]) -> Result<StoredPicture, Error> {
    decode_picture(Path::new("test"), bytes, &Limits::default())
}

/// Protects: F08: every finite number, coverage and any layer name survive the OpenEXR file bit for
/// bit, in one part.
#[test]
fn f08_exr_keeps_every_finite_number() {
    let mut picture = trouble();
    picture.alpha = Some(vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.0 / 3.0]);
    let long = "a_name_of_more_than_thirty_one_bytes.Z";
    for name in ["albedo.R", "depth.Z", "object.id", long] {
        let samples = (0..6_u8).map(|i| f32::from(i) * 1.1 - 1.0).collect();
        picture.layers.push(PictureLayer {
            name: name.into(),
            samples,
        });
    }
    picture.layers[1].samples[3] = f32::INFINITY;
    picture.layers.sort_by(|a, b| a.name.cmp(&b.name));
    let bytes = encode_exr(&picture, &metadata()).unwrap();
    let read = decode(&bytes).unwrap();
    assert_eq!(read.encoding, Encoding::Linear);
    assert!(read.has_colour);
    assert_eq!(read.picture, picture);
    assert_eq!(
        read.picture.rgb[0][0].to_bits(),
        picture.rgb[0][0].to_bits()
    );
    let headers = ::exr::prelude::MetaData::read_from_buffered(bytes.as_slice(), true)
        .unwrap()
        .headers;
    assert_eq!(headers.len(), 1, "parts");
    let space = headers[0].shared_attributes.chromaticities.unwrap();
    let primaries =
        [space.red, space.green, space.blue, space.white].map(|place| [place.0, place.1]);
    assert_eq!(
        primaries,
        [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]],
        "Rec. 709, D65"
    );
}

/// Protects: F08: an infinite colour becomes the largest number of its sign, a NaN stays one.
#[test]
fn f08_exr_has_no_infinite_colour() {
    let mut picture = Picture::new(2, 1);
    picture.rgb[0] = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    let read = decode(&encode_exr(&picture, &PictureMetadata::default()).unwrap()).unwrap();
    assert_eq!(read.picture.rgb[0][..2], [f32::MAX, f32::MIN]);
    assert!(read.picture.rgb[0][2].is_nan());
}

/// Protects: the same picture gives the same file, without the order of a hash table, the time or a
/// random number in it.
#[test]
fn files_are_reproducible() {
    let picture = trouble();
    let first = encode_exr(&picture, &metadata()).unwrap();
    // Each hash table has a random order; eight equal orders have a probability of one in 120⁷.
    for _ in 0..8 {
        assert!(encode_exr(&picture, &metadata()).unwrap() == first);
    }
    let png = || encode_png(&picture, Display::PLAIN, &metadata()).unwrap();
    assert!(png() == png());
}

/// Protects: both formats record the picture's origin, in any language, and omit unknown entries.
#[test]
fn metadata_are_kept() {
    let picture = trouble();
    let png = decode(&encode_png(&picture, Display::PLAIN, &metadata()).unwrap())
        .unwrap()
        .texts;
    let exr = decode(&encode_exr(&picture, &metadata()).unwrap())
        .unwrap()
        .texts;
    for (png_name, exr_name, text) in metadata().entries() {
        assert_eq!(png.get(png_name), Some(&text), "{png_name}");
        assert_eq!(exr.get(exr_name), Some(&text), "{exr_name}");
    }
    assert_eq!(png.len(), 6);
    assert_eq!(
        png["Raywright command"], "raywright render\u{fffd}",
        "no NUL gets into a text"
    );
    let bare = PictureMetadata {
        seed: Some(0),
        ..PictureMetadata::default()
    };
    assert_eq!(
        decode(&encode_png(&picture, Display::PLAIN, &bare).unwrap())
            .unwrap()
            .texts
            .len(),
        1
    );
}

/// Protects: a PNG has exactly the display's codes, straight alpha included, and declares their
/// curve.
#[test]
fn png_holds_the_codes_of_the_display() {
    let mut picture = trouble();
    for alpha in [None, Some(vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.0])] {
        picture.alpha = alpha;
        for (curve, gamma, srgb) in [
            (TransferCurve::Srgb, 45455, true),
            (TransferCurve::Gamma22, 45455, false),
            (TransferCurve::None, 100_000, false),
        ] {
            let display = Display {
                tone_map: ToneMap::Aces,
                curve,
                exposure_stops: -0.5,
                ..Display::PLAIN
            };
            let bytes = encode_png(&picture, display, &metadata()).unwrap();
            let decoder = ::png::Decoder::new(std::io::Cursor::new(&bytes));
            let reader = decoder.read_info().unwrap();
            assert_eq!(reader.info().srgb.is_some(), srgb, "{curve:?}");
            assert_eq!(
                reader.info().gama_chunk.map(|g| g.into_scaled()),
                Some(gamma),
                "{curve:?}"
            );
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

/// Protects: a WebP has exactly the display's codes, straight alpha included, and a JPEG of the
/// best quality nearly so; both record their origin, and have 8 bits even if more are requested.
#[test]
fn pages_show_the_codes_of_the_display() {
    let codes = |read: &StoredPicture| -> Vec<u8> {
        let alpha = |i: usize| read.picture.alpha.as_ref().map(|alpha| alpha[i]);
        let values = read
            .picture
            .rgb
            .iter()
            .enumerate()
            .flat_map(|(i, rgb)| rgb.iter().copied().chain(alpha(i)));
        values.map(|value| (value * 255.0).round() as u8).collect()
    };
    let other_metadata = decode(&encode_png(&trouble(), Display::PLAIN, &metadata()).unwrap())
        .unwrap()
        .metadata();
    let display = Display {
        tone_map: ToneMap::Aces,
        exposure_stops: -0.5,
        output: OutputFormat::Sixteen,
        ..Display::PLAIN
    };
    let eight = Display {
        output: OutputFormat::Eight,
        ..display
    };
    for alpha in [None, Some(vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.0])] {
        let picture = Picture { alpha, ..trouble() };
        let read = decode(&encode_webp(&picture, display, &metadata()).unwrap()).unwrap();
        assert_eq!(
            (read.format_name, codes(&read)),
            ("WebP", eight.to_codes(&picture))
        );
        assert_eq!(read.metadata(), other_metadata);
    }
    let ramp = |x: u32| [x as f32 / 64.0, 0.25, 1.0 - x as f32 / 64.0];
    let picture = Picture {
        rgb: (0..64 * 64).map(|i| ramp(i % 64)).collect(),
        ..Picture::new(64, 64)
    };
    let jpeg = |quality: u8| encode_jpeg(&picture, quality, Display::PLAIN, &metadata()).unwrap();
    let read = decode(&jpeg(100)).unwrap();
    let farthest = codes(&read)
        .iter()
        .zip(Display::PLAIN.to_codes(&picture))
        .map(|(&a, b)| a.abs_diff(b))
        .max();
    assert!(
        farthest <= Some(4) && read.format_name == "JPEG" && read.metadata() == other_metadata,
        "{farthest:?} codes"
    );
    assert!(jpeg(30).len() < jpeg(100).len());
    let clear = Picture {
        alpha: Some(vec![1.0; 64 * 64]),
        ..picture.clone()
    };
    assert!(encode_jpeg(&clear, 90, Display::PLAIN, &metadata()).is_err());
}

/// Protects: a file is written in the format of its name, under its final name only, and a missing
/// folder is reported beforehand.
#[test]
fn pictures_are_written_by_name() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "b.EXR", "c.jpg", "d.WebP"] {
        let path = folder.path().join(name);
        OutputPath::resolve(&path).unwrap();
        write_picture(&path, &trouble(), Display::PLAIN, &metadata()).unwrap();
        assert_eq!(
            read_picture(&path, &Limits::default())
                .unwrap()
                .picture
                .width,
            3
        );
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    for name in ["a.tif", "a"] {
        assert_eq!(
            PictureFormat::from_path(Path::new(name))
                .unwrap_err()
                .kind(),
            ErrorKind::Usage,
            "{name}"
        );
    }
    let kind = |path: PathBuf| OutputPath::resolve(&path).unwrap_err().kind();
    assert_eq!(kind(folder.path().join("missing/a.png")), ErrorKind::File);
    assert_eq!(kind(folder.path().join("a.png/b.png")), ErrorKind::File);
    std::fs::create_dir(folder.path().join("c.png")).unwrap();
    assert_eq!(kind(folder.path().join("c.png")), ErrorKind::File);
    assert!(OutputPath::resolve(Path::new("no_folder_in_the_name.png")).is_ok());
}

/// Protects: a picture under a default name replaces only a picture of this program, and gets
/// another name beside any other file; a name reported as not free is left unchanged.
#[test]
fn unnamed_pictures_make_way() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let put = |name: &str, width| {
        let picture = Picture::new(width, 1);
        write_new_picture(&at(name), &picture, Display::PLAIN, &metadata(), |path| {
            path != at("b-2.png")
        })
        .unwrap()
    };
    let width = |name: &str| {
        read_picture(&at(name), &Limits::default())
            .unwrap()
            .picture
            .width
    };
    assert_eq!(put("a.png", 1), at("a.png"));
    assert_eq!(put("a.png", 2), at("a.png"));
    assert_eq!(width("a.png"), 2);
    std::fs::write(at("b.png"), "mine").unwrap();
    assert_eq!(put("b.png", 3), at("b-3.png"));
    assert_eq!(
        (
            std::fs::read(at("b.png")).unwrap(),
            at("b-2.png").exists(),
            width("b-3.png")
        ),
        (b"mine".to_vec(), false, 3)
    );
}

/// Protects: an interrupted render gets a name beside the final one, with the same extension.
#[test]
fn partial_names_keep_folder_and_ending() {
    assert_eq!(
        partial_picture_path(Path::new("out/a.b.png")),
        Path::new("out/a.b.partial.png")
    );
    assert_eq!(partial_picture_path(Path::new("a")), Path::new("a.partial"));
    // The longest names stay within the limit of file systems, in whole characters.
    let long = partial_picture_path(Path::new(&("é".repeat(125) + ".png")));
    assert_eq!(long, Path::new(&("é".repeat(121) + ".partial.png")));
}

/// Protects: inconsistent pictures are refused instead of written wrongly.
#[test]
fn impossible_pictures_are_refused() {
    for picture in [
        Picture::new(0, 4),
        Picture {
            rgb: Vec::new(),
            ..Picture::new(2, 2)
        },
    ] {
        assert!(encode_png(&picture, Display::PLAIN, &PictureMetadata::default()).is_err());
        assert!(encode_exr(&picture, &PictureMetadata::default()).is_err());
    }
    let mut twice = Picture::new(1, 1);
    twice.layers = vec![
        PictureLayer {
            name: "x".into(),
            samples: vec![0.0]
        };
        2
    ];
    assert!(encode_exr(&twice, &PictureMetadata::default()).is_err());
}
