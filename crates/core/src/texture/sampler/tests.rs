//! Texels against an oracle in integers: selection by coordinate, interpolation, decoding of codes.

use std::sync::LazyLock;

use super::super::mipmap;
use super::*;
use crate::hash::splitmix64;

/// Width and height of the test image; neither a power of two nor equal.
const SIZE: [u32; 2] = [5, 2];

fn sampler<R: Real>(filter: TextureFilter, wrap: [WrapMode; 2]) -> TextureSampler<R> {
    TextureSampler {
        srgb: true,
        filter,
        wrap,
        transform: None,
        factor: R::Vec3::ONE,
    }
}

/// Texels that hold their own index.
fn numbered() -> ImageData {
    let pixels = (0..SIZE[0] * SIZE[1]).map(|i| [i as f32; 4]).collect();
    ImageData {
        width: SIZE[0],
        height: SIZE[1],
        pixels: PixelData::Linear(pixels),
    }
}

fn read<R: Real>(sampler: &TextureSampler<R>, u: R, v: R) -> f64 {
    static NUMBERED: LazyLock<ImageData> = LazyLock::new(numbered);
    sampler.sample_level(&NUMBERED, &TexelDecoder::new(), [u, v])[0].to_f64()
}

/// ⌊u·n⌋ without rounding: an f64 is an integer times a power of two.
fn whole_part(u: f64, n: u32) -> i64 {
    let bits = u.abs().to_bits();
    let exponent = (bits >> 52) as i32;
    let digits = i128::from(bits & ((1 << 52) - 1) | u64::from(exponent > 0) << 52);
    let product = digits * i128::from(n) * if u < 0.0 { -1 } else { 1 };
    match exponent.max(1) - 1075 {
        shift if shift >= 0 => (product << shift.min(60)) as i64,
        shift => (product >> (-shift).min(120)) as i64,
    }
}

/// Returns the texel of an integer coordinate, by counting.
fn wrapped(k: i64, n: u32, wrap: WrapMode) -> i64 {
    let n = i64::from(n);
    match wrap {
        WrapMode::Repeat => k.rem_euclid(n),
        WrapMode::MirroredRepeat if k.rem_euclid(2 * n) < n => k.rem_euclid(2 * n),
        WrapMode::MirroredRepeat => 2 * n - 1 - k.rem_euclid(2 * n),
        WrapMode::Clamp => k.clamp(0, n - 1),
    }
}

/// Returns the expected value along one axis for a coordinate: a texel, or the weighted mean of the
/// two neighbours.
fn expected(u: f64, n: u32, filter: TextureFilter, wrap: WrapMode) -> f64 {
    let texel = |k: i64| wrapped(k, n, wrap) as f64;
    match filter {
        TextureFilter::Nearest => texel(whole_part(u, n)),
        TextureFilter::Bilinear | TextureFilter::Mipmaps => {
            // In units of half a texel, the centre of each texel is a whole number.
            let left = (whole_part(u, 2 * n) - 1).div_euclid(2);
            let weight = (u * f64::from(n) - 0.5) - left as f64;
            texel(left) * (1.0 - weight) + texel(left + 1) * weight
        }
    }
}

/// A grid over six turns; seams and borders of texels from both sides; many tiles; numbers beyond
/// every f32 fraction.
fn coordinates() -> Vec<f64> {
    let grid = (0..=997).map(|i| 6.0 * f64::from(i) / 997.0 - 3.0);
    let tiles = (0..97).map(|i| 1e5 * (f64::from(i) + 0.37) / 97.0);
    let seams = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        2.0,
        -1e-9,
        1e-9,
        -1e-30,
        1.0 - 1e-7,
        1e8,
        -1e8,
        1e8 + 0.3125,
        1e12,
    ];
    let borders = [-0.2_f32, 0.2, 0.4, -0.6, 0.8, -1.4].map(f64::from);
    grid.chain(tiles).chain(seams).chain(borders).collect()
}

