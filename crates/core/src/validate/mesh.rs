//! Validation of meshes, images and textures.

use std::collections::HashSet;

use super::check::SceneCheck;
use super::{MAX_COORDINATE, MAX_PROBLEMS};
use crate::fault::{Fault, FaultKind, Subject};
use crate::lookup::{SceneLookup, objects_with_paths};
use crate::scene::{Image, MOST_UV_SETS, Mesh, MeshData, MeshSource, Scene, Shape, Texture};

pub(super) fn check_image(check: &mut SceneCheck<'_>, image: &Image) {
    if image.path.is_empty() && image.data.is_none() {
        check.report("path", "`path` must name a file");
    }
}

pub(super) fn check_texture(check: &mut SceneCheck<'_>, texture: &Texture) {
    check.check_reference("image", &texture.image, "image", |names| &names.images);
}

pub(super) fn check_mesh(check: &mut SceneCheck<'_>, mesh: &Mesh) {
    check.with_key("source", |check| match &mesh.source {
        MeshSource::File(path) if path.is_empty() => {
            check.report("file", "`file` must name a file")
        }
        MeshSource::File(_) => {}
        MeshSource::Inline(data) => {
            for (path, message) in check_mesh_data(data) {
                check.report(&format!("inline.{path}"), message);
            }
        }
    });
    let Some(model) = &mesh.model else { return };
    check.with_key("model", |check| {
        check.require_finite("time", model.time.unwrap_or_default());
        if matches!(mesh.source, MeshSource::Inline(_)) {
            check.report_with_hint("",
                "`model` selects a part of a file, but this mesh reads no file: its arrays are in the scene",
                "remove `model`",
            );
        }
    });
}

/// Returns a fault for each object whose material reads a set of texture coordinates that its
/// mesh lacks. Each combination of mesh, material and set is listed once. Set 0 is left out: a mesh
/// without it reads barycentric coordinates. Such a scene can still be rendered: a missing set reads
/// as (0, 0).
pub fn find_missing_uv_sets(scene: &Scene) -> Vec<Fault> {
    let lookup = SceneLookup::new(scene);
    let (mut seen, mut problems) = (HashSet::new(), Vec::new());
    for (path, object) in objects_with_paths(scene) {
        let Shape::Mesh(name) = &object.shape else {
            continue;
        };
        let (Some(data), Some((_, material))) =
            (lookup.mesh_data(name), lookup.material(&object.material))
        else {
            continue;
        };
        let lacks = |set: &u32| *set > 0 && data.uvs.get(*set as usize).is_none_or(Vec::is_empty);
        for set in material.uv_sets().into_iter().filter(lacks) {
            if problems.len() < MAX_PROBLEMS && seen.insert((name, &object.material, set)) {
                let message = format!(
                    "the material `{}` reads texture coordinates by `uv_set` {set}, but the mesh `{name}` has no such set, so they count as (0, 0): use a set that the mesh has",
                    object.material
                );
                problems.push(Fault {
                    path: path.to_string(),
                    ..FaultKind::NoTextureCoordinates.fault(Subject::Scene, message, "")
                });
            }
        }
    }
    problems
}

/// Returns the problems of a mesh's arrays, at most one for each array. A problem is the path of
/// the array within the mesh, and the message.
pub fn check_mesh_data(data: &MeshData) -> Vec<(String, String)> {
    let vertices = data.positions.len();
    let mut problems = Vec::new();
    if let Some(i) = data
        .positions
        .iter()
        .position(|p| !p.to_array().iter().all(|x| x.abs() <= MAX_COORDINATE))
    {
        let message = format!(
            "every position must be finite and within {MAX_COORDINATE:e} of the origin on each axis"
        );
        problems.push((format!("positions[{i}]"), message));
    }
    if let Some(i) = data
        .indices
        .iter()
        .position(|corners| corners.iter().any(|index| *index as usize >= vertices))
    {
        let message = format!(
            "an index of this triangle is too large: the mesh has {vertices} vertices, whose indices begin at 0"
        );
        problems.push((format!("indices[{i}]"), message));
    }
    check_attribute(&mut problems, "normals", &data.normals, vertices, |x| {
        x.is_finite()
    });
    check_attribute(&mut problems, "tangents", &data.tangents, vertices, |x| {
        x.is_finite()
    });
    check_attribute(&mut problems, "colours", &data.colours, vertices, |x| {
        x.is_finite() && x >= 0.0
    });
    if data.uvs.len() > MOST_UV_SETS {
        problems.push((
            "uvs".to_owned(),
            format!("a mesh may have at most {MOST_UV_SETS} sets of texture coordinates"),
        ));
    }
    for (i, set) in data.uvs.iter().enumerate() {
        check_attribute(&mut problems, &format!("uvs[{i}]"), set, vertices, |x| {
            x.is_finite()
        });
    }
    problems
}

/// Checks an array that must be empty or have an entry for each vertex. `right` returns whether a
/// number is valid.
fn check_attribute<const N: usize>(
    problems: &mut Vec<(String, String)>,
    name: &str,
    values: &[[f32; N]],
    vertices: usize,
    right: impl Fn(f32) -> bool,
) {
    if !values.is_empty() && values.len() != vertices {
        let message = format!(
            "`{name}` must have one entry for each of the {vertices} positions, not {}",
            values.len()
        );
        problems.push((name.to_owned(), message));
    } else if let Some(i) = values
        .iter()
        .position(|value| !value.iter().all(|x| right(*x)))
    {
        problems.push((
            format!("{name}[{i}]"),
            format!("every number of `{name}[{i}]` must be finite, and in a colour not negative"),
        ));
    }
}
