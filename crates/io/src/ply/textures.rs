//! Division of a PLY mesh by the image that each face uses: one mesh for each image.

use std::collections::{BTreeMap, HashMap};

use raywright_core::scene::MeshData;

use super::vertices::gather;
use crate::import::{DecodeBudget, ImportResult, Warnings};

/// Divides a mesh by the image numbers of its triangles. Returns a mesh for each image, and a mesh
/// of the triangles without an image. A warning names each image that no triangle uses; another
/// warning counts the triangles whose number exceeds the images of the file.
///
/// # Errors
///
/// A fault of kind limit beyond the limits.
pub(super) fn split_by_image(
    mesh: &MeshData,
    numbers: &[i64],
    images: &[String],
    budget: &mut DecodeBudget,
    warnings: &mut Warnings,
) -> ImportResult<Vec<(Option<usize>, MeshData)>> {
    let mut groups: BTreeMap<Option<usize>, Vec<[u32; 3]>> = BTreeMap::new();
    let mut strays = 0_u64;
    for (&triangle, &number) in mesh.indices.iter().zip(numbers) {
        let image = usize::try_from(number)
            .ok()
            .filter(|&image| image < images.len());
        strays += u64::from(image.is_none() && number >= 0);
        groups.entry(image).or_default().push(triangle);
    }
    if strays > 0 {
        warn!(
            warnings,
            Picture,
            "{} a texnumber beyond the file's {} images and {} shown without an image",
            match strays {
                1 => "1 triangle has".to_owned(),
                more => format!("{more} triangles have"),
            },
            images.len(),
            if strays == 1 { "is" } else { "are" }
        );
    }
    for (i, image) in images
        .iter()
        .enumerate()
        .filter(|(i, _)| !groups.contains_key(&Some(*i)))
    {
        warn!(
            warnings,
            Choice,
            "no face shows the texture {i}, `{}`",
            crate::import::sanitise_text(image)
        );
    }
    let vertex = size_of::<[f32; 3]>() * 2 + size_of::<[f32; 2]>() + size_of::<[f32; 4]>() + 16;
    budget.reserve_memory(mesh.indices.len(), 3 * vertex + 2 * size_of::<[u32; 3]>())?;
    Ok(groups
        .into_iter()
        .map(|(image, triangles)| (image, extract_triangles(mesh, &triangles)))
        .collect())
}

/// Returns a mesh of the given triangles of a mesh, with only the vertices of these triangles.
fn extract_triangles(mesh: &MeshData, triangles: &[[u32; 3]]) -> MeshData {
    let (mut numbers, mut used) = (HashMap::new(), Vec::new());
    let mut number = |old: u32| {
        *numbers.entry(old).or_insert_with(|| {
            used.push(old);
            used.len() as u32 - 1
        })
    };
    let indices = triangles
        .iter()
        .map(|triangle| triangle.map(&mut number))
        .collect();
    MeshData {
        positions: mesh
            .positions
            .subset(used.iter().map(|&vertex| vertex as usize)),
        normals: gather(&used, &mesh.normals),
        colours: gather(&used, &mesh.colours),
        uvs: mesh.uvs.iter().map(|set| gather(&used, set)).collect(),
        indices,
        ..MeshData::default()
    }
}
