//! Import of PLY, the Stanford triangle format ("The PLY Polygon File Format", Turk, 1994), in
//! ASCII and in binary of either byte order.
//!
//! The importer reads:
//! - vertices with normals, colours and texture coordinates, in properties of any order and type;
//! - faces with any number of corners, triangulated as in OBJ files;
//! - colours and texture coordinates of faces, as scanners and MeshLab write them;
//! - triangle strips;
//! - the images that MeshLab names in comments, each on the faces whose `texnumber` is its index.
//!
//! Other elements and properties, lists included, are skipped.
//!
//! A file without normals is shown with flat facets, as in OBJ without smoothing groups. The file
//! does not state which edges are sharp, a cube is as likely as a scan, and the facets are the
//! measured data.
//!
//! This reader does not use the crate `ply-rs`, which creates a map from names to values for each
//! element, some hundred times the size of the file, and allocates by the counts that a header
//! claims.
mod faces;
mod header;
mod textures;
mod values;
mod vertices;

use std::path::Path;

use crate::folder::Folder;
use crate::import::{DecodeBudget, ImportResult, ImportedScene, Warnings, sanitise_text};
use crate::text::strip_byte_order_mark;
use crate::{Limits, obj};

use faces::PlyFaces;
use values::ValueStream;
use vertices::PlyVertices;

/// Whether bytes have the signature of a PLY file, for input without a file name.
pub(crate) fn is_ply(bytes: &[u8]) -> bool {
    matches!(
        strip_byte_order_mark(bytes),
        [b'p', b'l', b'y', b'\r' | b'\n', ..]
    )
}

/// Imports a PLY file from its bytes, with the image beside the file.
///
/// # Errors
/// A fault of kind input that names line or element and cause, or of kind limit. A missing image
/// is only a warning.
pub(crate) fn import(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
) -> ImportResult<ImportedScene> {
    let (mut budget, mut warnings) = (DecodeBudget::new(limits), Warnings::default());
    let bytes = strip_byte_order_mark(bytes);
    let header = header::read_header(bytes, &mut warnings)?;
    let mut values = ValueStream::after_header(&header, bytes);
    let (mut vertices, mut faces) = (PlyVertices::default(), PlyFaces::default());
    for element in &header.elements {
        values.check_item_count(element)?;
        match element.name.as_str() {
            "vertex" => vertices.read(element, &mut values, &mut budget, &mut warnings)?,
            "face" | "tristrips" => faces.read(element, &mut values, &mut budget)?,
            _ => values.skip_element(element)?,
        }
    }
    if let Some(line) = values.surplus_line {
        warn!(
            warnings,
            Format,
            "line {line}: has more numbers than the header names; surplus numbers of lines are ignored, and so are colours of faces with such lines"
        );
    }
    if values.remaining_bytes() > 0 {
        warn!(
            warnings,
            Format,
            "{} bytes after the last element were ignored",
            values.remaining_bytes()
        );
    }
    if faces.is_empty() && !vertices.is_empty() {
        warn!(
            warnings,
            PointsAndLines,
            "has only points and no faces; points are ignored, so that nothing is visible"
        );
    }
    let (mapped, numbered) = (vertices.has_uvs() || faces.has_uvs(), faces.has_textures());
    let (mesh, numbers) = faces.into_mesh(vertices, &mut budget, &mut warnings)?;
    let mut images = header.images;
    if !mapped && !images.is_empty() {
        warn!(
            warnings,
            NoTextureCoordinates,
            "names {}, but has no texture coordinates; the model is shown without a texture",
            format_texture_names(&images)
        );
        images.clear();
    }
    if !numbered && images.len() > 1 {
        let others = format_texture_names(&images[1..]);
        warn!(
            warnings,
            Choice,
            "the faces have no texture number (texnumber): all faces show the first texture, none shows {others}"
        );
        images.truncate(1);
    }
    let parts = match images.len() {
        0 => vec![(None, mesh)],
        1 if !numbered => vec![(Some(0), mesh)],
        _ => textures::split_by_image(&mesh, &numbers, &images, &mut budget, &mut warnings)?,
    };
    obj::scene_from_meshes(file, parts, images, (folder, limits), budget, warnings)
}

/// Formats names of images for a message.
fn format_texture_names(images: &[String]) -> String {
    format!("the texture `{}`", sanitise_text(&images.join("`, `")))
}
