//! The loader's public API: sources of scenes, kinds of errors, coverage of the hash.

use std::path::{Path, PathBuf};

use raywright_core::scene::{MeshSource, Scene, Triple};
use raywright_io::{
    Error, ErrorKind, Input, Limits, LoadOptions, LoadedScene, ParameterOverrides, SceneFormat,
    SceneNotation, load, presets,
};

/// A temporary folder with a scene and further files of a test.
struct SceneFolder {
    folder: tempfile::TempDir,
}

impl SceneFolder {
    fn new(scene: &str) -> Self {
        let place = Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        };
        place.put("x.scene.toml", scene.as_bytes());
        place
    }

    fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(&path, bytes).expect("a file");
        path
    }

    fn load(&self) -> Result<LoadedScene, Error> {
        self.load_with(&LoadOptions::default())
    }

    fn load_with(&self, options: &LoadOptions) -> Result<LoadedScene, Error> {
        load(
            &Input::Path(self.folder.path().join("x.scene.toml")),
            options,
        )
    }

    /// Kind and message of the error, without the folder's path.
    fn fails(&self, options: &LoadOptions) -> (ErrorKind, String) {
        let error = self.load_with(options).expect_err("the scene is wrong");
        (
            error.kind(),
            error
                .to_string()
                .replace(&format!("{}/", self.folder.path().display()), ""),
        )
    }
}

fn limits(limits: Limits) -> LoadOptions {
    LoadOptions {
        limits,
        ..LoadOptions::default()
    }
}

fn at(t: f64) -> LoadOptions {
    LoadOptions {
        overrides: ParameterOverrides {
            time: Some(t),
            set: Vec::new(),
        },
        ..LoadOptions::default()
    }
}

const TEXTURED: &str = "format = 1\n[[images]]\nname = \"wood\"\npath = \"wood.png\"\n";

/// A red PNG of one pixel.
fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(&[255, 0, 0]))
        .expect("a picture");
    bytes
}

/// Protects: the error for a missing file names the file and the reason.
#[test]
fn a_file_that_does_not_exist_is_named_with_the_reason() {
    let error = load(
        &Input::Path(PathBuf::from("no/such.scene.toml")),
        &LoadOptions::default(),
    )
    .expect_err("no file");
    assert_eq!(error.kind(), ErrorKind::File);
    assert_eq!(
        error.to_string(),
        "error: cannot read no/such.scene.toml: no such file or folder"
    );
}

/// Protects: a folder is refused as a scene.
#[test]
fn a_folder_is_no_scene() {
    let error =
        load(&Input::Path(std::env::temp_dir()), &LoadOptions::default()).expect_err("a folder");
    assert_eq!(error.kind(), ErrorKind::File);
    assert!(
        error.to_string().ends_with(": the path is a folder"),
        "{error}"
    );
}

/// Protects: an unsupported format is refused with the supported ones.
#[test]
fn a_file_of_another_kind_is_refused_with_the_kinds_that_are_read() {
    let place = SceneFolder::new("");
    let path = place.put("notes.txt", b"Dear diary");
    let error = load(&Input::Path(path), &LoadOptions::default()).expect_err("no scene");
    assert_eq!(error.kind(), ErrorKind::Input);
    assert!(
        error
            .to_string()
            .contains("scenes are read from .scene.toml and .scene.json files, models from .stl, .ply, .obj, .gltf and .glb"),
        "{error}"
    );
}

/// Protects: a text that is not UTF-8 is refused with its position.
#[test]
fn a_text_that_is_not_utf_8_is_refused_with_its_place() {
    let place = SceneFolder::new("");
    place.put("x.scene.toml", b"format = 1\ntitle = \"caf\xe9\"");
    let (kind, message) = place.fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::Input);
    assert_eq!(
        message,
        "error: x.scene.toml: line 2, column 13: this is not UTF-8 text\nhelp: save the file with the encoding UTF-8"
    );
}

