//! Pictures of every format beside what the crate `image` makes of them.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat};
use raywright_core::scene::Pixels;

use super::decode;
use crate::Limits;

const SIZE: [u32; 2] = [37, 23];

/// A picture of smooth and of rough parts, in numbers of 16 bits.
fn picture() -> DynamicImage {
    let pixel = |x: u32, y: u32| [x * 1700, y * 2800 + x, (x * y * 977) % 65_536, 65_535 - x * 1500].map(|sample| sample as u16);
    DynamicImage::from(image::ImageBuffer::from_fn(SIZE[0], SIZE[1], |x, y| image::Rgba(pixel(x, y))))
}

fn written(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    picture.write_to(&mut out, format).expect("a format that has these channels");
    out.into_inner()
}

/// Protects: PNG, JPEG and WebP of every number of channels, of 8 bits and of 16, give the codes that `image` gives, to the last.
#[test]
fn codes_are_those_of_image() {
    let (all, deep) = (picture(), [true, false]);
    let png = deep.into_iter().flat_map(|is_deep| {
        let kinds = match is_deep {
            true => [all.to_luma16().into(), all.to_luma_alpha16().into(), all.to_rgb16().into(), all.clone()],
            false => [all.to_luma8().into(), all.to_luma_alpha8().into(), all.to_rgb8().into(), all.to_rgba8().into()],
        };
        kinds.map(|picture: DynamicImage| written(&picture, ImageFormat::Png))
    });
    let jpeg = [all.to_luma8().into(), all.to_rgb8().into()].map(|picture| written(&picture, ImageFormat::Jpeg));
    let webp = [all.to_rgb8().into(), all.to_rgba8().into()].map(|picture| written(&picture, ImageFormat::WebP));
    for (i, file) in png.chain(jpeg).chain(webp).enumerate() {
        let found = decode(&file, &Limits::default()).unwrap_or_else(|fault| panic!("{i}: {}", fault.message)).image;
        let expected = image::load_from_memory(&file).expect("a picture").into_rgba8();
        let Pixels::Codes(codes) = found.pixels else { panic!("codes") };
        assert_eq!(([found.width, found.height], codes.as_flattened()), (SIZE, &expected.as_raw()[..]), "{i}");
        for length in (0..file.len()).step_by(7) {
            let of_us = decode(&file[..length], &Limits::default()).is_err();
            assert_eq!(of_us, image::load_from_memory(&file[..length]).is_err(), "{i}, {length} bytes");
        }
    }
}

/// Protects: Radiance pictures, whose scan lines `image` packs by runs, have its numbers, black and the faintest included.
#[test]
fn light_is_that_of_image() {
    let numbers = [0.0, 1e-38, 1e-30, 0.002, 0.5, 1.0, 700.0, 3e37];
    let pixels: Vec<_> = (0..40 * 9).map(|i: usize| image::Rgb([i / 3, i / 50, i % 7].map(|k| numbers[k % 8]))).collect();
    let mut file = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut file).encode(&pixels, 40, 9).expect("a picture");
    let found = decode(&file, &Limits::default()).unwrap_or_else(|fault| panic!("{}", fault.message)).image;
    let Pixels::Linear(light) = found.pixels else { panic!("light") };
    let expected = image::load_from_memory(&file).expect("a picture").into_rgb32f();
    let limited = |pixel: &image::Rgb<f32>| [pixel.0[0], pixel.0[1], pixel.0[2], 1.0].map(|number| number.min(1e30));
    assert_eq!(light, expected.pixels().map(limited).collect::<Vec<_>>());
}
