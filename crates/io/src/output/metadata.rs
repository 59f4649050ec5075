//! Metadata about the origin of a picture, the same in all formats.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Metadata about the origin of a picture. Empty entries are left out of files.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PictureMetadata {
    /// Program and version, such as `Raywright 0.1.0`.
    pub software: String,
    /// Hash of all files and texts that the scene was loaded from.
    pub scene_hash: String,
    /// Settings that determine the pixels, as `name=value` separated by spaces.
    pub settings: String,
    /// Seed of the random numbers.
    pub seed: Option<u64>,
    /// Command line that rendered the picture.
    pub command: String,
    /// Estimated error of the picture, as `name=value` separated by spaces; empty without an
    /// estimate.
    #[serde(default)]
    pub error: String,
}

impl PictureMetadata {
    /// Collects the metadata from the text entries of a picture file, in any format; empty without
    /// text entries of this program.
    pub(super) fn from_texts(texts: &BTreeMap<String, String>) -> Self {
        let text = |(png, exr): (&str, &str)| {
            texts
                .get(png)
                .or_else(|| texts.get(exr))
                .cloned()
                .unwrap_or_default()
        };
        let [software, scene_hash, settings, seed, command, error] = ENTRY_NAMES.map(text);
        Self {
            software,
            scene_hash,
            settings,
            seed: seed.parse().ok(),
            command,
            error,
        }
    }

    /// Returns the value of a setting, such as `gamma`.
    pub fn setting(&self, name: &str) -> Option<&str> {
        find_named_value(&self.settings, name)
    }

    /// Returns the value of a name in the error entry, such as `root_relmse`.
    pub fn error_value(&self, name: &str) -> Option<&str> {
        find_named_value(&self.error, name)
    }

    /// Returns the non-empty entries, each with its name in PNG, its name in OpenEXR, and its text.
    pub(super) fn entries(&self) -> impl Iterator<Item = (&'static str, &'static str, String)> {
        let seed = self.seed.map(|seed| seed.to_string()).unwrap_or_default();
        let texts = [
            &self.software,
            &self.scene_hash,
            &self.settings,
            &seed,
            &self.command,
            &self.error,
        ];
        // Neither format can store a NUL inside a text, so that NULs are replaced.
        let texts = texts.map(|text| text.replace('\0', "\u{fffd}"));
        ENTRY_NAMES
            .into_iter()
            .zip(texts)
            .filter(|(_, text)| !text.is_empty())
            .map(|((png, exr), text)| (png, exr, text))
    }
}

/// Start of the `Software` entry in every picture of this program.
pub(super) const PROGRAM: &str = "Raywright";

/// Whether an entry of a PNG or OpenEXR file has a name used by this program.
pub(super) fn is_program_entry(name: &str) -> bool {
    ENTRY_NAMES
        .iter()
        .any(|&(png, exr)| name == png || name == exr)
}

/// Name of the standard OpenEXR attribute that holds the program.
pub(super) const SOFTWARE: &str = "software";

/// Returns the value of `name` in an entry that consists of `name=value` words. A value may be in
/// single quotes.
fn find_named_value<'a>(entry: &'a str, name: &str) -> Option<&'a str> {
    let starts = entry
        .match_indices(name)
        .map(|(position, _)| position)
        .filter(|&position| position == 0 || entry[..position].ends_with(' '));
    let value = starts
        .filter_map(|position| entry[position + name.len()..].strip_prefix('='))
        .next()?;
    match value.strip_prefix('\'') {
        Some(quoted) => quoted.split('\'').next(),
        None => value.split(' ').next(),
    }
}

/// Names of the entries, in PNG and in OpenEXR. `Software` and `software` follow the conventions of
/// the formats; the other names start with the name of the program.
const ENTRY_NAMES: [(&str, &str); 6] = [
    ("Software", SOFTWARE),
    ("Raywright scene hash", "raywright_scene_hash"),
    ("Raywright settings", "raywright_settings"),
    ("Raywright seed", "raywright_seed"),
    ("Raywright command", "raywright_command"),
    ("Raywright error", "raywright_error"),
];

// Exif metadata, for picture formats that have no text entries of their own. The tag `Software`
// holds the name of the program. The image description holds all other entries, a line for each
// (JEITA, "Exchangeable image file format for digital still cameras: Exif Version 2.3", 2010).

/// Header of a little-endian Exif block. Its last four bytes are the offset of the directory.
const BLOCK_HEADER: &[u8; 8] = b"II*\0\x08\0\0\0";
const DESCRIPTION: u16 = 0x010e;
const SOFTWARE_TAG: u16 = 0x0131;
/// Code of the type "zero-terminated text".
const ASCII: u16 = 2;
/// Size of a directory entry in bytes.
const ENTRY_BYTES: usize = 12;
/// Largest size of an Exif block in bytes. A JPEG segment holds at most 65 533 bytes.
const MOST_BYTES: usize = 60_000;

/// Encodes metadata as an Exif block; empty without metadata. Entries beyond the size limit are
/// left out.
pub(super) fn encode_exif_block(metadata: &PictureMetadata) -> Vec<u8> {
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
    let texts: Vec<(u16, String)> = [(DESCRIPTION, lines), (SOFTWARE_TAG, software)]
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
/// the layout that [`encode_exif_block`] writes is read; any other block gives no texts.
pub(super) fn decode_exif_texts(block: &[u8]) -> BTreeMap<String, String> {
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
            (SOFTWARE_TAG, text) => {
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
    if kind != ASCII || ![DESCRIPTION, SOFTWARE_TAG].contains(&tag) {
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
        let texts = decode_exif_texts(&encode_exif_block(&metadata()));
        let back = PictureMetadata::from_texts(&texts);
        assert_eq!(
            back,
            PictureMetadata {
                command: "raywright render \u{fc}ber.glb --spp 4".into(),
                ..metadata()
            }
        );
        assert!(encode_exif_block(&PictureMetadata::default()).is_empty());
        let short = PictureMetadata {
            software: "R 1".into(),
            ..PictureMetadata::default()
        };
        assert_eq!(
            PictureMetadata::from_texts(&super::decode_exif_texts(&encode_exif_block(&short))),
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
        let whole = encode_exif_block(&long);
        assert!(
            whole.len() < MOST_BYTES
                && PictureMetadata::from_texts(&decode_exif_texts(&whole)).software
                    == "Raywright 0.1.0"
        );
        let whole = encode_exif_block(&metadata());
        for end in 0..whole.len() {
            decode_exif_texts(&whole[..end]);
        }
        for position in 8..40 {
            let mut broken = whole.clone();
            broken[position] = 0xff;
            decode_exif_texts(&broken);
        }
    }
}
