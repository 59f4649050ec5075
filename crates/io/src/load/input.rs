//! Input of the loader: the source of a scene, its bytes and its format.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::folder::{Resolver, read_file, read_up_to_limit};
use crate::import::MODELS;
use crate::limits::{Limits, format_bytes};
use crate::source::{SceneFormat, unsupported_format};

/// Source of a scene: a file, bytes in memory, or a built-in scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// A file: a native scene, glTF, GLB, OBJ, STL or PLY.
    Path(PathBuf),
    /// Content of a scene or model file without a path, from a pipe or an archive.
    Bytes {
        /// Name for messages.
        name: String,
        /// The whole content, from which the format is detected.
        bytes: Vec<u8>,
        /// Source of the files that the content names; `None`: such files cannot be read.
        resolver: Option<Resolver>,
    },
    /// A built-in scene, by its name.
    Preset(String),
}

impl Input {
    /// Reads a source to its end. `name` stands for the source in messages.
    ///
    /// # Errors
    /// An error of kind file if reading fails, of kind limit for more bytes than a file may have.
    pub fn from_reader(name: &str, source: impl Read, limits: &Limits) -> Result<Self, Error> {
        let bytes = check_input_size(
            Path::new(name),
            read_up_to_limit(source, 0, max_input_bytes(limits)),
            limits,
        )?;
        Ok(Self::Bytes {
            name: name.to_owned(),
            bytes,
            resolver: None,
        })
    }

    /// Returns the file name without folders and extensions, from which names of pictures are
    /// formed.
    pub fn file_stem(&self) -> String {
        match self {
            Self::Path(path) => file_stem(path),
            Self::Bytes { name, .. } => name.replace(' ', "-"),
            Self::Preset(name) => name.clone(),
        }
    }
}

/// Reads a scene or model file whole. A file beyond the limits is refused.
pub(super) fn read_input_file(path: &Path, limits: &Limits) -> Result<Vec<u8>, Error> {
    let file = File::open(path).map_err(|cause| Error::unreadable(path, &cause))?;
    check_input_size(path, read_file(&file, max_input_bytes(limits)), limits)
}

/// Size limit for input whose format is not known yet, in bytes.
fn max_input_bytes(limits: &Limits) -> u64 {
    limits.file_bytes.max(limits.text_bytes)
}

/// Returns the bytes of an input that was read, or the error for input that is unreadable or larger
/// than allowed.
fn check_input_size(
    path: &Path,
    read: std::io::Result<Option<Vec<u8>>>,
    limits: &Limits,
) -> Result<Vec<u8>, Error> {
    read.map_err(|cause| Error::unreadable(path, &cause))?
        .ok_or_else(|| {
            Error::over_limit(
                path.display(),
                format!(
                    "the file is larger than the limit of {}; simplify its meshes, or divide the file",
                    format_bytes(max_input_bytes(limits))
                ),
            )
        })
}

/// Returns the file name of a path without folders and extensions.
fn file_stem(path: &Path) -> String {
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    let endings = [
        ".scene.toml",
        ".scene.json",
        ".toml",
        ".json",
        ".gltf",
        ".glb",
        ".obj",
        ".stl",
        ".ply",
    ];
    let ending = endings
        .iter()
        .find(|ending| name.to_ascii_lowercase().ends_with(*ending) && name.len() > ending.len());
    name[..name.len() - ending.map_or(0, |ending| ending.len())].to_owned()
}

/// Returns the format of an input, or the error for an unsupported format.
pub(super) fn detect_format(path: &Path, bytes: &[u8]) -> Result<SceneFormat, Error> {
    SceneFormat::detect_scene_format(path, bytes).ok_or_else(|| {
        if let Some((format, remedy)) = unsupported_format(path) {
            return Error::invalid_input(path.display(), format!("{format} is not supported"))
                .with_hint(remedy);
        }
        let message = if bytes.is_empty() {
            "is empty"
        } else {
            "the format of the file is unknown"
        };
        let hint =
            format!("scenes are read from .scene.toml and .scene.json files, models from {MODELS}");
        Error::invalid_input(path.display(), message).with_hint(hint)
    })
}

#[cfg(test)]
mod tests;
