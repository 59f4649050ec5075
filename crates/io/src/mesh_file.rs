//! A model file as one mesh: what a native scene's `source.file` means.

use std::path::Path;

use glam::{DAffine3, DVec3, Vec3};
use raywright_core::scene::{MeshData, ModelPart, Shape};
use raywright_core::{Lookup, Scene, affine};

use crate::error::{Error, Warning};
use crate::folder::Folder;
use crate::limits::Limits;
use crate::{gltf, obj};

/// All triangles of a glTF, GLB or OBJ file, where the file puts them in the scene and at the time that are asked for.
pub(crate) fn read(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
    model: &ModelPart,
) -> Result<(MeshData, Vec<Warning>), Error> {
    let ending = file.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let (scene, warnings) = match ending.as_str() {
        "gltf" | "glb" => {
            let choice = gltf::Choice { scene: model.scene.as_deref(), variant: None, time: model.time };
            let model = gltf::load(file, bytes, folder, limits, &choice)?;
            (model.scene, model.warnings)
        }
        "obj" if *model != ModelPart::default() => {
            return Err(Error::input(file.display(), "an OBJ file has no scenes and no time"));
        }
        "obj" => obj::load(file, bytes, folder, limits)?,
        _ => return Err(Error::input(file.display(), "meshes are read from .obj, .gltf and .glb files")),
    };
    Ok((merged(&scene), warnings))
}

/// The meshes of a scene in one, each as often as an object shows it.
fn merged(scene: &Scene) -> MeshData {
    let lookup = Lookup::new(scene);
    let shown = scene.objects.iter().filter_map(|object| match &object.shape {
        Shape::Mesh(name) => lookup.mesh_data(name).map(|part| (&**part, affine(&object.transform))),
        _ => None,
    });
    let parts: Vec<(&MeshData, DAffine3)> = shown.collect();
    let smooth = parts.iter().any(|(part, _)| !part.normals.is_empty());
    let mut whole = MeshData::default();
    for (part, transform) in parts {
        if smooth && part.normals.is_empty() {
            append(&mut whole, &faceted(part), &transform);
        } else {
            append(&mut whole, part, &transform);
        }
    }
    whole
}

/// The same triangles with corners of their own, whose normals are those of the flat facets.
fn faceted(part: &MeshData) -> MeshData {
    let corners = || part.indices.iter().flatten().map(|index| *index as usize);
    let positions: Vec<[f32; 3]> = corners().filter_map(|i| part.positions.get(i).copied()).collect();
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).normalize_or(Vec3::Y).to_array();
    let triangles = positions.chunks_exact(3).map(|p| [0, 1, 2].map(|k| Vec3::from_array(p[k])));
    MeshData {
        normals: triangles.flat_map(|triangle| [normal(triangle); 3]).collect(),
        indices: (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        uvs: part.uvs.iter().map(|set| corners().filter_map(|i| set.get(i).copied()).collect()).collect(),
        colours: corners().filter_map(|i| part.colours.get(i).copied()).collect(),
        positions,
    }
}

fn append(whole: &mut MeshData, part: &MeshData, transform: &DAffine3) {
    let (before, vertices) = (whole.positions.len(), part.positions.len());
    let after = before + vertices;
    let double = |v: &[f32; 3]| Vec3::from_array(*v).as_dvec3();
    whole.positions.extend(part.positions.iter().map(|p| transform.transform_point3(double(p)).as_vec3().to_array()));
    // A mirrored triangle faces the other way until two of its corners are swapped.
    let mirrored = transform.matrix3.determinant() < 0.0;
    let shift = |index: u32| index.saturating_add(u32::try_from(before).unwrap_or(u32::MAX));
    whole.indices.extend(part.indices.iter().map(|&[a, b, c]| {
        let [b, c] = if mirrored { [c, b] } else { [b, c] };
        [a, b, c].map(shift)
    }));
    let inverse = transform.matrix3.inverse().transpose();
    let turned = |n: &[f32; 3]| (inverse * double(n)).normalize_or(DVec3::Y).as_vec3().to_array();
    whole.normals.extend(part.normals.iter().map(turned));
    // Parts without colours or coordinates get neutral ones as soon as one part has them.
    if !part.colours.is_empty() || !whole.colours.is_empty() {
        whole.colours.resize(before, [1.0; 4]);
        whole.colours.extend(&part.colours);
        whole.colours.resize(after, [1.0; 4]);
    }
    let sets = whole.uvs.len().max(part.uvs.len());
    whole.uvs.resize(sets, Vec::new());
    for (i, set) in whole.uvs.iter_mut().enumerate() {
        set.resize(before, [0.0; 2]);
        set.extend(part.uvs.get(i).into_iter().flatten());
        set.resize(after, [0.0; 2]);
    }
}
