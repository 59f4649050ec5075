//! KTX 2.0 files with Basis Universal pictures, as KHR_texture_basisu allows them: flat, one layer, ETC1S or UASTC, the latter
//! perhaps compressed by Zstandard. Transcoding is `basisu`'s; that every range of the container lies in the file, and that the
//! picture is not larger than is allowed, is looked at here first, since that crate adds offsets before it compares them.

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use raywright_core::scene::{ImageData, Pixels};

use crate::Limits;
use crate::image_file::check_size;
use crate::import::{Fault, Outcome};

/// The first bytes of every KTX 2.0 file.
pub(crate) const SIGNATURE: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Bytes of the header, the index of sections included (KTX 2.0, section 3).
const HEADER: u64 = 80;
/// Levels that a picture of 2³² pixels a side could have at most, and more than the transcoder reads.
const MOST_LEVELS: u32 = 32;
/// Zstandard and BasisLZ are the greatest of the schemes that KHR_texture_basisu allows.
const ZSTANDARD: u32 = 2;
/// Colour models of the two encodings (Khronos Data Format 1.3, section 5.6).
const ETC1S: u8 = 163;
const UASTC: u8 = 166;

/// What a file's header says, as far as it is needed.
#[derive(Debug)]
struct Container {
    width: u32,
    height: u32,
}

/// The largest level of a file, in the order and with the codes of its channels.
///
/// # Errors
/// A fault of kind input for a broken file and for one that is no flat picture in ETC1S or UASTC, of kind limit for a larger one
/// than `limits` allow.
pub(crate) fn decode(bytes: &[u8], limits: &Limits) -> Outcome<ImageData> {
    let Container { width, height } = Container::read(bytes, limits)?;
    let broken = |why: &str| Fault::input(format!("is a broken KTX2 picture ({why})"));
    let transcoder = Transcoder::new(bytes).map_err(|_| broken("its codebooks"))?;
    let codes = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(|e| broken(&format!("{e:?}")))?;
    let pixels: Vec<[u8; 4]> = codes.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
    if pixels.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(broken("its size"));
    }
    Ok(ImageData { width, height, pixels: Pixels::Codes(pixels) })
}

/// Width and height of a file's largest level, by its header.
///
/// # Errors
/// As [`decode`] for what a header can say.
pub(crate) fn size(bytes: &[u8], limits: &Limits) -> Outcome<[u32; 2]> {
    Container::read(bytes, limits).map(|Container { width, height }| [width, height])
}

impl Container {
    fn read(bytes: &[u8], limits: &Limits) -> Outcome<Self> {
        let short = || Fault::input("is a KTX2 picture that ends inside its header");
        let word = |at: u64| word(bytes, at).ok_or_else(short);
        let long = |at: u64| Ok::<u64, Fault>(u64::from(word(at)?) | u64::from(word(at + 4)?) << 32);
        let [format, width, height, depth, layers, faces, levels, scheme] =
            [word(12)?, word(20)?, word(24)?, word(28)?, word(32)?, word(36)?, word(40)?, word(44)?];
        check_size(u64::from(width), u64::from(height), limits)?;
        if (format, depth, layers.max(1), faces) != (0, 0, 1, 1) || scheme > ZSTANDARD || levels > MOST_LEVELS {
            return Err(Fault::input("is a KTX2 picture, but no flat one in ETC1S or UASTC (KHR_texture_basisu)"));
        }
        let inside = |start: u64, length: u64| match start.checked_add(length) {
            Some(end) if end <= bytes.len() as u64 => Ok(()),
            _ => Err(Fault::input(format!("is a KTX2 picture cut off: {length} bytes from byte {start} are missing"))),
        };
        let model = u64::from(word(48)?);
        for (start, length) in [(model, u64::from(word(52)?)), (word(56)?.into(), word(60)?.into()), (long(64)?, long(72)?)] {
            inside(start, length)?;
        }
        let model = *usize::try_from(model + 12).ok().and_then(|at| bytes.get(at)).ok_or_else(short)?;
        if ![ETC1S, UASTC].contains(&model) || (model == ETC1S) != (scheme == 1) {
            return Err(Fault::input(format!("is a KTX2 picture of colour model {model}; ETC1S and UASTC are read")));
        }
        for level in 0..u64::from(levels.max(1)) {
            let at = HEADER + 24 * level;
            inside(long(at)?, long(at + 8)?)?;
            // What Zstandard makes of a level is known: blocks of sixteen bytes for four by four pixels.
            let side = |pixels: u32| u64::from((pixels >> level.min(31)).max(1).div_ceil(4));
            if scheme == ZSTANDARD && long(at + 16)? != side(width) * side(height) * 16 {
                return Err(Fault::input(format!("is a broken KTX2 picture (level {level} is of another size)")));
            }
        }
        if scheme == 1 {
            codebooks(bytes, long(64)?, long(72)?, levels.max(1))?;
        }
        Ok(Self { width, height })
    }
}