/// Protects: the extension decides the format, otherwise the content.
#[test]
fn the_ending_decides_what_a_file_is_and_the_content_where_it_does_not() {
    let place = SceneFolder::new("");
    let format = |name: &str, bytes: &[u8]| {
        let loaded = load(
            &Input::Path(place.put(name, bytes)),
            &LoadOptions::default(),
        );
        loaded
            .map(|loaded| (loaded.source.format, loaded.source.stem))
            .map_err(|error| error.to_string())
    };
    let toml = SceneFormat::Native(SceneNotation::Toml);
    let json = SceneFormat::Native(SceneNotation::Json);
    assert_eq!(
        format("a.scene.toml", b"format = 1"),
        Ok((toml, "a".to_owned()))
    );
    assert_eq!(
        format("b.b.scene.json", b"{\"format\": 1}"),
        Ok((json, "b.b".to_owned()))
    );
    assert_eq!(format("c.toml", b"format = 1"), Ok((toml, "c".to_owned())));
    assert_eq!(
        format("d", b"# mine\nformat = 1"),
        Ok((toml, "d".to_owned()))
    );
    assert_eq!(
        format("e.txt", b" {\"format\": 1}"),
        Ok((json, "e.txt".to_owned()))
    );
}

/// Protects: input beyond a limit is an error of kind limit.
#[test]
fn input_beyond_a_limit_is_an_error_of_kind_limit() {
    let grid = "format = 1\n[[materials]]\nname = \"m\"\nmodel.classic = {}\n[[generators]]\n\
        kind.grid = { counts = [4000000000, 4000000000, 4000000000], origin = [0, 0, 0], step = [1, 1, 1] }\n\
        object = { material = \"m\", shape.sphere = { centre = [0, 0, 0], radius = 1 } }";
    let (kind, message) = SceneFolder::new(grid).fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::Limit);
    assert_eq!(
        message,
        "error: x.scene.toml: the scene has 18446744073709551615 objects, more than the limit of 16000000; merge or remove objects"
    );

    let mesh = "format = 1\n[[meshes]]\nname = \"m\"\n\
        source.inline = { positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], indices = [[0, 1, 2], [0, 2, 1]] }";
    assert_eq!(
        SceneFolder::new(mesh)
            .fails(&limits(Limits {
                triangles: 1,
                ..Limits::default()
            }))
            .0,
        ErrorKind::Limit
    );

    let (kind, message) = SceneFolder::new(TEXTURED).fails(&limits(Limits {
        text_bytes: 10,
        ..Limits::default()
    }));
    assert_eq!(kind, ErrorKind::Limit);
    assert!(
        message.starts_with(
            "error: x.scene.toml: the scene is larger than the limit of 10 bytes\nhelp: "
        ),
        "{message}"
    );
}

/// Protects: a missing texture is a warning, and a missing sky an error.
#[test]
fn a_missing_texture_is_a_warning_and_a_missing_sky_is_not() {
    let loaded = SceneFolder::new(TEXTURED).load().expect("a scene");
    assert_eq!(loaded.scene.images[0].data, None);
    let [warning] = loaded.warnings.as_slice() else {
        panic!("one warning, not {:?}", loaded.warnings)
    };
    let text = "image `wood`: cannot read `wood.png`: no such file or folder; materials are shown without this image";
    assert!(warning.message.ends_with(text), "{warning}");

    let (kind, message) =
        SceneFolder::new(&format!("{TEXTURED}[sky]\nmap = {{ image = \"wood\" }}"))
            .fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::File);
    assert!(message.contains("--> x.scene.toml:4:8"), "{message}");
}

/// Protects: images are decoded, and broken ones reported at their position.
#[test]
fn images_are_decoded_and_broken_ones_shown_at_their_place() {
    let place = SceneFolder::new(TEXTURED);
    place.put("wood.png", &png());
    let image = place.load().expect("a scene").scene.images[0]
        .data
        .clone()
        .expect("pixels");
    assert_eq!((image.width, image.height), (1, 1));
    place.put("wood.png", &png()[..40]);
    let (kind, message) = place.fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::Input);
    assert!(
        message.contains("`wood.png` is a broken picture")
            && message.contains("--> x.scene.toml:4:8"),
        "{message}"
    );
    place.put("wood.png", &png());
    assert_eq!(
        place
            .fails(&limits(Limits {
                image_pixels: 0,
                ..Limits::default()
            }))
            .0,
        ErrorKind::Limit
    );
    assert!(
        place
            .load_with(&limits(Limits {
                image_pixels: 1,
                ..Limits::default()
            }))
            .is_ok(),
        "as many as are allowed"
    );
}

/// Protects: references outside the folder are refused at their position.
#[test]
fn references_out_of_the_folder_are_refused_at_their_place() {
    let scene = TEXTURED.replace("wood.png", "../wood.png");
    let (kind, message) = SceneFolder::new(&scene).fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::Input);
    assert_eq!(
        message,
        "error: `../wood.png` lies outside the scene's folder, and only files in that folder are read (--allow-outside permits other files)
 --> x.scene.toml:4:8
  |
4 | path = \"../wood.png\"
  |        ^^^^^^^^^^^^^"
    );
}

