//! Table of `info`: names of kinds, and sums of a scene.

use serde_json::json;

use raywright_core::scene::{LightKind, MaterialModel};

use super::*;

/// Protects: kinds of shapes, lights, materials and skies have their names in scene files.
#[test]
fn kinds_have_their_file_names() {
    let o = [0.0; 3];
    let up = [0.0, 1.0, 0.0];
    let shapes = [
        json!({ "sphere": { "centre": o, "radius": 1 } }),
        json!({ "plane": { "point": o, "normal": up } }),
        json!({ "disk": { "centre": o, "normal": up, "radius": 1 } }),
        json!({ "quad": { "corner": o, "edge_u": up, "edge_v": up } }),
        json!({ "box": { "min": o, "max": up } }),
        json!({ "cylinder": { "base": o, "axis": up, "radius": 1 } }),
        json!({ "cone": { "base": o, "axis": up, "radius": 1, "height": 1 } }),
        json!({ "ellipsoid": { "centre": o, "semi_axes": up } }),
        json!({ "hyperboloid": { "centre": o, "waist_radius": 1, "c": 1, "half_height": 1 } }),
        json!({ "paraboloid": { "apex": o, "radius": 1, "height": 1 } }),
        json!({ "torus": { "centre": o, "axis": up, "major_radius": 2, "minor_radius": 1 } }),
        json!({ "triangle": { "vertices": [o, o, o] } }),
        json!({ "mesh": "leaf" }),
    ];
    let key = |value: &serde_json::Value| {
        value
            .as_object()
            .and_then(|table| table.keys().next().cloned())
            .unwrap_or_default()
    };
    for value in shapes {
        let shape: Shape = serde_json::from_value(value.clone()).expect("a shape");
        assert_eq!(variant_name(&shape), key(&value));
    }
    for value in [
        json!({ "directional": { "to_light": up } }),
        json!({ "point": { "position": o } }),
        json!({ "spot": { "position": o, "direction": up, "inner_angle": 1, "outer_angle": 2 } }),
    ] {
        let kind: LightKind = serde_json::from_value(value.clone()).expect("a light");
        assert_eq!(variant_name(&kind), key(&value));
    }
    for value in [json!({ "classic": {} }), json!({ "physical": {} })] {
        let model: MaterialModel = serde_json::from_value(value.clone()).expect("a model");
        assert_eq!(variant_name(&model), key(&value));
    }
    for (value, name) in [
        (json!({ "constant": 1.0 }), "constant"),
        (
            json!({ "gradient": { "bottom": 0.0, "top": 1.0 } }),
            "gradient",
        ),
        (json!({ "expression": "d" }), "expression"),
        (json!({ "map": { "image": "a" } }), "environment picture"),
    ] {
        assert_eq!(
            sky_kind(&serde_json::from_value(value).expect("a sky")),
            name
        );
    }
}

/// Protects: the table's rows for pictures, triangles and images of a scene: fixed patterns by
/// name, stored and shown triangles, and missing images.
#[test]
fn sums_of_a_scene() {
    let with = |parts: serde_json::Value| {
        let mut whole = json!({ "format": 1 });
        whole
            .as_object_mut()
            .expect("a table")
            .extend(parts.as_object().expect("a table").clone());
        serde_json::from_value::<Scene>(whole).expect("a scene")
    };
    let describe =
        |render: serde_json::Value| describe_render_size(&with(json!({ "render": render })));
    assert!(
        describe(json!({ "samples": 9, "size": [4, 3], "max_depth": 5 }))
            .eq("4x3 pixels, 9 samples, paths of at most 5 ray segments")
    );
    assert!(describe(json!({ "pattern": "centre" })).contains(", 1 sample (centre), "));
    assert!(describe(json!({ "pattern": "corners" })).contains(", 4 samples (corners), "));
    let mesh = |name: &str| {
        let data = json!({ "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2], [2, 1, 0]] });
        json!({ "name": name, "source": { "inline": data } })
    };
    let shows = |name: &str| json!({ "shape": { "mesh": name }, "material": "m" });
    for (meshes, objects, expected) in [
        (vec![], vec![], ""),
        (vec![mesh("a")], vec![shows("a")], "2 in 1 mesh"),
        (
            vec![mesh("a")],
            vec![shows("a"), shows("a")],
            "2 in 1 mesh, 4 shown when each instance is counted",
        ),
        (
            vec![mesh("a"), mesh("b")],
            vec![shows("a"), shows("b")],
            "4 in 2 meshes",
        ),
        (
            vec![mesh("a"), mesh("b")],
            vec![shows("a")],
            "4 in 2 meshes, 2 shown when each instance is counted",
        ),
    ] {
        assert_eq!(
            describe_triangles(&count_triangles(&with(
                json!({ "meshes": meshes, "objects": objects })
            ))),
            expected
        );
    }
    let missing = with(json!({ "images": [{ "name": "a", "path": "a.png" }] }));
    assert_eq!(
        (list_images(&missing), list_images(&Scene::default())),
        ("1: a (missing)".to_owned(), String::new())
    );
}
