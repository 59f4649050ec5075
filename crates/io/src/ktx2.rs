//! Decoding of two-dimensional KTX 2.0 files with one layer. Supported are Basis Universal pictures
//! (ETC1S or UASTC), as in KHR_texture_basisu, and uncompressed pictures of eight bits a channel;
//! both may be compressed with Zstandard. `basisu` transcodes and `ruzstd` decompresses.
//!
//! This module first checks that every range of the container lies in the file, that each mip level
//! has the size that its pixels need, and that the picture is within the limits. The checks are
//! needed because the transcoder adds offsets without a check for overflow.

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use raywright_core::scene::{ImageData, PixelData};
use ruzstd::StreamingDecoder;
use ruzstd::io::Read as _;

use crate::Limits;
use crate::image_file::check_size;
use crate::import::{Fault, ImportResult};

/// The first bytes of every KTX 2.0 file.
pub(crate) const SIGNATURE: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Size in bytes of the header, including the index of sections (KTX 2.0, section 3).
const HEADER: u64 = 80;
/// Largest number of mip levels. A picture with sides below 2³² pixels has at most 32 mip levels,
/// and the transcoder reads no more.
const MOST_LEVELS: u32 = 32;
/// Code of the BasisLZ supercompression scheme (KTX 2.0, section 3.6.1). The code zero stands for
/// no scheme.
const BASIS_LZ: u32 = 1;
/// Code of the Zstandard supercompression scheme.
const ZSTANDARD: u32 = 2;
/// Code of the colour model ETC1S, one of the two encodings of Basis Universal (Khronos Data Format
/// 1.3, section 5.6).
const ETC1S: u8 = 163;
/// Code of the colour model UASTC, the other encoding of Basis Universal.
const UASTC: u8 = 166;

/// Encoding of the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PixelCoding {
    /// A Basis Universal picture.
    Basis,
    /// Uncompressed, with eight bits a channel.
    Uncompressed {
        /// Number of channels: 3, or 4 with alpha.
        channels: usize,
        /// Whether the channel order is blue, green, red.
        is_bgr: bool,
    },
}

impl PixelCoding {
    /// Returns the pixel coding for a `VkFormat` number (Vulkan 1.3, section 34.1.1); `None` for an
    /// unsupported format. UNORM and SRGB formats have the same coding, because the texture, not
    /// the file, chooses the transfer curve.
    fn from_vk_format(format: u32) -> Option<Self> {
        let plain = |channels, reversed| {
            Some(Self::Uncompressed {
                channels,
                is_bgr: reversed,
            })
        };
        match format {
            0 => Some(Self::Basis),
            23 | 29 => plain(3, false),
            30 | 36 => plain(3, true),
            37 | 43 => plain(4, false),
            44 | 50 => plain(4, true),
            _ => None,
        }
    }
}

/// Fields of a KTX2 header that decoding needs, and the data of the largest mip level.
#[derive(Debug)]
struct Ktx2Container<'b> {
    width: u32,
    height: u32,
    coding: PixelCoding,
    /// Stored bytes of the largest mip level, still compressed.
    level: &'b [u8],
    compressed: bool,
}

/// Decodes the largest mip level of a file to RGBA codes.
///
/// # Errors
/// A fault of kind input for a broken file and for an unsupported layout or coding, of kind limit
/// for a picture larger than `limits` allow.
pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> ImportResult<ImageData> {
    let container = Ktx2Container::read(bytes, limits)?;
    let Ktx2Container { width, height, .. } = container;
    let pixels = match container.coding {
        PixelCoding::Basis => transcode_basis(bytes)?,
        PixelCoding::Uncompressed {
            channels,
            is_bgr: reversed,
        } => container.decode_uncompressed(channels, reversed)?,
    };
    if pixels.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(ktx2_fault("its size"));
    }
    Ok(ImageData {
        width,
        height,
        pixels: PixelData::Codes(pixels),
    })
}

/// Transcodes a Basis Universal picture.
fn transcode_basis(bytes: &[u8]) -> ImportResult<Vec<[u8; 4]>> {
    let transcoder = Transcoder::new(bytes).map_err(|_| ktx2_fault("its codebooks are invalid"))?;
    let codes = transcoder
        .transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
        .map_err(|e| ktx2_fault(&format!("{e:?}")))?;
    Ok(codes.as_chunks().0.to_vec())
}