/// Protects: an unknown embedded image is refused at its position.
#[test]
fn an_unknown_embedded_image_is_refused_at_its_place() {
    let (kind, message) = SceneFolder::new(&TEXTURED.replace("wood.png", "embedded:nothing"))
        .fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::Input);
    assert!(
        message.starts_with("error: the program has no built-in image `nothing`"),
        "{message}"
    );
}

/// Writes a glTF file with one triangle, its buffer beside it, and two instances: translated, and
/// reflected.
fn gltf_triangle(place: &SceneFolder) {
    let corners: [Triple; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let buffer: Vec<u8> = corners
        .iter()
        .flatten()
        .flat_map(|x| (*x as f32).to_le_bytes())
        .collect();
    place.put("models/leaf.bin", &buffer);
    let text = r#"{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0, 1] }],
        "nodes": [{ "mesh": 0, "translation": [0, 0, 5] }, { "mesh": 0, "scale": [-1, 1, 1] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [{ "byteLength": 36, "uri": "leaf.bin" }] }"#;
    place.put("models/leaf.gltf", text.as_bytes());
}

const MODEL: &str = "format = 1\n[[meshes]]\nname = \"leaf\"\nsource.file = \"models/leaf.gltf\"\n";

/// Protects: a mesh from a file is a single mesh with the file's transforms applied.
#[test]
fn a_mesh_in_a_file_becomes_one_mesh_with_the_file_s_transforms() {
    let place = SceneFolder::new(MODEL);
    gltf_triangle(&place);
    let loaded = place.load().unwrap_or_else(|error| panic!("{error}"));
    let MeshSource::Inline(mesh) = &loaded.scene.meshes[0].source else {
        panic!("the mesh was not read")
    };
    assert_eq!(
        mesh.positions.offsets()[..3],
        [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]]
    );
    assert_eq!(
        mesh.positions.offsets()[3..],
        [[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    );
    // The reflected triangle is reversed, so that both face +z.
    assert_eq!(mesh.indices, [[0, 1, 2], [3, 5, 4]]);
}

/// Protects: an unreadable mesh file is an error at its position.
#[test]
fn a_mesh_file_that_cannot_be_had_is_an_error_at_its_place() {
    let place = SceneFolder::new(MODEL);
    let (kind, message) = place.fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::File);
    assert!(message.contains("--> x.scene.toml:4:15"), "{message}");
    gltf_triangle(&place);
    place.put("models/leaf.gltf", b"{}");
    let (kind, message) = place.fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::Input);
    assert!(
        message.contains("models/leaf.gltf: ") && message.contains("--> x.scene.toml:4:15"),
        "{message}"
    );
}

/// Protects: a mesh file of an unsupported format is refused with the supported formats and a
/// remedy.
#[test]
fn a_mesh_file_of_another_format_has_a_remedy() {
    let place = SceneFolder::new(&MODEL.replace("leaf.gltf", "leaf.fbx"));
    place.put("models/leaf.fbx", b"Kaydara");
    let (kind, message) = place.fails(&LoadOptions::default());
    assert_eq!(kind, ErrorKind::Input);
    assert!(
        message.contains(
            "meshes can only be read from .stl, .ply, .obj, .gltf and .glb files: convert this file"
        ),
        "{message}"
    );
}

/// Protects: a model has no parameters.
#[test]
fn a_model_has_no_parameters() {
    let place = SceneFolder::new("");
    gltf_triangle(&place);
    let overrides = ParameterOverrides {
        time: None,
        set: vec![("speed".to_owned(), 1.0)],
    };
    let options = LoadOptions {
        overrides,
        ..LoadOptions::default()
    };
    let model = Input::Path(place.folder.path().join("models/leaf.gltf"));
    assert_eq!(
        load(&model, &options).expect_err("no parameter").kind(),
        ErrorKind::Usage
    );
    assert_eq!(
        load(&model, &LoadOptions::default())
            .expect("a scene")
            .source
            .format,
        SceneFormat::Gltf
    );
}

/// Protects: the hash covers text, time, parameters and files.
#[test]
fn the_hash_covers_text_time_parameters_and_files() {
    let hash = |place: &SceneFolder, options: &LoadOptions| {
        place.load_with(options).expect("a scene").hash
    };
    let place = SceneFolder::new(TEXTURED);
    place.put("wood.png", &png());
    let first = hash(&place, &LoadOptions::default());
    assert_eq!(first.to_string().len(), 64);
    assert_eq!(hash(&place, &LoadOptions::default()), first);
    assert_ne!(hash(&place, &at(1.0)), first);
    assert_ne!(hash(&place, &at(2.0)), hash(&place, &at(1.0)));
    let mut other = png();
    other.push(0);
    place.put("wood.png", &other);
    assert_ne!(hash(&place, &LoadOptions::default()), first);
    place.put("wood.png", &png());
    assert_eq!(hash(&place, &LoadOptions::default()), first);
    place.put("x.scene.toml", format!("{TEXTURED}\n").as_bytes());
    assert_ne!(hash(&place, &LoadOptions::default()), first);

    let place = SceneFolder::new(MODEL);
    gltf_triangle(&place);
    let first = hash(&place, &LoadOptions::default());
    place.put("models/leaf.bin", &[0; 36]);
    assert_ne!(
        hash(&place, &LoadOptions::default()),
        first,
        "the buffer of a model does not count"
    );
}

/// Protects: a parameter on the command line changes the hash, by its value and by its name; the
/// last of two values for a parameter is used.
#[test]
fn values_of_parameters_count() {
    let place = SceneFolder::new("format = 1\n[parameters]\na = 1\nb = 1\n");
    let load = |set: &[(&str, f64)]| {
        let set = set
            .iter()
            .map(|&(name, value)| (name.to_owned(), value))
            .collect();
        let options = LoadOptions {
            overrides: ParameterOverrides { time: None, set },
            ..LoadOptions::default()
        };
        place.load_with(&options).expect("a scene")
    };
    let hash = |set| load(set).hash;
    assert_eq!(hash(&[("a", 2.0)]), hash(&[("a", 2.0)]));
    let different = [
        hash(&[]),
        hash(&[("a", 2.0)]),
        hash(&[("a", 3.0)]),
        hash(&[("b", 2.0)]),
    ];
    for (i, one) in different.iter().enumerate() {
        assert!(!different[..i].contains(one), "{i}");
    }
    assert_eq!(
        load(&[("a", 2.0), ("b", 5.0), ("a", 3.0)]).scene.parameters["a"].value,
        3.0
    );
}

/// Protects: loading lists the files that a scene is made from or names, itself included, so that
/// no picture replaces any of them.
#[test]
fn a_scene_knows_its_files() {
    use raywright_io::output;
    let place = SceneFolder::new(&format!("{TEXTURED}{}", MODEL.replace("format = 1\n", "")));
    gltf_triangle(&place);
    let unused = r#""images": [{ "uri": "un%20used.png" }], "asset""#;
    let text =
        std::fs::read_to_string(place.folder.path().join("models/leaf.gltf")).expect("a file");
    place.put(
        "models/leaf.gltf",
        text.replace("\"asset\"", unused).as_bytes(),
    );
    let inputs = place
        .load()
        .unwrap_or_else(|error| panic!("{error}"))
        .inputs;
    let held = |name: &str| {
        let file = output::OutputPath::resolve(&place.folder.path().join(name)).expect("a place");
        inputs.find_overwritten_input(&file).is_some()
    };
    for name in [
        "x.scene.toml",
        "wood.png",
        "models/leaf.gltf",
        "models/leaf.bin",
        "models/un used.png",
    ] {
        assert!(held(name), "{name}");
    }
    assert!(!held("x.png") && !held("leaf.bin"));
}

/// Protects: parts of a scene are located in its text.
#[test]
fn parts_of_a_scene_are_located_in_its_text() {
    let loaded = SceneFolder::new(TEXTURED).load().expect("a scene");
    let name = &loaded.source.name;
    assert_eq!(
        loaded.source.format_value_position("images[0].path"),
        format!("{name}:4:8")
    );
    assert_eq!(
        loaded.source.format_value_position("images[0].data"),
        format!("{name}:2:1")
    );
    assert_eq!(loaded.source.format_value_position("sky.map"), *name);
}

/// Protects: every preset loads and is found by its name.
#[test]
fn every_preset_loads_and_is_found_by_its_name() {
    for preset in presets::list() {
        let loaded = load(
            &Input::Preset(preset.name.to_owned()),
            &LoadOptions::default(),
        );
        let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(loaded.warnings, [], "{}", preset.name);
        assert_eq!(loaded.scene.title, preset.title);
        assert_ne!(
            preset.title, "",
            "{} says nothing about itself",
            preset.name
        );
    }
}

/// Protects: presets are the files of the scenes folder.
#[test]
fn presets_are_the_files_of_the_scenes_folder() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut files: Vec<String> = entries
        .filter_map(|entry| {
            entry
                .ok()?
                .file_name()
                .to_str()?
                .strip_suffix(".scene.toml")
                .map(str::to_owned)
        })
        .collect();
    files.sort();
    assert_eq!(
        presets::list()
            .iter()
            .map(|preset| preset.name.to_owned())
            .collect::<Vec<_>>(),
        files
    );
}

