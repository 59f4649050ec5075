//! Import of a model file of any format, for the command line and for scenes that name model files.

use std::path::Path;

use raywright_core::Observer;

use crate::folder::Folder;
use crate::gltf::{self, Choice, Contents, Model};
use crate::limits::Limits;
use crate::source::Format;
use crate::{Error, obj, ply, stl};

/// Imports a model from its bytes, with the files in its folder. Formats without scenes and time
/// ignore the choices.
///
/// # Errors
/// An error of kind input, limit or usage, from the importers.
pub(crate) fn load(
    format: Format,
    file: &Path,
    bytes: &[u8],
    (folder, limits): (&Folder, &Limits),
    choice: &Choice<'_>,
    observer: &dyn Observer,
) -> Result<Model, Error> {
    let (scene, warnings) = match format {
        Format::Obj => obj::load(file, bytes, folder, limits)?,
        Format::Stl => stl::load(file, bytes, folder, limits)?,
        Format::Ply => ply::load(file, bytes, folder, limits)?,
        Format::Gltf | Format::Glb | Format::Native(_) => {
            return gltf::load(file, bytes, folder, limits, choice, observer);
        }
    };
    Ok(Model {
        scene,
        warnings,
        contents: Contents::default(),
    })
}
