//! Radiance pictures (`.hdr`, `.pic`), as Radiance's own reader takes them: the header as any program writes it, scan lines with both kinds of
//! runs, and the order of the pixels.

use raywright_core::scene::{ImageData, Pixels};

use super::light::Unusable;
use super::{Decoded, broken, check_size};
use crate::Limits;
use crate::import::{Fault, Outcome, shown};
use crate::text::without_mark;

/// Bytes that a header may have.
const LONGEST: usize = 1 << 16;

/// Whether bytes begin as every such file does: `#?` and the name of a program.
pub(super) fn is_radiance(bytes: &[u8]) -> bool {
    matches!(without_mark(bytes), [b'#', b'?', letter, ..] if letter.is_ascii_alphabetic())
}

/// What a header says, and what follows it.
struct RadianceHeader<'b> {
    /// Scan lines, and the pixels of each.
    lines: u32,
    length: u32,
    /// Whether scan lines are columns.
    is_upright: bool,
    /// Whether columns are counted from the right, rows from the bottom.
    from_right: bool,
    from_bottom: bool,
    data: &'b [u8],
}

impl<'b> RadianceHeader<'b> {
    fn read(bytes: &'b [u8], limits: &Limits) -> Outcome<Self> {
        let mut rest = without_mark(bytes);
        let end = rest.len().saturating_sub(LONGEST);
        while rest.len() > end
            && let Some(length) = rest.iter().position(|&byte| byte == b'\n')
        {
            let line = String::from_utf8_lossy(rest.get(..length).unwrap_or_default());
            rest = rest.get(length + 1..).unwrap_or_default();
            if let Some(format) = line.trim().strip_prefix("FORMAT=")
                && format.trim() != "32-bit_rle_rgbe"
            {
                let message = "is a Radiance picture of format `{}`, which is not read here; 32-bit_rle_rgbe is";
                return Err(Fault::input(message.replace("{}", &shown(format.trim()))));
            }
            if let Some(header) = Self::resolution(&line, rest) {
                let [width, height] = header.size();
                check_size(u64::from(width), u64::from(height), limits)?;
                return Ok(header);
            }
        }
        Err(Fault::input("is a broken picture (its header has no line of its size, as `-Y 512 +X 1024`)"))
    }

    /// A line such as `-Y 512 +X 1024`: the axis across scan lines, then the one along them.
    fn resolution(line: &str, data: &'b [u8]) -> Option<Self> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [across, lines, along, length] = *words.as_slice() else { return None };
        let is_upright = match (across.get(1..)?, along.get(1..)?) {
            ("Y", "X") => false,
            ("X", "Y") => true,
            _ => return None,
        };
        let signs = [across.chars().next()?, along.chars().next()?];
        if !signs.iter().all(|sign| matches!(sign, '+' | '-')) {
            return None;
        }
        let [x, y] = if is_upright { signs } else { [signs[1], signs[0]] };
        let (lines, length) = (lines.parse().ok()?, length.parse().ok()?);
        Some(Self { lines, length, is_upright, from_right: x == '-', from_bottom: y == '+', data })
    }

    fn size(&self) -> [u32; 2] {
        if self.is_upright { [self.lines, self.length] } else { [self.length, self.lines] }
    }
}

/// Width and height.
///
/// # Errors
/// A fault of kind input for a broken header, of kind limit for a larger picture than is allowed.
pub(super) fn size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    RadianceHeader::read(bytes, limits).map(|header| header.size())
}

/// Decodes a picture. `EXPOSURE` and the like, by which programs multiply all pixels alike, are left to who looks at it.
///
/// # Errors
/// As [`size`], and of kind input for broken data.
pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Outcome<Decoded> {
    let header = RadianceHeader::read(bytes, limits)?;
    let scan_lines = scan_lines(&header)?;
    let ([width, height], mut unusable) = (header.size(), Unusable::default());
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        let row = if header.from_bottom { height - 1 - y } else { y };
        for x in 0..width {
            let column = if header.from_right { width - 1 - x } else { x };
            let [x, y] = if header.is_upright { [row, column] } else { [column, row] };
            let [r, g, b] =
                colour(scan_lines[y as usize * header.length as usize + x as usize]).map(|value| unusable.mend(value));
            pixels.push([r, g, b, 1.0]);
        }
    }
    Ok(Decoded {
        image: ImageData { width, height, pixels: Pixels::Linear(pixels) },
        remarks: unusable.remark().into_iter().collect(),
    })
}

/// All pixels as they are stored: three fractions and their common exponent. Room is made for what there is, not for what the header says.
fn scan_lines(header: &RadianceHeader<'_>) -> Outcome<Vec<[u8; 4]>> {
    let (mut rest, mut line, mut out) = (header.data, vec![[0; 4]; header.length as usize], Vec::new());
    for _ in 0..header.lines {
        scan_line(&mut rest, &mut line).ok_or_else(|| broken(&"its scan lines end too early, or are longer than it is wide"))?;
        out.extend_from_slice(&line);
    }
    Ok(out)
}

fn scan_line(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Option<()> {
    let first: [u8; 4] = *rest.first_chunk()?;
    if first[..2] != [2, 2] || first[2] >= 128 {
        return older_line(rest, line);
    }
    *rest = &rest[4..];
    for channel in 0..4 {
        let mut at = 0;
        while at < line.len() {
            let length = usize::from(*rest.split_off_first()?);
            // A run of one value, or as many values.
            let (length, values) = if length > 128 { (length - 128, 1) } else { (length, length) };
            let values = rest.split_off(..values)?;
            for (pixel, value) in line.get_mut(at..at + length)?.iter_mut().zip(values.iter().cycle()) {
                pixel[channel] = *value;
            }
            at += length;
        }
    }
    Some(())
}

/// Pixel after pixel; one of three ones says how often the last is repeated, in as many digits of 256 as there are such.
fn older_line(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Option<()> {
    let (mut at, mut digit) = (0, 1_usize);
    while at < line.len() {
        let pixel: [u8; 4] = *rest.split_off(..4)?.first_chunk()?;
        let (length, value) = match pixel {
            [1, 1, 1, times] => (usize::from(times).saturating_mul(digit), *line.get(at.checked_sub(1)?)?),
            _ => (1, pixel),
        };
        digit = if pixel[..3] == [1; 3] { digit.saturating_mul(256) } else { 1 };
        line.get_mut(at..at.checked_add(length)?)?.fill(value);
        at += length;
    }
    Some(())
}

/// The colour of a stored pixel. An exponent of 0 is black.
fn colour([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    let scale = if exponent == 0 { 0.0 } else { libm::scalbnf(1.0, i32::from(exponent) - 136) };
    [r, g, b].map(|fraction| f32::from(fraction) * scale)
}
