//! Corruption of bytes, of lines and of numbers in a text, whatever their meaning.

use crate::random::Random;

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
pub fn mangle(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        let (at, length) = (random.below(bytes.len()), 1 + random.below(16));
        let end = (at + length).min(bytes.len());
        match random.below(10) {
            0 | 1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            2 if !bytes.is_empty() => bytes[at] = *random.of(&[0, 0xff, 0x7f, 0x80]),
            3 => drop(bytes.drain(at..end)),
            4 if random.below(4) == 0 => bytes.truncate(at),
            5 => {
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            6 | 7 => word(bytes, at, random),
            _ => number(bytes, at, random),
        }
    }
}

/// Replaces four bytes by another number, in either byte order.
fn word(bytes: &mut [u8], at: usize, random: &mut Random) {
    let word = *random.of(&WORDS);
    let new = if random.below(2) == 0 {
        word.to_le_bytes()
    } else {
        word.to_be_bytes()
    };
    if let Some(old) = bytes
        .get_mut(at & !3..)
        .and_then(|rest| rest.first_chunk_mut::<4>())
    {
        *old = new;
    }
}

/// Replaces the next number in digits by another.
fn number(bytes: &mut Vec<u8>, from: usize, random: &mut Random) {
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
    bytes.splice(start..start + length, random.of(&NUMBERS).bytes());
}

/// Changes the order and number of a text's lines and words.
pub fn mangle_lines(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<Vec<u8>> = bytes.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
    for _ in 0..=random.below(3) {
        let (a, b) = (random.below(lines.len()), random.below(lines.len()));
        match random.below(7) {
            0 => lines.swap(a, b),
            1 => drop(lines.remove(a)),
            2 => lines.insert(b, lines[a].clone()),
            3 => lines[a].extend_from_slice(b" \\"),
            4 => lines[a] = lines[a].repeat(1 + random.below(64)),
            _ => words(&mut lines, a, b, random),
        }
        if lines.is_empty() {
            lines.push(Vec::new());
        }
    }
    let end = *random.of(&["\n", "\r\n", "\n", "\r"]);
    *bytes = lines.join(end.as_bytes());
}

/// Puts a word of one line, or a number, into another line.
fn words(lines: &mut [Vec<u8>], a: usize, b: usize, random: &mut Random) {
    let mut words: Vec<Vec<u8>> = lines[a]
        .split(|&byte| byte == b' ')
        .map(<[u8]>::to_vec)
        .collect();
    let others: Vec<&[u8]> = lines[b].split(|&byte| byte == b' ').collect();
    let new = if random.below(2) == 0 {
        random.of(&NUMBERS).as_bytes()
    } else {
        random.of(&others)
    }
    .to_vec();
    let at = random.below(words.len());
    match random.below(3) {
        0 => words.insert(at, new),
        _ => words[at] = new,
    }
    lines[a] = words.join(&b' ');
}

/// Corrects the checksums of a PNG's chunks, so that the decoder reads their corrupt content.
pub fn mend_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>()) {
        let end = at + 8 + u32::from_be_bytes(*length) as usize;
        let Some(sum) = bytes.get(at + 4..end).map(crc) else {
            return;
        };
        let Some(place) = bytes
            .get_mut(end..)
            .and_then(|rest| rest.first_chunk_mut::<4>())
        else {
            return;
        };
        *place = sum.to_be_bytes();
        at = end + 4;
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
