//! The same mesh in several formats, from a file or through a pipe: the same picture, to the bit.

use raywright_core::settings::Sampling;
use raywright_core::{Settings, prepare};
use raywright_io::{
    Error, Input, Limits, LoadOptions, LoadedScene, ModelOptions, Resolver, UpAxis,
};

use crate::written::{ENCODINGS, PolygonMesh};

/// Bits of a loaded file's picture.
fn picture(loaded: &LoadedScene) -> Vec<[u32; 3]> {
    let scene = &loaded.scene;
    let settings = Settings {
        size: [40, 30],
        sampling: Sampling::from_spp(scene, Some(4)),
        ..Settings::from_scene(scene)
    };
    let picture = prepare(scene, &settings, &())
        .expect("it can be rendered")
        .render(&())
        .picture;
    picture
        .rgb
        .iter()
        .map(|pixel| pixel.map(f32::to_bits))
        .collect()
}

fn from_file(name: &str, bytes: &[u8]) -> LoadedScene {
    from_turned_file(name, bytes, None)
}

/// Loads a file with an up axis.
fn from_turned_file(name: &str, bytes: &[u8], up: Option<UpAxis>) -> LoadedScene {
    let folder = tempfile::tempdir().expect("a folder");
    image::RgbaImage::from_fn(4, 4, |x, y| {
        image::Rgba([x as u8 * 80, y as u8 * 80, 99, 255])
    })
    .save(folder.path().join("x.png"))
    .expect("a picture");
    std::fs::write(folder.path().join("m.mtl"), "newmtl m\nmap_Kd x.png\n").expect("a file");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a file");
    if name.contains(".scene.") {
        return crate::shared::load(&path);
    }
    let model = ModelOptions {
        up,
        ..ModelOptions::default()
    };
    let loaded = raywright_io::load(
        &Input::Path(path.clone()),
        &LoadOptions {
            model,
            ..LoadOptions::default()
        },
    );
    let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
    crate::shared::check_sound(&loaded, &path);
    loaded
}

fn piped(bytes: &[u8]) -> Result<LoadedScene, Error> {
    let input = Input::from_reader("standard input", bytes, &Limits::default())?;
    raywright_io::load(&input, &LoadOptions::default())
}

