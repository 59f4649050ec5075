use serde_json::{Value, json};

use crate::picture::Picture;
use crate::scene::{Integrator, Projection};
use crate::settings::{Aov, Sampling, Settings};
use crate::{Scene, prepare};

/// A square of two triangles, `edge` wide, before an orthographic camera with a picture of two
/// units and 64 pixels, with further objects.
fn scene(edge: f64, colour: f64, more: Value) -> Scene {
    let mesh = json!({ "positions": [[0, 0, 0], [edge, 0, 0], [edge, edge, 0], [0, edge, 0]], "indices": [[0, 1, 2], [0, 2, 3]] });
    let model = json!({ "base_colour": colour, "roughness": 1 });
    let mut objects = vec![json!({ "shape": { "mesh": "square" }, "material": "m" })];
    objects.extend(more.as_array().cloned().unwrap_or_default());
    let camera = json!({ "pose": { "look_at": { "eye": [0, 0, 5], "target": [0, 0, 0] } }, "projection": { "orthographic": { "height": 2 } } });
    let scene = json!({ "format": 1, "materials": [{ "name": "m", "model": { "physical": model } }], "cameras": [camera],
        "meshes": [{ "name": "square", "source": { "inline": mesh } }], "objects": objects, "sky": { "constant": 1 } });
    serde_json::from_value(scene).expect("a scene")
}

fn picture(scene: &Scene, change: impl FnOnce(&mut Settings)) -> Picture {
    let mut settings = Settings {
        size: [64, 64],
        sampling: Sampling::General(64),
        max_depth: 3,
        wireframe: true,
        ..Settings::from_scene(scene)
    };
    change(&mut settings);
    prepare(scene, &settings, &())
        .expect("a small scene")
        .render(&())
        .picture
}

/// Sum of darkness in a row: the total width of lines in pixels, beside white.
fn width(picture: &Picture, row: u32, columns: core::ops::Range<u32>) -> f64 {
    columns
        .map(|x| 1.0 - f64::from(picture.pixel(x, row).expect("a pixel")[0]) / 0.8)
        .sum()
}

/// Protects: an edge of one triangle is half a pixel wide, an edge between two is a pixel wide, in
/// any direction, with both integrators, with a pinhole camera too. Nothing else of a triangle
/// changes, and lines on dark surfaces are bright.
#[test]
fn edges_are_a_pixel_wide() {
    let scene = scene(0.9, 0.8, json!([]));
    for integrator in [Integrator::Path, Integrator::Whitted] {
        for size in [64, 128] {
            let value_of = |wireframe: bool| {
                picture(&scene, |s| {
                    (s.integrator, s.size, s.wireframe) = (integrator, [size; 2], wireframe)
                })
            };
            let [lines, plain] = [true, false].map(value_of);
            let row = size / 2 - size / 5;
            let across: f64 = (0..size)
                .map(|x| {
                    f64::from(plain.pixel(x, row).unwrap()[0] - lines.pixel(x, row).unwrap()[0])
                })
                .sum();
            // Half a pixel on the left and on the right, and a diagonal line, which a row crosses
            // at 45°.
            let expected = (1.0 + 2.0_f64.sqrt()) * 0.79;
            assert!(
                (across - expected).abs() < 0.12,
                "{integrator:?} {size}: {across}, not {expected}"
            );
            let inside = lines
                .pixel(size / 2 + size / 20, size / 2 - size / 5)
                .expect("a pixel");
            assert_eq!(
                Some(inside),
                plain.pixel(size / 2 + size / 20, size / 2 - size / 5)
            );
        }
    }
    let mut perspective = scene.clone();
    perspective.cameras[0].projection = Projection::Pinhole(crate::scene::Pinhole {
        vertical_fov: Some(22.6),
        ..Default::default()
    });
    let lines = picture(&perspective, |_| {});
    assert!(
        (width(&lines, 20, 34..58) - (0.5 + 2.0_f64.sqrt()) * 0.99).abs() < 0.6,
        "{}",
        width(&lines, 20, 34..58)
    );
    let dark = picture(&super::tests::scene(0.9, 0.0, json!([])), |_| {});
    assert!(
        dark.rgb.iter().any(|rgb| rgb[0] > 0.4 && rgb[0] < 0.7),
        "lines are bright on black"
    );
}

