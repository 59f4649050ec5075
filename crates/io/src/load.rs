//! From a path or preset to a checked scene, whatever notation or model format it is in.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use raywright_core::Scene;

use crate::error::{Error, Warning};
use crate::folder::{Folder, read_limited};
use crate::gltf;
use crate::limits::{Limits, human_bytes};
use crate::native::{self, Notation, Overrides};
use crate::{obj, presets};

/// Where a scene comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// A file: a native scene, glTF, GLB or OBJ.
    Path(PathBuf),
    /// One that the program carries, by its name.
    Preset(String),
}

/// What loading may be told.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Time and parameters in place of the file's.
    pub overrides: Overrides,
    /// What is refused.
    pub limits: Limits,
}

/// A scene that was read and found right.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene; every number evaluated, every image and mesh in memory.
    pub scene: Scene,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// SHA-256, in hexadecimal, of all bytes read, the time and the overridden parameters: equal hashes, equal scenes.
    pub hash: String,
    /// Where it came from.
    pub source: SourceInfo,
}

/// Where a scene came from.
#[derive(Clone, Debug)]
pub struct SourceInfo {
    /// As the user named it: a path, or `preset:NAME`.
    pub name: String,
    /// The name without folders and endings, for naming pictures.
    pub stem: String,
    /// What it was written in.
    pub format: Format,
    /// The text of a native scene.
    pub text: Option<Arc<str>>,
}

/// What a scene was written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A native scene.
    Native(Notation),
    /// glTF 2.0 with its buffers beside it or inside as text.
    Gltf,
    /// glTF 2.0 in one binary file.
    Glb,
    /// Wavefront OBJ.
    Obj,
}

/// Reads and checks a scene.
///
/// # Errors
/// [`Error`] says which kind: content, file, limit, or a preset or parameter that does not exist.
pub fn load(input: &Input, options: &LoadOptions) -> Result<Loaded, Error> {
    match input {
        Input::Preset(name) => {
            let preset = presets::get(name)?;
            let folder = Folder::none(options.limits.file_bytes);
            native_scene(&format!("preset:{name}"), name, preset.text, Notation::Toml, &folder, options)
        }
        Input::Path(path) => {
            let bytes = read(path, &options.limits)?;
            let folder = Folder::around(path, options.limits.file_bytes).map_err(|cause| Error::read(path, &cause))?;
            let name = path.display().to_string();
            match format_of(path, &bytes)? {
                Format::Native(notation) => {
                    let text = native::text(&name, bytes, options.limits.text_bytes)?;
                    native_scene(&name, &stem(path), &text, notation, &folder, options)
                }
                format => model(path, bytes, format, &folder, options),
            }
        }
    }
}

/// A model becomes a whole scene; time and parameters mean nothing to it.
fn model(path: &Path, bytes: Vec<u8>, format: Format, folder: &Folder, options: &LoadOptions) -> Result<Loaded, Error> {
    folder.note(&bytes);
    note_overrides(folder, &options.overrides);
    let (scene, warnings) = match format {
        Format::Obj => obj::load(path, &bytes, folder, &options.limits)?,
        _ => gltf::load(path, &bytes, folder, &options.limits)?,
    };
    let source = SourceInfo { name: path.display().to_string(), stem: stem(path), format, text: None };
    Ok(Loaded { scene, warnings, hash: folder.hash(), source })
}

fn native_scene(
    name: &str,
    stem: &str,
    text: &str,
    notation: Notation,
    folder: &Folder,
    options: &LoadOptions,
) -> Result<Loaded, Error> {
    folder.note(text.as_bytes());
    note_overrides(folder, &options.overrides);
    let scene = native::parse(name, text, notation, &options.overrides)?.scene;
    let source =
        SourceInfo { name: name.to_owned(), stem: stem.to_owned(), format: Format::Native(notation), text: Some(text.into()) };
    Ok(Loaded { scene, warnings: Vec::new(), hash: folder.hash(), source })
}

/// The hash covers what the command line changed.
fn note_overrides(folder: &Folder, overrides: &Overrides) {
    if let Some(t) = overrides.at {
        folder.note(b"t");
        folder.note(&t.to_le_bytes());
    }
    for (name, value) in &overrides.set {
        folder.note(name.as_bytes());
        folder.note(&value.to_le_bytes());
    }
}

fn read(path: &Path, limits: &Limits) -> Result<Vec<u8>, Error> {
    let unreadable = |cause: std::io::Error| Error::read(path, &cause);
    let file = File::open(path).map_err(unreadable)?;
    let limit = limits.file_bytes.max(limits.text_bytes);
    read_limited(file, limit)
        .map_err(unreadable)?
        .ok_or_else(|| Error::limit(path.display(), format!("the file is larger than the limit of {}", human_bytes(limit))))
}

/// The file's name without its folder and endings.
fn stem(path: &Path) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let endings = [".scene.toml", ".scene.json", ".toml", ".json", ".gltf", ".glb", ".obj"];
    let ending = endings.iter().find(|ending| name.to_ascii_lowercase().ends_with(*ending) && name.len() > ending.len());
    name[..name.len() - ending.map_or(0, |ending| ending.len())].to_owned()
}

/// What a file is written in, by its ending or, where that says nothing, by its first characters.
fn format_of(path: &Path, bytes: &[u8]) -> Result<Format, Error> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let start = bytes.trim_ascii_start();
    match ending.as_str() {
        _ if bytes.starts_with(b"glTF") => Ok(Format::Glb),
        "glb" => Ok(Format::Glb),
        "gltf" => Ok(Format::Gltf),
        "obj" => Ok(Format::Obj),
        "toml" => Ok(Format::Native(Notation::Toml)),
        "json" => Ok(Format::Native(Notation::Json)),
        _ if start.starts_with(b"{") => Ok(Format::Native(Notation::Json)),
        _ if start.starts_with(b"format") || start.starts_with(b"#") => Ok(Format::Native(Notation::Toml)),
        _ => {
            let message = "cannot tell what kind of scene this is";
            let hint = "scenes are read from .scene.toml, .scene.json, .gltf, .glb and .obj files";
            Err(Error::input(path.display(), message).with_hint(hint))
        }
    }
}