fn agrees<R: Real>(tolerance: f64) {
    const WRAPS: [WrapMode; 3] = [WrapMode::Repeat, WrapMode::MirroredRepeat, WrapMode::Clamp];
    for (filter, wrap) in [TextureFilter::Nearest, TextureFilter::Bilinear]
        .into_iter()
        .flat_map(|f| WRAPS.map(|w| (f, w)))
    {
        for u in coordinates() {
            // The stored number is read, and the oracle uses the same number.
            let (stored, middle) = (R::from_f64(u), R::from_f64(0.5));
            // Along u in the upper row, whose middle is 1/4; along v in the middle column.
            let along_u = read(
                &sampler::<R>(filter, [wrap, WrapMode::Clamp]),
                stored,
                R::from_f64(0.25),
            );
            let along_v = read(
                &sampler::<R>(filter, [WrapMode::Clamp, wrap]),
                middle,
                stored,
            );
            let columns = expected(stored.to_f64(), SIZE[0], filter, wrap);
            let rows = 2.0 + 5.0 * expected(stored.to_f64(), SIZE[1], filter, wrap);
            assert!(
                (along_u - columns).abs() <= tolerance,
                "{filter:?} {wrap:?} u = {u:e}: {along_u}, not {columns}"
            );
            assert!(
                (along_v - rows).abs() <= tolerance,
                "{filter:?} {wrap:?} v = {u:e}: {along_v}, not {rows}"
            );
        }
    }
}

/// Protects: the right texel for every wrap mode, filter, axis and precision, at seams, for
/// negative coordinates and many tiles.
#[test]
fn s19_texels_are_the_ones_that_counting_finds() {
    agrees::<f32>(3e-6);
    agrees::<f64>(1e-9);
}

/// Protects: a coordinate that is NaN or infinite reads some texel of the image.
#[test]
fn s19_any_coordinate_reads_a_texel() {
    for filter in [TextureFilter::Nearest, TextureFilter::Bilinear] {
        for wrap in [WrapMode::Repeat, WrapMode::MirroredRepeat, WrapMode::Clamp] {
            for u in [
                f32::NAN,
                f32::INFINITY,
                -f32::INFINITY,
                f32::MAX,
                f32::MIN,
                f32::MIN_POSITIVE,
                -f32::MIN_POSITIVE,
            ] {
                let single = sampler::<f32>(filter, [wrap; 2]);
                assert!(
                    (0.0..=9.0).contains(&read(&single, u, u)),
                    "{filter:?} {wrap:?} {u}"
                );
                let double = sampler::<f64>(filter, [wrap; 2]);
                let u = if u.is_finite() {
                    f64::from(u) * 1e250
                } else {
                    f64::from(u)
                };
                assert!(
                    (0.0..=9.0).contains(&read(&double, u, u)),
                    "{filter:?} {wrap:?} {u}"
                );
            }
        }
    }
}

/// Protects: a filtered repeating texture has no seam. Its values differ by five at most, so its
/// slope is below 25 a turn.
#[test]
fn s19_a_repeating_texture_is_continuous_at_its_seam() {
    let sampler = sampler::<f64>(TextureFilter::Bilinear, [WrapMode::Repeat; 2]);
    for seam in [-1.0, 0.0, 1.0, 2.0] {
        for step in [1e-3, 1e-6, 1e-9] {
            let (before, after) = (
                read(&sampler, seam - step, 0.25),
                read(&sampler, seam + step, 0.25),
            );
            assert!(
                (before - after).abs() <= 50.0 * step + 1e-12,
                "{before} and {after} at {seam} ± {step}"
            );
        }
    }
}

/// Protects: texels are decoded with the digits of the precision; for `reference`, all of f64.
#[test]
fn codes_are_decoded_in_the_precision_that_reads_them() {
    let curve = |c: f64| {
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    };
    let codes = TexelDecoder::new();
    for code in 0..=255_u8 {
        let image = ImageData {
            width: 1,
            height: 1,
            pixels: PixelData::Codes(vec![[code; 4]]),
        };
        let read = sampler::<f64>(TextureFilter::Nearest, [WrapMode::Repeat; 2]);
        let plain = TextureSampler {
            srgb: false,
            ..read
        };
        let share = f64::from(code) / 255.0;
        let [r, _, b, a] = read.sample_level(&image, &codes, [0.0; 2]);
        assert!((r - curve(share)).abs() < 1e-15 && r == b, "{code}: {r}");
        assert_eq!(
            ([a, plain.sample_level(&image, &codes, [0.0; 2])[1]]),
            [share; 2]
        );
    }
}

