//! Files read on several threads: the result does not depend on them, and an observer gets the
//! progress.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use raywright_core::Observer;
use raywright_io::{Input, LoadOptions, load_observed};

use crate::shared::{load, try_load};

/// Triangles of the model, each with corners of its own: more than a single thread reads.
const TRIANGLES: u32 = 40_000;

/// Position of a vertex: numbers exact in single precision.
fn place(vertex: u32) -> [f32; 3] {
    [vertex as f32, (vertex % 7) as f32, -((vertex % 11) as f32)]
}

/// Vertex of a corner in the file: all vertices, from the last to the first.
fn corner(index: u32) -> u32 {
    3 * TRIANGLES - 1 - index
}

/// Writes a model of one mesh whose triangles have no accidental order.
fn write(folder: &Path, changed: impl Fn(u32) -> u32) -> PathBuf {
    let count = 3 * TRIANGLES;
    let mut bytes: Vec<u8> = (0..count)
        .flat_map(place)
        .flat_map(f32::to_le_bytes)
        .collect();
    bytes.extend(
        (0..count)
            .map(corner)
            .map(changed)
            .flat_map(u32::to_le_bytes),
    );
    std::fs::write(folder.join("large.bin"), &bytes).unwrap();
    let json = serde_json::json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "buffers": [{ "byteLength": bytes.len(), "uri": "large.bin" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 12 * count }, { "buffer": 0, "byteOffset": 12 * count, "byteLength": 4 * count }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3" },
                      { "bufferView": 1, "componentType": 5125, "count": count, "type": "SCALAR" }] });
    let path = folder.join("large.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    path
}

/// Protects: in a mesh read by several threads, every vertex and every triangle is in its place;
/// the first of several wrong indices is reported; exactly the degenerate triangles are removed.
#[test]
fn large_meshes_are_read_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = load(&write(folder.path(), |index| index));
    let mesh = crate::shared::mesh_of(&loaded, &loaded.scene.objects[0]);
    assert!(
        mesh.positions
            .offsets()
            .iter()
            .zip(0..)
            .all(|(position, vertex)| *position == place(vertex))
    );
    let expected = |triangle: u32| [0, 1, 2].map(|k| corner(3 * triangle + k));
    assert!(
        mesh.indices
            .iter()
            .zip(0..)
            .all(|(corners, triangle)| *corners == expected(triangle))
    );
    assert_eq!(
        (mesh.positions.len(), mesh.indices.len()),
        (3 * TRIANGLES as usize, TRIANGLES as usize)
    );
    // The vertices 7 and 4 come late, as corners near the end.
    let wrong = |index: u32| {
        if index == 7 || index == 4 {
            900_000 + index
        } else {
            index
        }
    };
    let error = try_load(&write(folder.path(), wrong))
        .expect_err("no such vertices")
        .to_string();
    assert!(
        error.contains("vertex 900007 does not exist, the primitive has 120000 vertices"),
        "{error}"
    );
    let loaded = load(&write(folder.path(), |index| {
        if index % 300 == 0 { index + 1 } else { index }
    }));
    assert_eq!(
        crate::shared::mesh_of(&loaded, &loaded.scene.objects[0])
            .indices
            .len(),
        TRIANGLES as usize * 99 / 100
    );
}

/// Records the reports.
#[derive(Default)]
struct Listener(Mutex<Vec<[u64; 2]>>);

impl Observer for Listener {
    fn progress(&self, done: u64, total: u64) {
        self.0.lock().unwrap().push([done, total]);
    }
}

/// Protects: an observer gets the progress over the indices and vertices of a mesh, up to all of
/// them.
#[test]
fn loading_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (path, listener) = (write(folder.path(), |index| index), Listener::default());
    load_observed(&Input::Path(path), &LoadOptions::default(), &listener)
        .unwrap_or_else(|e| panic!("{e}"));
    let all = u64::from(6 * TRIANGLES);
    assert_eq!(
        listener.0.into_inner().unwrap(),
        [[all / 2, all], [all, all]]
    );
}
