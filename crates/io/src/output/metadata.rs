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
