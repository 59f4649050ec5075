//! How textures continue beyond their edges: single samplers, written here.

use raywright_core::scene::Wrap;

use crate::shared::load;

/// A triangle of one material whose colour is a single pixel, seen through a sampler.
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

/// Protects: each direction of a texture has a wrap mode of its own (glTF 2.0: 33071 clamps, 33648 mirrors, 10497 repeats), and
/// repeats where the file is silent.
#[test]
fn directions_wrap_each_in_its_way() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    for (sampler, expected) in [
        (r#""wrapS": 33071, "wrapT": 33648"#, [Wrap::Clamp, Wrap::MirroredRepeat]),
        (r#""wrapS": 10497, "wrapT": 33071"#, [Wrap::Repeat, Wrap::Clamp]),
        (r#""wrapS": 33648"#, [Wrap::MirroredRepeat, Wrap::Repeat]),
        (r#""wrapT": 33648"#, [Wrap::Repeat, Wrap::MirroredRepeat]),
    ] {
        std::fs::write(&path, textured(sampler)).unwrap();
        let loaded = load(&path);
        let [texture] = loaded.scene.textures.as_slice() else { panic!("{:?}", loaded.scene.textures) };
        assert_eq!([texture.wrap_u, texture.wrap_v], expected, "{sampler}");
    }
}
