//! Choice among a glTF file's scenes, material variants and animations, and the list of these
//! choices.

use std::collections::BTreeSet;

use raywright_core::suggest::most_similar_word;

use super::accessor::AccessorReader;
use super::document::Document;
use super::extensions;
use super::keyframes::KeyframeReader;
use crate::error_kind::ErrorKind;
use crate::import::{Fault, ImportResult, sanitise_text};

/// The user's choices for a glTF file. `None` stands for the default scene, the default materials
/// and the rest pose.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ModelChoice<'a> {
    /// Name or index of a scene.
    pub scene: Option<&'a str>,
    /// Name of a material variant.
    pub variant: Option<&'a str>,
    /// Name or index of an animation; `None` plays all animations together.
    pub animation: Option<&'a str>,
    /// Time in seconds from the start of the animations; `None` shows the rest pose.
    pub time: Option<f64>,
}

/// Names of the scenes, variants, animations and extensions in a model file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelContents {
    /// Names of the scenes by index; an unnamed scene has an empty name.
    pub scenes: Vec<String>,
    /// Names of the material variants.
    pub variants: Vec<String>,
    /// Animations by index.
    pub animations: Vec<AnimationInfo>,
    /// Extensions used by the file, in alphabetical order.
    pub extensions: Vec<ExtensionInfo>,
}

/// A glTF extension that a model file uses, and whether it is supported.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExtensionInfo {
    /// Name of the extension, such as `KHR_materials_ior`.
    pub name: String,
    /// Whether the file declares the extension as required.
    pub required: bool,
    /// Whether the extension is supported. An unsupported extension is ignored.
    pub is_supported: bool,
}

/// An animation of a model file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AnimationInfo {
    /// Name of the animation; may be empty.
    pub name: String,
    /// Time of the last keyframe in seconds; `None` without keyframes.
    pub seconds: Option<f64>,
}

impl ModelContents {
    /// Returns the duration of an animation in seconds, or of the longest animation if `animation`
    /// is `None`. The animation is found by name or, if no name matches, by index. Returns `None`
    /// for an unknown animation, and for an animation without keyframes.
    pub fn animation_seconds(&self, animation: Option<&str>) -> Option<f64> {
        let Some(wish) = animation else {
            return self
                .animations
                .iter()
                .filter_map(|of| of.seconds)
                .reduce(f64::max);
        };
        let names: Vec<&str> = self.animations.iter().map(|of| of.name.as_str()).collect();
        self.animations
            .get(find_by_name_or_index(&names, wish)?)?
            .seconds
    }
}

/// Returns the index of `wish` among `names`. If no name matches, `wish` is parsed as an index.
fn find_by_name_or_index(names: &[&str], wish: &str) -> Option<usize> {
    let by_name = names
        .iter()
        .position(|name| !name.is_empty() && *name == wish);
    by_name.or_else(|| {
        wish.parse::<usize>()
            .ok()
            .filter(|&index| index < names.len())
    })
}

/// Lists the scenes, variants, animations and extensions of a file. Faults in an animation are not
/// reported here, but when the animation is played.
pub(super) fn list_contents(document: &Document, reader: &AccessorReader<'_>) -> ModelContents {
    let mut keys = KeyframeReader::new(reader);
    let name = |name: &Option<String>| sanitise_text(name.as_deref().unwrap_or_default());
    let animations = document.animations.iter().map(|animation| {
        let ends = animation
            .samplers
            .iter()
            .filter_map(|sampler| keys.last_key_time(sampler));
        AnimationInfo {
            name: name(&animation.name),
            seconds: ends.reduce(f64::max),
        }
    });
    let named: BTreeSet<&String> = document
        .extensions()
        .chain(&document.extensions_required)
        .collect();
    let extension = |name: &String| ExtensionInfo {
        name: sanitise_text(name),
        required: document.extensions_required.contains(name),
        is_supported: extensions::is_supported(name),
    };
    ModelContents {
        extensions: named.into_iter().map(extension).collect(),
        animations: animations.collect(),
        scenes: document
            .scenes
            .iter()
            .map(|scene| name(&scene.name))
            .collect(),
        variants: variant_names(document)
            .iter()
            .map(|variant| sanitise_text(variant))
            .collect(),
    }
}

fn variant_names(document: &Document) -> Vec<&str> {
    document
        .extensions
        .variants
        .variants
        .iter()
        .map(|variant| variant.name.as_deref().unwrap_or_default())
        .collect()
}

/// Finds a scene by name or, if no name matches, by index.
///
/// # Errors
/// A fault of kind choice that lists the scenes.
pub(super) fn find_scene(document: &Document, wish: &str) -> ImportResult<usize> {
    let names: Vec<&str> = document
        .scenes
        .iter()
        .map(|scene| scene.name.as_deref().unwrap_or_default())
        .collect();
    find_by_name_or_index(&names, wish)
        .ok_or_else(|| unknown_name_fault("scene", wish, &names, true))
}

/// Keeps the channels of a single animation and clears the channels of all others. The animation is
/// found by name or, if no name matches, by index.
///
/// # Errors
/// A fault of kind choice that lists the animations.
pub(super) fn select_animation(document: &mut Document, wish: &str) -> ImportResult<()> {
    let names: Vec<&str> = document
        .animations
        .iter()
        .map(|animation| animation.name.as_deref().unwrap_or_default())
        .collect();
    let chosen = find_by_name_or_index(&names, wish)
        .ok_or_else(|| unknown_name_fault("animation", wish, &names, true))?;
    // The animations stay, because messages use their indices.
    let others = document
        .animations
        .iter_mut()
        .enumerate()
        .filter(|(index, _)| *index != chosen);
    others.for_each(|(_, animation)| animation.channels.clear());
    Ok(())
}

/// Finds a material variant by name, and returns its index.
///
/// # Errors
/// A fault of kind choice that lists the variants.
pub(super) fn find_variant(document: &Document, wish: &str) -> ImportResult<u32> {
    let names = variant_names(document);
    let found = names.iter().position(|name| *name == wish);
    found
        .map(|index| index as u32)
        .ok_or_else(|| unknown_name_fault("variant", wish, &names, false))
}

/// Creates the fault for an unknown name, with the closest known name and the list of names.
fn unknown_name_fault(label: &str, wish: &str, names: &[&str], by_index: bool) -> Fault {
    const MOST: usize = 20;
    let wish = sanitise_text(wish);
    if names.is_empty() {
        return Fault::with_kind(
            ErrorKind::Usage,
            format!("has no {label}s, but the {label} `{wish}` was requested"),
        );
    }
    let listed = names.iter().take(MOST).enumerate().map(|(index, name)| {
        match (by_index, name.is_empty()) {
            (true, true) => index.to_string(),
            (true, false) => format!("{index} `{}`", sanitise_text(name)),
            (false, _) => format!("`{}`", sanitise_text(name)),
        }
    });
    let list = listed
        .chain((names.len() > MOST).then(|| "…".to_owned()))
        .collect::<Vec<_>>()
        .join(", ");
    let meant =
        match most_similar_word(&wish, names.iter().copied().filter(|name| !name.is_empty())) {
            Some(name) => format!("did you mean `{}`? Its", sanitise_text(name)),
            None => "its".to_owned(),
        };
    Fault::with_kind(
        ErrorKind::Usage,
        format!("has no {label} `{wish}`; {meant} {label}s: {list}"),
    )
}
