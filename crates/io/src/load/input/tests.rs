//! Tests of file formats and names.

use super::*;
use crate::native::SceneNotation;

/// Protects: the format follows the extension in any case, otherwise the first bytes; binary glTF
/// is detected by its first bytes under any name.
#[test]
fn kinds_of_files_are_told() {
    let toml = SceneFormat::Native(SceneNotation::Toml);
    let json = SceneFormat::Native(SceneNotation::Json);
    for (name, bytes, format) in [
        ("a.glb", "", SceneFormat::Glb),
        ("a.obj", "glTF", SceneFormat::Glb),
        ("a.gltf", "", SceneFormat::Gltf),
        ("a.GLTF", "", SceneFormat::Gltf),
        ("a.obj", "", SceneFormat::Obj),
        ("a.Obj", "", SceneFormat::Obj),
        ("a.toml", "{", toml),
        ("a.json", "# no", json),
        ("a.json", "{ \"asset\": 1 }", json),
        ("a", " { \"asset\": 1 }", SceneFormat::Gltf),
        ("a", "\n{ \"format\": 1 }", json),
        ("a", "format = 1", toml),
        ("a", "\n# a scene", toml),
        ("a.txt", "format = 1", toml),
        ("a.STL", "ply", SceneFormat::Stl),
        ("a.ply", "solid", SceneFormat::Ply),
        ("a", "ply\r\nformat", SceneFormat::Ply),
        ("a", "  SOLID x", SceneFormat::Stl),
        ("a", "# by somebody\n\n  v 0 0 0", SceneFormat::Obj),
        ("a", "mtllib a.mtl", SceneFormat::Obj),
        ("a", "# by somebody\n[render]", toml),
    ] {
        assert_eq!(
            detect_format(Path::new(name), bytes.as_bytes()).ok(),
            Some(format),
            "{name} {bytes}"
        );
    }
    for (name, bytes) in [
        ("a", ""),
        ("a.png", "\u{89}PNG"),
        ("a", "vision"),
        ("a", "plywood"),
    ] {
        assert!(
            detect_format(Path::new(name), bytes.as_bytes())
                .is_err_and(|error| error.kind() == crate::ErrorKind::Input),
            "{name}"
        );
    }
}

/// Protects: the name of a picture is that of its scene without the longest known extension, in any
/// case.
#[test]
fn stems_lack_their_ending() {
    for (name, expected) in [
        ("x/room.scene.toml", "room"),
        ("room.scene.json", "room"),
        ("room.Scene.TOML", "room"),
        ("room.toml", "room"),
        ("room.json", "room"),
        ("a.b.gltf", "a.b"),
        ("duck.glb", "duck"),
        ("teapot.obj", "teapot"),
        ("bunny.ply", "bunny"),
        ("part.STL", "part"),
        ("teapot", "teapot"),
        ("teapot.txt", "teapot.txt"),
        (".obj", ".obj"),
    ] {
        assert_eq!(file_stem(Path::new(name)), expected, "{name}");
    }
}
