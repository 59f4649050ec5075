//! Location of the shared files, and helpers to check a loaded scene.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3, Vec3};
use raywright_core::scene::{MeshData, MeshSource, Object, Shape, TransformStep};
use raywright_io::{Error, Input, LoadOptions, LoadedScene};

/// Folder of test models; `None`, with a message, on machines without them.
pub fn assets(sub: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/assets")
        .join(sub);
    if path.exists() {
        return Some(path);
    }
    skipped(&path);
    None
}

#[expect(clippy::print_stderr, reason = "a test that does nothing must say so")]
fn skipped(path: &Path) {
    eprintln!("skipped: shared data not found ({})", path.display());
}

/// Loads a file with the default limits.
pub fn try_load(path: &Path) -> Result<LoadedScene, Error> {
    raywright_io::load(&Input::Path(path.to_path_buf()), &LoadOptions::default())
}

/// Loads a file that must load.
pub fn load(path: &Path) -> LoadedScene {
    try_load(path).unwrap_or_else(|e| panic!("{e}"))
}

/// Lists all files below a folder, sorted.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut out = Vec::new();
    let mut waiting = vec![folder.to_path_buf()];
    while let Some(folder) = waiting.pop() {
        for entry in
            std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                out.push(path);
            }
        }
    }
    out.sort();
    out
}

/// Returns a mesh by name.
pub fn mesh<'a>(loaded: &'a LoadedScene, name: &str) -> &'a MeshData {
    let mesh = loaded
        .scene
        .meshes
        .iter()
        .find(|mesh| mesh.name == name)
        .unwrap_or_else(|| panic!("no mesh {name}"));
    match &mesh.source {
        MeshSource::Inline(data) => data,
        MeshSource::File(path) => panic!("{path} was not replaced by its data"),
    }
}

/// Returns the mesh of an object.
pub fn mesh_of<'a>(loaded: &'a LoadedScene, object: &Object) -> &'a MeshData {
    match &object.shape {
        Shape::Mesh(name) => mesh(loaded, name),
        other => panic!("{other:?} is no mesh"),
    }
}

/// Returns the object's linear map and translation.
pub fn transform(object: &Object) -> (DMat3, DVec3) {
    match object.transform.as_slice() {
        [] => (DMat3::IDENTITY, DVec3::ZERO),
        [TransformStep::Matrix([x, y, z])] => {
            let row = |r: &[f64; 4]| DVec3::new(r[0], r[1], r[2]);
            (
                DMat3::from_cols(row(x), row(y), row(z)).transpose(),
                DVec3::new(x[3], y[3], z[3]),
            )
        }
        other => panic!("imports write one matrix, not {other:?}"),
    }
}

/// Corners of an object's triangles in world space, and its normals there, one per corner, if it
/// has any.
pub fn world_triangles(
    loaded: &LoadedScene,
    object: &Object,
) -> (Vec<[DVec3; 3]>, Vec<[DVec3; 3]>) {
    let data = mesh_of(loaded, object);
    let (m, t) = transform(object);
    let cofactors = m.inverse().transpose();
    let point = |i: u32| m * data.positions.position(i as usize) + t;
    let normal =
        |i: u32| (cofactors * Vec3::from_array(data.normals[i as usize]).as_dvec3()).normalize();
    let points = data
        .indices
        .iter()
        .map(|triangle| triangle.map(point))
        .collect();
    let normals = match data.normals.is_empty() {
        true => Vec::new(),
        false => data
            .indices
            .iter()
            .map(|triangle| triangle.map(normal))
            .collect(),
    };
    (points, normals)
}

/// Number of triangles of all objects.
pub fn triangle_count(loaded: &LoadedScene) -> usize {
    loaded
        .scene
        .objects
        .iter()
        .map(|object| mesh_of(loaded, object).indices.len())
        .sum()
}

/// Checks the invariants of every imported scene.
pub fn check_sound(loaded: &LoadedScene, path: &Path) {
    let scene = &loaded.scene;
    let place = path.display();
    let problems = raywright_core::validate::validate(scene);
    assert!(problems.is_empty(), "{place}: {problems:?}");
    for mesh in &scene.meshes {
        let MeshSource::Inline(data) = &mesh.source else {
            panic!("{place}: {} is not inline", mesh.name)
        };
        let count = data.positions.len();
        assert!(
            data.indices
                .as_flattened()
                .iter()
                .all(|&i| (i as usize) < count),
            "{place}: index out of range"
        );
        assert!(
            data.positions
                .offsets()
                .as_flattened()
                .iter()
                .all(|c| c.is_finite()),
            "{place}: a position is not finite"
        );
        assert!(
            data.normals.is_empty() || data.normals.len() == count,
            "{place}: normals"
        );
        assert!(
            data.normals
                .iter()
                .all(|n| (Vec3::from_array(*n).length() - 1.0).abs() < 1e-3),
            "{place}: a normal's length"
        );
        assert!(
            data.uvs.iter().all(|set| set.len() == count),
            "{place}: texture coordinates"
        );
        assert!(
            data.colours.is_empty() || data.colours.len() == count,
            "{place}: colours"
        );
    }
    for object in &scene.objects {
        assert!(
            scene
                .materials
                .iter()
                .any(|material| material.name == object.material),
            "{place}: {}",
            object.material
        );
        mesh_of(loaded, object);
        let (m, t) = transform(object);
        assert!(
            m.is_finite() && t.is_finite() && m.determinant() != 0.0,
            "{place}: transform {m:?}"
        );
    }
    for texture in &scene.textures {
        assert!(
            scene
                .images
                .iter()
                .any(|image| image.name == texture.image && image.data.is_some()),
            "{place}: {}",
            texture.name
        );
    }
    for names in [
        scene.meshes.iter().map(|x| &x.name).collect::<Vec<_>>(),
        scene.materials.iter().map(|x| &x.name).collect(),
        scene.textures.iter().map(|x| &x.name).collect(),
        scene.images.iter().map(|x| &x.name).collect(),
    ] {
        let distinct: std::collections::HashSet<_> = names.iter().collect();
        assert_eq!(
            distinct.len(),
            names.len(),
            "{place}: two things of one name"
        );
    }
}
