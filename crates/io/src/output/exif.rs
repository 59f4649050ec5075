//! Exif metadata, for picture formats that have no text entries of their own. The tag `Software`
//! holds the name of the program. The image description holds all other entries, a line for each
//! (JEITA, "Exchangeable image file format for digital still cameras: Exif Version 2.3", 2010).

use std::collections::BTreeMap;

use super::metadata::{PictureMetadata, SOFTWARE};

/// Header of a little-endian Exif block. Its last four bytes are the offset of the directory.
const BLOCK_HEADER: &[u8; 8] = b"II*\0\x08\0\0\0";
const DESCRIPTION: u16 = 0x010e;
const PROGRAM: u16 = 0x0131;
/// Code of the type "zero-terminated text".
const ASCII: u16 = 2;
/// Size of a directory entry in bytes.
const ENTRY_BYTES: usize = 12;
/// Largest size of an Exif block in bytes. A JPEG segment holds at most 65 533 bytes.
const MOST_BYTES: usize = 60_000;

/// Encodes metadata as an Exif block; empty without metadata. Entries beyond the size limit are
/// left out.
pub(super) fn encode_block(metadata: &PictureMetadata) -> Vec<u8> {
    let (mut software, mut lines, mut bytes) = (String::new(), String::new(), 0);
    for (_, name, text) in metadata.entries() {
        let text = text.replace(['\r', '\n'], " ");
        bytes += name.len() + text.len() + 3;
        if bytes > MOST_BYTES {
            break;
        }
        match name {
            SOFTWARE => software = text,
            _ => lines += &format!("{name}: {text}\n"),
        }
    }
    let texts: Vec<(u16, String)> = [(DESCRIPTION, lines), (PROGRAM, software)]
        .into_iter()
        .filter(|(_, text)| !text.is_empty())
        .collect();
    if texts.is_empty() {
        return Vec::new();
    }
    let mut block = BLOCK_HEADER.to_vec();
    block.extend((texts.len() as u16).to_le_bytes());
    let mut index = BLOCK_HEADER.len() + 2 + ENTRY_BYTES * texts.len() + 4;
    let mut rest = Vec::new();
    for (tag, text) in &texts {
        let length = text.len() + 1;
        block.extend(tag.to_le_bytes());
        block.extend(ASCII.to_le_bytes());
        block.extend((length as u32).to_le_bytes());
        // Texts of up to four bytes are stored in the entry itself.
        let mut bytes = text.clone().into_bytes();
        bytes.push(0);
        if length <= 4 {
            bytes.resize(4, 0);
            block.extend(bytes);
        } else {
            block.extend((index as u32).to_le_bytes());
            index += length;
            rest.extend(bytes);
        }
    }
    block.extend([0; 4]);
    block.extend(rest);
    block
}

/// Decodes the texts of an Exif block. Each text gets the name that OpenEXR files use for it. Only
/// the layout that [`encode_block`] writes is read; any other block gives no texts.
pub(super) fn decode_texts(block: &[u8]) -> BTreeMap<String, String> {
    let mut texts = BTreeMap::new();
    let Some(count) = block
        .strip_prefix(BLOCK_HEADER)
        .and_then(|rest| rest.first_chunk::<2>())
    else {
        return texts;
    };
    for position in 0..usize::from(u16::from_le_bytes(*count)) {
        let start = BLOCK_HEADER.len() + 2 + ENTRY_BYTES * position;
        let Some(text) = block
            .get(start..start + ENTRY_BYTES)
            .and_then(|entry| decode_entry(block, entry))
        else {
            continue;
        };
        match text {
            (PROGRAM, text) => {
                texts.insert(SOFTWARE.to_owned(), text);
            }
            (_, lines) => texts.extend(
                lines
                    .lines()
                    .filter_map(|line| line.split_once(": "))
                    .map(|(name, text)| (name.to_owned(), text.to_owned())),
            ),
        }
    }
    texts
}

/// Returns tag and text of a directory entry; `None` for an unknown tag.
fn decode_entry(block: &[u8], entry: &[u8]) -> Option<(u16, String)> {
    let short = |position: usize| u16::from_le_bytes([entry[position], entry[position + 1]]);
    let long = |position: usize| {
        u32::from_le_bytes([
            entry[position],
            entry[position + 1],
            entry[position + 2],
            entry[position + 3],
        ]) as usize
    };
    let (tag, kind, length) = (short(0), short(2), long(4));
    if kind != ASCII || ![DESCRIPTION, PROGRAM].contains(&tag) {
        return None;
    }
    let bytes = if length <= 4 {
        entry.get(8..8 + length)?
    } else {
        block.get(long(8)..long(8).checked_add(length)?)?
    };
    let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    Some((tag, String::from_utf8_lossy(text).into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metadata() -> PictureMetadata {
        PictureMetadata {
            software: "Raywright 0.1.0".into(),
            command: "raywright render \u{fc}ber.glb\n--spp 4".into(),
            seed: Some(7),
            ..PictureMetadata::default()
        }
    }

    /// Protects: written metadata are read back, except for line ends, and empty metadata write no
    /// block.
    #[test]
    fn blocks_are_read_again() {
        let texts = decode_texts(&encode_block(&metadata()));
        let back = PictureMetadata::from_texts(&texts);
        assert_eq!(
            back,
            PictureMetadata {
                command: "raywright render \u{fc}ber.glb --spp 4".into(),
                ..metadata()
            }
        );
        assert!(encode_block(&PictureMetadata::default()).is_empty());
        let short = PictureMetadata {
            software: "R 1".into(),
            ..PictureMetadata::default()
        };
        assert_eq!(
            PictureMetadata::from_texts(&super::decode_texts(&encode_block(&short))),
            short
        );
    }

    /// Protects: a text beyond the size limit does not displace others, and a truncated block or
    /// false lengths cause no panic.
    #[test]
    fn broken_blocks_are_read_as_far_as_they_go() {
        let long = PictureMetadata {
            command: "x".repeat(MOST_BYTES),
            ..metadata()
        };
        let whole = encode_block(&long);
        assert!(
            whole.len() < MOST_BYTES
                && PictureMetadata::from_texts(&decode_texts(&whole)).software == "Raywright 0.1.0"
        );
        let whole = encode_block(&metadata());
        for end in 0..whole.len() {
            decode_texts(&whole[..end]);
        }
        for position in 8..40 {
            let mut broken = whole.clone();
            broken[position] = 0xff;
            decode_texts(&broken);
        }
    }
}
