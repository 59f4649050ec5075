//! PLY files with known contents, and faults in others.

use raywright_core::scene::{MaterialModel, MeshData};
use raywright_io::{Error, ErrorKind, Input, Limits, LoadOptions, LoadedScene};

use crate::shared::{check_sound, mesh_of, triangle_count};
use crate::written::{ENCODINGS, PolygonMesh};

fn with(bytes: &[u8], limits: Limits) -> Result<LoadedScene, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("test.ply");
    std::fs::write(&path, bytes).expect("a file");
    let loaded = raywright_io::load(
        &Input::Path(path.clone()),
        &LoadOptions {
            limits,
            ..LoadOptions::default()
        },
    )?;
    check_sound(&loaded, &path);
    Ok(loaded)
}

fn read(bytes: &[u8]) -> Result<LoadedScene, Error> {
    with(bytes, Limits::default())
}

fn mesh(text: &str) -> MeshData {
    let loaded = read(text.as_bytes()).unwrap_or_else(|e| panic!("{text}: {e}"));
    mesh_of(&loaded, &loaded.scene.objects[0]).clone()
}

/// An ASCII file of a triangle with more header lines, values and numbers.
fn triangle(header: &str, vertices: [&str; 3], faces: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\n{header}end_header\n{}\n{faces}\n",
        vertices.join("\n")
    )
}

const XYZ: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const FACES: &str = "element face 1\nproperty list uchar int vertex_indices\n";
const PLACES: [&str; 3] = ["0 0 0", "1 0 0", "0 1 0"];

/// Protects: no face, one square and 10⁵ triangles, in all three encodings.
#[test]
fn faces_are_triangles() {
    for (n, triangles) in [(0, 0), (1, 2), (224, 100_352)] {
        let sheet = PolygonMesh::sheet(n);
        for encoding in ENCODINGS {
            let loaded = read(&sheet.ply(encoding, "")).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(triangle_count(&loaded), triangles);
            let data = loaded
                .scene
                .objects
                .first()
                .map(|object| mesh_of(&loaded, object));
            if let Some(data) = data {
                assert!(*data.positions.offsets() == sheet.positions && data.normals.is_empty());
                assert!(
                    data.indices
                        .as_flattened()
                        .iter()
                        .eq(sheet.faces.iter().flatten())
                );
            }
        }
    }
    let nothing = read(b"ply\nformat ascii 1.0\nend_header\n").expect("a file");
    assert!(
        nothing.warnings[0].message.contains("nothing to see"),
        "{:?}",
        nothing.warnings
    );
    let points = read(triangle(XYZ, PLACES, "").as_bytes()).expect("a file");
    assert!(
        points.warnings[0].message.contains("points and no faces"),
        "{:?}",
        points.warnings
    );
}

