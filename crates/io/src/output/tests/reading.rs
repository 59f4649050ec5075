//! Tests of files from other programs, and of malformed files.

use crate::output::read::decode_picture;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, FlatSamples, Image, LayerAttributes, LineOrder,
    SmallVec, Vec2, WritableImage, f16,
};
use raywright_core::picture::DataWindow;

use super::*;
use crate::image_file::tests::crc32;

/// Protects: 16-bit, grey, palette and alpha PNGs are read with their stored values.
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
        encoder
            .write_header()
            .unwrap()
            .write_image_data(data)
            .unwrap();
        decode(&bytes).unwrap().picture
    };
    use ::png::{BitDepth as B, ColorType as C};
    let sixteen = encode(C::Grayscale, B::Sixteen, &[0x80, 0x01, 0xff, 0xff], None);
    assert_eq!(sixteen.rgb, [[32769.0 / 65535.0; 3], [1.0; 3]]);
    let two_bit = encode(C::Grayscale, B::Two, &[0b0110_0000], None);
    assert_eq!(two_bit.rgb, [[85.0 / 255.0; 3], [170.0 / 255.0; 3]]);
    let grey = encode(C::GrayscaleAlpha, B::Eight, &[255, 51, 0, 255], None);
    assert_eq!(
        (grey.rgb, grey.alpha),
        (vec![[1.0; 3], [0.0; 3]], Some(vec![0.2, 1.0]))
    );
    let palette = encode(
        C::Indexed,
        B::Eight,
        &[1, 0],
        Some(vec![255, 0, 0, 0, 51, 255]),
    );
    assert_eq!(palette.rgb, [[0.0, 0.2, 1.0], [1.0, 0.0, 0.0]]);
}

/// An OpenEXR file of 40 × 35 pixels with a channel of each given kind.
fn exr_file(compression: Compression, blocks: Blocks, channels: &[(&str, FlatSamples)]) -> Vec<u8> {
    let encoding = ::exr::prelude::Encoding {
        compression,
        blocks,
        line_order: LineOrder::Increasing,
    };
    let channels: SmallVec<_> = channels
        .iter()
        .map(|(name, samples)| AnyChannel::new(*name, samples.clone()))
        .collect();
    let layer = ::exr::prelude::Layer::new(
        (40, 35),
        LayerAttributes::default(),
        encoding,
        AnyChannels::sort(channels),
    );
    let mut bytes = Vec::new();
    Image::from_layer(layer)
        .write()
        .to_buffered(std::io::Cursor::new(&mut bytes))
        .unwrap();
    bytes
}

fn halves() -> Vec<f16> {
    (0..1400_u16)
        .map(|i| f16::from_f32(f32::from(i) / 64.0))
        .collect()
}

/// Protects: half floats, integers, luminance alone, tiles and every lossless compression are read
/// back exactly.
#[test]
fn other_kinds_of_exr_are_read() {
    let tiles = Blocks::Tiles(Vec2(16, 16));
    let whole: Vec<u32> = (0..1400).collect();
    let channels = [
        ("Y", FlatSamples::F16(halves())),
        ("object.id", FlatSamples::U32(whole)),
    ];
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
    ] {
        for blocks in [Blocks::ScanLines, tiles] {
            let read = decode(&exr_file(compression, blocks, &channels)).unwrap();
            assert!(read.has_colour);
            assert_eq!(
                read.picture.rgb[1399],
                [1399.0 / 64.0; 3],
                "{compression:?} {blocks:?}"
            );
            assert_eq!(
                read.picture.layer("object.id").unwrap().samples[777],
                777.0,
                "{compression:?} {blocks:?}"
            );
            assert_eq!(read.picture.layers.len(), 1);
        }
    }
    let red = decode(&exr_file(
        Compression::RLE,
        tiles,
        &[("R", FlatSamples::F16(halves()))],
    ))
    .unwrap();
    assert_eq!(
        (red.has_colour, red.picture.rgb[64]),
        (true, [1.0, 0.0, 0.0])
    );
    let depth = decode(&exr_file(
        Compression::RLE,
        tiles,
        &[("Z", FlatSamples::F16(halves()))],
    ))
    .unwrap();
    assert_eq!((depth.has_colour, depth.picture.layers.len()), (false, 1));
}

