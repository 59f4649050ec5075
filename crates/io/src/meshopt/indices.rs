//! Decoding of index packets: triangles from recent edges and vertices, and sequences as
//! differences to one of two recent indices.

use super::{Broken, LONG, SHORT, STRIDE, difference, opened, take};

/// Ring buffer of the sixteen latest entries.
struct RecentIndices<T> {
    values: [T; 16],
    next: usize,
}

impl<T: Copy> RecentIndices<T> {
    /// Creates a buffer filled with `nothing`, which is no vertex index.
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

    /// Returns the entry `steps` back; the latest is 1.
    fn back(&self, steps: usize) -> T {
        self.values[self.next.wrapping_sub(steps) % 16]
    }
}

/// Reads a variable-length integer of seven bits per byte, lowest bits first.
fn whole(rest: &mut &[u8]) -> Result<u32, Broken> {
    let mut value = 0;
    for shift in (0..35).step_by(7) {
        let byte = take(rest, 1)?[0];
        value |= u32::from(byte & 127) << shift;
        if byte < 128 {
            break;
        }
    }
    Ok(value)
}

/// State of decoding a packet of triangles.
struct RecentCorners<'p> {
    rest: &'p [u8],
    /// Lowest index not used so far.
    new: u32,
    /// Latest explicitly coded index.
    last: u32,
    recent: RecentIndices<u32>,
}

impl RecentCorners<'_> {
    fn take_new(&mut self) -> u32 {
        self.new = self.new.wrapping_add(1);
        self.new.wrapping_sub(1)
    }

    /// Returns the vertex of a code: 0 is a new vertex, 1 to 14 a recent vertex, and 15 a
    /// placeholder, which [`Self::written`] replaces.
    fn of(&mut self, code: u8) -> u32 {
        if code == 0 {
            self.take_new()
        } else {
            self.recent.back(code.into())
        }
    }

    /// Replaces a corner by an explicitly coded vertex if `code` is 15.
    fn written(&mut self, corner: &mut u32, code: u8) -> Result<(), Broken> {
        if code == 15 {
            self.last = self.last.wrapping_add(difference(whole(&mut self.rest)?));
            *corner = self.last;
        }
        Ok(())
    }

    /// Reads a triangle from three codes, of which the first is 0 or 15.
    fn triangle(&mut self, codes: [u8; 3]) -> Result<[u32; 3], Broken> {
        let mut corners = codes.map(|code| self.of(code));
        for (corner, code) in corners.iter_mut().zip(codes) {
            self.written(corner, code)?;
        }
        for (corner, code) in corners.into_iter().zip(codes) {
            if matches!(code, 0 | 15) {
                self.recent.push(corner);
            }
        }
        Ok(corners)
    }

    /// Reads the third vertex of a triangle on a recent edge.
    fn third(&mut self, code: u8, version: u8) -> Result<u32, Broken> {
        let mut corner = match code {
            0 => self.take_new(),
            13 if version > 0 => self.last.wrapping_sub(1),
            14 if version > 0 => self.last.wrapping_add(1),
            1..15 => return Ok(self.recent.back(usize::from(code) + 1)),
            _ => 0,
        };
        self.written(&mut corner, code)?;
        if code > 0 {
            self.last = corner;
        }
        self.recent.push(corner);
        Ok(corner)
    }
}

/// Decodes a packet of triangles to `count` indices of `stride` bytes each.
pub(crate) fn triangles(count: usize, stride: usize, packet: &[u8]) -> Result<Vec<u8>, Broken> {
    if !matches!(stride, 2 | 4) {
        return Err(STRIDE);
    }
    if !count.is_multiple_of(3) {
        return Err("its indices are no triangles");
    }
    let (version, mut rest) = opened(packet, 0xe0)?;
    let codes = take(&mut rest, count / 3)?;
    let (rest, table) = rest.split_last_chunk::<16>().ok_or(SHORT)?;
    let mut edges = RecentIndices::new([u32::MAX; 2]);
    let mut corners = RecentCorners {
        rest,
        new: 0,
        last: 0,
        recent: RecentIndices::new(u32::MAX),
    };
    let mut out = Vec::with_capacity(count * stride);
    for &code in codes {
        let (high, low) = (code >> 4, code & 15);
        let [a, b, c] = if high < 15 {
            let [a, b] = edges.back(usize::from(high) + 1);
            [a, b, corners.third(low, version)?]
        } else {
            let is_written = low >= 14;
            let two = if is_written {
                take(&mut corners.rest, 1)?[0]
            } else {
                table[usize::from(low)]
            };
            if is_written && two == 0 {
                corners.new = 0;
            }
            let found = corners.triangle([if low == 15 { 15 } else { 0 }, two >> 4, two & 15])?;
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
        Err(LONG)
    }
}

/// Decodes a packet of indices in any order to `count` indices of `stride` bytes each.
pub(crate) fn sequence(count: usize, stride: usize, packet: &[u8]) -> Result<Vec<u8>, Broken> {
    if !matches!(stride, 2 | 4) {
        return Err(STRIDE);
    }
    let (_, rest) = opened(packet, 0xd0)?;
    let (mut rest, _) = rest.split_last_chunk::<4>().ok_or(SHORT)?;
    let (mut last, mut out) = ([0_u32; 2], Vec::new());
    for _ in 0..count {
        let code = whole(&mut rest)?;
        let last = &mut last[(code & 1) as usize];
        *last = last.wrapping_add(difference(code >> 1));
        out.extend(&last.to_le_bytes()[..stride]);
    }
    if rest.is_empty() { Ok(out) } else { Err(LONG) }
}
