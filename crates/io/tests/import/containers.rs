//! Structure around a model's contents: versions, nodes, strides, binary chunks, and the files that
//! a scene names.

use std::path::{Path, PathBuf};

use raywright_core::scene::WrapMode;
use raywright_io::{Error, ErrorKind, Input, Limits, LoadOptions, LoadedScene};

use crate::shared::{load, mesh_of, try_load, world_triangles};

/// The corners 0, x and y as floats.
fn corners() -> Vec<u8> {
    [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect()
}

/// A glTF file of one triangle with these parts.
fn json(asset: &str, node: &str, view: &str, buffers: &str) -> String {
    format!(
        r#"{{ "asset": {{ {asset} }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ {node} "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }} }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }}],
        "bufferViews": [{{ "byteLength": 36 {view} }}], "buffers": [{buffers}] }}"#
    )
}

fn read(asset: &str, node: &str, view: &str, buffers: &str) -> Result<LoadedScene, Error> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.bin"), corners()).unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, json(asset, node, view, buffers)).unwrap();
    try_load(&path)
}

const ASSET: &str = r#""version": "2.0""#;
const BUFFER: &str = r#"{ "byteLength": 36, "uri": "a.bin" }"#;

fn warning_text(loaded: &LoadedScene) -> String {
    loaded
        .warnings
        .iter()
        .map(|warning| warning.message.as_str())
        .collect::<Vec<_>>()
        .join("\n")
}

