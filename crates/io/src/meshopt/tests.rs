//! Tests of packets encoded by meshoptimizer (1.3, in its Rust translation 0.2.17), whole and
//! broken.

use super::*;

fn bytes(digits: &str) -> Vec<u8> {
    let digits: Vec<char> = digits.chars().filter(char::is_ascii_hexdigit).collect();
    digits
        .chunks(2)
        .map(|pair| u8::from_str_radix(&pair.iter().collect::<String>(), 16).expect("two digits"))
        .collect()
}

/// Forty vertices of 12 bytes, and their packets in versions 0 and 1.
fn of_bytes() -> (Vec<u8>, [Vec<u8>; 2]) {
    let vertex = |i: u32| {
        let (a, b) = ((i * i % 97) as u8, (i / 3) as u8);
        [
            a,
            b,
            7,
            0,
            (i * 37) as u8,
            ((i * 37) >> 8) as u8,
            a ^ b,
            255,
            u8::from(i == 20),
            0,
            0,
            (i * 3) as u8,
        ]
    };
    let packets = [
        "a01f0002060a0e12161a1e229b2a2e328b3a3e427b4a735256675e5f665753724b7affff0000433f8637332f96271502082082082082082082000000001f004a4a
         4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4affff00004a4a4a4a4a4a4a4a150002000800200080020000001f00020608120e1c1a1e20
         a33620428b28423e65326b506a77505f6635738e6d82ffff00002b3d6a370d4fa61500040090000000002a06666666666666666666666666666666666666660000
         0000000000000000000000000000000000000000000000000700000000ff00000000",
        "a1a7bb680002060a0e12161a1e229b2a2e328b3a3e427b4a735256675e5f665753724b7a433f8637332f962715020820820820820820820000004a4a4a4a4a4a4a
         4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a00020608120e1c1a1e20a33620428b28423e65326b506a77505f6635738e6d822b
         3d6a370d4fa61504300002012a06666666666666666666666666666666666666660000000000000000000000000000000700000000ff00000000000100",
    ];
    ((0..40).flat_map(vertex).collect(), packets.map(bytes))
}

/// Protects: vertices of both versions are decoded exactly: byte differences, 16-bit differences,
/// and rotated float bits.
#[test]
fn vertices_come_out() {
    let (expected, packets) = of_bytes();
    for packet in packets {
        assert_eq!(decode_vertices(40, 12, &packet), Ok(expected.clone()));
    }
    let floats: Vec<u8> = (0..20)
        .flat_map(|i| (1.0 / (i as f32 + 3.0)).to_le_bytes())
        .collect();
    assert_eq!(decode_vertices(20, 4, &bytes(FLOATS)), Ok(floats));
    // Two vertices with literal bytes: no difference, and then the lowest bit, rotated up by four.
    let turned = [
        &[0xa1, 0xff, 0, 0x10, 0, 0, 0, 0, 0, 0][..],
        &[0; 19],
        &1.0_f32.to_le_bytes(),
        &[2 | 4 << 4],
    ]
    .concat();
    let [one, next] = [1.0, 1.0 + f32::EPSILON].map(f32::to_le_bytes);
    assert_eq!(decode_vertices(2, 4, &turned), Ok([one, next].concat()));
}

/// Thirds, quarters and so on.
const FLOATS: &str = "a1bf00aa65430b498d287e3ea367c8ee1d6ffa2ec8b600aa6644c392e37dc3f841817eee1ec50b717e44005367432f23392d231f1915130f1f191715111100000000000000000000000000000000000000abaaaa3e01";

/// A strip, and distant indices.
fn indices() -> Vec<u32> {
    let strip = (0..6).flat_map(|i| [i, i + 1, i + 8, i + 8, i + 1, i + 9]);
    strip.chain([0, 70_000, 9, 200, 201, 5]).collect()
}

/// Converts decoded indices of any width.
fn wide(bytes: Result<Vec<u8>, PacketFault>) -> Vec<u32> {
    bytes
        .expect("a packet")
        .as_chunks()
        .0
        .iter()
        .map(|four| u32::from_le_bytes(*four))
        .collect()
}

const TRIANGLES: [&str; 2] = [
    "e0fe1f100f100f100f100f100fffff0f10020202020202fb1be0c508f6cfc20802007687566778a9866589689801690000",
    "e1fe1e100e100e100e100e100effff0f10fb1be0c508f6cfc20802007687566778a9866589689801690000",
];
const SEQUENCES: [&str; 2] = [
    "d000041c001a201e041c001a201e041c001a201e041c001a201e041c001a201e041c001a2036c18b11249f8511050e00000000",
    "d100041c001a201e041c001a201e041c001a201e041c001a201e041c001a201e041c001a2036c18b11249f8511050e00000000",
];

