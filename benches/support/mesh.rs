//! A generated mesh.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use raywright::core::Scene;
use raywright::core::noise::fbm3;
use raywright::core::scene::{Mesh, MeshData, MeshSource};

/// A crumpled sphere of about 65 000 triangles on a plane under a sun, the same on every machine.
pub fn mesh() -> Scene {
    const COLUMNS: u32 = 256;
    const ROWS: u32 = 128;
    let vertex = |i: u32| {
        let (u, v) = (
            (i % COLUMNS) as f32 / COLUMNS as f32 * TAU,
            (i / COLUMNS) as f32 / ROWS as f32 * PI,
        );
        let p = glam::Vec3::new(v.sin() * u.cos(), v.cos(), v.sin() * u.sin());
        (p * (1.0 + 0.25 * fbm3::<f32>(p * 3.0, 4))).to_array()
    };
    let quad = |i: u32| {
        let (row, column) = (i / COLUMNS * COLUMNS, i % COLUMNS);
        let [a, b] = [row + column, row + (column + 1) % COLUMNS];
        [[a, b, b + COLUMNS], [a, b + COLUMNS, a + COLUMNS]]
    };
    let data = MeshData {
        positions: (0..COLUMNS * (ROWS + 1))
            .map(vertex)
            .collect::<Vec<_>>()
            .into(),
        indices: (0..COLUMNS * ROWS).flat_map(quad).collect(),
        ..MeshData::default()
    };
    let mut scene: Scene = serde_json::from_str(
        r#"{"format": 1, "render": {"samples": 4, "max_depth": 4},
        "cameras": [{"name": "c", "pose": {"look_at": {"eye": [0, 1.5, 4], "target": [0, 0, 0]}},
                     "projection": {"pinhole": {"vertical_fov": 40}}}],
        "lights": [{"kind": {"directional": {"to_light": [1, 2, 1]}}, "colour": 1}],
        "sky": {"constant": 0.4},
        "materials": [{"name": "m", "model": {"classic": {}}}],
        "objects": [{"shape": {"mesh": "ball"}, "material": "m"},
                    {"shape": {"plane": {"point": [0, -1.2, 0], "normal": [0, 1, 0]}}, "material": "m"}]}"#,
    )
    .unwrap_or_else(|e| panic!("the scene of the benches: {e}"));
    scene.meshes.push(Mesh {
        name: "ball".to_owned(),
        source: MeshSource::Inline(Arc::new(data)),
        model: None,
    });
    scene
}
