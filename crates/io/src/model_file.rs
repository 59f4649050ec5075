//! Import of a model file of any format, for the command line and for scenes that name model files.

use std::path::Path;

use raywright_core::Observer;

use crate::folder::Folder;
use crate::gltf::{self, ImportedModel, ModelChoice, ModelContents};
use crate::limits::Limits;
use crate::source::SceneFormat;
use crate::{Error, obj, ply, stl};

/// Imports a model from its bytes, with the files in its folder. Formats without scenes and
/// animations ignore the choices.
///
/// # Errors
/// An error of kind input, limit or usage, from the importers.
pub(crate) fn load(
    format: SceneFormat,
    file: &Path,
    bytes: &[u8],
    (folder, limits): (&Folder, &Limits),
    choice: &ModelChoice<'_>,
    observer: &dyn Observer,
) -> Result<ImportedModel, Error> {
    let import = match format {
        SceneFormat::Obj => obj::import,
        SceneFormat::Stl => stl::import,
        SceneFormat::Ply => ply::import,
        SceneFormat::Gltf | SceneFormat::Glb | SceneFormat::Native(_) => {
            return gltf::load(file, bytes, folder, limits, choice, observer);
        }
    };
    let (scene, warnings) =
        import(file, bytes, folder, limits).map_err(|fault| fault.into_error(file.display()))?;
    Ok(ImportedModel {
        scene,
        warnings,
        contents: ModelContents::default(),
    })
}
