use serde_json::{Value, json};

use crate::picture::Picture;
use crate::scene::{Integrator, Scene};
use crate::settings::{Aov, Crop, Sampling, Settings};
use crate::{ReadyScene, prepare};

/// Shapes in the box from -1 to 1, before an orthographic camera whose picture has 64 pixels and 4
/// units, from 60° above the ground.
fn scene(shapes: &[Value], base_colour: f64) -> Scene {
    let camera = json!({ "pose": { "orbit": { "target": [0, 0, 0], "distance": 10, "azimuth": 0, "elevation": 60 } }, "projection": { "orthographic": { "height": 4 } } });
    let model = json!({ "base_colour": base_colour, "roughness": 1 });
    let objects: Vec<Value> = shapes
        .iter()
        .map(|shape| json!({ "shape": shape, "material": "m" }))
        .collect();
    let scene = json!({ "format": 1, "materials": [{ "name": "m", "model": { "physical": model } }], "cameras": [camera],
        "objects": objects, "sky": { "constant": 1 } });
    serde_json::from_value(scene).expect("a scene")
}

fn ready(scene: &Scene, change: impl FnOnce(&mut Settings)) -> ReadyScene {
    let mut settings = Settings {
        size: [64, 64],
        sampling: Sampling::General(1),
        max_depth: 2,
        edges: true,
        ..Settings::from_scene(scene)
    };
    change(&mut settings);
    prepare(scene, &settings, &()).expect("a small scene")
}

fn lines(picture: &Picture) -> &[f32] {
    &picture.layer("edges.V").expect("a layer").samples
}

/// Length in pixels of lines that are a pixel wide.
fn length(scene: &Scene) -> f64 {
    let picture = ready(scene, |_| ()).render(&()).picture;
    lines(&picture).iter().map(|&share| f64::from(share)).sum()
}

fn quad(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Value {
    json!({ "quad": { "corner": corner, "edge_u": u, "edge_v": v } })
}

/// Protects: lines have the length of outlines, borders, steps and creases, in pixels: of a ball, a
/// box with its three visible creases, a square, a square above another, and a roof whose slopes
/// meet at more than 30°, but not of one whose slopes meet at less or whose normals are smooth.
#[test]
fn lines_are_where_surfaces_end_or_turn() {
    let sine = 60_f64.to_radians().sin();
    // Lines at 45° are 0.7 pixels wide, so that a ball has a tenth less.
    // Sixteen pixels to a unit. Across the view, depths shrink by the sine, heights by the cosine.
    let square = 16.0 * (4.0 + 4.0 * sine);
    let flat = quad([-1.0, 0.0, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0]);
    let above = quad([-0.5, 0.4, -0.5], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let roof = |rise: f64| {
        [
            quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, rise, -1.0]),
            quad([-1.0, rise, 0.0], [2.0, 0.0, 0.0], [0.0, -rise, -1.0]),
        ]
    };
    for (name, shapes, expected) in [
        (
            "ball",
            vec![json!({ "sphere": { "centre": [0, 0, 0], "radius": 1 } })],
            16.0 * 2.0 * std::f64::consts::PI,
        ),
        (
            "box",
            vec![json!({ "box": { "min": [-1, -1, -1], "max": [1, 1, 1] } })],
            // The front's two sides, four of width 2, and two sides of the roof.
            16.0 * (3.0 * 2.0 + 2.0 * 2.0 * sine + 2.0 * 2.0 * 0.5),
        ),
        ("square", vec![flat.clone()], square),
        ("steps", vec![flat, above], 1.5 * square),
    ] {
        let found = length(&scene(&shapes, 0.8));
        assert!(
            (found / expected - 1.0).abs() < 0.11,
            "{name}: {found} for {expected}"
        );
    }
    // Two objects meet at every ridge: one mesh does not end there.
    let of_mesh = |data: &Value| {
        let mut scene = scene(&[], 0.8);
        scene.meshes =
            serde_json::from_value(json!([{ "name": "roof", "source": { "inline": data } }]))
                .expect("meshes");
        scene.objects =
            serde_json::from_value(json!([{ "shape": { "mesh": "roof" }, "material": "m" }]))
                .expect("objects");
        length(&scene)
    };
    let mesh = |rise: f64, normals: Option<f64>| {
        let mut data = json!({ "positions": [[-1, 0, 1], [1, 0, 1], [-1, rise, 0], [1, rise, 0], [-1, 0, -1], [1, 0, -1]],
            "indices": [[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]] });
        if let Some(z) = normals {
            data["normals"] = json!([
                [0, 1, z],
                [0, 1, z],
                [0, 1, 0],
                [0, 1, 0],
                [0, 1, -z],
                [0, 1, -z]
            ]);
        }
        of_mesh(&data)
    };
    for (rise, normals, ridge) in [(0.2, None, 0.0), (0.35, None, 2.0), (0.35, Some(0.4), 0.0)] {
        let expected = square + 16.0 * ridge;
        let found = mesh(rise, normals);
        assert!(
            (found / expected - 1.0).abs() < 0.05,
            "{rise}: {found} for {expected}"
        );
    }
    // The steps once more, in one mesh.
    let levels = [(1.0, 0.0), (0.5, 0.4)];
    let corners = levels.map(|(r, y)| [[-r, y, -r], [-r, y, r], [r, y, r], [r, y, -r]]);
    let steps = json!({ "positions": corners.concat(), "indices": [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]] });
    let found = of_mesh(&steps);
    assert!((found / (1.5 * square) - 1.0).abs() < 0.05, "{found}");
    assert!(length(&scene(&roof(0.2), 0.8)) > mesh(0.2, None) + 20.0);
    assert_eq!(length(&scene(&[], 0.8)), 0.0);
}

