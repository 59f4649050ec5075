//! Decoding of index packets of two kinds. A packet of triangles refers to recent edges and
//! vertices. A packet of an index sequence holds differences to one of two recent indices.

use super::{
    PacketFault, TOO_LONG, TOO_SHORT, WRONG_STRIDE, decode_zigzag, parse_header, split_off_bytes,
};

/// Ring buffer of the sixteen latest entries.
struct RingBuffer<T> {
    values: [T; 16],
    next: usize,
}

impl<T: Copy> RingBuffer<T> {
    /// Creates a buffer in which every entry is `nothing`, the value of a missing entry.
    fn new(nothing: T) -> Self {
        Self {
            values: [nothing; 16],
            next: 0,
        }
    }

    fn push(&mut self, value: T) {
        self.values[self.next] = value;
        self.next = (self.next + 1) % 16;
    }

    /// Returns the entry that was pushed `steps` calls ago; 1 is the latest.
    fn nth_latest(&self, steps: usize) -> T {
        self.values[self.next.wrapping_sub(steps) % 16]
    }
}

/// Reads a variable-length integer of seven bits per byte, lowest bits first.
fn read_varint(rest: &mut &[u8]) -> Result<u32, PacketFault> {
    let mut value = 0;
    for shift in (0..35).step_by(7) {
        let byte = split_off_bytes(rest, 1)?[0];
        value |= u32::from(byte & 127) << shift;
        if byte < 128 {
            break;
        }
    }
    Ok(value)
}

/// State of decoding a packet of triangles: the bytes not read yet, and the recent indices.
struct IndexDecoder<'p> {
    rest: &'p [u8],
    /// Lowest vertex index that no triangle has used so far.
    new: u32,
    /// The index that was last coded as a difference; the next difference is added to this index.
    last: u32,
    recent: RingBuffer<u32>,
}

impl IndexDecoder<'_> {
    /// Returns the lowest unused vertex index, which counts as used from now on.
    fn take_unused_index(&mut self) -> u32 {
        self.new = self.new.wrapping_add(1);
        self.new.wrapping_sub(1)
    }

    /// Returns the vertex index for a code: 0 is the lowest unused index, 1 to 14 a recent index,
    /// and 15 a placeholder, which [`Self::read_explicit_corner`] replaces.
    fn decode_corner(&mut self, code: u8) -> u32 {
        if code == 0 {
            self.take_unused_index()
        } else {
            self.recent.nth_latest(code.into())
        }
    }

    /// If `code` is 15, replaces a corner by the next vertex index of the packet, which is coded as
    /// a difference.
    fn read_explicit_corner(&mut self, corner: &mut u32, code: u8) -> Result<(), PacketFault> {
        if code == 15 {
            self.last = self
                .last
                .wrapping_add(decode_zigzag(read_varint(&mut self.rest)?));
            *corner = self.last;
        }
        Ok(())
    }

    /// Reads a triangle without a recent edge from the codes of its three corners. The first code
    /// is 0 or 15.
    fn decode_triangle(&mut self, codes: [u8; 3]) -> Result<[u32; 3], PacketFault> {
        let mut corners = codes.map(|code| self.decode_corner(code));
        for (corner, code) in corners.iter_mut().zip(codes) {
            self.read_explicit_corner(corner, code)?;
        }
        for (corner, code) in corners.into_iter().zip(codes) {
            if matches!(code, 0 | 15) {
                self.recent.push(corner);
            }
        }
        Ok(corners)
    }

    /// Reads the third corner of a triangle that has a recent edge.
    fn decode_third_corner(&mut self, code: u8, version: u8) -> Result<u32, PacketFault> {
        let mut corner = match code {
            0 => self.take_unused_index(),
            13 if version > 0 => self.last.wrapping_sub(1),
            14 if version > 0 => self.last.wrapping_add(1),
            1..15 => return Ok(self.recent.nth_latest(usize::from(code) + 1)),
            _ => 0,
        };
        self.read_explicit_corner(&mut corner, code)?;
        if code > 0 {
            self.last = corner;
        }
        self.recent.push(corner);
        Ok(corner)
    }
}

/// Decodes a packet of triangles to `count` indices of `stride` bytes each.
pub(crate) fn decode_triangles(
    count: usize,
    stride: usize,
    packet: &[u8],
) -> Result<Vec<u8>, PacketFault> {
    if !matches!(stride, 2 | 4) {
        return Err(WRONG_STRIDE);
    }
    if !count.is_multiple_of(3) {
        return Err("the number of indices is not a multiple of 3");
    }
    let (version, mut rest) = parse_header(packet, 0xe0)?;
    let codes = split_off_bytes(&mut rest, count / 3)?;
    let (rest, table) = rest.split_last_chunk::<16>().ok_or(TOO_SHORT)?;
    let mut edges = RingBuffer::new([u32::MAX; 2]);
    let mut corners = IndexDecoder {
        rest,
        new: 0,
        last: 0,
        recent: RingBuffer::new(u32::MAX),
    };
    let mut out = Vec::with_capacity(count * stride);
    for &code in codes {
        let (high, low) = (code >> 4, code & 15);
        let [a, b, c] = if high < 15 {
            let [a, b] = edges.nth_latest(usize::from(high) + 1);
            [a, b, corners.decode_third_corner(low, version)?]
        } else {
            let is_written = low >= 14;
            let two = if is_written {
                split_off_bytes(&mut corners.rest, 1)?[0]
            } else {
                table[usize::from(low)]
            };
            if is_written && two == 0 {
                corners.new = 0;
            }
            let found =
                corners.decode_triangle([if low == 15 { 15 } else { 0 }, two >> 4, two & 15])?;
            edges.push([found[1], found[0]]);
            found
        };
        edges.push([c, b]);
        edges.push([a, c]);
        [a, b, c]
            .iter()
            .for_each(|index| out.extend(&index.to_le_bytes()[..stride]));
    }
    if corners.rest.is_empty() {
        Ok(out)
    } else {
        Err(TOO_LONG)
    }
}

/// Decodes a packet of indices in any order to `count` indices of `stride` bytes each.
pub(crate) fn decode_index_sequence(
    count: usize,
    stride: usize,
    packet: &[u8],
) -> Result<Vec<u8>, PacketFault> {
    if !matches!(stride, 2 | 4) {
        return Err(WRONG_STRIDE);
    }
    let (_, rest) = parse_header(packet, 0xd0)?;
    let (mut rest, _) = rest.split_last_chunk::<4>().ok_or(TOO_SHORT)?;
    let (mut last, mut out) = ([0_u32; 2], Vec::new());
    for _ in 0..count {
        let code = read_varint(&mut rest)?;
        let last = &mut last[(code & 1) as usize];
        *last = last.wrapping_add(decode_zigzag(code >> 1));
        out.extend(&last.to_le_bytes()[..stride]);
    }
    if rest.is_empty() {
        Ok(out)
    } else {
        Err(TOO_LONG)
    }
}
