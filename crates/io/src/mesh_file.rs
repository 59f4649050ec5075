//! Reading of a model file as a single mesh, for `source.file` of a mesh in a native scene.

use std::path::Path;

use glam::{DAffine3, DVec3, Vec3};
use raywright_core::fault::Fault;
use raywright_core::scene::{MeshData, ModelSelection, Shape};
use raywright_core::{Scene, SceneLookup, affine_from_steps};

use crate::error::Error;
use crate::folder::Folder;
use crate::gltf::ModelChoice;
use crate::import::MODELS;
use crate::limits::Limits;
use crate::model_file;
use crate::source::SceneFormat;

/// Reads a model file and merges its objects to a single mesh in world space, for the chosen scene
/// and time.
pub(crate) fn read_mesh(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
    model: &ModelSelection,
) -> Result<(MeshData, Vec<Fault>), Error> {
    let format = SceneFormat::from_model_path(file).ok_or_else(|| {
        Error::invalid_input(
            file.display(),
            format!("meshes can only be read from {MODELS} files: convert this file"),
        )
    })?;
    if !format.has_model_choices() && *model != ModelSelection::default() {
        return Err(Error::invalid_input(
            file.display(),
            format!(
                "{} has no scenes and no animations, so that no scene and no time can be chosen",
                format.file_description()
            ),
        ));
    }
    let choice = ModelChoice {
        scene: model.scene.as_deref(),
        variant: None,
        animation: None,
        time: model.time,
    };
    let model = model_file::load(format, file, bytes, (folder, limits), &choice, &())?;
    Ok((merge_meshes(&model.scene), model.warnings))
}

/// Merges the meshes of all objects in world space. A mesh with several objects is copied for each
/// object.
fn merge_meshes(scene: &Scene) -> MeshData {
    let lookup = SceneLookup::new(scene);
    let shown = scene
        .objects
        .iter()
        .filter_map(|object| match &object.shape {
            Shape::Mesh(name) => lookup
                .mesh_data(name)
                .map(|part| (&**part, affine_from_steps(&object.transform))),
            _ => None,
        });
    let parts: Vec<(&MeshData, DAffine3)> = shown.collect();
    let smooth = parts.iter().any(|(part, _)| !part.normals.is_empty());
    // If only some meshes have tangents, they are dropped, and tangents are computed for the merged
    // mesh on demand.
    let anisotropy = parts.iter().all(|(part, _)| !part.tangents.is_empty());
    let (mut mesh_data, mut positions) = (MeshData::default(), Vec::new());
    for (part, transform) in parts {
        if smooth && part.normals.is_empty() {
            append_mesh(
                (&mut mesh_data, &mut positions),
                &make_faceted(part),
                &transform,
            );
        } else {
            append_mesh((&mut mesh_data, &mut positions), part, &transform);
        }
    }
    mesh_data.positions = positions.into();
    if !anisotropy {
        mesh_data.tangents.clear();
    }
    mesh_data
}

/// Returns a copy of a mesh in which each triangle has three vertices of its own. Their normals are
/// the normal of the triangle.
fn make_faceted(part: &MeshData) -> MeshData {
    let corners = || part.indices.iter().flatten().map(|index| *index as usize);
    let positions = part.positions.subset(corners());
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).normalize_or(Vec3::Y).to_array();
    let triangles = positions
        .offsets()
        .chunks_exact(3)
        .map(|p| [0, 1, 2].map(|k| Vec3::from_array(p[k])));
    MeshData {
        normals: triangles
            .flat_map(|triangle| [normal(triangle); 3])
            .collect(),
        indices: (0..positions.len() as u32 / 3)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        uvs: part
            .uvs
            .iter()
            .map(|set| corners().filter_map(|i| set.get(i).copied()).collect())
            .collect(),
        tangents: corners()
            .filter_map(|i| part.tangents.get(i).copied())
            .collect(),
        colours: corners()
            .filter_map(|i| part.colours.get(i).copied())
            .collect(),
        positions,
        is_cap: false,
    }
}