/// Asserts that all files have the same picture, and another file a different one.
fn same(files: Vec<(&'static str, Vec<u8>)>, other: Option<&PolygonMesh>) {
    let seen = |(name, bytes): &(&'static str, Vec<u8>)| {
        // STL has another default up axis.
        let loaded = from_turned_file(name, bytes, Some(UpAxis::Y));
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        (*name, picture(&loaded))
    };
    let pictures: Vec<_> = files.iter().map(seen).collect();
    let (_, first) = &pictures[0];
    assert!(
        first.iter().any(|pixel| pixel != &first[0]),
        "something is seen"
    );
    for (name, found) in &pictures {
        assert!(found == first, "{name} is not {}", files[0].0);
    }
    if let Some(other) = other {
        assert!(picture(&from_file("other.ply", &other.ply("ascii", ""))) != *first);
    }
}

/// The same mesh in OBJ and all three encodings of PLY.
fn obj_and_ply(mesh: &PolygonMesh, obj: &str, comment: &str) -> Vec<(&'static str, Vec<u8>)> {
    let mut files = vec![("a.obj", [obj.as_bytes(), &mesh.obj()].concat())];
    files.extend(
        ENCODINGS
            .iter()
            .map(|encoding| ("a.ply", mesh.ply(encoding, comment))),
    );
    files
}

/// Protects: triangles give the same picture in every format and encoding; polygons, convex,
/// concave and large, in OBJ and PLY.
#[test]
fn one_mesh_in_every_format() {
    let sheet = PolygonMesh::sheet(6);
    let mut files = obj_and_ply(&sheet, "", "");
    files.extend([
        ("a.stl", sheet.stl("", |_| 0)),
        ("solid.stl", sheet.stl("solid", |_| 0)),
        ("words.stl", sheet.stl_text()),
    ]);
    let mut moved = sheet.clone();
    moved.positions[9][2] += 0.5;
    same(files, Some(&moved));
    let corner = |i: u32| {
        let out = if i.is_multiple_of(2) { 2.0 } else { 0.75 };
        let [x, y] = [
            [1.0, 0.0],
            [0.75, 0.5],
            [0.25, 1.0],
            [-0.5, 0.75],
            [-1.0, 0.0],
            [-0.75, -0.5],
            [0.0, -1.0],
            [0.5, -0.75],
        ][i as usize];
        [x * out, y * out, 0.25 * x]
    };
    let star = PolygonMesh {
        positions: (0..8).map(corner).collect(),
        faces: vec![(0..8).collect(), vec![0, 2, 4, 6]],
        ..PolygonMesh::default()
    };
    let mut files = obj_and_ply(&star, "", "");
    files.push(("words.stl", star.stl_text()));
    same(files, None);
}

/// Protects: vertex colours, given normals, and texture coordinates with an image are equivalent in
/// OBJ and PLY.
#[test]
fn attributes_in_both_formats() {
    let sheet = PolygonMesh::sheet(6);
    same(obj_and_ply(&sheet.clone().coloured(), "", ""), Some(&sheet));
    let normals = sheet
        .positions
        .iter()
        .map(|p| [p[0] - 0.75, 0.5, 1.0 - p[2]])
        .collect();
    let shaded = PolygonMesh {
        normals,
        ..sheet.clone()
    };
    same(obj_and_ply(&shaded, "", ""), Some(&sheet));
    let uvs = sheet
        .positions
        .iter()
        .map(|p| [p[0] * 2.0 + 0.125, p[1]])
        .collect();
    let mapped = PolygonMesh {
        uvs,
        ..sheet.clone()
    };
    same(
        obj_and_ply(
            &mapped,
            "mtllib m.mtl\nusemtl m\n",
            "comment TextureFile x.png\n",
        ),
        Some(&sheet),
    );
}

/// Protects: both colour dialects of binary STL are equivalent, to each other and to face colours
/// of PLY.
#[test]
fn facets_have_colours_of_their_own() {
    let sheet = PolygonMesh::sheet(4);
    let facets = (0..sheet.faces.len() as u16)
        .map(|i| [i * 7 % 32, i * 11 % 32, 31 - i % 32])
        .collect();
    let coloured = PolygonMesh {
        facets,
        ..sheet.clone()
    };
    let mut files: Vec<_> = ENCODINGS
        .iter()
        .map(|encoding| ("a.ply", coloured.ply(encoding, "")))
        .collect();
    files.push((
        "viscam.stl",
        coloured.stl("", |[r, g, b]| 0x8000 | r << 10 | g << 5 | b),
    ));
    files.push((
        "magics.stl",
        coloured.stl("COLOR=\u{9}\u{9}\u{9}\u{9},MATERIAL=", |[r, g, b]| {
            b << 10 | g << 5 | r
        }),
    ));
    same(files, Some(&sheet));
}

/// Protects: data from a pipe is detected by its content and has the same picture as the file;
/// files that it names are not read, with a message.
#[test]
fn pipes_bring_what_files_bring() {
    let sheet = PolygonMesh::sheet(3).coloured();
    let plain = PolygonMesh {
        colours: Vec::new(),
        ..sheet.clone()
    };
    let folder = tempfile::tempdir().expect("a folder");
    let [_, glb, _] = crate::built::models(folder.path());
    let glb = std::fs::read(glb).expect("just written");
    let gltf = std::fs::read(crate::keyed::KeyedTriangle::new().write()).expect("just written");
    let toml = "# a scene\n\nformat = 1\n[[materials]]\nname = \"m\"\nmodel.physical = {}\n[[objects]]\nshape.sphere = { centre = [0, 0, 0], \
        radius = 1 }\nmaterial = \"m\"\n";
    let json = r#" { "format": 1, "materials": [{ "name": "m", "model": { "physical": {} } }],
        "objects": [{ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "m" }] }"#;
    let mut files = vec![
        ("a.obj", sheet.obj()),
        ("a.stl", plain.stl("solid", |_| 0)),
        ("a.stl", plain.stl("\u{7}", |_| 0)),
        ("a.stl", plain.stl_text()),
        ("a.gltf", gltf),
        ("a.glb", glb),
        ("a.scene.toml", toml.into()),
        ("a.scene.json", json.into()),
    ];
    files.extend(
        ENCODINGS
            .iter()
            .map(|encoding| ("a.ply", sheet.ply(encoding, ""))),
    );
    for (name, bytes) in files {
        let (file, pipe) = (
            from_file(name, &bytes),
            piped(&bytes).unwrap_or_else(|error| panic!("{name}: {error}")),
        );
        assert_eq!(
            (file.source.format, &file.hash),
            (pipe.source.format, &pipe.hash),
            "{name}"
        );
        assert!(picture(&file) == picture(&pipe), "{name}");
        assert_eq!(
            (pipe.source.name.as_str(), pipe.inputs.files().count()),
            ("standard input", 0)
        );
    }
    let beside = [b"mtllib m.mtl\nusemtl m\n".as_slice(), &plain.obj()].concat();
    let warnings = piped(&beside).expect("a model").warnings;
    let words = "standard input: material library: `m.mtl` cannot be read: a scene read from a pipe has no folder";
    assert!(warnings[0].message.starts_with(words), "{warnings:?}");
    let buffer =
        br#"{ "asset": { "version": "2.0" }, "buffers": [{ "byteLength": 4, "uri": "a.bin" }] }"#;
    let error = piped(buffer).expect_err("no buffer").to_string();
    assert!(
        error.contains("`a.bin` cannot be read: a scene read from a pipe"),
        "{error}"
    );
    for (bytes, words) in [
        (b"".as_slice(), "standard input: is empty"),
        (
            b"what is this",
            "standard input: the format of the file is unknown",
        ),
    ] {
        let error = piped(bytes).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
    }
    let limits = Limits {
        file_bytes: 9,
        text_bytes: 9,
        ..Limits::default()
    };
    assert!(
        Input::from_reader("a", [0; 10].as_slice(), &limits).is_err()
            && Input::from_reader("a", [0; 9].as_slice(), &limits).is_ok()
    );
}