/// Protects: properties of every type are read in any order, between lists and unknown ones, with
/// faces before vertices, and with unknown elements; equally in ASCII and in both byte orders.
#[test]
fn properties_in_any_order_and_type() {
    let header = "comment made by hand\nelement face 2\nproperty uchar flags\nproperty list short uint vertex_index\nproperty list uint double \
        weights\nelement camera 1\nproperty list uchar float view\nelement vertex 4\nproperty double z\nproperty list uchar ushort tags\n\
        property uint8 blue\nproperty int16 x\nproperty char y\nproperty float64 nz\nproperty float ny\nproperty float nx\nproperty uint8 \
        green\nproperty uint8 red\nproperty ushort t\nproperty int s\nobj_info end\n";
    type PlyRow<'a> = &'a [(&'a str, f64)];
    let face = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(f64::from);
        [
            ("u8", 7.0),
            ("i16", 3.0),
            ("u32", a),
            ("u32", b),
            ("u32", c),
            ("u32", 2.0),
            ("f64", 0.5),
            ("f64", -0.5),
        ]
    };
    let vertex = |z: f64, x: f64, y: f64, code: f64| {
        [
            ("f64", z),
            ("u8", 2.0),
            ("u16", 9.0),
            ("u16", 65535.0),
            ("u8", code),
            ("i16", x),
            ("i8", y),
            ("f64", 0.8),
            ("f32", 0.6),
            ("f32", 0.0),
            ("u8", 255.0),
            ("u8", 0.0),
            ("u16", 3.0),
            ("i32", -2.0),
        ]
    };
    let faces = [face([0, 1, 2]), face([2, 1, 3])];
    let vertices = [
        vertex(0.5, 0.0, 0.0, 255.0),
        vertex(0.25, 300.0, 0.0, 0.0),
        vertex(0.125, 0.0, -128.0, 0.0),
        vertex(-2.0, 5.0, 5.0, 0.0),
    ];
    let camera: PlyRow = &[("u8", 2.0), ("f32", 1.0), ("f32", 2.0)];
    let rows: Vec<PlyRow> = [&faces[0][..], &faces[1], camera]
        .into_iter()
        .chain(vertices.iter().map(|row| &row[..]))
        .collect();
    let mut mesh_datas = Vec::new();
    for encoding in ENCODINGS {
        let mut out = format!("ply\nformat {encoding} 1.0\n{header}end_header\n").into_bytes();
        for row in &rows {
            for &(kind, value) in *row {
                if encoding == "ascii" {
                    out.extend(format!("{value} ").bytes());
                    continue;
                }
                let mut bytes = match kind {
                    "i8" => vec![value as i8 as u8],
                    "u8" => vec![value as u8],
                    "i16" => (value as i16).to_le_bytes().to_vec(),
                    "u16" => (value as u16).to_le_bytes().to_vec(),
                    "i32" => (value as i32).to_le_bytes().to_vec(),
                    "u32" => (value as u32).to_le_bytes().to_vec(),
                    "f32" => (value as f32).to_le_bytes().to_vec(),
                    _ => value.to_le_bytes().to_vec(),
                };
                if encoding == "binary_big_endian" {
                    bytes.reverse();
                }
                out.extend(bytes);
            }
            out.extend((encoding == "ascii").then_some(b'\n'));
        }
        let loaded = read(&out).unwrap_or_else(|e| panic!("{encoding}: {e}"));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        mesh_datas.push(mesh_of(&loaded, &loaded.scene.objects[0]).clone());
    }
    let first = &mesh_datas[0];
    assert_eq!(
        *first.positions.offsets(),
        [
            [0.0, 0.0, 0.5],
            [300.0, 0.0, 0.25],
            [0.0, -128.0, 0.125],
            [5.0, 5.0, -2.0]
        ]
    );
    assert_eq!(first.indices, [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(
        (first.colours[0], first.colours[1]),
        ([0.0, 1.0, 1.0, 1.0], [0.0, 1.0, 0.0, 1.0])
    );
    // v counts from the top in a scene.
    assert_eq!(first.uvs, [vec![[-2.0, -2.0]; 4]]);
    assert!((first.normals[2][1] - 0.6).abs() < 1e-6 && (first.normals[2][2] - 0.8).abs() < 1e-6);
    assert!(mesh_datas.iter().all(|mesh| mesh == first));
}

/// Protects: ASCII files with line ends of all three kinds, comments in all allowed places,
/// integers written as fractions, and all data on one line.
#[test]
fn texts_are_read_as_they_are_written() {
    let text = triangle(
        &format!("comment a\n{XYZ}comment b\nobj_info c\n\n{FACES}comment d\n"),
        ["0.0 0 0", " 1e0\t0 0", "0 +1 -0"],
        "3 0 1.0 2",
    );
    let plain = mesh(&text);
    assert_eq!(
        (plain.positions.len(), plain.indices.as_slice()),
        (3, &[[0, 1, 2]][..])
    );
    assert_eq!(plain.positions.offsets()[1], [1.0, 0.0, 0.0]);
    for ends in ["\r\n", "\r"] {
        assert!(mesh(&text.replace('\n', ends)) == plain, "{ends:?}");
    }
    let (head, body) = text.split_once("end_header\n").expect("both");
    assert!(mesh(&format!("{head}end_header\n{}", body.replace('\n', " "))) == plain);
}

/// Protects: polygons are triangulated as in OBJ, large ones too; strips give all their triangles,
/// with one orientation; a face of fewer than three corners is dropped.
#[test]
fn polygons_and_strips() {
    let corner = |i: u8| {
        [
            (f32::from(i) / 10.0).cos(),
            (f32::from(i) / 10.0).sin(),
            0.0,
        ]
    };
    let faces = vec![(0..63).collect(), vec![0, 9, 30], vec![4, 5], vec![]];
    let ring = PolygonMesh {
        positions: (0..200).map(corner).collect(),
        faces,
        ..PolygonMesh::default()
    };
    for encoding in ENCODINGS {
        let loaded = read(&ring.ply(encoding, "")).expect("a mesh");
        assert_eq!(triangle_count(&loaded), 61 + 1);
        assert!(
            loaded.warnings[0]
                .message
                .contains("fewer than three corners"),
            "{:?}",
            loaded.warnings
        );
    }
    let strips = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\nproperty list int int vertex_indices\n";
    let text = format!(
        "ply\nformat ascii 1.0\n{strips}end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n9 0 1 2 3 -1 3 1 1 0 \n"
    );
    assert_eq!(mesh(&text).indices, [[0, 1, 2], [2, 1, 3]]);
}

/// Protects: texture coordinates and colours of a face apply to its corners, and replace those of
/// vertices.
#[test]
fn faces_have_their_own() {
    let header = format!(
        "{XYZ}property float u\nproperty float v\nelement face 2\nproperty list uchar float texcoord\nproperty float red\n\
        property list uchar int vertex_indices\nproperty float green\nproperty float blue\n"
    );
    let text = triangle(
        &header,
        ["0 0 0 9 9", "1 0 0 9 9", "0 1 0 9 9"],
        "6 0 0 1 0 0.5 0.25 1 3 0 1 2 0 0\n2 7 7 0 3 2 1 0 0 1",
    );
    let data = mesh(&text);
    assert_eq!(data.indices, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(
        *data.positions.offsets(),
        [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0; 3]
        ]
    );
    assert_eq!(
        data.uvs,
        [vec![
            [0.0, 1.0],
            [1.0, 1.0],
            [0.5, 0.75],
            [0.0; 2],
            [0.0; 2],
            [0.0; 2]
        ]],
        "a list of another length is none"
    );
    assert_eq!(
        (data.colours[1], data.colours[4]),
        ([1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0])
    );
}

/// Protects: strips beside faces with colours and coordinates are white and at (0, 0), before and
/// after them.
#[test]
fn strips_beside_faces() {
    let faces = "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\n";
    let strips = "element tristrips 1\nproperty list uchar int vertex_indices\n";
    let (face, strip) = ("3 0 1 2 6 0.5 0.5 0.5 0.5 0.5 0.5 255 0 0\n", "3 0 1 2\n");
    for (headers, bodies, position) in [
        ([faces, strips], [face, strip], 0),
        ([strips, faces], [strip, face], 3),
    ] {
        let data = mesh(&triangle(
            &format!("{XYZ}{}", headers.concat()),
            PLACES,
            &bodies.concat(),
        ));
        assert_eq!((data.positions.len(), data.indices.len()), (6, 2));
        assert_eq!(
            (data.colours[position], data.uvs[0][position]),
            ([1.0, 0.0, 0.0, 1.0], [0.5; 2])
        );
        assert_eq!(
            (data.colours[3 - position], data.uvs[0][3 - position]),
            ([1.0; 4], [0.0; 2])
        );
    }
}

/// Protects: float colours range to 255 if any is above 1, and 16-bit codes are scaled by their
/// type.
#[test]
fn colours_of_every_type() {
    for (kind, values) in [
        ("float", ["0 1 0.5", "0 0 0", "1 1 1"]),
        ("float", ["0 255 127.5", "0 0 0", "255 255 255"]),
        ("ushort", ["0 65535 32767.0", "0 0 0", "1 1 1"]),
    ] {
        let properties = ["red", "green", "blue"]
            .map(|name| format!("property {kind} {name}\n"))
            .concat();
        let vertices: [String; 3] =
            core::array::from_fn(|i| format!("{} {}", PLACES[i], values[i]));
        let data = mesh(&triangle(
            &format!("{XYZ}{properties}{FACES}"),
            [&vertices[0], &vertices[1], &vertices[2]],
            "3 0 1 2",
        ));
        let [r, g, b, a] = data.colours[0];
        assert!(
            (r, g, a) == (0.0, 1.0, 1.0) && (b - 0.214_04).abs() < 1e-4,
            "{kind}: {:?}",
            data.colours[0]
        );
    }
}

/// Protects: an invalid file is refused with line or element and cause.
#[test]
fn errors_name_place_and_cause() {
    let ply = |lines: &str| format!("ply\nformat ascii 1.0\n{lines}end_header\n");
    let body =
        |vertices: [&str; 3], faces: &str| triangle(&format!("{XYZ}{FACES}"), vertices, faces);
    let cases: [(String, &str); 21] = [
        ("plx\n".to_owned(), "does not begin with `ply`"),
        (
            "ply\nformat ascii 1.0\n".to_owned(),
            "line 3: the header has no end_header",
        ),
        ("ply\nend_header\n".to_owned(), "no `format` line"),
        (
            "ply\nformat ascii 2.0\nend_header\n".to_owned(),
            "line 2: is PLY version 2.0",
        ),
        (
            "ply\nformat binary 1.0\nend_header\n".to_owned(),
            "line 2: the format `binary`",
        ),
        (
            ply("element vertex three\n"),
            "line 3: the number of elements is `three`",
        ),
        (ply("element vertex -3\n"), "the number of elements is `-3`"),
        (
            ply("property float x\n"),
            "line 3: a property stands before the first element",
        ),
        (
            ply("element vertex 3\nproperty real x\n"),
            "line 4: `real` is not a number type",
        ),
        (
            ply("element vertex 3\nproperty float x\nproperty float x\n"),
            "line 5: the element `vertex` declares the property `x` twice",
        ),
        (
            ply("element vertex 0\nelement vertex 3\n"),
            "line 4: the element `vertex` is declared twice",
        ),
        (
            ply("element face 1\nproperty list float int vertex_indices\n"),
            "line 4: the length of the list `vertex_indices` has a floating-point type",
        ),
        (
            ply("nonsense here\n"),
            "line 3: `nonsense here` is not a valid line of a PLY header",
        ),
        (
            format!("{}1 2 3\n", ply("element vertex 1\nproperty float x\n")),
            "its vertices have no x, y and z",
        ),
        (
            body(["0 0 0", "1 zero 0", "0 1 0"], "3 0 1 2"),
            "line 11: vertex 1: y: `zero` is no number",
        ),
        (
            body(["0 0 0", "1 0,5 0", "0 1 0"], "3 0 1 2"),
            "`0,5` is no number; export the file again with decimal points",
        ),
        (
            body(PLACES, "3 0 1 3"),
            "a face refers to vertex 3, but the file has 3 vertices",
        ),
        (
            body(PLACES, "3 0 1 -1"),
            "line 13: face 0: the vertex index -1 is negative or above 4294967295",
        ),
        (
            body(PLACES, "3 0 1 1.5"),
            "vertex_indices: `1.5` is no number",
        ),
        (
            body(PLACES, "4 0 1 2"),
            "face 0: the file ends before the next number",
        ),
        (
            body(PLACES, "99 0 1 2"),
            "line 13: face 0: vertex_indices: the list length 99 is negative, not a whole number, or more than the remaining data can hold",
        ),
    ];
    for (text, words) in cases {
        let error = read(text.as_bytes()).expect_err(words);
        assert!(
            error.to_string().contains(words) && error.to_string().contains("test.ply"),
            "{words}: {error}"
        );
        assert_eq!(error.kind(), ErrorKind::Input);
    }
}

/// Protects: false counts take neither memory nor time, in every encoding, even for items of zero
/// bytes; limits hold.
#[test]
fn counts_that_lie() {
    let sheet = PolygonMesh::sheet(2);
    for encoding in ENCODINGS {
        let good = sheet.ply(encoding, "");
        let text = String::from_utf8_lossy(&good).into_owned();
        for (right, wrong) in [
            ("element vertex 9", "element vertex 4000000000"),
            ("element vertex 9", "element vertex 18446744073709551615"),
            ("element face 8", "element face 4000000000"),
            ("element face 8", "element face 9"),
        ] {
            let position = text.find(right).expect("it is there");
            let bytes = [
                &good[..position],
                wrong.as_bytes(),
                &good[position + right.len()..],
            ]
            .concat();
            assert!(read(&bytes).is_err(), "{encoding}: {wrong}");
        }
        let fewer = read(&[&good[..], b" 7 7"].concat()).expect("a mesh");
        assert!(
            fewer.warnings[0]
                .message
                .contains("bytes after the last element were ignored"),
            "{:?}",
            fewer.warnings
        );
        let more = text.find("end_header").expect("it is there");
        let bytes = [
            &good[..more],
            b"element nothing 18446744073709551615\n",
            &good[more..],
        ]
        .concat();
        assert_eq!(
            triangle_count(&read(&bytes).expect("elements of nothing")),
            8
        );
        for limits in [
            Limits {
                triangles: 7,
                ..Limits::default()
            },
            Limits {
                memory_bytes: 200,
                ..Limits::default()
            },
        ] {
            assert_eq!(
                with(&good, limits).expect_err("too many").kind(),
                ErrorKind::Limit
            );
        }
    }
}

/// Protects: triangles of zero area are kept; those with non-finite vertices are dropped with a
/// warning.
#[test]
fn odd_faces() {
    let mut sheet = PolygonMesh::sheet(2);
    sheet.faces.extend([vec![0, 0, 0], vec![0, 1, 2]]);
    for bad in [0.0, f32::NAN, f32::INFINITY, -1e38] {
        sheet.positions[0][1] = bad;
        for encoding in ENCODINGS {
            let loaded = read(&sheet.ply(encoding, "")).expect("a mesh");
            assert_eq!(
                triangle_count(&loaded),
                if bad == 0.0 { 10 } else { 7 },
                "{bad}"
            );
            assert_eq!(
                loaded.warnings.is_empty(),
                bad == 0.0,
                "{:?}",
                loaded.warnings
            );
        }
    }
}

/// Loads a file of two triangles with coordinates and these texture numbers, with three small
/// images beside it.
fn textured(comments: &str, numbers: Option<[i32; 2]>) -> LoadedScene {
    let [a, b] = numbers.map_or([String::new(), String::new()], |numbers| {
        numbers.map(|number| format!(" {number}"))
    });
    textured_faces(
        comments,
        numbers.is_some(),
        &[format!("3 0 1 2{a}"), format!("3 0 2 3{b}")],
    )
}

/// The same with the faces given as text.
fn textured_faces(comments: &str, numbered: bool, faces: &[String]) -> LoadedScene {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["red.png", "green hue.png"] {
        image::RgbImage::from_pixel(1, 1, image::Rgb([9, 9, 9]))
            .save(folder.path().join(name))
            .expect("an image");
    }
    let vertices = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float u\nproperty float v\n";
    let (count, property) = (
        faces.len(),
        if numbered {
            "property int texnumber\n"
        } else {
            ""
        },
    );
    let text = format!(
        "ply\nformat ascii 1.0\n{comments}{vertices}element face {count}\nproperty list uchar int vertex_indices\n{property}end_header\n\
         0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n{}\n",
        faces.join("\n")
    );
    let path = folder.path().join("test.ply");
    std::fs::write(&path, text).expect("a file");
    let loaded = raywright_io::load(&Input::Path(path.clone()), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"));
    check_sound(&loaded, &path);
    loaded
}

/// Image, number of triangles and number of vertices of each object.
fn shown(loaded: &LoadedScene) -> Vec<(&str, usize, usize)> {
    let one = |object| {
        let (mesh, scene) = (mesh_of(loaded, object), &loaded.scene);
        let model = scene
            .materials
            .iter()
            .find(|material| material.name == object.material)
            .map(|material| &material.model);
        let Some(MaterialModel::Physical(model)) = model else {
            panic!("{model:?}")
        };
        let used = model
            .base_colour_texture
            .as_ref()
            .map_or("", |texture| &texture.name);
        let image = scene
            .textures
            .iter()
            .find(|texture| texture.name == used)
            .map_or("", |texture| &texture.image);
        (image, mesh.indices.len(), mesh.positions.len())
    };
    loaded.scene.objects.iter().map(one).collect()
}

/// Protects: each face shows the texture of its `texnumber`; `TextureFile` may have any letter case
/// and names may have blanks; a negative or excessive number shows none; unused textures are
/// reported.
#[test]
fn faces_show_their_own_textures() {
    let comments = "comment TextureFile red.png\ncomment TEXTUREFILE green hue.png\n";
    type Meshes<'a> = &'a [(&'a str, usize, usize)];
    type Case<'a> = (&'a str, Option<[i32; 2]>, Meshes<'a>, &'a [&'a str]);
    let cases: [Case<'_>; 8] = [
        (
            comments,
            Some([0, 1]),
            &[("red.png", 1, 3), ("green hue.png", 1, 3)],
            &[],
        ),
        (
            comments,
            Some([1, 1]),
            &[("green hue.png", 2, 4)],
            &["no face shows the texture 0, `red.png`"],
        ),
        (
            comments,
            Some([-1, 7]),
            &[("", 2, 4)],
            &[
                "1 triangle has a texnumber beyond the file's 2 images",
                "texture 0",
                "texture 1",
            ],
        ),
        (
            comments,
            None,
            &[("red.png", 2, 4)],
            &["all faces show the first texture, none shows the texture `green hue.png`"],
        ),
        (
            "comment texturefile red.png\n",
            None,
            &[("red.png", 2, 4)],
            &[],
        ),
        (
            "comment TextureFile red.png\n",
            Some([0, 0]),
            &[("red.png", 2, 4)],
            &[],
        ),
        (
            "comment TextureFile red.png\n",
            Some([0, -1]),
            &[("", 1, 3), ("red.png", 1, 3)],
            &[],
        ),
        ("", Some([0, 1]), &[("", 2, 4)], &[]),
    ];
    // Each triangle of a polygon has the number of its face.
    let polygons = textured_faces(
        comments,
        true,
        &["4 0 1 2 3 0".to_owned(), "3 0 1 2 1".to_owned()],
    );
    assert_eq!(
        shown(&polygons),
        [("red.png", 2, 4), ("green hue.png", 1, 3)]
    );
    // A face of two corners is dropped together with its number.
    let faces = ["2 0 1 0", "3 0 1 2 1", "3 0 2 3 1"].map(str::to_owned);
    assert_eq!(
        shown(&textured_faces(comments, true, &faces)),
        [("green hue.png", 2, 4)]
    );
    for (comments, numbers, expected, warnings) in cases {
        let loaded = textured(comments, numbers);
        assert_eq!(shown(&loaded), expected, "{comments}, {numbers:?}");
        assert_eq!(
            loaded.warnings.len(),
            warnings.len(),
            "{:?}",
            loaded.warnings
        );
        for (warning, words) in loaded.warnings.iter().zip(warnings) {
            assert!(warning.message.contains(words), "{warning}, not {words}");
        }
    }
}

/// Protects: a texture in a file without coordinates is reported.
#[test]
fn textures_without_coordinates_are_said() {
    let loaded = read(
        triangle(
            &format!("comment TextureFile a.png\n{XYZ}{FACES}"),
            PLACES,
            "3 0 1 2",
        )
        .as_bytes(),
    )
    .expect("a mesh");
    let [warning] = loaded.warnings.as_slice() else {
        panic!("{:?}", loaded.warnings)
    };
    assert!(
        warning.message.contains("`a.png`") && warning.message.contains("no texture coordinates"),
        "{warning}"
    );
}

/// Protects: where a text has as many lines as items, numbers beyond those of the header are
/// skipped, with a warning that names the first such line; elsewhere the numbers are a stream.
#[test]
fn surplus_numbers_of_lines_are_skipped() {
    let header = format!("{XYZ}{FACES}property uchar red\n");
    let edges = format!("element edge 1\nproperty int a\n{header}");
    let warned = "line 14: has more numbers than the header names";
    for (text, words) in [
        (triangle(&header, PLACES, "3 0 1 2 9"), ""),
        (triangle(&header, PLACES, "3 0 1 2 9 1 1 1"), "line 14"),
        (
            triangle(&header, ["0 0 0", "1 0 0 7 7 7", "0 1 0 7"], "3 0 1 2 9"),
            "line 12",
        ),
        (
            triangle(&edges, ["5 6\n0 0 0", "1 0 0", "\n0 1 0 7\n"], "3 0 1 2 9"),
            "line 13",
        ),
        (
            triangle(&header, ["0 0 0 1 0 0 0", "", "1 0 3 0 1 2"], "9"),
            "",
        ),
    ] {
        for end in ["\n", "\r\n"] {
            let loaded =
                read(text.replace('\n', end).as_bytes()).unwrap_or_else(|e| panic!("{text}: {e}"));
            let data = mesh_of(&loaded, &loaded.scene.objects[0]);
            assert_eq!(data.indices, [[0, 1, 2]], "{text}");
            assert_eq!(
                *data.positions.offsets(),
                [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
                "{text}"
            );
            let text = format!("{:?}", loaded.warnings);
            assert_eq!(
                loaded.warnings.len(),
                usize::from(!words.is_empty()),
                "{text}"
            );
            assert!(
                text.contains(words) && (words != "line 14" || text.contains(warned)),
                "{text}"
            );
        }
    }
}

/// Protects: faces are white, not black, where their lines hold other numbers than the header names:
/// MeshLab writes a list of nine floats for four bytes of colour.
#[test]
fn surplus_numbers_of_faces_are_no_colours() {
    let rgb = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    for (face, colours) in [("3 0 1 2 9 1 1", 3), ("3 0 1 2 9 1 1 1 1 1 1 1 1 1", 0)] {
        let loaded = read(triangle(&format!("{XYZ}{FACES}{rgb}"), PLACES, face).as_bytes());
        let loaded = loaded.expect("a mesh");
        let data = mesh_of(&loaded, &loaded.scene.objects[0]);
        assert_eq!(data.colours.len(), colours, "{face}");
    }
}

/// Protects: a float colour a little above 1 is a fraction, for vertices and faces, clamped with a
/// warning. sRGB .3 is 0.0732.
#[test]
fn float_colours_a_little_above_one_are_fractions() {
    const RGB: &str = "property float red\nproperty float green\nproperty float blue\n";
    for odd in ["1.000001", "2.0", "1e9"] {
        let row = |place: &str| format!("{place} {odd} 0.3 0.2");
        let [a, b, c] = PLACES.map(row);
        for text in [
            triangle(
                &format!("{XYZ}{RGB}{FACES}"),
                [&a, &b.replace(odd, "0.9"), &c.replace(odd, "0.9")],
                "3 0 1 2",
            ),
            triangle(&format!("{XYZ}{FACES}{RGB}"), PLACES, &row("3 0 1 2")),
        ] {
            let loaded = read(text.as_bytes()).expect("a mesh");
            let colour = mesh_of(&loaded, &loaded.scene.objects[0]).colours[0];
            assert!(
                colour[0] == 1.0 && (colour[1] - 0.073_239).abs() < 1e-5,
                "{odd}: {colour:?}"
            );
            let warnings = format!("{:?}", loaded.warnings);
            assert!(
                warnings.contains("channels above 1 are clamped"),
                "{warnings}"
            );
        }
    }
}

/// Protects: a header line that lacks the word `comment` is a comment, with a warning; a misspelt
/// declaration is refused with its line.
#[test]
fn comments_without_their_word() {
    let text = triangle(
        &format!("Created by a scanner\n{XYZ}more of it\n{FACES}"),
        PLACES,
        "3 0 1 2",
    );
    let loaded = read(text.as_bytes()).expect("a mesh");
    assert_eq!(triangle_count(&loaded), 1);
    let [warning] = loaded.warnings.as_slice() else {
        panic!("{:?}", loaded.warnings)
    };
    let words = "line 3: `Created by a scanner` is not a valid line of a PLY header; such lines are read as comments";
    assert!(warning.message.contains(words), "{warning}");
    for line in [
        "propery float t",
        "propery list uchar int t",
        "elment edge 3",
        "element edge",
        "format ascii",
    ] {
        let text = triangle(&format!("{XYZ}{line}\n{FACES}"), PLACES, "3 0 1 2");
        let error = read(text.as_bytes()).expect_err(line).to_string();
        assert!(
            error.contains(&format!("line 7: `{line}` is not a valid line")),
            "{error}"
        );
    }
}
