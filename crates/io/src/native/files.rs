//! The images and meshes that a native scene names: read through its folder's gate and put into the scene.

use std::path::Path;
use std::sync::Arc;

use raywright_core::scene::{Image, ImageData, MeshSource, Sky, SkyMap};
use raywright_core::suggest::closest;
use raywright_core::validate::{mesh_data, missing_uv_sets};

use super::{Parsed, models};
use crate::error::{Error, Warning};
use crate::error_kind::ErrorKind;
use crate::folder::{Folder, ReadError};
use crate::import::{Budget, FaultKind};
use crate::limits::Limits;
use crate::{image_file, mesh_file, presets};

/// Marks an image that the program carries.
const EMBEDDED: &str = "embedded:";

/// Reads every file that a scene names. A missing texture is only a warning, everything else that cannot be had an error
/// at its place.
pub(crate) fn read(parsed: &mut Parsed<'_>, outer: &Folder, limits: &Limits) -> Result<Vec<Warning>, Error> {
    let mut budget = Budget::new(limits);
    let mut warnings = Vec::new();
    for i in 0..parsed.scene.images.len() {
        match image(parsed, i, outer, limits, &mut budget)? {
            Ok(data) => parsed.scene.images[i].data = Some(Arc::new(data)),
            Err(why) => {
                let name = &parsed.scene.images[i].name;
                let message = format!("image `{name}`: {why}; where it is used, the factor alone counts");
                warnings.push(Warning::new(parsed.file, message));
            }
        }
    }
    for i in 0..parsed.scene.meshes.len() {
        if let MeshSource::File(reference) = &parsed.scene.meshes[i].source {
            let at = format!("meshes[{i}].source.file");
            let bytes = outer.read(reference).map_err(|why| unread(parsed, &at, &why))?;
            let folder = outer.beside(reference).map_err(|why| unread(parsed, &at, &why))?;
            let part = parsed.scene.meshes[i].model.clone().unwrap_or_default();
            let (mesh, more) =
                mesh_file::read(Path::new(reference), &bytes, &folder, limits, &part).map_err(|error| match error.kind() {
                    // What a command line is blamed for there stands in the scene here.
                    ErrorKind::Usage => parsed.error(ErrorKind::Input, &format!("meshes[{i}].model.scene"), error.message()),
                    kind => parsed.error(kind, &at, error.message()),
                })?;
            if let Some((path, message)) = mesh_data(&mesh).into_iter().next() {
                return Err(parsed.error(ErrorKind::Input, &at, format!("{path} of `{reference}`: {message}")));
            }
            outer.note(folder.hash().as_bytes());
            warnings.extend(more);
            (parsed.scene.meshes[i].source, parsed.scene.meshes[i].model) = (MeshSource::Inline(Arc::new(mesh)), None);
        }
    }
    warnings.extend(models::read(parsed, outer, limits)?);
    warnings.extend(missing_uv_sets(&parsed.scene).into_iter().map(|problem| parsed.warning(&problem)));
    Ok(warnings)
}

/// The pixels of an image, or why only its factor counts.
fn image(
    parsed: &Parsed<'_>,
    index: usize,
    folder: &Folder,
    limits: &Limits,
    budget: &mut Budget,
) -> Result<Result<ImageData, String>, Error> {
    let Image { name, path, .. } = &parsed.scene.images[index];
    let at = format!("images[{index}].path");
    let bytes = match path.strip_prefix(EMBEDDED) {
        Some(asset) => match presets::asset(asset) {
            Some(bytes) => bytes.to_vec(),
            None => return Err(parsed.error(ErrorKind::Input, &at, no_asset(asset))),
        },
        None => match folder.read(path) {
            Ok(bytes) => bytes,
            // A sky without its picture would be another scene; a texture is a refinement.
            Err(ReadError::Unreadable(why)) if !is_sky(parsed, name) => return Ok(Err(why)),
            Err(why) => return Err(unread(parsed, &at, &why)),
        },
    };
    let decoded = image_file::decode(&bytes, limits).and_then(|image| {
        budget.memory(image.width as usize * image.height as usize, size_of::<[f32; 4]>())?;
        Ok(image)
    });
    decoded.map(Ok).map_err(|fault| {
        let kind = if fault.kind == FaultKind::Limit { ErrorKind::Limit } else { ErrorKind::Input };
        parsed.error(kind, &at, format!("`{path}` {}", fault.message))
    })
}

fn is_sky(parsed: &Parsed<'_>, name: &str) -> bool {
    matches!(&parsed.scene.sky, Some(Sky::Map(SkyMap { image, .. })) if image == name)
}

pub(super) fn unread(parsed: &Parsed<'_>, at: &str, why: &ReadError) -> Error {
    let kind = match why {
        ReadError::Refused(_) => ErrorKind::Input,
        ReadError::Unreadable(_) => ErrorKind::File,
        ReadError::TooLarge(_) => ErrorKind::Limit,
    };
    parsed.error(kind, at, why.to_string())
}

fn no_asset(name: &str) -> String {
    match closest(name, presets::asset_names()) {
        Some(word) => format!("the program carries no `{name}`; did you mean `{EMBEDDED}{word}`?"),
        None => format!("the program carries no `{name}`"),
    }
}
