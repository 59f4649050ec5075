//! Mipmap levels against their meaning: the mean of the image, whatever its size.

use super::*;

fn image(width: u32, height: u32) -> ImageData {
    let value = |i: u32| {
        [i.wrapping_mul(2_654_435_761), i.wrapping_mul(40_503), i, 7]
            .map(|bits| (bits % 1009) as f32 / 1009.0)
    };
    ImageData {
        width,
        height,
        pixels: PixelData::Linear((0..width * height).map(value).collect()),
    }
}

fn means(image: &ImageData) -> [f64; 4] {
    let PixelData::Linear(pixels) = &image.pixels else {
        panic!("levels are linear")
    };
    let mut sum = [0.0; 4];
    pixels.iter().for_each(|pixel| {
        sum.iter_mut()
            .zip(pixel)
            .for_each(|(sum, value)| *sum += f64::from(*value))
    });
    sum.map(|sum| sum / pixels.len() as f64)
}

/// Protects: every level has the image's mean and half the size of the previous one, down to one
/// texel, and the estimated memory, for single texels, lines, powers of two and other sizes.
#[test]
fn levels_keep_the_mean() {
    for [width, height] in [
        [1, 1],
        [1, 9],
        [1000, 1],
        [2, 2],
        [64, 16],
        [3, 5],
        [37, 101],
        [255, 257],
    ] {
        let image = image(width, height);
        let levels = build_mipmaps(&image, false);
        let (mut size, mut bytes) = ([width, height], 0);
        for level in &levels {
            size = size.map(|n| (n / 2).max(1));
            assert_eq!([level.width, level.height], size);
            bytes += level.byte_size() as u64;
            for (own, whole) in means(level).into_iter().zip(means(&image)) {
                assert!(
                    (own - whole).abs() < 2e-6,
                    "{width} by {height} at {size:?}: {own}, not {whole}"
                );
            }
        }
        assert_eq!(
            (size, bytes),
            ([1, 1], mipmap_bytes(width, height)),
            "{width} by {height}"
        );
        assert_eq!(levels.is_empty(), width == 1 && height == 1);
    }
    assert_eq!(
        mipmap_bytes(u32::MAX, 1),
        16 * (0..32)
            .map(|level| u64::from(u32::MAX >> level))
            .skip(1)
            .sum::<u64>()
    );
}

/// Protects: five texels are divided into two by weights, and black and white average to half the
/// light, not half of the codes.
#[test]
fn texels_are_divided_and_light_is_averaged() {
    assert_eq!(
        texel_weights(5, 2),
        vec![(0, vec![0.4, 0.4, 0.2]), (2, vec![0.2, 0.4, 0.4])]
    );
    assert_eq!(texel_weights(3, 1), vec![(0, vec![1.0 / 3.0; 3])]);
    assert_eq!(texel_weights(1, 1), vec![(0, vec![1.0])]);
    let codes = ImageData {
        width: 2,
        height: 1,
        pixels: PixelData::Codes(vec![[0, 0, 0, 0], [255, 188, 255, 51]]),
    };
    let grey = |srgb: bool| build_mipmaps(&codes, srgb)[0].pixels.clone();
    let decoded = ((188.0_f64 / 255.0 + 0.055) / 1.055).powf(2.4);
    for (srgb, green) in [(true, 0.5 * decoded), (false, 94.0 / 255.0)] {
        let PixelData::Linear(pixels) = grey(srgb) else {
            panic!("levels are linear")
        };
        let [r, g, b, a] = pixels[0].map(f64::from);
        assert!(
            r == 0.5 && b == 0.5 && (g - green).abs() < 1e-7 && (a - 0.1).abs() < 1e-7,
            "{srgb}: {pixels:?}"
        );
    }
}

/// Protects: levels have the same bits on one thread and on several.
#[test]
fn levels_do_not_depend_on_threads() {
    let image = image(129, 67);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| build_mipmaps(&image, false))
    };
    assert_eq!(on(1), on(3));
}
