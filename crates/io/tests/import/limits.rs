//! Numbers and notations of glTF files beyond the usual range: none of them refuses a model.

use raywright_core::scene::{Colour, LightKind, MaterialModel, Physical, Projection};
use raywright_io::LoadedScene;
use serde_json::{Value, json};

use crate::keyed::KeyedTriangle;
use crate::shared::{check_sound, load};

/// Loads the model with one value in its JSON, at a path of keys; missing parents are created.
fn with(path: &str, value: &Value) -> LoadedScene {
    let made = KeyedTriangle::new().with(|document| {
        document["nodes"][0]["camera"] = json!(0);
        document["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
        document["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 },
            "orthographic": { "xmag": 1, "ymag": 1, "znear": 0, "zfar": 9 } }]);
        document["extensions"]["KHR_lights_punctual"] = json!({ "lights": [{ "type": "spot", "spot": {} }] });
        document["images"] = json!([{ "uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNk+A8AAQUBAScY42YAAAAASUVORK5CYII=" }]);
        document["textures"] = json!([{ "source": 0 }]);
        let extensions = json!({ "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_volume": { "thicknessFactor": 1 },
            "KHR_materials_anisotropy": { "anisotropyStrength": 0.5 }, "KHR_materials_sheen": { "sheenColorFactor": [1, 1, 1] },
            "KHR_materials_iridescence": { "iridescenceFactor": 1 }, "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 1 },
            "KHR_materials_clearcoat": { "clearcoatFactor": 1, "clearcoatNormalTexture": { "index": 0 } } });
        document["materials"][0] = json!({ "extensions": extensions, "normalTexture": { "index": 0 }, "emissiveFactor": [1, 1, 1],
            "alphaMode": "MASK", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": {} } } } });
        let mut slot = &mut *document;
        for key in path.split('/') {
            slot = match key.parse::<usize>() {
                Ok(index) => &mut slot[index],
                Err(_) => &mut slot[key],
            };
        }
        *slot = value.clone();
    });
    let loaded = made
        .load_with(None, None, None)
        .unwrap_or_else(|e| panic!("{path} {value}: {e}"));
    check_sound(&loaded, &made.write());
    loaded
}

fn model(loaded: &LoadedScene) -> &Physical {
    match loaded
        .scene
        .materials
        .first()
        .map(|material| &material.model)
    {
        Some(MaterialModel::Physical(model)) => model,
        other => panic!("{other:?}"),
    }
}

/// Every number of a file that becomes a checked field of the scene.
const NUMBERS: [&str; 37] = [
    "extensions/KHR_lights_punctual/lights/0/color/0",
    "extensions/KHR_lights_punctual/lights/0/intensity",
    "extensions/KHR_lights_punctual/lights/0/range",
    "extensions/KHR_lights_punctual/lights/0/spot/innerConeAngle",
    "extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle",
    "cameras/0/perspective/yfov",
    "cameras/0/perspective/znear",
    "cameras/0/perspective/zfar",
    "cameras/0/perspective/aspectRatio",
    "nodes/0/translation/1",
    "nodes/0/scale/1",
    "nodes/0/rotation/1",
    "nodes/1/weights/0",
    "materials/0/alphaCutoff",
    "materials/0/emissiveFactor/1",
    "materials/0/normalTexture/scale",
    "materials/0/pbrMetallicRoughness/baseColorFactor/3",
    "materials/0/pbrMetallicRoughness/metallicFactor",
    "materials/0/pbrMetallicRoughness/roughnessFactor",
    "materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset/0",
    "materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/scale/0",
    "materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/rotation",
    "materials/0/extensions/KHR_materials_anisotropy/anisotropyStrength",
    "materials/0/extensions/KHR_materials_anisotropy/anisotropyRotation",
    "materials/0/extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale",
    "materials/0/extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor",
    "materials/0/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor",
    "materials/0/extensions/KHR_materials_dispersion/dispersion",
    "materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength",
    "materials/0/extensions/KHR_materials_ior/ior",
    "materials/0/extensions/KHR_materials_iridescence/iridescenceIor",
    "materials/0/extensions/KHR_materials_iridescence/iridescenceThicknessMaximum",
    "materials/0/extensions/KHR_materials_sheen/sheenRoughnessFactor",
    "materials/0/extensions/KHR_materials_specular/specularColorFactor/2",
    "materials/0/extensions/KHR_materials_transmission/transmissionFactor",
    "materials/0/extensions/KHR_materials_volume/thicknessFactor",
    "materials/0/extensions/KHR_materials_volume/attenuationDistance",
];

/// Protects: no single number of any size refuses a model, and at most one warning reports it.
#[test]
fn no_number_refuses_a_model() {
    let usual = with("asset/generator", &json!("a test")).warnings.len();
    for path in NUMBERS {
        for number in [
            0.0,
            -0.0,
            1e-45,
            1e-18,
            -1.0,
            1.0,
            7.5,
            1001.0,
            1e16,
            3.402_823_466e38,
            -1e39,
            1e300,
            -1e300,
        ] {
            let slots = [
                "color",
                "translation",
                "scale",
                "rotation",
                "weights",
                "emissiveFactor",
                "baseColorFactor",
                "offset",
                "specularColorFactor",
            ];
            let (holder, place) = path.rsplit_once('/').unwrap_or(("", path));
            let name = holder.rsplit('/').next().unwrap_or_default();
            let loaded = match place.parse::<usize>() {
                Ok(index) if slots.contains(&name) => {
                    let length = match name {
                        "offset" => 2,
                        "rotation" | "baseColorFactor" => 4,
                        "weights" => 1,
                        _ if path.contains("KHR_texture_transform") => 2,
                        _ => 3,
                    };
                    let mut list = vec![1.0; length];
                    list[index] = number;
                    with(holder, &json!(list))
                }
                _ => with(path, &json!(number)),
            };
            let more = loaded.warnings.len().saturating_sub(usual);
            // A singular node removes its child too, and a zero rotation has a warning of its own.
            let maximum = if path.starts_with("nodes") { 3 } else { 1 };
            assert!(more <= maximum, "{path} {number:e}: {:?}", loaded.warnings);
        }
    }
}

/// Protects: the replacement of each number out of range, with a warning where the meaning changes.
#[test]
fn the_nearest_number_is_taken() {
    let light = |key: &str, number: f64| {
        let loaded = with(
            &format!("extensions/KHR_lights_punctual/lights/0/{key}"),
            &json!(number),
        );
        let messages: Vec<String> = loaded
            .warnings
            .iter()
            .map(|warning| warning.message.clone())
            .filter(|message| message.contains("lights[0]"))
            .collect();
        (loaded.scene.lights.first().cloned(), messages)
    };
    for (number, expected, warned) in [
        (3.402_823e38, None, 0),
        (4.0, Some(4.0), 0),
        (-1.0, None, 1),
        (1e-20, Some(1e-15), 1),
    ] {
        let (found, messages) = light("range", number);
        let Some(LightKind::Spot { range, .. }) = found.map(|light| light.kind) else {
            panic!("a spot")
        };
        assert_eq!(
            (range, messages.len()),
            (expected, warned),
            "{number}: {messages:?}"
        );
    }
    let (found, messages) = light("intensity", 3e38);
    assert_eq!(
        (found.map(|light| light.colour.0), messages.len()),
        (Some([1e37; 3]), 1)
    );
    let quarter = f64::from(core::f32::consts::FRAC_PI_4).to_degrees();
    for (key, number, expected, warned) in [
        (
            "spot/innerConeAngle",
            f64::from(core::f32::consts::FRAC_PI_4),
            [quarter, quarter],
            0,
        ),
        ("spot/innerConeAngle", 1.2, [quarter, quarter], 1),
        ("spot/innerConeAngle", -1.0, [0.0, quarter], 1),
        ("spot/outerConeAngle", 2.0, [0.0, 90.0], 1),
    ] {
        let (found, messages) = light(key, number);
        let Some(LightKind::Spot {
            inner_angle,
            outer_angle,
            ..
        }) = found.map(|light| light.kind)
        else {
            panic!("a spot")
        };
        assert_eq!(
            ([inner_angle, outer_angle], messages.len()),
            (expected, warned),
            "{key} {number}: {messages:?}"
        );
    }
    let (found, messages) = light("spot/outerConeAngle", 0.0);
    assert!(
        found.is_none()
            && messages.len() == 1
            && messages[0].contains("outer cone angle is not above 0"),
        "{messages:?}"
    );
    let value_of = |path: &str, number: f64| {
        with(
            &format!("materials/0/extensions/KHR_materials_{path}"),
            &json!(number),
        )
    };
    for (number, expected) in [(0.0, 0.0), (0.5, 1.5), (1001.0, 1000.0), (3e38, 1000.0)] {
        assert_eq!(
            model(&value_of("ior/ior", number)).ior,
            expected.into(),
            "{number}"
        );
    }
    for (number, expected) in [
        (1e16, None),
        (2.0, Some(2.0)),
        (1e-18, Some(1e-15)),
        (0.0, None),
    ] {
        assert_eq!(
            model(&value_of("volume/attenuationDistance", number)).attenuation_distance,
            expected,
            "{number}"
        );
    }
    assert_eq!(
        model(&value_of("emissive_strength/emissiveStrength", 3e38)).emission,
        Colour([1e30; 3]).into()
    );
    let camera = |key: &str, number: f64| {
        with(&format!("cameras/0/{key}"), &json!(number))
            .scene
            .cameras
            .len()
    };
    assert_eq!(
        (
            camera("perspective/zfar", 3e38),
            camera("perspective/yfov", 4.0)
        ),
        (1, 0)
    );
    let view = with("cameras/0/type", &json!("orthographic"));
    assert!(matches!(
        view.scene.cameras[0].projection,
        Projection::Orthographic { height: 2.0 }
    ));
    let far = with("nodes/0/translation", &json!([0.0, 1e16, 0.0]));
    assert_eq!(
        (
            far.scene.objects.len(),
            far.scene.cameras.len(),
            far.scene.lights.len()
        ),
        (0, 0, 0)
    );
}

/// Protects: integers written with a point or an exponent are integers, and the later value of a
/// repeated key is in force, at any depth, with one warning; any other malformed text is refused at
/// its position.
#[test]
fn numbers_and_names_in_other_words() {
    let made = KeyedTriangle::new();
    let path = made.write();
    let text = std::fs::read_to_string(&path).expect("just written");
    let count = |text: &str| {
        std::fs::write(&path, text).expect("a file");
        let loaded = load(&path);
        (
            loaded.scene.objects.len(),
            loaded.scene.materials.len(),
            loaded.warnings.len(),
        )
    };
    let usual = count(&text);
    assert_eq!(usual.0, 1);
    for (from, to) in [
        ("5126", "5126.0"),
        ("5126", "5.126e3"),
        (r#""scene":0"#, r#""scene":0e0"#),
        (r#""count":3"#, r#""count":3.0"#),
    ] {
        assert!(text.contains(from), "{from}");
        assert_eq!(count(&text.replace(from, to)), usual, "{to}");
    }
    let warned = (usual.0, usual.1, usual.2 + 1);
    for (from, to) in [
        (r#""scene":0"#, r#""scene":7,"scene":0"#),
        (
            r#""baseColorFactor":["#,
            r#""baseColorFactor":"none","baseColorFactor":["#,
        ),
        (r#""POSITION":0"#, r#""POSITION":9,"POSITION":0"#),
        (
            r#""pbrMetallicRoughness":"#,
            r#""pbrMetallicRoughness":{"metallicFactor":{"a":[1,{}]}},"pbrMetallicRoughness":"#,
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let expected = if to.contains("POSITION") {
            usual
        } else {
            warned
        };
        assert_eq!(count(&text.replace(from, to)), expected, "{to}");
    }
    std::fs::write(&path, text.replace(r#""count":3"#, r#""count":3.5"#)).expect("a file");
    let refused = crate::shared::try_load(&path)
        .expect_err("a count of 3.5")
        .to_string();
    assert!(refused.contains("accessors[0].count"), "{refused}");
}

/// Protects: triangles that a node of no height moves beyond all coordinates are left out with one
/// warning, which has their number and the mesh.
#[test]
fn triangles_that_a_flat_node_moves_too_far_are_told() {
    let made = KeyedTriangle::new().with(|document| {
        document["nodes"][0]["scale"] = json!([9e14, 0.0, 1.0]);
        document["nodes"][0]["translation"] = json!([9e14, 0.0, 0.0]);
    });
    let loaded = made
        .load_with(None, None, None)
        .unwrap_or_else(|e| panic!("{e}"));
    let told: Vec<_> = loaded
        .warnings
        .iter()
        .filter(|warning| warning.message.contains("left out"))
        .collect();
    assert_eq!(told.len(), 1, "{:?}", loaded.warnings);
    for words in ["1 triangle ", "mesh `"] {
        assert!(told[0].message.contains(words), "{}", told[0].message);
    }
}
