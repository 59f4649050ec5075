//! Tests of KTX2 decoding.

use super::*;
use crate::error_kind::ErrorKind;

/// Encodes a UASTC block of a single colour: mode 8, then eight bits a channel.
fn block(colour: [u8; 4]) -> [u8; 16] {
    (u128::from(u32::from_le_bytes(colour)) << 5 | 0x17).to_le_bytes()
}

/// Encodes bytes as a Zstandard frame: a single segment with its size in four bytes, and one
/// last raw block (RFC 8878, section 3.1.1).
fn frame(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u32).to_le_bytes();
    let header = ((data.len() as u32) << 3 | 1).to_le_bytes();
    [
        b"\x28\xb5\x2f\xfd\xa0".as_slice(),
        &length,
        &header[..3],
        data,
    ]
    .concat()
}

/// Encodes a file with one level, in this `VkFormat` and with this colour model in its
/// descriptor, raw or with Zstandard.
fn file(
    [width, height]: [u32; 2],
    format: u32,
    model: u8,
    data: &[u8],
    zstandard: bool,
) -> Vec<u8> {
    let level = if zstandard {
        frame(data)
    } else {
        data.to_vec()
    };
    let mut out = SIGNATURE.to_vec();
    let scheme = if zstandard { ZSTANDARD } else { 0 };
    out.extend(
        [format, 1, width, height, 0, 0, 1, 1, scheme, 104, 44, 0, 0]
            .into_iter()
            .flat_map(u32::to_le_bytes),
    );
    out.extend(
        [0_u64, 0, 148, level.len() as u64, data.len() as u64]
            .into_iter()
            .flat_map(u64::to_le_bytes),
    );
    // One basic descriptor: colour model, primaries, the sRGB curve; 4×4 blocks; a single
    // sample for all channels.
    let sample = [127 << 16 | 3 << 24, 0, 0, u32::MAX];
    out.extend(
        [
            44,
            0,
            2 | 40 << 16,
            0x0002_0100 | u32::from(model),
            0x0303,
            16,
            0,
        ]
        .into_iter()
        .flat_map(u32::to_le_bytes),
    );
    out.extend(sample.into_iter().flat_map(u32::to_le_bytes));
    out.extend(level);
    out
}

/// Encodes a picture of UASTC blocks, row by row.
fn uastc(size: [u32; 2], blocks: &[[u8; 4]], zstandard: bool) -> Vec<u8> {
    let data: Vec<u8> = blocks.iter().flat_map(|colour| block(*colour)).collect();
    file(size, 0, UASTC, &data, zstandard)
}

/// Protects: uncompressed pixels keep their codes, for any order of channels, sRGB or not,
/// opaque without alpha, raw or with Zstandard.
#[test]
fn plain_pixels() {
    let colours = [
        [1, 2, 3, 4],
        [250, 100, 50, 0],
        [7, 8, 9, 255],
        [0, 0, 255, 128],
        [255, 0, 0, 1],
        [90, 80, 70, 60],
    ];
    for zstandard in [false, true] {
        for (formats, channels, reversed) in [
            ([23, 29], 3, false),
            ([30, 36], 3, true),
            ([37, 43], 4, false),
            ([44, 50], 4, true),
        ] {
            let texel = |&[r, g, b, a]: &[u8; 4]| {
                let texel = if reversed { [b, g, r, a] } else { [r, g, b, a] };
                texel.into_iter().take(channels).collect::<Vec<u8>>()
            };
            let data: Vec<u8> = colours.iter().flat_map(texel).collect();
            for format in formats {
                let good = file([3, 2], format, 1, &data, zstandard);
                let image = decode(&good, &Limits::default()).unwrap();
                let expected =
                    colours.map(|[r, g, b, a]| [r, g, b, if channels == 4 { a } else { 255 }]);
                assert_eq!(
                    (image.width, image.height, image.pixels),
                    (3, 2, PixelData::Codes(expected.to_vec())),
                    "{format}"
                );
                // Sizes that need more or fewer pixels than the data has.
                for size in [[3, 3], [3, 1], [7, 1]] {
                    assert!(
                        decode(&file(size, format, 1, &data, zstandard), &Limits::default())
                            .is_err(),
                        "{size:?}"
                    );
                }
                for end in 0..good.len() {
                    assert!(
                        decode(&good[..end], &Limits::default()).is_err(),
                        "{format} cut at {end}"
                    );
                }
            }
        }
    }
    let foreign = decode(&file([1, 1], 97, 1, &[0; 8], false), &Limits::default())
        .unwrap_err()
        .message;
    assert!(foreign.contains("VkFormat 97"), "{foreign}");
}

/// Protects: pixels have the codes of their blocks, in rows from the top, cropped at the
/// picture's edge, raw or with Zstandard.
#[test]
fn blocks_of_one_colour() {
    let colours = [
        [255, 0, 0, 255],
        [1, 2, 3, 4],
        [0, 200, 7, 128],
        [9, 9, 9, 255],
    ];
    for zstandard in [false, true] {
        let image = decode(&uastc([6, 5], &colours, zstandard), &Limits::default()).unwrap();
        let PixelData::Codes(codes) = image.pixels else {
            panic!("codes")
        };
        let expected = |i: usize| colours[(i / 6 / 4) * 2 + (i % 6) / 4];
        assert_eq!((image.width, image.height), (6, 5));
        assert_eq!(
            codes,
            (0..30).map(expected).collect::<Vec<_>>(),
            "zstandard {zstandard}"
        );
    }
}

/// Protects: nothing is allocated for a picture beyond the limits, and every truncated or false
/// container is an error.
#[test]
fn broken_containers_are_refused() {
    let good = uastc([8, 4], &[[5; 4], [6; 4]], true);
    let small = Limits {
        image_pixels: 31,
        ..Limits::default()
    };
    assert_eq!(decode(&good, &small).unwrap_err().kind, ErrorKind::Limit);
    for end in 0..good.len() {
        assert!(
            decode(&good[..end], &Limits::default()).is_err(),
            "cut at {end}"
        );
    }
    for (position, value) in [
        (28, 1),
        (32, 2),
        (36, 6),
        (40, 33),
        (44, 3),
        (48, u32::MAX),
        (68, 1),
        (84, 1),
        (96, 1),
        (116, 162),
    ] {
        let mut bad = good.clone();
        bad[position..position + 4].copy_from_slice(&value.to_le_bytes());
        assert!(
            decode(&bad, &Limits::default()).is_err(),
            "{value} at {position}"
        );
    }
}