/// Protects: edges behind a pane that is cut away are as wide and as black in `albedo` as edges in
/// plain view, with both integrators and both kinds of camera.
#[test]
fn edges_behind_holes_are_those_in_view() {
    let pane = json!([{ "shape": { "quad": { "corner": [-2, -2, 3], "edge_u": [4, 0, 0], "edge_v": [0, 4, 0] } }, "material": "hole" }]);
    for fov in [None, Some(22.6)] {
        for integrator in [Integrator::Path, Integrator::Whitted] {
            let lines = |more: Value| {
                let mut scene = scene(0.9, 0.8, more);
                let hole = json!({ "name": "hole", "model": { "physical": { "base_colour": 0.8, "alpha": { "mask": { "cutoff": 0.5 } }, "opacity": 0 } } });
                scene
                    .materials
                    .push(serde_json::from_value(hole).expect("a material"));
                if fov.is_some() {
                    scene.cameras[0].projection = Projection::Pinhole(crate::scene::Pinhole {
                        vertical_fov: fov,
                        ..Default::default()
                    });
                }
                let picture = picture(&scene, |s| {
                    (s.integrator, s.aovs) = (integrator, vec![Aov::Albedo]);
                });
                let albedo = &picture.layer("albedo.R").expect("a layer").samples;
                let blacks = (34..58).map(|x| 1.0 - f64::from(albedo[20 * 64 + x]) / 0.8);
                blacks.sum::<f64>()
            };
            let [plain, behind] = [json!([]), pane.clone()].map(lines);
            assert!(
                (plain - behind).abs() < 0.02 * plain,
                "{integrator:?} {fov:?}: {plain} {behind}"
            );
        }
    }
}

/// Protects: a mesh of triangles smaller than pixels becomes grey, not black; spheres have no
/// edges; mirrors and lights show none; layers show the surface, except that lines are black in
/// `albedo`; no samples are dropped.
#[test]
fn dense_meshes_and_other_shapes() {
    let grid = 200;
    let mut mesh = scene(0.9, 0.8, json!([]));
    let at = |i: usize| (i as f32) / grid as f32 * 0.9;
    let positions: Vec<[f32; 3]> = (0..=grid)
        .flat_map(|y| (0..=grid).map(move |x| [at(x), at(y), 0.0]))
        .collect();
    let corner = |x: usize, y: usize| (y * (grid + 1) + x) as u32;
    let cell = |x: usize, y: usize| {
        let [a, b, c, d] = [
            corner(x, y),
            corner(x + 1, y),
            corner(x + 1, y + 1),
            corner(x, y + 1),
        ];
        [[a, b, c], [a, c, d]]
    };
    let indices: Vec<[u32; 3]> = (0..grid)
        .flat_map(|y| (0..grid).flat_map(move |x| cell(x, y)))
        .collect();
    let data = json!({ "positions": positions, "indices": indices });
    mesh.meshes[0] =
        serde_json::from_value(json!({ "name": "square", "source": { "inline": data } }))
            .expect("a mesh");
    let dense = picture(&mesh, |_| {});
    let middle = dense.pixel(46, 18).expect("a pixel")[0];
    assert!((0.35..0.6).contains(&middle), "{middle}");
    let ball = json!([{ "shape": { "sphere": { "centre": [-0.5, -0.5, 0], "radius": 0.3 } }, "material": "m" }]);
    let with_ball = scene(0.3, 0.8, ball);
    let [lines, plain] =
        [true, false].map(|wireframe| picture(&with_ball, |s| s.wireframe = wireframe));
    let differs = |i: usize| lines.rgb[i] != plain.rgb[i];
    assert!(
        (32 * 64..64 * 64).all(|i| !differs(i)) && (0..32 * 64).any(differs),
        "the ball is below"
    );
    let layers = picture(&with_ball, |s| s.aovs = vec![Aov::Albedo, Aov::Depth]);
    let albedo = &layers.layer("albedo.R").expect("a layer").samples;
    assert!(albedo.iter().any(|&a| a > 0.1 && a < 0.7) && albedo.contains(&0.8));
}
