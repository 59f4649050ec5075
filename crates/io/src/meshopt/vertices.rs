//! Decoding of vertex packets. A packet consists of blocks of at most 256 vertices. A byte of a
//! vertex is coded as the difference to the same byte of the previous vertex. In version 1, two or
//! four bytes may be coded as one number.

use super::{
    PacketFault, TOO_LONG, TOO_SHORT, WRONG_STRIDE, decode_zigzag, parse_header, split_off_bytes,
};

/// Number of vertices in a group. The differences of a group are coded with the same number of
/// bits.
const GROUP: usize = 16;
/// Largest size of a block in bytes.
const BLOCK_BYTES: usize = 8192;
/// Largest number of vertices in a block.
const BLOCK: usize = 256;

/// The bytes at a single byte position of all vertices in a block.
type BytePlane = [u8; BLOCK];

/// Decodes a packet of `count` vertices of `stride` bytes each to the bytes of the vertices.
pub(crate) fn decode_vertices(
    count: usize,
    stride: usize,
    packet: &[u8],
) -> Result<Vec<u8>, PacketFault> {
    if !(4..=256).contains(&stride) || !stride.is_multiple_of(4) {
        return Err(WRONG_STRIDE);
    }
    let (version, rest) = parse_header(packet, 0xa0)?;
    let words = if version == 0 { 0 } else { stride / 4 };
    // The first vertex is stored at the end of the packet, after padding for decoders that read
    // ahead. In version 1 it is followed by a byte for each 32-bit word of a vertex: the rule by
    // which the word's differences are coded.
    let tail = (stride + words).max(if version == 0 { 32 } else { 24 });
    let (mut rest, tail) = rest
        .split_at_checked(rest.len().wrapping_sub(tail))
        .ok_or(TOO_SHORT)?;
    let (first, rules) = tail[tail.len() - stride - words..].split_at(stride);
    let mut last = first.to_vec();
    let maximum = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK);
    let mut out = Vec::new();
    for start in (0..count).step_by(maximum) {
        let here = maximum.min(count - start);
        out.resize((start + here) * stride, 0);
        let block = &mut out[start * stride..];
        let controls = split_off_bytes(&mut rest, words)?;
        for word in 0..stride / 4 {
            let control = controls.get(word).copied();
            let mut planes = [[0; BLOCK]; 4];
            for (byte, plane) in planes.iter_mut().enumerate() {
                read_byte_plane(
                    &mut rest,
                    control.map(|control| control >> (2 * byte) & 3),
                    &mut plane[..here.next_multiple_of(GROUP)],
                    here,
                )?;
            }
            let rule = rules.get(word).copied().unwrap_or(0);
            decode_word_differences(
                &planes,
                rule,
                &last[4 * word..][..4],
                &mut block[4 * word..],
                stride,
            )?;
        }
        last.copy_from_slice(&block[(here - 1) * stride..]);
    }
    if rest.is_empty() {
        Ok(out)
    } else {
        Err(TOO_LONG)
    }
}

/// Reads the differences of one byte position for each vertex in a block. `control` selects the
/// coding of the differences:
/// - `None` (version 0): 0, 2, 4 or 8 bits, chosen for each group of sixteen vertices;
/// - 0: 0, 1, 2 or 4 bits, chosen for each group;
/// - 1: 1, 2, 4 or 8 bits, chosen for each group;
/// - 2: all differences are zero;
/// - 3: a byte for each difference.
fn read_byte_plane(
    rest: &mut &[u8],
    control: Option<u8>,
    plane: &mut [u8],
    count: usize,
) -> Result<(), PacketFault> {
    let widths = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => return Ok(()),
        Some(_) => {
            plane[..count].copy_from_slice(split_off_bytes(rest, count)?);
            return Ok(());
        }
    };
    let choices = split_off_bytes(rest, (plane.len() / GROUP).div_ceil(4))?;
    for (i, group) in plane.as_chunks_mut().0.iter_mut().enumerate() {
        read_byte_group(
            rest,
            widths[usize::from(choices[i / 4] >> (2 * (i % 4)) & 3)],
            group,
        )?;
    }
    Ok(())
}

/// Reads the differences of a group, coded with `bits` bits each. A difference beyond these bits
/// has the largest code, and is stored as a whole byte after the group.
fn read_byte_group(
    rest: &mut &[u8],
    bits: usize,
    group: &mut [u8; GROUP],
) -> Result<(), PacketFault> {
    if matches!(bits, 0 | 8) {
        group[..2 * bits].copy_from_slice(split_off_bytes(rest, 2 * bits)?);
        return Ok(());
    }
    let (packed, largest) = (split_off_bytes(rest, 2 * bits)?, (1 << bits) - 1);
    for (i, value) in group.iter_mut().enumerate() {
        let index = i * bits % 8;
        // Codes of one bit start at the lowest bit of a byte, all other codes at the highest.
        let shift = if bits == 1 { index } else { 8 - bits - index };
        let code = packed[i * bits / 8] >> shift & largest;
        *value = if code == largest {
            split_off_bytes(rest, 1)?[0]
        } else {
            code
        };
    }
    Ok(())
}

/// Adds up the differences of a 32-bit word from vertex to vertex, and stores the word in every
/// vertex of a block. The two lowest bits of `rule` select the kind of difference:
/// - 0: of single bytes;
/// - 1: of 16-bit numbers;
/// - 2: the exclusive or of whole words, rotated by the number of bits in the upper half of `rule`.
fn decode_word_differences(
    planes: &[BytePlane; 4],
    rule: u8,
    last: &[u8],
    block: &mut [u8],
    stride: usize,
) -> Result<(), PacketFault> {
    let width = *[1, 2, 4]
        .get(usize::from(rule & 3))
        .ok_or("the compressed data stores a 32-bit word of a vertex in an unknown encoding")?;
    let turn = u32::from(rule >> 4);
    for position in (0..4).step_by(width) {
        let number = |byte: &dyn Fn(usize) -> u8| {
            (position..position + width)
                .rev()
                .fold(0, |number, k| number << 8 | u32::from(byte(k)))
        };
        let mut value = number(&|k| last[k]);
        for (i, vertex) in block.chunks_mut(stride).enumerate() {
            let code = number(&|k| planes[k][i]);
            value = if width == 4 {
                code.rotate_right(turn) ^ value
            } else {
                value.wrapping_add(decode_zigzag(code))
            };
            vertex[position..position + width].copy_from_slice(&value.to_le_bytes()[..width]);
        }
    }
    Ok(())
}