/// Appends a mesh under a transform to a merged mesh.
fn append_mesh(
    (mesh_data, positions): (&mut MeshData, &mut Vec<DVec3>),
    part: &MeshData,
    transform: &DAffine3,
) {
    let (before, vertices) = (positions.len(), part.positions.len());
    let after = before + vertices;
    let double = |v: &[f32; 3]| Vec3::from_array(*v).as_dvec3();
    positions.extend(part.positions.iter().map(|p| transform.transform_point3(p)));
    // A reflection reverses the orientation of triangles; a swap of two corners restores the
    // orientation.
    let mirrored = transform.matrix3.determinant() < 0.0;
    let shift = |index: u32| index.saturating_add(u32::try_from(before).unwrap_or(u32::MAX));
    mesh_data
        .indices
        .extend(part.indices.iter().map(|&[a, b, c]| {
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            [a, b, c].map(shift)
        }));
    let inverse = transform.matrix3.inverse().transpose();
    let turned = |n: &[f32; 3]| {
        (inverse * double(n))
            .normalize_or(DVec3::Y)
            .as_vec3()
            .to_array()
    };
    mesh_data.normals.extend(part.normals.iter().map(turned));
    let along = |t: &[f32; 4]| {
        let [x, y, z] = (transform.matrix3 * double(&[t[0], t[1], t[2]]))
            .normalize_or_zero()
            .as_vec3()
            .to_array();
        [x, y, z, if mirrored { -t[3] } else { t[3] }]
    };
    mesh_data.tangents.extend(part.tangents.iter().map(along));
    // If any of the merged meshes has colours or texture coordinates, the others get neutral
    // values.
    if !part.colours.is_empty() || !mesh_data.colours.is_empty() {
        mesh_data.colours.resize(before, [1.0; 4]);
        mesh_data.colours.extend(&part.colours);
        mesh_data.colours.resize(after, [1.0; 4]);
    }
    let sets = mesh_data.uvs.len().max(part.uvs.len());
    mesh_data.uvs.resize(sets, Vec::new());
    for (i, set) in mesh_data.uvs.iter_mut().enumerate() {
        set.resize(before, [0.0; 2]);
        set.extend(part.uvs.get(i).into_iter().flatten());
        set.resize(after, [0.0; 2]);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use raywright_core::scene::{Mesh, MeshSource, Object, SideRule, TransformStep};

    use super::*;

    /// Creates a scene of these parts, each with one object under its transform steps.
    fn file(parts: Vec<(MeshData, Vec<TransformStep>)>) -> Scene {
        let mut scene = Scene::default();
        for (i, (data, transform)) in parts.into_iter().enumerate() {
            scene.meshes.push(Mesh {
                name: i.to_string(),
                source: MeshSource::Inline(Arc::new(data)),
                model: None,
            });
            scene.objects.push(Object {
                name: String::new(),
                shape: Shape::Mesh(i.to_string()),
                material: String::new(),
                side: SideRule::Both,
                face_viewer: true,
                casts_shadow: true,
                transform,
                transform_end: None,
            });
        }
        scene
    }

    /// A triangle with the corners 0, x and y, facing +z.
    fn leaf() -> MeshData {
        let positions = vec![[0.0_f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        MeshData {
            positions: positions.into(),
            indices: vec![[0, 1, 2]],
            ..MeshData::default()
        }
    }

    fn full() -> MeshData {
        let uvs = vec![vec![[0.25, 0.5]; 3], vec![[0.75, 1.0]; 3]];
        MeshData {
            normals: vec![[0.0, 0.6, 0.8]; 3],
            colours: vec![[0.5; 4]; 3],
            uvs,
            ..leaf()
        }
    }

    /// Protects: merged parts keep their own attributes, and missing ones get the defaults of a
    /// mesh without them: white, (0, 0) and the facet's normal; in either order.
    #[test]
    fn parts_keep_what_they_have() {
        for bare_first in [true, false] {
            let mut parts = vec![(leaf(), Vec::new()), (full(), Vec::new())];
            if !bare_first {
                parts.reverse();
            }
            let mesh_data = merge_meshes(&file(parts));
            let [bare, own] = if bare_first { [0, 3] } else { [3, 0] };
            assert_eq!(
                (mesh_data.positions.len(), mesh_data.indices.as_slice()),
                (6, &[[0, 1, 2], [3, 4, 5]][..])
            );
            assert_eq!(
                (mesh_data.colours[bare + 2], mesh_data.colours[own + 2]),
                ([1.0; 4], [0.5; 4])
            );
            assert_eq!(
                (mesh_data.normals[bare + 2], mesh_data.normals[own + 2]),
                ([0.0, 0.0, 1.0], [0.0, 0.6, 0.8])
            );
            assert_eq!(
                (mesh_data.uvs[0][bare + 2], mesh_data.uvs[0][own + 2]),
                ([0.0; 2], [0.25, 0.5])
            );
            assert_eq!(
                (mesh_data.uvs[1][bare + 2], mesh_data.uvs[1][own + 2]),
                ([0.0; 2], [0.75, 1.0])
            );
        }
        assert!(
            merge_meshes(&file(vec![(leaf(), Vec::new())]))
                .normals
                .is_empty()
        );
    }

    /// Protects: a part has the transform of its node; normals stay perpendicular under non-uniform
    /// scale, and a reflection does not reverse triangles.
    #[test]
    fn parts_stand_where_they_are_put() {
        let stretched = merge_meshes(&file(vec![(
            full(),
            vec![TransformStep::Scale([1.0, 3.0, 4.0])],
        )]));
        assert_eq!(stretched.positions.offsets()[2], [0.0, 3.0, 0.0]);
        // (0, 0.6/3, 0.8/4) has equal components.
        let half = std::f32::consts::FRAC_1_SQRT_2;
        assert!(
            stretched.normals[0]
                .iter()
                .zip([0.0, half, half])
                .all(|(a, b)| (a - b).abs() < 1e-6),
            "{:?}",
            stretched.normals
        );
        let mirrored = merge_meshes(&file(vec![(
            leaf(),
            vec![TransformStep::Scale([-1.0, 1.0, 1.0])],
        )]));
        let [a, b, c] =
            mirrored.indices[0].map(|i| Vec3::from_array(mirrored.positions.offsets()[i as usize]));
        assert_eq!((b - a).cross(c - a), Vec3::Z);
    }
}