/// Protects: the selected level has texels as wide as the footprint, with interpolation between
/// levels. Small footprints read the image, large ones the mean of the last level, in every wrap
/// mode and for sizes that are not powers of two.
#[test]
fn footprints_choose_levels() {
    let image = numbered();
    let (levels, codes) = (mipmap::build_mipmaps(&image, false), TexelDecoder::new());
    assert_eq!(levels.len(), 2);
    for wrap in [WrapMode::Repeat, WrapMode::MirroredRepeat, WrapMode::Clamp] {
        let sampler = sampler::<f64>(TextureFilter::Mipmaps, [wrap; 2]);
        for (u, v) in [(0.1, 0.2), (0.83, 0.61), (-1.3, 2.4)] {
            let read = |image: &ImageData| sampler.sample_level(image, &codes, [u, v])[0];
            let (own, half, all) = (read(&image), read(&levels[0]), read(&levels[1]));
            assert!((all - 4.5).abs() < 1e-6);
            for (texels, expected) in [
                (0.0, own),
                (0.7, own),
                (1.0, own),
                (2.0_f64.powf(0.25), 0.75 * own + 0.25 * half),
                (2.0, half),
                (2.0_f64.powf(1.5), 0.5 * half + 0.5 * all),
                (4.0, all),
                (1e30, all),
                (f64::INFINITY, all),
                (f64::NAN, own),
            ] {
                // Edge, in texture coordinates, of a square that covers `texels` × `texels` texels
                // of the image of 5 by 2.
                let side = texels / f64::from(SIZE[0] * SIZE[1]).sqrt();
                let [found, ..] = sampler.sample(
                    &image,
                    &codes,
                    [u, v],
                    FilterFootprint {
                        levels: &levels,
                        side,
                    },
                );
                assert!(
                    (found - expected).abs() < 1e-6,
                    "{wrap:?} {texels} texels at {u} {v}: {found}, not {expected}"
                );
            }
        }
    }
    // Under a map that halves the image in both directions, the next level is read; mirrored as
    // well.
    let stretched = TextureSampler {
        transform: Some([[0.0, 2.0, 0.0], [2.0, 0.0, 0.0]]),
        ..sampler::<f64>(TextureFilter::Mipmaps, [WrapMode::Repeat; 2])
    };
    let side = 1.0 / f64::from(SIZE[0] * SIZE[1]).sqrt();
    let [found, ..] = stretched.sample(
        &image,
        &codes,
        [0.3, 0.1],
        FilterFootprint {
            levels: &levels,
            side,
        },
    );
    let [expected, ..] = stretched.sample_level(&levels[0], &codes, [0.2, 0.6]);
    assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
}

