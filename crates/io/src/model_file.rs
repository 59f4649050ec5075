//! A model file of any format, as a scene: for who names it on the command line, and for scenes
//! that name it.

use std::path::Path;

use raywright_core::Observer;

use crate::folder::Folder;
use crate::gltf::{self, Choice, Contents, Model};
use crate::limits::Limits;
use crate::source::Format;
use crate::{Error, obj, ply, stl};

/// Reads a model, given its bytes, with what lies in its folder. Formats without scenes and time
/// make nothing of the choice.
///
/// # Errors
/// An error of kind input, limit or usage, as the importers say.
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
