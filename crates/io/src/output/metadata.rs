//! What a picture says about its origin, the same in both formats.

use serde::{Deserialize, Serialize};

/// Where a picture comes from. Empty entries are left out of files.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Metadata {
    /// Program and version, such as `Raywright 0.1.0`.
    pub software: String,
    /// Hash of everything the scene was made from.
    pub scene_hash: String,
    /// The settings that decide the picture's bits, in a form that people and programs can read.
    pub settings: String,
    /// Seed of the sampler.
    pub seed: Option<u64>,
    /// The command line.
    pub command: String,
}

impl Metadata {
    /// Name of each entry, in PNG and in OpenEXR, and its text.
    pub(super) fn entries(&self) -> impl Iterator<Item = (&'static str, &'static str, String)> {
        let seed = self.seed.map(|seed| seed.to_string()).unwrap_or_default();
        let texts = [&self.software, &self.scene_hash, &self.settings, &seed, &self.command];
        // Neither format can hold a NUL inside a text.
        let texts = texts.map(|text| text.replace('\0', "\u{fffd}"));
        NAMES.into_iter().zip(texts).filter(|(_, text)| !text.is_empty()).map(|((png, exr), text)| (png, exr, text))
    }
}

/// What the entry for the software begins with in a picture of ours.
pub(super) const PROGRAM: &str = "Raywright";

/// Whether an entry of a PNG or OpenEXR file bears a name that we write.
pub(super) fn is_own_entry(name: &str) -> bool {
    NAMES.iter().any(|&(png, exr)| name == png || name == exr)
}

/// OpenEXR's own attribute for the program.
pub(super) const SOFTWARE: &str = "software";

/// Names of the entry for the settings.
pub(super) const SETTINGS: (&str, &str) = ("Raywright settings", "raywright_settings");

/// `Software` and `software` are the formats' own conventions; the others say whose they are.
const NAMES: [(&str, &str); 5] = [
    ("Software", SOFTWARE),
    ("Raywright scene hash", "raywright_scene_hash"),
    SETTINGS,
    ("Raywright seed", "raywright_seed"),
    ("Raywright command", "raywright_command"),
];