/// The parts of BasisLZ's global data lie in it (KTX 2.0, section 3.12.2).
fn codebooks(bytes: &[u8], start: u64, length: u64, images: u32) -> Outcome<()> {
    let broken = || Fault::input("is a broken KTX2 picture (its codebooks reach beyond it)");
    let word = |at: u64| word(bytes, at).map(u64::from).ok_or_else(broken);
    let whole = 20 + 20 * u64::from(images) + word(start + 4)? + word(start + 8)? + word(start + 12)? + word(start + 16)?;
    if whole > length {
        return Err(broken());
    }
    Ok(())
}

/// A little-endian number.
fn word(bytes: &[u8], at: u64) -> Option<u32> {
    let at = usize::try_from(at).ok()?;
    bytes.get(at..at.checked_add(4)?)?.try_into().ok().map(u32::from_le_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::FaultKind;

    /// A block of one colour: UASTC's mode 8, then eight bits a channel.
    fn block(colour: [u8; 4]) -> [u8; 16] {
        (u128::from(u32::from_le_bytes(colour)) << 5 | 0x17).to_le_bytes()
    }

    /// A picture of UASTC blocks, row by row, whose level is stored as it is or as Zstandard.
    fn uastc(size: [u32; 2], blocks: &[[u8; 4]], zstandard: bool) -> Vec<u8> {
        let data: Vec<u8> = blocks.iter().flat_map(|colour| block(*colour)).collect();
        // One segment with its size in four bytes, one last block that is not compressed (RFC 8878, section 3.1.1).
        let length = (data.len() as u32).to_le_bytes();
        let header = ((data.len() as u32) << 3 | 1).to_le_bytes();
        let frame = [b"\x28\xb5\x2f\xfd\xa0".as_slice(), &length, &header[..3], &data].concat();
        let level = if zstandard { &frame } else { &data };
        let mut out = SIGNATURE.to_vec();
        let scheme = if zstandard { 2 } else { 0 };
        out.extend([0, 1, size[0], size[1], 0, 0, 1, 1, scheme, 104, 44, 0, 0].into_iter().flat_map(u32::to_le_bytes));
        out.extend([0_u64, 0, 148, level.len() as u64, data.len() as u64].into_iter().flat_map(u64::to_le_bytes));
        // One basic descriptor: colour model, primaries, the sRGB curve; blocks of four by four; a sample of all channels.
        let sample = [127 << 16 | 3 << 24, 0, 0, u32::MAX];
        out.extend([44, 0, 2 | 40 << 16, 0x0002_0100 | u32::from(UASTC), 0x0303, 16, 0].into_iter().flat_map(u32::to_le_bytes));
        out.extend(sample.into_iter().flat_map(u32::to_le_bytes));
        out.extend(level);
        out
    }

    /// Protects: pixels have the codes that their blocks say, in rows from the top, cut at the picture's edge, stored or compressed.
    #[test]
    fn blocks_of_one_colour() {
        let colours = [[255, 0, 0, 255], [1, 2, 3, 4], [0, 200, 7, 128], [9, 9, 9, 255]];
        for zstandard in [false, true] {
            let image = decode(&uastc([6, 5], &colours, zstandard), &Limits::default()).unwrap();
            let Pixels::Codes(codes) = image.pixels else { panic!("codes") };
            let expected = |i: usize| colours[(i / 6 / 4) * 2 + (i % 6) / 4];
            assert_eq!((image.width, image.height), (6, 5));
            assert_eq!(codes, (0..30).map(expected).collect::<Vec<_>>(), "zstandard {zstandard}");
        }
    }

    /// Protects: nothing is taken for a picture larger than allowed, and no cut or lie in the container is more than an error.
    #[test]
    fn broken_containers_are_refused() {
        let good = uastc([8, 4], &[[5; 4], [6; 4]], true);
        let small = Limits { image_pixels: 31, ..Limits::default() };
        assert_eq!(decode(&good, &small).unwrap_err().kind, FaultKind::Limit);
        for end in 0..good.len() {
            assert!(decode(&good[..end], &Limits::default()).is_err(), "cut at {end}");
        }
        for (at, value) in [(28, 1), (32, 2), (36, 6), (40, 33), (44, 3), (48, u32::MAX), (68, 1), (84, 1), (96, 1), (116, 162)] {
            let mut bad = good.clone();
            bad[at..at + 4].copy_from_slice(&value.to_le_bytes());
            assert!(decode(&bad, &Limits::default()).is_err(), "{value} at {at}");
        }
    }
}
