//! The extent against the built geometry, to the bit.

use raywright_bvh::AcceleratorKind;
use serde_json::{Value, json};

use super::*;
use crate::prepare::build_geometry;

fn ball(transform: Value) -> Value {
    json!({ "shape": { "sphere": { "centre": [0.1, 0.2, 0.3], "radius": 0.7 } }, "material": "m", "transform": transform })
}

/// Returns the object in motion from its place to `end`.
fn moving(mut object: Value, end: Value) -> Value {
    object["transform_end"] = end;
    object
}

fn leaf(mesh: &str, transform: Value) -> Value {
    json!({ "shape": { "mesh": mesh }, "material": "m", "transform": transform })
}

/// Objects with every kind of placement, at coordinates that f32 cannot represent.
fn objects() -> Vec<Value> {
    let turned = json!([{ "rotate": { "axis": [1, 2, 3], "degrees": 33 } }, { "translate": [0.1, 20.3, -3.7] }]);
    let squeezed = json!([{ "scale": [0.1, -1.7, 1e-3] }, { "translate": [-50.1, 0.7, 0.3] }]);
    let moved = json!([{ "translate": [1e3, -7.7, 0.1] }]);
    let pipe = json!({ "cylinder": { "base": [0, 0, 0], "axis": [0, 1, 0], "radius": 0.3 } });
    vec![
        ball(json!([])),
        ball(moved.clone()),
        ball(turned.clone()),
        ball(squeezed.clone()),
        json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "m" }),
        json!({ "shape": pipe, "material": "m" }),
        json!({ "shape": pipe, "material": "m", "transform": turned }),
        moving(ball(turned.clone()), moved.clone()),
        moving(json!({ "shape": pipe, "material": "m" }), turned.clone()),
        moving(leaf("travelling", turned.clone()), moved.clone()),
        moving(leaf("nowhere", json!([])), moved.clone()),
        leaf("once", squeezed.clone()),
        leaf("empty", moved.clone()),
        leaf("twice", turned),
        leaf("twice", squeezed),
        leaf("nothing", moved.clone()),
        leaf("nothing", json!([])),
    ]
}

fn scene(objects: &[Value]) -> Scene {
    // The last vertex belongs to no triangle. The second triangle has no area once stored.
    let positions = json!([
        [0, 0, 0],
        [1.1, 0.3, 0],
        [0, 1.7, 0.9],
        [0.1, 0.1, 0.1],
        [0.2, 0.2, 0.2],
        [0.3, 0.3, 0.3],
        [99, 99, 99]
    ]);
    let arrays = json!({ "positions": positions, "indices": [[0, 1, 2], [3, 4, 5]] });
    let mesh = |name: &str, arrays: &Value| json!({ "name": name, "source": { "inline": arrays } });
    let kind =
        json!({ "scatter": { "count": 9, "min": [-3, 0, 0], "max": [0, 4, 0.5], "seed": 7 } });
    let scattered = json!({ "kind": kind, "object": ball(json!([{ "scale": [1, 2, 1] }])) });
    let swarm = json!({ "kind": kind, "object": moving(ball(json!([])), json!([{ "translate": [0.3, 0.1, 7] }])) });
    let scene = json!({
        "format": 1,
        "materials": [{ "name": "m", "model": { "classic": {} } }],
        "meshes": [mesh("once", &arrays), mesh("twice", &arrays), mesh("empty", &json!({})), mesh("nothing", &json!({})),
            mesh("travelling", &arrays), mesh("nowhere", &json!({}))],
        "objects": objects,
        "generators": if objects.len() > 1 { json!([scattered, swarm]) } else { json!([]) },
    });
    serde_json::from_value(scene).unwrap_or_else(|e| panic!("{e}"))
}

fn agrees<R: Real>(scene: &Scene) {
    let lookup = SceneLookup::new(scene);
    let built = build_geometry::<R>(scene, &lookup, AcceleratorKind::Linear, &())
        .unwrap_or_else(|e| panic!("{e}"));
    let found_extent = scene_extent::<R>(scene, &lookup);
    let (origin, Aabb { min, max }) = (
        StorageOrigin::from_scene::<R>(scene, &lookup).origin,
        built.geometry.bounded_primitives_box(),
    );
    let bounds = Aabb {
        min: min + origin,
        max: max + origin,
    };
    assert_eq!(
        (found_extent.bounds, found_extent.unbounded),
        (bounds, built.geometry.unbounded_count())
    );
}

/// Protects: the extent equals that of the built geometry, which frames a camera correctly. Covers
/// shapes moved, turned, flattened, unbounded, generated and in motion; meshes shown once and
/// several times, empty, and with unused vertices.
#[test]
fn the_extent_is_that_of_what_is_built() {
    let objects = objects();
    let alone = objects
        .iter()
        .map(|object| scene(core::slice::from_ref(object)));
    for scene in alone.chain([scene(&objects), scene(&[])]) {
        agrees::<f32>(&scene);
        agrees::<f64>(&scene);
    }
    let whole = scene(&objects);
    let found_extent = scene_extent::<f32>(&whole, &SceneLookup::new(&whole));
    assert!(
        found_extent.unbounded == 4
            && found_extent.bounds.max.x > 1000.0
            && found_extent.bounds.max.y < 99.0,
        "{found_extent:?}"
    );
}