fn ktx2_fault(reason: &str) -> Fault {
    fault!("is a broken KTX2 picture ({reason})")
}

/// Reads width and height of a file's largest mip level from its header.
///
/// # Errors
/// As [`decode`], for all faults that the header shows.
pub(crate) fn read_size(bytes: &[u8], limits: &Limits) -> ImportResult<[u32; 2]> {
    Ktx2Container::read(bytes, limits).map(|Ktx2Container { width, height, .. }| [width, height])
}

impl<'b> Ktx2Container<'b> {
    /// Reads the header of a file, and checks it against the file and the limits.
    fn read(bytes: &'b [u8], limits: &Limits) -> ImportResult<Self> {
        let word = |index: u64| header_u32(bytes, index);
        let long = |index: u64| header_u64(bytes, index);
        let [format, width, height, depth, layers, faces, levels, scheme] = [
            word(12)?,
            word(20)?,
            word(24)?,
            word(28)?,
            word(32)?,
            word(36)?,
            word(40)?,
            word(44)?,
        ];
        check_size(u64::from(width), u64::from(height), limits)?;
        if (depth, layers.max(1), faces) != (0, 1, 1) || levels > MOST_LEVELS {
            return Err(fault!(
                "is a KTX2 file with several layers, faces or depths; only flat pictures with one layer are supported"
            ));
        }
        let coding = PixelCoding::from_vk_format(format).ok_or_else(|| {
            let read = "ETC1S, UASTC (KHR_texture_basisu) and eight bits in three or four channels are supported";
            fault!("is a KTX2 picture of VkFormat {format}; {read}")
        })?;
        for (start, length) in [
            (word(48)?.into(), word(52)?.into()),
            (word(56)?.into(), word(60)?.into()),
            (long(64)?, long(72)?),
        ] {
            byte_range(bytes, start, length)?;
        }
        let has_codebooks = check_coding(bytes, coding, scheme)?;
        let mut container = Self {
            width,
            height,
            coding,
            level: &[],
            compressed: scheme == ZSTANDARD,
        };
        container.level = container.check_levels(bytes, levels.max(1))?;
        if has_codebooks {
            check_codebooks(bytes, long(64)?, long(72)?, levels.max(1))?;
        }
        Ok(container)
    }