/// Protects: files of another version are refused, and those of a later 2.x are read with a
/// warning.
#[test]
fn versions_are_looked_at() {
    for (asset, words) in [
        (r#""version": "2.0""#, Some("")),
        (r#""version": "2.1""#, Some("")),
        (r#""version": "2.0", "minVersion": "2.0""#, Some("")),
        (
            r#""version": "2.1", "minVersion": "2.1""#,
            Some("minVersion"),
        ),
        (r#""version": "3.0""#, None),
        (r#""version": "1.0""#, None),
        (r#""version": "2.0", "minVersion": "3.0""#, None),
        (r#""generator": "none""#, None),
    ] {
        match (read(asset, "", r#", "buffer": 0"#, BUFFER), words) {
            (Ok(loaded), Some(words)) => assert_eq!(
                warning_text(&loaded).contains("minVersion"),
                !words.is_empty(),
                "{asset}"
            ),
            (result, words) => {
                assert_eq!(
                    (result.err().map(|error| error.kind()), words),
                    (Some(ErrorKind::Input), None),
                    "{asset}"
                )
            }
        }
    }
}

/// Protects: a zero rotation is the identity, and a rotation of another length equals the
/// normalised one; both give a warning.
#[test]
fn rotations_are_brought_to_unit_length() {
    for (rotation, y, told) in [
        ("[0, 0, 0, 1]", [0.0, 1.0], false),
        ("[0, 0, 0, 0]", [0.0, 1.0], true),
        ("[0, 0, 3, 3]", [-1.0, 0.0], true),
    ] {
        let loaded = read(
            ASSET,
            &format!(r#""rotation": {rotation},"#),
            r#", "buffer": 0"#,
            BUFFER,
        )
        .unwrap();
        let corner = world_triangles(&loaded, &loaded.scene.objects[0]).0[0][2];
        assert!(
            (corner.x - y[0]).abs() < 1e-12 && (corner.y - y[1]).abs() < 1e-12,
            "{rotation}: {corner}"
        );
        assert_eq!(
            warning_text(&loaded).contains("its rotation has length"),
            told,
            "{rotation}"
        );
    }
}

/// Protects: elements may have gaps between them, but may not overlap.
#[test]
fn strides_hold_their_elements() {
    let strided = |stride: u32| {
        read(
            ASSET,
            "",
            &format!(r#", "buffer": 0, "byteStride": {stride}"#),
            BUFFER,
        )
    };
    assert!(strided(12).is_ok());
    let error = strided(8).expect_err("elements of 12 bytes");
    assert!(
        error.kind() == ErrorKind::Input && error.to_string().contains("has a stride of 8 bytes"),
        "{error}"
    );
}

/// Writes a container of these chunks.
fn glb(folder: &Path, text: &str, binaries: &[Vec<u8>]) -> PathBuf {
    let chunk = |kind: &[u8; 4], bytes: &[u8]| {
        [&(bytes.len() as u32).to_le_bytes()[..], kind, bytes].concat()
    };
    let mut text = text.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let binaries: Vec<u8> = binaries
        .iter()
        .flat_map(|bytes| chunk(b"BIN\0", bytes))
        .collect();
    let chunks = [chunk(b"JSON", &text), binaries].concat();
    let whole = [
        &b"glTF"[..],
        &2_u32.to_le_bytes(),
        &(12 + chunks.len() as u32).to_le_bytes(),
        &chunks,
    ]
    .concat();
    let path = folder.join("a.glb");
    std::fs::write(&path, whole).unwrap();
    path
}

/// Protects: the first binary chunk is the first buffer, and no other: a second chunk is skipped
/// with a warning, and a second buffer without a URI has no bytes.
#[test]
fn the_first_chunk_is_the_first_buffer() {
    let folder = tempfile::tempdir().unwrap();
    let own = r#"{ "byteLength": 36 }"#;
    let loaded = load(&glb(
        folder.path(),
        &json(ASSET, "", r#", "buffer": 0"#, own),
        &[corners(), vec![0; 36]],
    ));
    assert_eq!(
        mesh_of(&loaded, &loaded.scene.objects[0])
            .positions
            .offsets()[1],
        [1.0, 0.0, 0.0]
    );
    assert!(
        warning_text(&loaded).contains("GLB chunk 2"),
        "{}",
        warning_text(&loaded)
    );
    let second = json(ASSET, "", r#", "buffer": 1"#, &format!("{own}, {own}"));
    let error = try_load(&glb(folder.path(), &second, &[corners()])).expect_err("no bytes");
    assert!(
        error.to_string().contains("buffers[1] has no uri"),
        "{error}"
    );
}

/// Protects: the kind of error for a model named by a scene: missing, too large, outside the
/// folder, not a file, or not a model.
#[test]
fn a_named_model_fails_in_its_own_way() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("a.txt", "v 0 0 0\n");
    write("b.obj", "f 0 0 0\n");
    let read = |file: &str, file_bytes: u64| {
        write(
            "a.scene.toml",
            &format!("format = 1\nmeshes = [{{ name = \"m\", source.file = \"{file}\" }}]\n"),
        );
        let limits = Limits {
            file_bytes,
            ..Limits::default()
        };
        let options = LoadOptions {
            limits,
            ..LoadOptions::default()
        };
        raywright_io::load(&Input::Path(folder.path().join("a.scene.toml")), &options)
            .err()
            .map(|error| error.kind())
    };
    for (file, limit, kind) in [
        ("a.obj", 1000, None),
        ("a.obj", 10, Some(ErrorKind::Limit)),
        ("gone.obj", 1000, Some(ErrorKind::File)),
        ("../a.obj", 1000, Some(ErrorKind::Input)),
        (".", 1000, Some(ErrorKind::Input)),
        ("a.txt", 1000, Some(ErrorKind::Input)),
        ("b.obj", 1000, Some(ErrorKind::Input)),
    ] {
        assert_eq!(read(file, limit), kind, "{file} in {limit} bytes");
    }
}

/// Loads an OBJ file of one triangle, from its lines before the face and a library's line.
fn obj(vertices: &str, before: &str, library: &str) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::new(1, 1)
        .save(folder.path().join("a.png"))
        .unwrap();
    std::fs::write(
        folder.path().join("a.mtl"),
        format!("newmtl m\n{library}\n"),
    )
    .unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(
        &path,
        format!("mtllib a.mtl\n{vertices}vt 0 0\nusemtl m\n{before}\nf 1/1 2/1 3/1\n"),
    )
    .unwrap();
    load(&path)
}

/// Protects: smoothing is switched by the keywords of the format, and colours are in bytes if any
/// number is above 1.
#[test]
fn smoothing_keywords_and_byte_colours() {
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (statement, smooth) in [
        ("", false),
        ("s off", false),
        ("s 0", false),
        ("s", false),
        ("s 1", true),
        ("s on", true),
    ] {
        let loaded = obj(plain, statement, "");
        assert_eq!(
            !mesh_of(&loaded, &loaded.scene.objects[0])
                .normals
                .is_empty(),
            smooth,
            "{statement}"
        );
    }
    for scale in [1.0, 255.0] {
        let coloured = format!("v 0 0 0 {scale} 0 0\nv 1 0 0 0 {scale} 0\nv 0 1 0 0 0 {scale}\n");
        let loaded = obj(&coloured, "", "");
        let mut colours = mesh_of(&loaded, &loaded.scene.objects[0]).colours.clone();
        colours.sort_by(|a, b| b.partial_cmp(a).unwrap());
        assert_eq!(
            colours,
            [
                [1.0, 0.0, 0.0, 1.0],
                [0.0, 1.0, 0.0, 1.0],
                [0.0, 0.0, 1.0, 1.0]
            ],
            "{scale}"
        );
    }
}

/// Protects: options before the name of an image: supported ones, ignored ones with their words,
/// and defaults where an option has fewer numbers. Rows count from the top in a scene, from the
/// bottom in a library.
#[test]
fn options_of_images_have_their_meaning() {
    let repeat = WrapMode::Repeat;
    for (options, wrap, rows) in [
        ("", repeat, None),
        ("-clamp on", WrapMode::Clamp, None),
        ("-clamp off", repeat, None),
        (
            "-s 2 4 1",
            repeat,
            Some([[2.0, 0.0, 0.0], [0.0, 4.0, -3.0]]),
        ),
        ("-s 2", repeat, Some([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
        (
            "-o 0.25 0.5",
            repeat,
            Some([[1.0, 0.0, 0.25], [0.0, 1.0, -0.5]]),
        ),
        ("-o 0.25", repeat, Some([[1.0, 0.0, 0.25], [0.0, 1.0, 0.0]])),
        ("-s 1 1 1 -o 0 0 0", repeat, None),
        ("-mm 0 1 -clamp on", WrapMode::Clamp, None),
        (
            "-bm 0.5 -boost 2 -texres 64 -imfchan r -type sphere -blendu off -blendv off -cc on -colorspace srgb",
            repeat,
            None,
        ),
        ("-t 0.5 0.5 0.5 -noise 1", repeat, None),
    ] {
        let loaded = obj(
            "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
            "",
            &format!("map_Kd {options} a.png"),
        );
        let [texture] = loaded.scene.textures.as_slice() else {
            panic!("{options}: {:?}", warning_text(&loaded))
        };
        assert_eq!([texture.wrap_u, texture.wrap_v], [wrap; 2], "{options}");
        let uses: Vec<_> = loaded
            .scene
            .materials
            .iter()
            .flat_map(|material| material.textures())
            .collect();
        assert_eq!((uses.len(), uses[0].uv_transform), (1, rows), "{options}");
    }
}

/// Protects: a buffer ends at its declared length, not at the end of its file; reads beyond it are
/// refused.
#[test]
fn a_buffer_is_as_long_as_it_says() {
    let view = r#", "buffer": 0"#;
    assert!(read(ASSET, "", view, BUFFER).is_ok());
    let short = r#"{ "byteLength": 24, "uri": "a.bin" }"#;
    let message = read(ASSET, "", view, short)
        .map(|_| ())
        .expect_err("beyond its end")
        .to_string();
    assert!(
        message.contains("bufferViews[0]") || message.contains("accessors[0]"),
        "{message}"
    );
}