/// Protects: a scene from bytes finds its files through a resolver, and a model its files below the
/// model's folder, with the picture and the hash of the same files on disk; outside paths are never
/// requested, and oversized files are refused.
#[test]
fn files_in_memory_are_files() {
    let plain = PolygonMesh {
        colours: Vec::new(),
        ..PolygonMesh::sheet(3).coloured()
    };
    let of_library = |library: &str| {
        [
            format!("mtllib {library}\nusemtl m\n").as_bytes(),
            &plain.obj(),
        ]
        .concat()
    };
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_fn(4, 4, |x, y| {
        image::Rgba([x as u8 * 80, y as u8 * 80, 99, 255])
    })
    .write_to(&mut png, image::ImageFormat::Png)
    .expect("a picture");
    let scene = r#"{ "format": 1, "models": [{ "file": "./sub/a.obj" }] }"#;
    let files = [
        ("sub/a.obj", of_library("lib/m.mtl")),
        ("sub/lib/m.mtl", b"newmtl m\nmap_Kd maps/x.png\n".to_vec()),
        ("sub/maps/x.png", png.into_inner()),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    ["sub/lib", "sub/maps"]
        .iter()
        .for_each(|name| std::fs::create_dir_all(folder.path().join(name)).expect("a folder"));
    for (name, bytes) in files
        .iter()
        .map(|(name, bytes)| (*name, bytes.as_slice()))
        .chain([("a.scene.json", scene.as_bytes())])
    {
        std::fs::write(folder.path().join(name), bytes).expect("a file");
    }
    let on_disk = crate::shared::load(&folder.path().join("a.scene.json"));

    let expected = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
    let load = |name: &str, bytes: &[u8], limits: Limits| {
        let (files, expected) = (files.clone(), expected.clone());
        let resolver = Resolver::new(move |name| {
            expected.lock().expect("no panic").push(name.to_owned());
            let found = files.iter().find(|(known, _)| *known == name);
            found
                .map(|(_, bytes)| bytes.clone())
                .ok_or_else(|| std::io::ErrorKind::NotFound.into())
        });
        let input = Input::Bytes {
            name: name.to_owned(),
            bytes: bytes.to_vec(),
            resolver: Some(resolver),
        };
        raywright_io::load(
            &input,
            &LoadOptions {
                limits,
                ..LoadOptions::default()
            },
        )
    };
    let in_memory = load("a.scene.json", scene.as_bytes(), Limits::default()).expect("a scene");
    assert!(
        on_disk.warnings.is_empty() && in_memory.warnings.is_empty(),
        "{:?} {:?}",
        on_disk.warnings,
        in_memory.warnings
    );
    assert!(picture(&on_disk) == picture(&in_memory));
    assert_eq!(on_disk.hash, in_memory.hash);
    assert_eq!(
        expected.lock().expect("no panic").split_off(0),
        [
            "sub/a.obj",
            "sub/lib/m.mtl",
            "sub/lib/maps/x.png",
            "sub/maps/x.png"
        ]
    );

    for (library, words) in [
        (
            "../m.mtl",
            "lies outside the scene's folder, and only files in that folder are read",
        ),
        ("/m.mtl", "lies outside"),
        ("http://x/m.mtl", "is a URL"),
    ] {
        let warnings = load("a.obj", &of_library(library), Limits::default())
            .expect("a model")
            .warnings;
        assert!(warnings[0].message.contains(words), "{warnings:?}");
    }
    assert!(
        expected.lock().expect("no panic").is_empty(),
        "{expected:?}"
    );
    let warnings = load("a.obj", &of_library("n.mtl"), Limits::default())
        .expect("a model")
        .warnings;
    assert!(
        warnings[0].message.contains("cannot read `n.mtl`"),
        "{warnings:?}"
    );
    let small = Limits {
        file_bytes: 30,
        ..Limits::default()
    };
    let error = load("a.scene.json", scene.as_bytes(), small)
        .expect_err("a model of more than 30 bytes")
        .to_string();
    assert!(error.contains("is larger than the limit of 30"), "{error}");
}
