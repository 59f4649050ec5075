//! Built-in scenes: the files of `scenes/` at the time of the build.

use raywright_core::suggest::most_similar_word;

use crate::error::Error;
use crate::native;

include!(concat!(env!("OUT_DIR"), "/embedded.rs"));

/// A built-in scene: its name, title and text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Name without the extension `.scene.toml`.
    pub name: &'static str,
    /// Title from the scene file; may be empty.
    pub title: String,
    /// Text of the whole file.
    pub text: &'static str,
}

/// Returns all presets, ordered by name.
pub fn list() -> Vec<Preset> {
    PRESETS
        .iter()
        .map(|&(name, text)| Preset {
            name,
            title: native::read_title(text),
            text,
        })
        .collect()
}

/// Returns the names of all presets, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|&(name, _)| name)
}

/// Returns the built-in scene with this name.
///
/// # Errors
/// Of kind [`ErrorKind::Usage`](crate::ErrorKind::Usage) for an unknown name, with the closest
/// known name.
pub fn get(name: &str) -> Result<Preset, Error> {
    if let Some(&(name, text)) = PRESETS.iter().find(|(known, _)| *known == name) {
        return Ok(Preset {
            name,
            title: native::read_title(text),
            text,
        });
    }
    let hint = match most_similar_word(name, names()) {
        Some(word) => format!("did you mean `preset:{word}`?"),
        None if PRESETS.is_empty() => {
            "this program was built without presets: give the path of a scene file".to_owned()
        }
        None => format!("the presets: {}", names().collect::<Vec<_>>().join(", ")),
    };
    Err(Error::invalid_usage(format!("there is no preset `{name}`")).with_hint(hint))
}

/// Returns the bytes of a file that is built into the program. A preset names such a file as
/// `embedded:NAME`.
pub(crate) fn find_asset(name: &str) -> Option<&'static [u8]> {
    ASSETS
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, bytes)| *bytes)
}

/// Returns the names of all built-in files.
pub(crate) fn asset_names() -> impl Iterator<Item = &'static str> {
    ASSETS.iter().map(|&(name, _)| name)
}