    /// Checks that each mip level lies in the file and has the size that its pixels need. Returns
    /// the stored bytes of the largest mip level, which is the first.
    fn check_levels(&self, bytes: &'b [u8], count: u32) -> ImportResult<&'b [u8]> {
        let mut largest = None;
        for number in 0..u64::from(count) {
            let index = HEADER + 24 * number;
            let level = byte_range(
                bytes,
                header_u64(bytes, index)?,
                header_u64(bytes, index + 8)?,
            )?;
            let reported = if self.compressed {
                header_u64(bytes, index + 16)?
            } else {
                level.len() as u64
            };
            let is_checked = self.compressed || self.coding != PixelCoding::Basis;
            if is_checked && reported != self.level_size(number) {
                return Err(ktx2_fault(&format!(
                    "mip level {number} does not have the size that its pixels need"
                )));
            }
            largest = largest.or(Some(level));
        }
        Ok(largest.unwrap_or_default())
    }

    /// Returns the size of a decompressed mip level in bytes.
    fn level_size(&self, level: u64) -> u64 {
        let side = |pixels: u32| u64::from((pixels >> level.min(31)).max(1));
        let (width, height) = (side(self.width), side(self.height));
        match self.coding {
            // Blocks of sixteen bytes for 4×4 pixels.
            PixelCoding::Basis => width.div_ceil(4) * height.div_ceil(4) * 16,
            PixelCoding::Uncompressed { channels, .. } => width * height * channels as u64,
        }
    }

    /// Decodes uncompressed pixels to RGBA codes. `reversed` states that the channels are stored as
    /// blue, green, red; pictures without alpha become opaque.
    fn decode_uncompressed(&self, channels: usize, reversed: bool) -> ImportResult<Vec<[u8; 4]>> {
        let mut unpacked = Vec::new();
        let level = match self.compressed {
            false => self.level,
            true => {
                // The size was checked against the pixels and the limits.
                unpacked.resize(self.width as usize * self.height as usize * channels, 0);
                let mut decoder =
                    StreamingDecoder::new(self.level).map_err(|e| ktx2_fault(&e.to_string()))?;
                decoder
                    .read_exact(&mut unpacked)
                    .map_err(|_| ktx2_fault("its compressed data cannot be decompressed"))?;
                &unpacked
            }
        };
        let pixel = |texel: &[u8]| match *texel {
            [r, g, b] if !reversed => [r, g, b, 255],
            [b, g, r] => [r, g, b, 255],
            [r, g, b, a] if !reversed => [r, g, b, a],
            [b, g, r, a] => [r, g, b, a],
            _ => [255; 4],
        };
        Ok(level.chunks_exact(channels).map(pixel).collect())
    }
}

/// Checks that the colour model and the supercompression scheme of a file fit the coding of its
/// pixels. Returns whether the file has codebooks, as ETC1S pictures have.
fn check_coding(bytes: &[u8], coding: PixelCoding, scheme: u32) -> ImportResult<bool> {
    let model = colour_model(bytes).ok_or_else(truncated_header_fault)?;
    if coding == PixelCoding::Basis && ![ETC1S, UASTC].contains(&model) {
        return Err(fault!(
            "is a KTX2 picture of colour model {model}; ETC1S and UASTC are supported"
        ));
    }
    let is_etc1s = coding == PixelCoding::Basis && model == ETC1S;
    if is_etc1s != (scheme == BASIS_LZ) || scheme > ZSTANDARD {
        return Err(fault!(
            "is a KTX2 picture whose pixel format is not supported with supercompression {scheme}"
        ));
    }
    Ok(is_etc1s)
}

/// Returns the colour model in the first data format descriptor of a file; `None` beyond the end of
/// the file.
fn colour_model(bytes: &[u8]) -> Option<u8> {
    bytes
        .get(
            usize::try_from(read_u32(bytes, 48)?)
                .ok()?
                .checked_add(12)?,
        )
        .copied()
}

/// Returns `length` bytes of the file from byte `start` on.
fn byte_range(bytes: &[u8], start: u64, length: u64) -> ImportResult<&[u8]> {
    let end = start
        .checked_add(length)
        .and_then(|end| usize::try_from(end).ok());
    usize::try_from(start)
        .ok()
        .zip(end)
        .and_then(|(start, end)| bytes.get(start..end))
        .ok_or_else(|| {
            fault!("is a truncated KTX2 picture: {length} bytes from byte {start} are missing")
        })
}

/// Checks that the parts of BasisLZ's global data lie inside the range of that data (KTX 2.0,
/// section 3.12.2).
fn check_codebooks(bytes: &[u8], start: u64, length: u64, images: u32) -> ImportResult<()> {
    let broken = || fault!("is a broken KTX2 picture (its codebooks reach beyond their data)");
    let word = |index: u64| read_u32(bytes, index).map(u64::from).ok_or_else(broken);
    let whole = 20
        + 20 * u64::from(images)
        + word(start + 4)?
        + word(start + 8)?
        + word(start + 12)?
        + word(start + 16)?;
    if whole > length {
        return Err(broken());
    }
    Ok(())
}

fn truncated_header_fault() -> Fault {
    fault!("is a KTX2 picture that ends inside its header")
}

/// Reads a 32-bit number of the header at a byte position.
fn header_u32(bytes: &[u8], index: u64) -> ImportResult<u32> {
    read_u32(bytes, index).ok_or_else(truncated_header_fault)
}

/// Reads a 64-bit number of the header at a byte position.
fn header_u64(bytes: &[u8], index: u64) -> ImportResult<u64> {
    let (low, high) = (header_u32(bytes, index)?, header_u32(bytes, index + 4)?);
    Ok(u64::from(low) | u64::from(high) << 32)
}

/// Reads a little-endian 32-bit number at a byte position; `None` beyond the end.
fn read_u32(bytes: &[u8], index: u64) -> Option<u32> {
    let position = usize::try_from(index).ok()?;
    bytes
        .get(position..position.checked_add(4)?)?
        .try_into()
        .ok()
        .map(u32::from_le_bytes)
}

#[cfg(test)]
mod tests;
