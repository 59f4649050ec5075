//! Corruption of bytes, of lines and of numbers in a text, whatever their meaning.

use crate::random::MangleRng;

/// Numbers that break counters, sums and divisions.
const NUMBERS: [&str; 14] = [
    "0",
    "-1",
    "1",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "1e38",
    "1e308",
    "1e-320",
    "-0.0",
    "nan",
    "18446744073709551615",
];

/// The same as 32-bit words, integers and floats: with infinities, NaN, and the largest subnormal
/// number.
const WORDS: [u32; 12] = [
    0,
    1,
    0xff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7f80_0000,
    0xff80_0000,
    0x7fc0_0000,
    0x0000_0001,
    0x7f7f_ffff,
];

/// Changes some bytes.
pub fn mangle(bytes: &mut Vec<u8>, rng: &mut MangleRng) {
    for _ in 0..=rng.below(4) {
        let (position, length) = (rng.below(bytes.len()), 1 + rng.below(16));
        let end = (position + length).min(bytes.len());
        match rng.below(10) {
            0 | 1 if !bytes.is_empty() => bytes[position] ^= 1 << rng.below(8),
            2 if !bytes.is_empty() => bytes[position] = *rng.choose(&[0, 0xff, 0x7f, 0x80]),
            3 => drop(bytes.drain(position..end)),
            4 if rng.below(4) == 0 => bytes.truncate(position),
            5 => {
                let copy = bytes[position..end].to_vec();
                let to = rng.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            6 | 7 => word(bytes, position, rng),
            _ => number(bytes, position, rng),
        }
    }
}

/// Replaces four bytes by another number, in either byte order.
fn word(bytes: &mut [u8], position: usize, rng: &mut MangleRng) {
    let word = *rng.choose(&WORDS);
    let new = if rng.below(2) == 0 {
        word.to_le_bytes()
    } else {
        word.to_be_bytes()
    };
    if let Some(old) = bytes
        .get_mut(position & !3..)
        .and_then(|rest| rest.first_chunk_mut::<4>())
    {
        *old = new;
    }
}

/// Replaces the next number in digits by another.
fn number(bytes: &mut Vec<u8>, from: usize, rng: &mut MangleRng) {
    let Some(start) = bytes
        .iter()
        .skip(from)
        .position(u8::is_ascii_digit)
        .map(|i| from + i)
    else {
        return;
    };
    let length = bytes[start..]
        .iter()
        .take_while(|b| b.is_ascii_digit() || **b == b'.')
        .count();
    bytes.splice(start..start + length, rng.choose(&NUMBERS).bytes());
}

/// Changes the order and number of a text's lines and words.
pub fn mangle_lines(bytes: &mut Vec<u8>, rng: &mut MangleRng) {
    let mut lines: Vec<Vec<u8>> = bytes.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
    for _ in 0..=rng.below(3) {
        let (a, b) = (rng.below(lines.len()), rng.below(lines.len()));
        match rng.below(7) {
            0 => lines.swap(a, b),
            1 => drop(lines.remove(a)),
            2 => lines.insert(b, lines[a].clone()),
            3 => lines[a].extend_from_slice(b" \\"),
            4 => lines[a] = lines[a].repeat(1 + rng.below(64)),
            _ => words(&mut lines, a, b, rng),
        }
        if lines.is_empty() {
            lines.push(Vec::new());
        }
    }
    let end = *rng.choose(&["\n", "\r\n", "\n", "\r"]);
    *bytes = lines.join(end.as_bytes());
}

/// Puts a word of one line, or a number, into another line.
fn words(lines: &mut [Vec<u8>], a: usize, b: usize, rng: &mut MangleRng) {
    let mut words: Vec<Vec<u8>> = lines[a]
        .split(|&byte| byte == b' ')
        .map(<[u8]>::to_vec)
        .collect();
    let others: Vec<&[u8]> = lines[b].split(|&byte| byte == b' ').collect();
    let new = if rng.below(2) == 0 {
        rng.choose(&NUMBERS).as_bytes()
    } else {
        rng.choose(&others)
    }
    .to_vec();
    let position = rng.below(words.len());
    match rng.below(3) {
        0 => words.insert(position, new),
        _ => words[position] = new,
    }
    lines[a] = words.join(&b' ');
}

/// Corrects the checksums of a PNG's chunks, so that the decoder reads their corrupt content.
pub fn mend_png(bytes: &mut [u8]) {
    let mut position = 8;
    while let Some(length) = bytes
        .get(position..)
        .and_then(|rest| rest.first_chunk::<4>())
    {
        let end = position + 8 + u32::from_be_bytes(*length) as usize;
        let Some(sum) = bytes.get(position + 4..end).map(crc) else {
            return;
        };
        let Some(place) = bytes
            .get_mut(end..)
            .and_then(|rest| rest.first_chunk_mut::<4>())
        else {
            return;
        };
        *place = sum.to_be_bytes();
        position = end + 4;
    }
}

/// Computes the checksum of the PNG specification, third edition, annex D.
fn crc(bytes: &[u8]) -> u32 {
    let bit = |sum: u32, _| {
        if sum & 1 == 1 {
            0xedb8_8320 ^ (sum >> 1)
        } else {
            sum >> 1
        }
    };
    !bytes
        .iter()
        .fold(!0, |sum, &byte| (0..8).fold(sum ^ u32::from(byte), bit))
}
