//! Scenes that the program carries: the files of `scenes/` as they were when it was built, and
//! nothing more.

use raywright_core::suggest::closest;

use crate::error::Error;
use crate::native;

include!(concat!(env!("OUT_DIR"), "/embedded.rs"));

/// A scene that the program carries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Name without the ending `.scene.toml`.
    pub name: &'static str,
    /// The scene's own line about itself; may be empty.
    pub title: String,
    /// The whole file.
    pub text: &'static str,
}

/// All presets, by name.
pub fn list() -> Vec<Preset> {
    PRESETS
        .iter()
        .map(|&(name, text)| Preset {
            name,
            title: native::title(text),
            text,
        })
        .collect()
}

/// Names of all presets, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|&(name, _)| name)
}

/// The preset of this name.
///
/// # Errors
/// Of kind [`ErrorKind::Usage`](crate::ErrorKind::Usage) if there is none; it suggests the nearest
/// one.
pub fn get(name: &str) -> Result<Preset, Error> {
    if let Some(&(name, text)) = PRESETS.iter().find(|(known, _)| *known == name) {
        return Ok(Preset {
            name,
            title: native::title(text),
            text,
        });
    }
    let hint = match closest(name, names()) {
        Some(word) => format!("did you mean `preset:{word}`?"),
        None if PRESETS.is_empty() => "this program was built without presets".to_owned(),
        None => format!("the presets: {}", names().collect::<Vec<_>>().join(", ")),
    };
    Err(Error::usage(format!("there is no preset `{name}`")).with_hint(hint))
}

/// An asset that the program carries for its presets: `embedded:NAME` in a scene.
pub(crate) fn asset(name: &str) -> Option<&'static [u8]> {
    ASSETS
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, bytes)| *bytes)
}

/// Names of all assets.
pub(crate) fn asset_names() -> impl Iterator<Item = &'static str> {
    ASSETS.iter().map(|&(name, _)| name)
}
