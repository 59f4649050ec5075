//! Stray vertices, far away from the rest of their mesh.

use raywright_core::scene::TransformStep;

use super::*;

/// Positions and triangles of a ball with `rings` rings of twice as many quads each.
pub(super) fn ball_mesh(rings: u32, radius: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let across = 2 * rings;
    let at = |ring: u32, turn: u32| {
        let (sin, cos) = (f64::from(ring) / f64::from(rings) * core::f64::consts::PI).sin_cos();
        let (s, c) = (f64::from(turn) / f64::from(across) * core::f64::consts::TAU).sin_cos();
        [sin * c * radius, cos * radius, -sin * s * radius]
    };
    let mut positions = vec![[0.0, radius, 0.0], [0.0, -radius, 0.0]];
    positions.extend((1..rings).flat_map(|ring| (0..across).map(move |turn| at(ring, turn))));
    let index = |ring: u32, turn: u32| 2 + (ring - 1) * across + turn % across;
    let mut triangles = Vec::new();
    for turn in 0..across {
        triangles.push([0, index(1, turn), index(1, turn + 1)]);
        triangles.push([1, index(rings - 1, turn + 1), index(rings - 1, turn)]);
        for ring in 1..rings - 1 {
            let [a, b] = [index(ring, turn), index(ring, turn + 1)];
            let [c, d] = [index(ring + 1, turn), index(ring + 1, turn + 1)];
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    (positions, triangles)
}

/// A scene with a ball of triangles of a material. `change` edits its positions and triangles.
pub(super) fn ball_scene(
    material: &str,
    change: impl FnOnce(&mut Vec<[f64; 3]>, &mut Vec<[u32; 3]>),
) -> Scene {
    let (mut positions, mut indices) = ball_mesh(12, 1.0);
    change(&mut positions, &mut indices);
    let inline = json!({ "positions": positions, "indices": indices });
    scene(&json!({
        "meshes": [{ "name": "ball", "source": { "inline": inline } }],
        "objects": [object("ball", json!({ "mesh": "ball" }), material)],
    }))
}

/// Protects: a stray vertex is reported with its position and a remedy. It is harmless if the ball
/// is out of view. Its triangles are not reported again as degenerate.
#[test]
fn a_vertex_far_out_is_named() {
    assert_eq!(
        listed(&summarise_findings(&ball_scene("paint", |_, _| {})).findings),
        []
    );
    for far in [1e5, 1e8, 1e13] {
        let mut stray = ball_scene("paint", |positions, _| positions[150] = [far, 0.0, 0.0]);
        let finding = alone(&stray, FaultKind::StrayVertices, PictureWrong);
        assert_eq!((finding.count, finding.of), (6, 528), "{finding:?}");
        assert!(
            finding.message.contains("vertex 150 is far out")
                && finding
                    .message
                    .contains(&raywright_core::fault::format_decimal(far)),
            "{finding:?}"
        );
        assert!(
            finding.place.is_some_and(|[x, ..]| x.abs() < 2.0),
            "{finding:?}"
        );
        // Behind the camera.
        stray.objects[0].transform = vec![TransformStep::Translate([0.0, 0.0, 30.0])];
        let all = summarise_findings(&stray).findings;
        let found = all
            .iter()
            .find(|found| found.kind == FaultKind::StrayVertices);
        assert_eq!(found.map(|found| found.severity), Some(Harmless), "{all:?}");
    }
}

/// Protects: a stray vertex whose spike leads through the mesh does not count the mesh as inside out.
/// The spike is marked where it can be seen.
#[test]
fn a_spike_through_the_mesh() {
    let stray = ball_scene("paint", |positions, _| {
        let left = (0..positions.len())
            .min_by(|&a, &b| positions[a][0].total_cmp(&positions[b][0]))
            .expect("a vertex");
        positions[left] = [1e6, 1e6, 1e6];
    });
    let finding = alone(&stray, FaultKind::StrayVertices, PictureWrong);
    assert!(finding.pixel.is_some(), "{finding:?}");
}

/// Protects: an antenna a hundred times as long as the rest has no stray vertex. Neither has a mesh
/// with many distant vertices.
#[test]
fn antennas_and_many_vertices_are_no_strays() {
    let antenna = ball_scene("paint", |positions, _| positions[150] = [100.0, 0.0, 0.0]);
    let many = ball_scene("paint", |positions, _| {
        (150..160).for_each(|vertex: usize| positions[vertex] = [1e5, vertex as f64, 0.0]);
    });
    for scene in [antenna, many] {
        let all = summarise_findings(&scene).findings;
        let is_stray = |found: &Fault| found.kind == FaultKind::StrayVertices;
        assert!(!all.iter().any(is_stray), "{all:?}");
    }
}

/// Protects: a small object and a wide ground in one mesh have no stray vertices.
#[test]
fn a_wide_ground_in_one_mesh_is_no_stray() {
    let ground = ball_scene("paint", |positions, indices| {
        let first = positions.len() as u32;
        let edge = 1e5;
        positions.extend([
            [-edge, -1.0, edge],
            [edge, -1.0, edge],
            [edge, -1.0, -edge],
            [-edge, -1.0, -edge],
        ]);
        indices.extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|corner| first + corner)));
    });
    let all = summarise_findings(&ground).findings;
    let is_stray = |found: &&Fault| found.kind == FaultKind::StrayVertices;
    assert!(!all.iter().any(|found| is_stray(&found)), "{all:?}");
}

/// Protects: a spike whose near end is behind the mesh is marked farther out, where it can be seen.
#[test]
fn a_spike_from_the_back_of_the_mesh() {
    let stray = ball_scene("paint", |positions, _| {
        let back = (0..positions.len())
            .min_by(|&a, &b| positions[a][2].total_cmp(&positions[b][2]))
            .expect("a vertex");
        positions[back] = [1e6, 0.0, -1.0];
    });
    let finding = alone(&stray, FaultKind::StrayVertices, PictureWrong);
    assert!(finding.pixel.is_some(), "{finding:?}");
    let place = finding.place.expect("a place");
    assert!(place[0] > 1.1, "{finding:?}");
}