/// Protects: pictures with DWA compression are read within its loss, as pictures and as
/// environments. A block that states huge sizes is refused before the decoder allocates them, and
/// no damaged byte aborts the process.
#[test]
fn dwa_compression_is_read() {
    let smooth: Vec<f16> = (0..1400_u16)
        .map(|i| f16::from_f32(1.0 + f32::from(i % 40) / 64.0 + f32::from(i / 40) / 32.0))
        .collect();
    let channels = ["B", "G", "R"].map(|name| (name, FlatSamples::F16(smooth.clone())));
    for compression in [Compression::DWAA(None), Compression::DWAB(None)] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 16))] {
            let file = exr_file(compression, blocks, &channels);
            let read = decode(&file).unwrap();
            for (pixel, expected) in read.picture.rgb.iter().zip(&smooth) {
                let expected = expected.to_f32();
                assert!((pixel[0] - expected).abs() < 0.02, "{pixel:?} {expected}");
            }
            assert!(crate::image_file::decode(&file, &Limits::default()).is_ok());
        }
    }
    let file = exr_file(Compression::DWAB(None), Blocks::ScanLines, &channels);
    // The block's version is followed by the count of values without a transform.
    let version = 2_u64.to_le_bytes();
    let block = file.windows(8).rposition(|bytes| bytes == version).unwrap();
    for counter in [1, 6, 7, 8, 9] {
        let mut file = file.clone();
        let place = block + 8 * counter;
        file[place..place + 8].copy_from_slice(&(1_u64 << 50).to_le_bytes());
        let error = decode(&file).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Input);
        assert!(error.to_string().contains("more values"), "{error}");
        assert!(crate::image_file::decode(&file, &Limits::default()).is_err());
    }
    for i in 0..600 {
        let mut file = file.clone();
        let place = block + i * 7919 % (file.len() - block);
        file[place] ^= 1 << (i % 8);
        let _ = decode(&file);
    }
}

/// Protects: the data window is read as the picture's window, wherever the display window begins
/// and even if data extends beyond it, and is written back equally; parts with different windows
/// are refused.
#[test]
fn windows_become_places() {
    let part = |name: &str, x: i32, y: i32| {
        let channels = smallvec_of(AnyChannel::new("Z", FlatSamples::F32(vec![0.5; 6])));
        let attributes = LayerAttributes {
            layer_position: Vec2(x, y),
            ..LayerAttributes::named(name)
        };
        ::exr::prelude::Layer::new(
            (3, 2),
            attributes,
            ::exr::prelude::Encoding::FAST_LOSSLESS,
            AnyChannels { list: channels },
        )
    };
    let file = |parts: Vec<[i32; 2]>, display: ([i32; 2], [usize; 2])| {
        let ([x, y], [width, height]) = display;
        let window = ::exr::meta::attribute::IntegerBounds::new((x, y), (width, height));
        let parts: SmallVec<[_; 2]> = parts
            .iter()
            .zip(["one", "two"])
            .map(|(&[x, y], name)| part(name, x, y))
            .collect();
        let mut bytes = Vec::new();
        let image = Image::from_layers(::exr::prelude::ImageAttributes::new(window), parts);
        image
            .write()
            .to_buffered(std::io::Cursor::new(&mut bytes))
            .unwrap();
        decode(&bytes)
    };
    let window = |place, display| file(vec![place], display).unwrap().picture.window;
    assert_eq!(window([0, 0], ([0, 0], [3, 2])), None);
    assert_eq!(window([7, -3], ([7, -3], [3, 2])), None);
    assert_eq!(
        window([4, 4], ([4, 4], [10, 9])),
        Some(DataWindow {
            origin: [0, 0],
            full: [10, 9]
        })
    );
    assert_eq!(
        window([5, 6], ([4, 4], [10, 9])),
        Some(DataWindow {
            origin: [1, 2],
            full: [10, 9]
        })
    );
    assert_eq!(
        window([-1, -2], ([0, 0], [1, 1])),
        Some(DataWindow {
            origin: [-1, -2],
            full: [1, 1]
        })
    );
    let error = file(vec![[0, 0], [0, 1]], ([0, 0], [3, 3]))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("parts at different positions, which are not supported"),
        "{error}"
    );
    let picture = Picture {
        window: Some(DataWindow {
            origin: [-4, 5],
            full: [20, 30],
        }),
        ..trouble()
    };
    assert_eq!(
        decode(&encode_exr(&picture, &metadata()).unwrap())
            .unwrap()
            .picture
            .window,
        picture.window
    );
}