/// Protects: triangles of both versions are decoded up to a cyclic order of corners, sequences
/// exactly; 16-bit indices are the low halves of 32-bit ones.
#[test]
fn indices_come_out() {
    let sorted = |indices: &[u32]| -> Vec<[u32; 3]> {
        let turned = |&[a, b, c]: &[u32; 3]| {
            [[a, b, c], [b, c, a], [c, a, b]]
                .into_iter()
                .min()
                .unwrap_or_default()
        };
        indices.as_chunks().0.iter().map(turned).collect()
    };
    for (packet, sequence_packet) in TRIANGLES.map(bytes).iter().zip(SEQUENCES.map(bytes)) {
        assert_eq!(
            sorted(&wide(decode_triangles(42, 4, packet))),
            sorted(&indices())
        );
        assert_eq!(
            wide(decode_index_sequence(42, 4, &sequence_packet)),
            indices()
        );
        let low = |bytes: Vec<u8>| -> Vec<u8> {
            bytes
                .as_chunks::<4>()
                .0
                .iter()
                .flat_map(|four| [four[0], four[1]])
                .collect()
        };
        assert_eq!(
            decode_triangles(42, 2, packet),
            decode_triangles(42, 4, packet).map(low)
        );
        assert_eq!(
            decode_index_sequence(42, 2, &sequence_packet),
            decode_index_sequence(42, 4, &sequence_packet).map(low)
        );
    }
}

/// Protects: a truncated packet, trailing bytes, another codec and a later version are refused, and
/// no changed byte causes a panic or another output size.
#[test]
fn broken_packets_are_refused() {
    type Decode = fn(usize, usize, &[u8]) -> Result<Vec<u8>, PacketFault>;
    let (_, [old, new]) = of_bytes();
    let [old_triangles, new_triangles] = TRIANGLES.map(bytes);
    let cases: [(Decode, usize, usize, Vec<u8>); 6] = [
        (decode_vertices, 40, 12, old),
        (decode_vertices, 40, 12, new),
        (decode_vertices, 20, 4, bytes(FLOATS)),
        (decode_triangles, 42, 4, old_triangles),
        (decode_triangles, 42, 2, new_triangles),
        (decode_index_sequence, 42, 4, bytes(SEQUENCES[0])),
    ];
    for (decode, count, stride, packet) in cases {
        assert!((0..packet.len()).all(|length| decode(count, stride, &packet[..length]).is_err()));
        assert!(decode(count, stride, &[&packet[..], &[0]].concat()).is_err());
        assert!(
            decode(count + 48, stride, &packet).is_err()
                && decode(count - 18, stride, &packet).is_err()
        );
        assert!(
            [0, 3, 260]
                .into_iter()
                .all(|stride| decode(count, stride, &packet).is_err())
        );
        for (position, bit) in
            (0..packet.len()).flat_map(|position| (0..8).map(move |bit| (position, bit)))
        {
            let mut changed = packet.clone();
            changed[position] ^= 1 << bit;
            let found = decode(count, stride, &changed);
            assert!(
                found.is_ok_and(|bytes| bytes.len() == count * stride)
                    || decode(count, stride, &changed).is_err(),
                "{position} {bit}"
            );
        }
    }
}

/// Protects: filters on computed examples: directions of length 1 to the last step, rotations
/// likewise, powers of two times integers, and colours with fewer bits than a channel.
#[test]
fn filters_by_hand() {
    let changed =
        |filter: fn(usize, &mut [u8]) -> Result<(), PacketFault>, stride, bytes: &[u8]| {
            let mut bytes = bytes.to_vec();
            filter(stride, &mut bytes).map(|()| bytes)
        };
    let byte = |x: i8| x as u8;
    assert_eq!(
        changed(decode_octahedral, 4, &[0, 0, 127, 9]),
        Ok(vec![0, 0, 127, 9])
    );
    assert_eq!(
        changed(decode_octahedral, 4, &[63, 0, 63, 9]),
        Ok(vec![127, 0, 0, 9])
    );
    assert_eq!(
        changed(decode_octahedral, 4, &[byte(-63), 63, 63, 9]),
        Ok(vec![0, 0, byte(-127), 9])
    );
    assert!(
        changed(decode_octahedral, 4, &[0; 4]).is_err()
            && changed(decode_octahedral, 12, &[0; 12]).is_err()
    );
    // Three components 0 and the largest 1, at each index.
    for place in 0..4_u8 {
        let found = changed(decode_quaternions, 8, &[0, 0, 0, 0, 0, 0, 0xfc | place, 7])
            .expect("a rotation");
        let numbers: Vec<i16> = found
            .as_chunks()
            .0
            .iter()
            .map(|two| i16::from_le_bytes(*two))
            .collect();
        let expected: Vec<i16> = (0..4).map(|i| if i == place { 32767 } else { 0 }).collect();
        assert_eq!(numbers, expected);
    }
    let floats = [0x01_00_00_03_u32, 0xfe_ff_ff_fd].map(u32::to_le_bytes);
    let found = changed(decode_exponential, 8, floats.as_flattened()).expect("floats");
    let found: Vec<f32> = found
        .as_chunks()
        .0
        .iter()
        .map(|four| f32::from_le_bytes(*four))
        .collect();
    assert_eq!(found, [6.0, -0.75]);
    // Five bits: white, and a green of 30/31.
    assert_eq!(
        changed(decode_colours, 4, &[31, 0, 0, 31]),
        Ok(vec![255; 4])
    );
    assert_eq!(
        changed(decode_colours, 4, &[15, 0, 15, 31]),
        Ok(vec![0, 247, 0, 255])
    );
    assert!(changed(decode_colours, 4, &[1, 1, 1, 0]).is_err());
}
