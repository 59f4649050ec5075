//! Hidden nodes (KHR_node_visibility), and properties animated by pointers (KHR_animation_pointer),
//! at given times.

use raywright_core::scene::{Colour, ColourInput, LightKind, MaterialModel, Physical, Projection};
use raywright_io::{ErrorKind, LoadedScene};
use serde_json::json;

use crate::keyed::KeyedTriangle;

/// Adds an animation of one channel with a pointer, with keys at 1 and 3 seconds.
fn pointing(
    mut made: KeyedTriangle,
    pointer: &str,
    kind: &str,
    interpolation: &str,
    values: &[f32],
) -> KeyedTriangle {
    let input = made.accessor("SCALAR", &[1.0, 3.0]);
    let output = made.accessor(kind, values);
    let target = json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": pointer } } });
    made.with(|d| {
        d["animations"]
            .as_array_mut()
            .expect("a list")
            .push(json!({ "channels": [{ "sampler": 0, "target": target }],
            "samplers": [{ "input": input, "output": output, "interpolation": interpolation }] }));
    })
}

fn loaded(made: &KeyedTriangle, at: Option<f64>) -> LoadedScene {
    made.load_with(None, None, at)
        .unwrap_or_else(|e| panic!("{e}"))
}

fn material(loaded: &LoadedScene) -> &Physical {
    let MaterialModel::Physical(model) = &loaded.scene.materials[0].model else {
        panic!("physical")
    };
    model
}

/// The small model with a light and a camera on the node of its mesh, below a node that may hide
/// them.
fn carried(visible: [bool; 2]) -> KeyedTriangle {
    KeyedTriangle::new().with(|d| {
        d["extensions"]["KHR_lights_punctual"] =
            json!({ "lights": [{ "type": "spot", "intensity": 5, "spot": { "outerConeAngle": 0.5 } }] });
        d["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } },
            { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "zfar": 9, "znear": 0.1 } }]);
        d["nodes"][1]["camera"] = json!(0);
        d["nodes"][1]["extensions"]["KHR_lights_punctual"] = json!({ "light": 0 });
        for node in [0, 1] {
            d["nodes"][node]["extensions"]["KHR_node_visibility"] = json!({ "visible": visible[node] });
        }
        d["extensionsRequired"] = json!(["KHR_node_visibility"]);
    })
}

/// Protects: an invisible node hides the meshes and lights of all its descendants, whatever their
/// own visibility; cameras stay.
#[test]
fn hidden_nodes_hide_what_hangs_on_them() {
    for (visible, shown) in [
        ([true, true], 1),
        ([false, true], 0),
        ([true, false], 0),
        ([false, false], 0),
    ] {
        let scene = loaded(&carried(visible), None).scene;
        assert_eq!(
            [scene.objects.len(), scene.lights.len(), scene.cameras.len()],
            [shown, shown, 1],
            "{visible:?}"
        );
    }
    let silent = KeyedTriangle::new()
        .with(|d| d["nodes"][0]["extensions"] = json!({ "KHR_node_visibility": {} }));
    assert_eq!(
        loaded(&silent, None).scene.objects.len(),
        1,
        "visible where nothing is said"
    );
}

/// Protects: animated visibility is that of the last key, at rest the file's own.
#[test]
fn visibility_is_moved() {
    let made = pointing(
        carried([false, true]),
        "/nodes/0/extensions/KHR_node_visibility/visible",
        "SCALAR",
        "STEP",
        &[1.0, 0.0],
    );
    for (at, shown) in [
        (None, 0),
        (Some(0.0), 1),
        (Some(2.9), 1),
        (Some(3.0), 0),
        (Some(9.0), 0),
    ] {
        assert_eq!(loaded(&made, at).scene.objects.len(), shown, "{at:?}");
    }
}

