//! Texture sampling and sidedness: single materials, written here.

use raywright_core::scene::{ColourSpace, MaterialModel, SideRule, WrapMode};

use crate::shared::load;

/// A triangle whose material's colour is a single pixel, with this sampler.
fn textured(sampler: &str) -> String {
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "material": 0 }}] }}],
        "materials": [{{ "pbrMetallicRoughness": {{ "baseColorTexture": {{ "index": 0 }} }} }}],
        "textures": [{{ "source": 0, "sampler": 0 }}], "samplers": [{{ {sampler} }}],
        "images": [{{ "uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==" }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}],
        "buffers": [{{ "byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }}] }}"#
    )
}

/// Protects: each direction of a texture has its own wrap mode (glTF 2.0: 33071 clamps, 33648
/// mirrors, 10497 repeats), and repeats by default.
#[test]
fn directions_wrap_each_in_its_way() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    for (sampler, expected) in [
        (
            r#""wrapS": 33071, "wrapT": 33648"#,
            [WrapMode::Clamp, WrapMode::MirroredRepeat],
        ),
        (
            r#""wrapS": 10497, "wrapT": 33071"#,
            [WrapMode::Repeat, WrapMode::Clamp],
        ),
        (
            r#""wrapS": 33648"#,
            [WrapMode::MirroredRepeat, WrapMode::Repeat],
        ),
        (
            r#""wrapT": 33648"#,
            [WrapMode::Repeat, WrapMode::MirroredRepeat],
        ),
    ] {
        std::fs::write(&path, textured(sampler)).unwrap();
        let loaded = load(&path);
        let [texture] = loaded.scene.textures.as_slice() else {
            panic!("{:?}", loaded.scene.textures)
        };
        assert_eq!([texture.wrap_u, texture.wrap_v], expected, "{sampler}");
    }
}

/// Protects: a texture used both as colour and as data is decoded in both ways.
#[test]
fn a_texture_may_play_two_parts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let one = r#""baseColorTexture": { "index": 0 }"#;
    let both = r#""baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 0 }"#;
    std::fs::write(&path, textured("").replace(one, both)).unwrap();
    let mut spaces: Vec<_> = load(&path)
        .scene
        .textures
        .iter()
        .map(|texture| texture.colour_space)
        .collect();
    spaces.sort_by_key(|space| *space != ColourSpace::Srgb);
    assert_eq!(spaces, [ColourSpace::Srgb, ColourSpace::Linear]);
}

/// Protects: the red channel of KHR_materials_transmission's image multiplies the factor, as linear
/// data, with its coordinate transform and without a warning; without a factor nothing is
/// transmitted, because the default factor is zero.
#[test]
fn transmission_has_an_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let read = |factor: &str| {
        let texture = r#"{ "index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0.25] } } }"#;
        let glass = format!(
            r#""extensions": {{ "KHR_materials_transmission": {{ {factor} "transmissionTexture": {texture} }} }}, "pbrMetallicRoughness""#
        );
        std::fs::write(
            &path,
            textured("").replace(r#""pbrMetallicRoughness""#, &glass),
        )
        .unwrap();
        let loaded = load(&path);
        assert!(
            loaded
                .warnings
                .iter()
                .all(|w| !w.message.contains("transmission")),
            "{:?}",
            loaded.warnings
        );
        let MaterialModel::Physical(model) = &loaded.scene.materials[0].model else {
            panic!("physical")
        };
        let image = model.transmission_texture.clone().expect("an image");
        let texture = loaded
            .scene
            .textures
            .iter()
            .find(|texture| texture.name == image.name)
            .expect("named");
        assert_eq!(
            (texture.colour_space, image.channel),
            (ColourSpace::Linear, None)
        );
        assert_eq!(
            image.uv_transform,
            Some([[1.0, 0.0, 0.5], [0.0, 1.0, 0.25]])
        );
        (model.transmission.clone(), loaded.scene.objects[0].side)
    };
    assert_eq!(
        read(r#""transmissionFactor": 0.5,"#),
        (0.5.into(), SideRule::Both)
    );
    assert_eq!(read(""), (0.0.into(), SideRule::Culled));
}

/// Protects: a surface is visible from outside, and from both sides for glass and double-sided
/// materials.
#[test]
fn glass_has_two_sides() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let glass = |factor: f64| {
        format!(
            r#""extensions": {{ "KHR_materials_transmission": {{ "transmissionFactor": {factor} }} }}, "#
        )
    };
    for (more, side) in [
        (String::new(), SideRule::Culled),
        (r#""doubleSided": true, "#.to_owned(), SideRule::Both),
        (glass(0.5), SideRule::Both),
        (glass(0.0), SideRule::Culled),
    ] {
        let material = r#""materials": [{ "#;
        std::fs::write(
            &path,
            textured("").replace(material, &format!("{material}{more}")),
        )
        .unwrap();
        assert_eq!(load(&path).scene.objects[0].side, side, "{more}");
    }
}