/// Protects: lines are dark, and bright on dark surfaces; they cover what is behind them; nothing
/// beside them changes; they do not depend on integrator, samples, tiles and crop; and a preview has
/// them too.
#[test]
fn lines_lie_over_the_picture() {
    let ball = json!({ "sphere": { "centre": [0, 0, 0], "radius": 1 } });
    for (colour, radiance) in [(0.8, 0.01), (0.01, 0.6)] {
        let scene = scene(std::slice::from_ref(&ball), colour);
        let with = |change: &dyn Fn(&mut Settings)| ready(&scene, change).render(&()).picture;
        let drawn = with(&|_| ());
        let plain = with(&|settings| settings.edges = false);
        for ((line, plain), share) in drawn.rgb.iter().zip(&plain.rgb).zip(lines(&drawn)) {
            assert!(share.abs() <= 1.0 && (*share >= 0.0) == (colour > 0.5) || *share == 0.0);
            for (line, plain) in line.iter().zip(plain) {
                let expected = plain + share.abs() * (radiance - plain);
                assert!((line - expected).abs() < 1e-6, "{line} {plain} {share}");
            }
        }
        let layer = with(&|settings| (settings.edges, settings.aovs) = (false, vec![Aov::Edges]));
        assert_eq!((lines(&layer), &layer.rgb), (lines(&drawn), &plain.rgb));
        assert!(lines(&drawn).iter().any(|share| share.abs() > 0.8));
        for other in [
            with(&|settings| settings.integrator = Integrator::Whitted),
            with(&|settings| settings.sampling = Sampling::General(8)),
            with(&|settings| settings.tile_size = 7),
        ] {
            assert_eq!(lines(&other), lines(&drawn));
        }
        let crop = Crop {
            x: 13,
            y: 9,
            width: 20,
            height: 11,
        };
        let part = with(&|settings| settings.crop = Some(crop));
        let row = |y: usize| &lines(&drawn)[(9 + y) * 64 + 13..][..20];
        let whole: Vec<f32> = (0..11).flat_map(|y| row(y).to_vec()).collect();
        assert_eq!(lines(&part), whole);
        let sketch = ready(&scene, |_| ()).render_preview(4, 1, &[], &()).picture;
        assert!(lines(&sketch).iter().any(|share| *share != 0.0));
    }
}