/// Protects: parts of a file keep their names, and parts of different sizes are refused.
#[test]
fn parts_are_told_apart() {
    let part = |name: &str, width: usize| {
        let channels = smallvec_of(AnyChannel::new("Z", FlatSamples::F32(vec![0.5; width * 2])));
        let encoding = ::exr::prelude::Encoding::FAST_LOSSLESS;
        ::exr::prelude::Layer::new(
            (width, 2),
            LayerAttributes::named(name),
            encoding,
            AnyChannels { list: channels },
        )
    };
    let file = |width: usize| {
        let attributes = ::exr::prelude::ImageAttributes::with_size((3, 2));
        let parts: SmallVec<[_; 2]> = [part("near", 3), part("far", width)].into_iter().collect();
        let mut bytes = Vec::new();
        Image::from_layers(attributes, parts)
            .write()
            .to_buffered(std::io::Cursor::new(&mut bytes))
            .unwrap();
        decode(&bytes)
    };
    let names: Vec<String> = file(3)
        .unwrap()
        .picture
        .layers
        .into_iter()
        .map(|layer| layer.name)
        .collect();
    assert_eq!(names, ["far.Z", "near.Z"]);
    assert!(file(2).unwrap_err().to_string().contains("different sizes"));
}

fn smallvec_of<T>(value: T) -> SmallVec<[T; 4]> {
    std::iter::once(value).collect()
}

/// Protects: no truncation and no changed byte of a valid file makes the reader panic or allocate
/// beyond the limits.
#[test]
fn damaged_files_give_errors() {
    let mut picture = trouble();
    picture.alpha = Some(vec![0.5; 6]);
    let opaque = Picture {
        alpha: None,
        ..picture.clone()
    };
    let files = [
        encode_exr(&picture, &metadata()).unwrap(),
        encode_png(&picture, Display::PLAIN, &metadata()).unwrap(),
        encode_webp(&picture, Display::PLAIN, &metadata()).unwrap(),
        encode_jpeg(&opaque, 90, Display::PLAIN, &metadata()).unwrap(),
    ];
    for bytes in files {
        assert!(decode(&bytes).is_ok());
        for length in 0..bytes.len() - 1 {
            let _ = decode(&bytes[..length]);
        }
        for index in 0..bytes.len() {
            for value in [
                0,
                1,
                0x7f,
                0x80,
                0xff,
                bytes[index] ^ 1,
                bytes[index] ^ 0x10,
            ] {
                let mut damaged = bytes.clone();
                damaged[index] = value;
                let _ = decode(&damaged);
            }
        }
    }
    assert_eq!(decode(b"GIF89a").unwrap_err().kind(), ErrorKind::Input);
    assert_eq!(decode(b"").unwrap_err().kind(), ErrorKind::Input);
}

/// Protects: a small file that claims a large picture is refused before any allocation, and the
/// limits are exact.
#[test]
fn sizes_are_checked_before_memory_is_taken() {
    let bytes = encode_png(&trouble(), Display::PLAIN, &PictureMetadata::default()).unwrap();
    let mut claims = bytes.clone();
    claims[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    let crc = crc32(&claims[12..29]);
    claims[29..33].copy_from_slice(&crc.to_be_bytes());
    let error = decode(&claims).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Input);
    assert!(error.to_string().contains("16384 × 16384"), "{error}");
    for file in [
        bytes,
        encode_exr(&trouble(), &PictureMetadata::default()).unwrap(),
    ] {
        for limits in [
            Limits {
                image_pixels: 5,
                ..Limits::default()
            },
            Limits {
                memory_bytes: 71,
                ..Limits::default()
            },
        ] {
            assert_eq!(
                decode_picture(Path::new("x"), &file, &limits)
                    .unwrap_err()
                    .kind(),
                ErrorKind::Limit
            );
        }
        assert!(
            decode_picture(
                Path::new("x"),
                &file,
                &Limits {
                    image_pixels: 6,
                    memory_bytes: 72,
                    ..Limits::default()
                }
            )
            .is_ok()
        );
    }
}
