//! Images and meshes named by a native scene, read through its folder and added to the scene.

use std::path::Path;
use std::sync::Arc;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use raywright_core::fault;
use raywright_core::scene::{Image, MeshSource, Sky, SkyMap};
use raywright_core::suggest::most_similar_word;
use raywright_core::validate::{check_mesh_data, find_missing_uv_sets};

use super::models::unreadable_file_error;
use super::{ParsedScene, colours, models};
use crate::error::Error;
use crate::error_kind::ErrorKind;
use crate::folder::{Folder, ReadError};
use crate::image_file::{self, DecodedImage};
use crate::import::{DecodeBudget, Fault};
use crate::limits::Limits;
use crate::{mesh_file, presets};

/// Prefix of a built-in image.
const EMBEDDED: &str = "embedded:";

/// Reads every file that a scene names. A missing texture gives a warning; any other missing file
/// gives an error at the position of its name in the text.
pub(crate) fn read_files(
    parsed: &mut ParsedScene<'_>,
    outer: &Folder,
    limits: &Limits,
) -> Result<Vec<fault::Fault>, Error> {
    let mut warnings = colours::warn_colour_codes(parsed.file, &parsed.scene);
    warnings.extend(read_images(parsed, outer, limits)?);
    for i in 0..parsed.scene.meshes.len() {
        warnings.extend(read_mesh(parsed, i, outer, limits)?);
    }
    warnings.extend(models::add_models(parsed, outer, limits)?);
    warnings.extend(
        find_missing_uv_sets(&parsed.scene)
            .into_iter()
            .map(|problem| parsed.warning_at(&problem)),
    );
    Ok(warnings)
}

/// Reads and decodes all images of a scene. Returns a warning for each missing texture, and for
/// each repaired image.
fn read_images(
    parsed: &mut ParsedScene<'_>,
    folder: &Folder,
    limits: &Limits,
) -> Result<Vec<fault::Fault>, Error> {
    let mut budget = DecodeBudget::new(limits);
    let mut warnings = Vec::new();
    let mut waiting = Vec::new();
    for i in 0..parsed.scene.images.len() {
        match read_image(parsed, i, folder)? {
            Ok(bytes) => {
                image_file::reserve_picture_memory(&bytes, limits, &mut budget)
                    .map_err(|fault| image_error(parsed, i, &fault))?;
                waiting.push((i, bytes));
            }
            Err(reason) => {
                let name = &parsed.scene.images[i].name;
                let message =
                    format!("image `{name}`: {reason}; materials are shown without this image");
                warnings.push(fault::FaultKind::Picture.in_file(parsed.file, message));
            }
        }
    }
    let decode = |(i, bytes): (usize, Vec<u8>)| (i, image_file::decode(&bytes, limits));
    let decoded: Vec<_> = match waiting.len() {
        // A single image is decoded without the pool.
        0 | 1 => waiting.into_iter().map(decode).collect(),
        _ => waiting.into_par_iter().map(decode).collect(),
    };
    for (i, data) in decoded {
        let DecodedImage {
            image,
            remarks,
            repaired_count: repaired,
        } = data.map_err(|fault| image_error(parsed, i, &fault))?;
        let name = &parsed.scene.images[i].name;
        warnings.extend(remarks.into_iter().map(|remark| {
            image_file::remark_kind(repaired)
                .in_file(parsed.file, format!("image `{name}` {remark}"))
        }));
        (parsed.scene.images[i].data, parsed.scene.images[i].mended) =
            (Some(Arc::new(image)), repaired);
    }
    Ok(warnings)
}

/// Reads the file of the mesh with this index, and puts its vertices and triangles into the scene.
/// A mesh without a file stays as it is. Returns the warnings of the file.
fn read_mesh(
    parsed: &mut ParsedScene<'_>,
    index: usize,
    outer: &Folder,
    limits: &Limits,
) -> Result<Vec<fault::Fault>, Error> {
    let MeshSource::File(reference) = &parsed.scene.meshes[index].source else {
        return Ok(Vec::new());
    };
    let at = format!("meshes[{index}].source.file");
    let bytes = outer
        .read(reference)
        .map_err(|why| unreadable_file_error(parsed, &at, &why))?;
    let folder = outer
        .folder_of_reference(reference)
        .map_err(|why| unreadable_file_error(parsed, &at, &why))?;
    let part = parsed.scene.meshes[index].model.clone().unwrap_or_default();
    let (mesh, warnings) =
        mesh_file::read_mesh(Path::new(reference), &bytes, &folder, limits, &part).map_err(
            |error| match error.kind() {
                // On the command line, an unknown choice is an error of kind usage. Written in a
                // scene, it is an error in the scene's content.
                ErrorKind::Usage => parsed.error_at(
                    ErrorKind::Input,
                    &format!("meshes[{index}].model.scene"),
                    error.message(),
                ),
                kind => parsed.error_at(kind, &at, error.message()),
            },
        )?;
    if let Some((path, message)) = check_mesh_data(&mesh).into_iter().next() {
        return Err(parsed.error_at(
            ErrorKind::Input,
            &at,
            format!("{path} of `{reference}`: {message}"),
        ));
    }
    outer.add_to_hash(folder.take_hash().to_string().as_bytes());
    (
        parsed.scene.meshes[index].source,
        parsed.scene.meshes[index].model,
    ) = (MeshSource::Inline(Arc::new(mesh)), None);
    Ok(warnings)
}

/// Reads the bytes of an image. If a texture's image is missing, returns the reason as
/// `Ok(Err(reason))`; the material then uses only its factor.
fn read_image(
    parsed: &ParsedScene<'_>,
    index: usize,
    folder: &Folder,
) -> Result<Result<Vec<u8>, String>, Error> {
    let Image { name, path, .. } = &parsed.scene.images[index];
    let at = format!("images[{index}].path");
    match path.strip_prefix(EMBEDDED) {
        Some(asset) => match presets::find_asset(asset) {
            Some(bytes) => Ok(Ok(bytes.to_vec())),
            None => Err(parsed.error_at(ErrorKind::Input, &at, unknown_asset_message(asset))),
        },
        None => match folder.read(path) {
            Ok(bytes) => Ok(Ok(bytes)),
            // A missing texture changes a detail of the picture, but a missing sky picture would
            // change all of it.
            Err(ReadError::Unreadable(reason)) if !is_sky_image(parsed, name) => Ok(Err(reason)),
            Err(why) => Err(unreadable_file_error(parsed, &at, &why)),
        },
    }
}

/// Creates the error for an image whose bytes cannot be decoded.
fn image_error(parsed: &ParsedScene<'_>, index: usize, fault: &Fault) -> Error {
    let message = format!("`{}` {}", parsed.scene.images[index].path, fault.message);
    parsed.error_at(fault.kind, &format!("images[{index}].path"), message)
}

fn is_sky_image(parsed: &ParsedScene<'_>, name: &str) -> bool {
    matches!(&parsed.scene.sky, Some(Sky::Map(SkyMap { image, .. })) if image == name)
}

fn unknown_asset_message(name: &str) -> String {
    match most_similar_word(name, presets::asset_names()) {
        Some(word) => {
            format!("the program has no built-in image `{name}`; did you mean `{EMBEDDED}{word}`?")
        }
        None => format!("the program has no built-in image `{name}`"),
    }
}