/// Protects: an unknown preset is a usage error with a suggestion.
#[test]
fn an_unknown_preset_is_a_usage_error_with_a_suggestion() {
    let Some(preset) = presets::list().into_iter().next() else {
        return;
    };
    let mistyped = format!("{}x", preset.name);
    let error = load(&Input::Preset(mistyped.clone()), &LoadOptions::default())
        .expect_err("no such preset");
    assert_eq!(error.kind(), ErrorKind::Usage);
    let expected = format!(
        "error: there is no preset `{mistyped}`\nhelp: did you mean `preset:{}`?",
        preset.name
    );
    assert_eq!(error.to_string(), expected);
}

/// Protects: extensions in any letter case decide the format, and are removed from the name of the
/// picture.
#[test]
fn endings_count_in_any_case() {
    let place = SceneFolder::new("");
    let model = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (name, bytes, expected) in [
        (
            "A.Scene.TOML",
            b"format = 1".as_slice(),
            (SceneFormat::Native(SceneNotation::Toml), "A"),
        ),
        (
            "B.JSON",
            b"{\"format\": 1}",
            (SceneFormat::Native(SceneNotation::Json), "B"),
        ),
        ("C.OBJ", model, (SceneFormat::Obj, "C")),
    ] {
        let source = load(
            &Input::Path(place.put(name, bytes)),
            &LoadOptions::default(),
        )
        .expect("a scene")
        .source;
        assert_eq!((source.format, source.stem.as_str()), expected, "{name}");
    }
}

