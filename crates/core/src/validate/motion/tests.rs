//! Motions that are degenerate at some time, each with the place and the hint of its message, and
//! valid motions that come close.

use serde_json::{Value, json};

use super::super::validate;
use crate::fault::Fault;
use crate::scene::Scene;

fn problems(camera: Value, object: Value) -> Vec<Fault> {
    let mut whole = json!({
        "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": [0, 0, 5], "target": [0, 0, 0] } },
            "projection": { "pinhole": { "vertical_fov": 40 } } }],
        "materials": [{ "name": "clay", "model": { "classic": {} } }, { "name": "lamp", "model": { "physical": { "emission": 1 } } },
            { "name": "screen", "model": { "physical": { "emission": "[u, v, 0]" } } }],
        "objects": [{ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "clay" }]
    });
    for (list, keys) in [("cameras", camera), ("objects", object)] {
        keys.as_object()
            .expect("keys")
            .iter()
            .for_each(|(key, value)| whole[list][0][key] = value.clone());
    }
    validate(&serde_json::from_value::<Scene>(whole).unwrap_or_else(|e| panic!("{e}")))
}

#[track_caller]
fn expect_problem(camera: Value, object: Value, path: &str, message: &str) {
    let found = problems(camera, object);
    let [problem] = found.as_slice() else {
        panic!("not one problem: {found:?}")
    };
    assert_eq!(problem.path, path);
    assert!(problem.message.contains(message), "{}", problem.message);
}

fn turned(degrees: f64) -> Value {
    json!([{ "rotate": { "axis": [0, 1, 0], "degrees": degrees } }])
}

/// Protects: an object's map must be invertible at every time, at each end and in between; an
/// object with constant emission cannot move. The message refers to the end, with a hint.
#[test]
fn maps_are_invertible_at_every_time() {
    let end = |steps: Value| json!({ "transform_end": steps });
    for fine in [
        turned(179.0),
        json!([]),
        json!([{ "scale": [1e-3, 5, 2] }, { "translate": [9, 9, 9] }]),
    ] {
        assert_eq!(problems(json!({}), end(fine)), []);
    }
    for flat in [turned(180.0), json!([{ "scale": [-1, 1, 1] }])] {
        expect_problem(
            json!({}),
            end(flat),
            "objects[0].transform_end",
            "the object is flattened to zero thickness",
        );
    }
    expect_problem(
        json!({}),
        end(json!([{ "scale": [0, 1, 1] }])),
        "objects[0].transform_end[0].scale",
        "may be zero",
    );
    let tiny = vec![json!({ "scale": [1e-15, 1e-15, 1e-15] }); 30];
    expect_problem(
        json!({}),
        end(json!(tiny)),
        "objects[0].transform_end",
        "the steps of `transform_end` together",
    );
    let glowing = |material: &str| json!({ "material": material, "transform_end": [{ "translate": [1, 0, 0] }] });
    expect_problem(
        json!({}),
        glowing("lamp"),
        "objects[0].transform_end",
        "emits light cannot move",
    );
    assert_eq!(problems(json!({}), glowing("screen")), []);
    assert!(
        problems(json!({}), end(turned(180.0)))
            .iter()
            .all(|problem| !problem.remedy.is_empty())
    );
}

/// Protects: a camera's view and up direction must be defined at every time, for every kind of
/// pose, with ends of the same kind; motions that pass close by a degenerate view are valid.
#[test]
fn cameras_look_somewhere_all_the_way() {
    let from_to = |pose: Value, end: Value| json!({ "pose": pose, "pose_end": end });
    let look =
        |eye: [f64; 3], target: [f64; 3]| json!({ "look_at": { "eye": eye, "target": target } });
    let orbit = |azimuth: f64, elevation: f64| {
        json!({ "orbit": { "target": [0, 0, 0], "distance": 2, "azimuth": azimuth,
        "elevation": elevation } })
    };
    let axes = |x: f64, y: f64| json!({ "axes": { "eye": [0, 0, 0], "right": [x, 0, 0], "up": [0, y, 0], "back": [0, 0, 3] } });
    let start = || look([0.0, 0.0, 5.0], [0.0; 3]);
    for fine in [
        from_to(start(), look([5.0, 1.0, 0.0], [0.0; 3])),
        // Looks down on its path, but for a thousandth.
        from_to(
            look([0.001, 5.0, 5.0], [0.0; 3]),
            look([0.001, 5.0, -5.0], [0.0; 3]),
        ),
        // Past its target, a millimetre beside it.
        from_to(
            look([0.001, 0.0, 5.0], [0.0; 3]),
            look([0.001, 0.0, -3.0], [0.0; 3]),
        ),
        from_to(orbit(0.0, -80.0), orbit(720.0, 80.0)),
        from_to(axes(1.0, 1.0), axes(2.0, 5.0)),
        json!({ "pose_end": start() }),
    ] {
        assert_eq!(problems(fine, json!({})), []);
    }
    for wrong in [
        from_to(
            look([0.0, 5.0, 5.0], [0.0; 3]),
            look([0.0, 5.0, -5.0], [0.0; 3]),
        ),
        from_to(start(), look([0.0, 0.0, -3.0], [0.0; 3])),
        from_to(axes(1.0, 1.0), axes(-1.0, 1.0)),
        // Hardly valid at either end and degenerate between: an unlimited search would take hours.
        from_to(
            look([1.001e-6, 1.0, 0.0], [0.0; 3]),
            look([1.001, 1e6, 0.0], [0.0; 3]),
        ),
    ] {
        expect_problem(
            wrong,
            json!({}),
            "cameras[0].pose_end",
            "at some time between",
        );
    }
    expect_problem(
        from_to(start(), orbit(0.0, 0.0)),
        json!({}),
        "cameras[0].pose_end",
        "same kind",
    );
    expect_problem(
        from_to(start(), look([1.0; 3], [1.0; 3])),
        json!({}),
        "cameras[0].pose_end.look_at.target",
        "no viewing direction",
    );
}

/// Protects: a shutter opens and closes between 0 and 1, in this order.
#[test]
fn shutters_open_before_they_close() {
    let with = |times: [f64; 2]| json!({ "shutter": times });
    for fine in [[0.0, 1.0], [0.5, 0.5], [1.0, 1.0]] {
        assert_eq!(problems(with(fine), json!({})), []);
    }
    for wrong in [[0.5, 0.25], [-0.1, 1.0], [0.0, 1.1]] {
        expect_problem(
            with(wrong),
            json!({}),
            "cameras[0].shutter",
            "must hold an opening time",
        );
    }
}