/// Protects: pointers animate nodes as ordinary channels do, and materials, texture transforms,
/// lights, cameras and weights to the mean half-way between two keys, or along a spline; at rest
/// the file's values are used.
#[test]
fn properties_have_their_value_at_a_time() {
    let number = |pointer: &str, values: [f32; 2], read: &dyn Fn(&LoadedScene) -> f64| {
        let made = pointing(carried([true; 2]), pointer, "SCALAR", "LINEAR", &values);
        let rest = read(&loaded(&carried([true; 2]), None));
        assert_eq!(read(&loaded(&made, None)), rest, "{pointer} at rest");
        let found_loaded = loaded(&made, Some(2.0));
        assert!(
            found_loaded
                .warnings
                .iter()
                .all(|warning| warning.message.contains("znear")
                    || !warning.message.contains("ignored")),
            "{:?}",
            found_loaded.warnings
        );
        let [first, mean] = [values[0], 0.5 * (values[0] + values[1])].map(f64::from);
        assert!(
            (read(&found_loaded) - mean).abs() < 1e-6
                && (read(&loaded(&made, Some(0.0))) - first).abs() < 1e-6,
            "{pointer}"
        );
    };
    let constant = |input: &raywright_core::scene::NumberInput| input.constant().expect("a number");
    number(
        "/materials/0/pbrMetallicRoughness/metallicFactor",
        [0.25, 0.75],
        &|l| constant(&material(l).metallic),
    );
    number(
        "/materials/0/pbrMetallicRoughness/roughnessFactor",
        [0.5, 0.25],
        &|l| constant(&material(l).roughness),
    );
    number(
        "/extensions/KHR_lights_punctual/lights/0/intensity",
        [2.0, 4.0],
        &|l| l.scene.lights[0].colour.0[0],
    );
    number(
        "/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle",
        [0.25, 0.75],
        &|l| match l.scene.lights[0].kind {
            LightKind::Spot { outer_angle, .. } => outer_angle.to_radians(),
            _ => panic!("a spot"),
        },
    );
    number(
        "/cameras/0/perspective/yfov",
        [1.0, 0.5],
        &|l| match &l.scene.cameras[0].projection {
            Projection::Pinhole(pinhole) => pinhole.vertical_fov.expect("told").to_radians(),
            _ => panic!("a pinhole"),
        },
    );
    let colours = [1.0, 0.5, 0.25, 1.0, 0.0, 0.5, 0.75, 1.0];
    let painted = pointing(
        KeyedTriangle::new(),
        "/materials/0/pbrMetallicRoughness/baseColorFactor",
        "VEC4",
        "LINEAR",
        &colours,
    );
    assert_eq!(
        material(&loaded(&painted, Some(2.0))).base_colour,
        ColourInput::Constant(Colour([0.5; 3]))
    );
    // With zero tangents the spline's middle is the mean; otherwise an eighth of the interval in
    // seconds times the difference of the tangents is added.
    let spline = [0.0, 0.25, 0.5, 0.0, 0.75, 0.0].map(|x| [x; 3]).concat();
    let glowing = pointing(
        KeyedTriangle::new(),
        "/materials/0/emissiveFactor",
        "VEC3",
        "CUBICSPLINE",
        &spline,
    );
    assert_eq!(
        material(&loaded(&glowing, Some(2.0))).emission,
        Colour([0.5 + 2.0 / 8.0 * 0.5; 3]).into()
    );
    let moved = pointing(
        KeyedTriangle::new(),
        "/nodes/1/translation",
        "VEC3",
        "LINEAR",
        &[2.0, 0.0, 0.0, 4.0, 0.0, 0.0],
    );
    assert_eq!(
        moved.transform_at(2.0).translation.to_array(),
        [3.0, 0.0, 5.0]
    );
    let offset = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset";
    let dot = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg==";
    let slid = pointing(
        KeyedTriangle::new(),
        offset,
        "VEC2",
        "LINEAR",
        &[0.0, 0.5, 1.0, 0.0],
    )
    .with(|d| {
        d["images"] = json!([{ "uri": dot }]);
        d["textures"] = json!([{ "source": 0 }]);
        d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] =
            json!({ "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 3] } } });
    });
    let texture = material(&loaded(&slid, Some(2.0)))
        .base_colour_texture
        .clone()
        .expect("a texture");
    assert_eq!(
        texture.uv_transform,
        Some([[2.0, 0.0, 0.5], [0.0, 3.0, 0.25]])
    );
}

/// Protects: unsupported, ineffective and missing targets are named and skipped, the first of two
/// is used, and invalid keys are refused with their channel.
#[test]
fn other_pointers_are_named() {
    for (pointer, words) in [
        (
            "/cameras/0/perspective/znear",
            "animations of `/cameras/0/perspective/znear` are not supported and are ignored",
        ),
        (
            "/nodes/0/name",
            "animations of `/nodes/0/name` are not supported and are ignored",
        ),
        ("", "animations of `` are not supported and are ignored"),
        (
            "nodes",
            "animations of `nodes` are not supported and are ignored",
        ),
        (
            "/materials/7/emissiveFactor",
            "`/materials/7/emissiveFactor` are ignored: the file has no such property",
        ),
        (
            "/materials/0/extensions/KHR_materials_sheen/sheenColorFactor",
            "are ignored: the file has no such property",
        ),
        (
            "/materials/0/normalTexture/scale",
            "are ignored: the file has no such property",
        ),
    ] {
        let kind = if pointer.ends_with("Factor") {
            "VEC3"
        } else {
            "SCALAR"
        };
        let values = if kind == "VEC3" {
            vec![0.0; 6]
        } else {
            vec![0.0; 2]
        };
        let found_loaded = loaded(
            &pointing(carried([true; 2]), pointer, kind, "LINEAR", &values),
            Some(2.0),
        );
        assert!(
            found_loaded
                .warnings
                .iter()
                .any(|warning| warning.message.contains(words)),
            "{words}: {:?}",
            found_loaded.warnings
        );
        assert_eq!(
            (
                found_loaded.scene.objects.len(),
                found_loaded.scene.lights.len()
            ),
            (1, 1)
        );
    }
    let metallic = "/materials/0/pbrMetallicRoughness/metallicFactor";
    let twice = pointing(
        pointing(
            KeyedTriangle::new(),
            metallic,
            "SCALAR",
            "LINEAR",
            &[0.5, 0.5],
        ),
        metallic,
        "SCALAR",
        "LINEAR",
        &[0.0, 0.0],
    );
    let found_loaded = loaded(&twice, Some(2.0));
    assert_eq!(material(&found_loaded).metallic, 0.5.into());
    assert!(
        found_loaded.warnings.iter().any(|warning| warning
            .message
            .contains("several animations change `/materials")),
        "{:?}",
        found_loaded.warnings
    );
    for (values, kind) in [
        (vec![0.0; 3], "SCALAR"),
        (vec![0.0; 6], "VEC3"),
        (vec![0.0, f32::NAN], "SCALAR"),
    ] {
        let error = pointing(KeyedTriangle::new(), metallic, kind, "LINEAR", &values)
            .load_with(None, None, Some(2.0))
            .expect_err("no such keys");
        assert!(
            error.kind() == ErrorKind::Input
                && error.to_string().contains("animations[0].channels[0]"),
            "{error}"
        );
    }
}

/// Protects: a node listed below a hidden and, at the same transform, below a visible parent is
/// shown once, in either order.
#[test]
fn hidden_and_seen_in_one_place() {
    for order in [json!([0, 2]), json!([2, 0])] {
        let made = carried([false, true]).with(|d| {
            d["nodes"][2] = json!({ "children": [1], "translation": [0, 0, 5] });
            d["scenes"][0]["nodes"] = order.clone();
        });
        let scene = loaded(&made, None).scene;
        assert_eq!([scene.objects.len(), scene.lights.len()], [1, 1], "{order}");
    }
}