/// Protects: uses with equal footprints read the same texels, whatever their codes and factors;
/// other uses do not.
#[test]
fn equal_footprints_read_equal_texels() {
    let (image, codes) = (numbered(), TexelDecoder::new());
    let wraps = [WrapMode::Repeat, WrapMode::MirroredRepeat, WrapMode::Clamp];
    let filters = [TextureFilter::Nearest, TextureFilter::Bilinear];
    let transforms = [
        None,
        Some([[1.0, 0.0, 0.3], [0.0, 1.0, 0.0]]),
        Some([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    ];
    let mut uses = Vec::new();
    for filter in filters {
        for wrap in wraps
            .into_iter()
            .flat_map(|across| wraps.map(|down| [across, down]))
        {
            uses.extend(transforms.map(|transform| TextureSampler::<f64> {
                transform,
                ..sampler(filter, wrap)
            }));
        }
    }
    let points = [[0.13, 0.2], [0.83, 0.61], [-1.3, 2.4], [1.07, -0.2]];
    for (i, one) in uses.iter().enumerate() {
        for (k, other) in uses.iter().enumerate() {
            let darker = TextureSampler {
                srgb: false,
                factor: other.factor * 0.5,
                ..*other
            };
            assert_eq!(one.has_same_footprint(&darker), i == k, "{one:?} {other:?}");
            let equal = |uv: [f64; 2]| {
                darker.filter_texels(&image, &codes, &one.texel_footprint(&image, uv))
                    == darker.sample_level(&image, &codes, darker.transform_uv(uv))
            };
            assert!(i != k || points.into_iter().all(equal), "{one:?}");
        }
    }
}

/// Protects: two uses share a footprint only where they read the same texels: equal wrap modes in
/// both directions, equal map of coordinates, and the same number of texels, one or four. Colour
/// spaces and factors do not matter.
#[test]
fn equal_footprints() {
    let plain = sampler::<f64>(TextureFilter::Bilinear, [WrapMode::Repeat; 2]);
    let moved = Some([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]]);
    let others = [
        (
            TextureSampler {
                srgb: false,
                factor: <f64 as Real>::Vec3::ZERO,
                ..plain
            },
            true,
        ),
        (
            TextureSampler {
                filter: TextureFilter::Mipmaps,
                ..plain
            },
            true,
        ),
        (
            TextureSampler {
                filter: TextureFilter::Nearest,
                ..plain
            },
            false,
        ),
        (
            TextureSampler {
                wrap: [WrapMode::Clamp, WrapMode::Repeat],
                ..plain
            },
            false,
        ),
        (
            TextureSampler {
                wrap: [WrapMode::Repeat, WrapMode::MirroredRepeat],
                ..plain
            },
            false,
        ),
        (
            TextureSampler {
                transform: moved,
                ..plain
            },
            false,
        ),
    ];
    for (i, (other, equal)) in others.iter().enumerate() {
        assert_eq!(
            (
                plain.has_same_footprint(other),
                other.has_same_footprint(&plain)
            ),
            (*equal, *equal),
            "{i}"
        );
        assert!(other.has_same_footprint(other), "{i}");
        // Equal footprints are claimed only where they are equal everywhere about the image.
        for place in (-20..=30).map(|i| 0.1 * f64::from(i) + 0.013) {
            let found = [&plain, other].map(|use_of| {
                use_of
                    .texel_footprint(&numbered(), [place, 0.7 - place])
                    .corners(&numbered())
            });
            assert!(!equal || found[0] == found[1], "{i} at {place}");
        }
    }
}

/// Protects: opaque and black texels, which take fewer steps, are interpolated to the bits of the
/// same texels as linear numbers; also beside texels that are not opaque.
#[test]
fn opaque_texels_are_interpolated_as_all_others() {
    let decoder = TexelDecoder::<f32>::new();
    let code = |i: u64| {
        let bits = splitmix64(i);
        let [r, g, b, a] = (bits as u32).to_le_bytes();
        match i / 40 % 4 {
            0 => [r, g, b, a],
            1 => [0, 0, 0, 255],
            _ => [r, g, b, 255],
        }
    };
    let codes: Vec<[u8; 4]> = (0..320).map(code).collect();
    let image = |pixels| ImageData {
        width: 20,
        height: 16,
        pixels,
    };
    for srgb in [false, true] {
        let linear = codes.iter().map(|&code| decoder.decode(code, srgb));
        let images = [
            image(PixelData::Linear(linear.collect())),
            image(PixelData::Codes(codes.clone())),
        ];
        let sampler = TextureSampler::<f32> {
            srgb,
            ..sampler(TextureFilter::Bilinear, [WrapMode::Repeat; 2])
        };
        let mut black = 0;
        for i in 0..4000 {
            let number = |k: u64| (splitmix64(2 * i + k) >> 40) as f32 / (1 << 24) as f32;
            let found = images.each_ref().map(|image| {
                let place = sampler.texel_footprint(image, [number(0), number(1)]);
                sampler.sample_at_footprint(image, &decoder, &place)
            });
            assert_eq!(
                found[0].map(f32::to_bits),
                found[1].map(f32::to_bits),
                "{i}"
            );
            black += u32::from(found[1] == [0.0, 0.0, 0.0, 1.0]);
        }
        assert!((100..2000).contains(&black), "{black}");
    }
}