/// Protects: a byte order mark before a text of any format, with either line end, has no effect on
/// the content, from a file and from a pipe alike; positions in messages of native scenes are
/// relative to the text after it.
#[test]
fn byte_order_marks_change_nothing() {
    let toml = "format = 1\n[[materials]]\nname = \"m\"\nmodel.classic = {}\n";
    let json =
        "{\"format\": 1,\n\"materials\": [{\"name\": \"m\", \"model\": {\"classic\": {}}}]}\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
               property list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let gltf = "{\"asset\": {\"version\": \"2.0\"},\n\"materials\": [{}], \"scenes\": [{}], \"scene\": 0}\n";
    let place = SceneFolder::new("");
    for (name, text) in [
        ("a.scene.toml", toml),
        ("a.scene.json", json),
        ("a.obj", obj),
        ("a.stl", stl),
        ("a.ply", ply),
        ("a.gltf", gltf),
    ] {
        let read = |text: &str| {
            let path = place.put(name, text.as_bytes());
            let piped = Input::Bytes {
                name: name.to_owned(),
                bytes: text.as_bytes().to_vec(),
                resolver: None,
            };
            let unnamed = Input::Bytes {
                name: "-".to_owned(),
                bytes: text.as_bytes().to_vec(),
                resolver: None,
            };
            [Input::Path(path), piped, unnamed].map(|input| {
                let loaded =
                    load(&input, &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
                assert_eq!(
                    loaded
                        .warnings
                        .iter()
                        .filter(|warning| !warning.message.contains("no visible triangles"))
                        .count(),
                    0
                );
                Scene {
                    title: String::new(),
                    ..loaded.scene
                }
            })
        };
        let plain = read(text);
        assert_eq!(read(&format!("\u{feff}{text}")), plain, "{name}");
        assert_eq!(
            read(&format!("\u{feff}{}", text.replace('\n', "\r\n"))),
            plain,
            "{name}"
        );
    }
    place.put("x.scene.toml", b"\xef\xbb\xbfformat = 2\n");
    let (_, message) = place.fails(&LoadOptions::default());
    assert!(message.contains("x.scene.toml:1:10"), "{message}");
}
