//! OBJ files with known contents, whole collections, and hostile files.

use glam::DVec3;
use raywright_core::scene::{
    AlphaMode, Channel, Colour, ColourInput, ColourSpace, MaterialModel, MeshData, NumberInput,
    Physical, SideRule,
};
use raywright_io::LoadedScene;

use crate::shared::{
    assets, check_sound, files_below, load, mesh, mesh_of, triangle_count, try_load,
};

fn physical<'a>(loaded: &'a LoadedScene, name: &str) -> &'a Physical {
    match loaded
        .scene
        .materials
        .iter()
        .find(|m| m.name == name)
        .map(|m| &m.model)
    {
        Some(MaterialModel::Physical(physical)) => physical,
        other => panic!("{name}: {other:?}"),
    }
}

fn corner(data: &MeshData, i: u32) -> DVec3 {
    data.positions.position(i as usize)
}

/// Sum of the triangles' area vectors, and of their areas.
fn areas(data: &MeshData) -> (DVec3, f64) {
    let area = |[a, b, c]: &[u32; 3]| {
        (corner(data, *b) - corner(data, *a)).cross(corner(data, *c) - corner(data, *a)) / 2.0
    };
    data.indices
        .iter()
        .map(area)
        .fold((DVec3::ZERO, 0.0), |(v, s), area| {
            (v + area, s + area.length())
        })
}

fn write(text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.obj");
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

/// Protects: quads, hexagons and a concave L are split by material; the lamp is emissive.
#[test]
fn cornell_room() {
    let Some(path) = assets("obj/crafted/cornell_quads_ngons.obj") else {
        return;
    };
    let room = load(&path);
    let names: Vec<_> = room.scene.meshes.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["white", "red", "green", "lamp", "blue"]);
    assert_eq!(
        physical(&room, "lamp").emission,
        Colour([15.0, 12.0, 9.0]).into()
    );
    // Floor, ceiling and back wall of 2 x 2, and the L: 0.6 x 0.4 and 0.2 x 0.7.
    let (_, white) = areas(mesh(&room, "white"));
    assert!((white - (12.0 + 0.24 + 0.14)).abs() < 1e-6, "{white}");
    assert_eq!(mesh(&room, "blue").indices.len(), 4 + 6 * 2);
    assert_eq!(
        physical(&room, "red").base_colour,
        ColourInput::Constant(Colour([0.65_f32, 0.05, 0.05].map(f64::from)))
    );
    assert!(room.scene.objects.iter().all(|o| o.side == SideRule::Both));
}

/// Protects: glass and mirror materials are recognised.
#[test]
fn glass_and_mirror() {
    let Some(path) = assets("obj/crafted/glass_and_mirror.obj") else {
        return;
    };
    let file = load(&path);
    let glass = physical(&file, "glass");
    assert_eq!(
        (&glass.transmission, &glass.ior, &glass.roughness),
        (&1.0.into(), &1.5.into(), &0.0.into())
    );
    assert_eq!(
        (glass.alpha, &glass.opacity),
        (AlphaMode::Opaque, &1.0.into()),
        "what is refracted is not also faded"
    );
    let mirror = physical(&file, "mirror");
    assert_eq!(
        (&mirror.metallic, &mirror.roughness, &mirror.transmission),
        (&1.0.into(), &0.0.into(), &0.0.into())
    );
}

/// Protects: a smoothing group shares a normal along its edge; without a group, facets stay flat.
#[test]
fn smoothing_groups() {
    let Some(path) = assets("obj/crafted/no_normals_smooth.obj") else {
        return;
    };
    let file = load(&path);
    let [smooth, flat] = [0, 1].map(|i| mesh_of(&file, &file.scene.objects[i]));
    assert_eq!((smooth.indices.len(), flat.indices.len()), (2, 2));
    assert!(flat.normals.is_empty());
    assert_eq!(smooth.positions.len(), 4, "the shared edge is welded");
    // At the ridge (x = 0), the normal is the mean of both facets, which are mirror images in x.
    for (p, n) in smooth.positions.offsets().iter().zip(&smooth.normals) {
        assert!(p[0] != 0.0 || n[0].abs() < 1e-6, "{p:?} {n:?}");
        assert!(p[0] == 0.0 || n[0].abs() > 0.1, "{p:?} {n:?}");
    }
}

/// Protects: negative indices are relative to the current end of the list.
#[test]
fn negative_indices() {
    let Some(path) = assets("obj/crafted/negative_indices.obj") else {
        return;
    };
    let file = load(&path);
    let data = mesh_of(&file, &file.scene.objects[0]);
    assert_eq!(data.indices.len(), 3);
    let (_, area) = areas(data);
    assert!((area - 1.5).abs() < 1e-9, "{area}");
    assert_eq!(data.normals, vec![[0.0, 0.0, 1.0]; data.positions.len()]);
    // v = 0 is the top row in a scene, the bottom row in the file.
    let at = |p: [f32; 3]| {
        data.uvs[0][data
            .positions
            .offsets()
            .iter()
            .position(|q| *q == p)
            .unwrap()]
    };
    assert_eq!(
        (at([0.0, 0.0, 0.0]), at([1.0, 1.0, 0.0])),
        ([0.0, 1.0], [1.0, 0.0])
    );
}

/// Protects: well-known models have their published counts.
#[test]
fn well_known_models() {
    let Some(folder) = assets("obj/common") else {
        return;
    };
    for (file, triangles) in [
        ("fandisk.obj", 12946),
        ("spot.obj", 5856),
        ("teapot.obj", 6320),
        ("suzanne.obj", 968),
    ] {
        assert_eq!(
            triangle_count(&load(&folder.join(file))),
            triangles,
            "{file}"
        );
    }
}

/// Protects: every shared OBJ file loads and shows an object, except a file of lines.
#[test]
fn all_files_load() {
    let Some(folder) = assets("obj") else { return };
    for path in files_below(&folder)
        .into_iter()
        .filter(|p| p.extension().is_some_and(|e| e == "obj"))
    {
        let loaded = load(&path);
        check_sound(&loaded, &path);
        assert!(
            triangle_count(&loaded) > 0 || path.ends_with("line-prim.obj"),
            "{}: {:?}",
            path.display(),
            loaded.warnings
        );
    }
}

/// Protects: several libraries on one line are tried, one of which exists; a name may contain
/// blanks.
#[test]
fn libraries_are_found() {
    let Some(folder) = assets("obj") else { return };
    let several = load(&folder.join("tinyobj/mtllib-multiple-files-issue-112.obj"));
    assert_eq!(
        physical(&several, "default").base_colour,
        ColourInput::Constant(Colour::BLACK)
    );
    assert!(
        several
            .warnings
            .iter()
            .any(|w| w.message.contains("invalid-file-aaa.mtl")),
        "{:?}",
        several.warnings
    );
    let blanks = load(&folder.join("assimp/space_in_material_name.obj"));
    assert!(
        blanks
            .scene
            .materials
            .iter()
            .any(|m| m.name == "Hard Shiny Plastic White"),
        "{:?}",
        blanks.scene.materials
    );
}

/// Protects: in Embree's Cornell box every material keeps its colour, whichever face uses it first.
#[test]
fn materials_go_with_their_faces() {
    let Some(path) = assets("obj/tinyobj/cornell_box.obj") else {
        return;
    };
    let file = load(&path);
    for (name, colour) in [
        ("red", [1.0, 0.0, 0.0]),
        ("green", [0.0, 1.0, 0.0]),
        ("white", [1.0; 3]),
    ] {
        assert_eq!(
            physical(&file, name).base_colour,
            ColourInput::Constant(Colour(colour)),
            "{name}"
        );
    }
}

/// Protects: vertex colours are decoded from sRGB, and multiply the base colour.
#[test]
fn vertex_colours() {
    let (_folder, path) = write("v 0 0 0 1 0.5 0\nv 1 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
    let file = load(&path);
    let data = mesh_of(&file, &file.scene.objects[0]);
    assert!(
        (data.colours[0][1] - 0.214_041_14).abs() < 1e-6,
        "{:?}",
        data.colours
    );
    assert_eq!(
        data.colours[1], [1.0; 4],
        "a vertex without colour is white"
    );
    assert!(physical(&file, &file.scene.objects[0].material).vertex_colours);
}

/// Protects: any colour above 1 means that all colours of the file range to 255, dark ones
/// included; a vertex without a colour is white in any case. sRGB codes 128 and 1 are 0.215861 and
/// 0.000303527.
#[test]
fn vertex_colours_in_bytes() {
    let (_folder, path) = write("v 0 0 0 255 128 1\nv 1 0 0 0 0 0\nv 0 1 0\nf 1 2 3\n");
    let file = load(&path);
    let colours = &mesh_of(&file, &file.scene.objects[0]).colours;
    for (found, expected) in colours[0]
        .iter()
        .zip([1.0, 0.215_860_5, 0.000_303_527, 1.0])
    {
        assert!((found - expected).abs() < 1e-6, "{colours:?}");
    }
    assert_eq!(colours[1..], [[0.0, 0.0, 0.0, 1.0], [1.0; 4]]);
}

/// Protects: given normals of a face are kept in a smoothing group, and the group's faces without
/// normals are smoothed among themselves. Both faces here touch the x axis, one in the plane of z,
/// one in the plane of y, and the given normals point along x.
#[test]
fn given_normals_stay_out_of_smoothing() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 1 0 0\n";
    let (_folder, path) = write(&format!("{vertices}s 1\nf 1//1 2//1 3//1\nf 1 4 2\n"));
    let file = load(&path);
    let data: Vec<&MeshData> = file
        .scene
        .objects
        .iter()
        .map(|object| mesh_of(&file, object))
        .collect();
    let normals_of = |triangle: [[f32; 3]; 3]| {
        let found = data.iter().flat_map(|data| {
            let corners = |t: &[u32; 3]| t.map(|i| data.positions.offsets()[i as usize]);
            data.indices
                .iter()
                .filter(move |&t| corners(t) == triangle)
                .map(|t| t.map(|i| data.normals[i as usize]))
        });
        found.collect::<Vec<_>>()
    };
    let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(normals_of([o, x, y]), [[x; 3]]);
    assert_eq!(
        normals_of([o, z, x]),
        [[y; 3]],
        "nothing of the other face is in it"
    );
}

/// Protects: an invalid file is refused with the line of its fault.
#[test]
fn errors_name_line_and_cause() {
    for (text, words) in [
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
            "line 4: f: `0`: index 0 is not allowed: indices start at 1",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 99999\n",
            "line 5: f: `99999`: refers to vertex 99999, but the file has 3",
        ),
        ("v 0 0 0\nf -2 1 1\n", "vertex -2, but the file has 1"),
        (
            "v 0 0 0\nf -9223372036854775808 1 1\n",
            "but the file has 1",
        ),
        ("v 0 0 0\nf 99999999999999999999 1 1\n", "no whole number"),
        ("v 0 zero 0\n", "line 1: v: `zero` is no number"),
        (
            "v 0 0 0\nv 1,0 0 0\n",
            "line 2: v: `1,0` is no number; export the file again with decimal points",
        ),
        (
            "vt 0,5 0,5\n",
            "line 1: vt: `0,5` is no number; export the file again with decimal points",
        ),
        ("v 0 0\n", "line 1: v: has 2 numbers"),
        ("vn 1 2\n", "vn: has 2 numbers"),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", "more than three indices"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1/1 2/1 0/1\n",
            "line 6: f: `0/1`: index 0 is not allowed: indices start at 1",
        ),
    ] {
        let (_folder, path) = write(text);
        let error = try_load(&path).expect_err(text).to_string();
        assert!(
            error.contains(words) && error.contains("test.obj"),
            "{text:?}: {error}"
        );
    }
}

/// Protects: references to missing texture coordinates and normals are a warning with the first
/// line, its corner and the number of faces; these faces lose them, are smoothed by their group,
/// and all others keep theirs.
#[test]
fn references_to_nothing_are_warnings() {
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (rest, words) in [
        (
            "vt 0 0\nf 1/1 2/2 3/1\n",
            "line 5: f: `2/2`: refers to texture coordinate 2, but the file has 1; 1 face refers to texture coordinates",
        ),
        (
            "vt 0 0\nf 1/1 2/1 3/1\nf 1/-2 2/1 3/1\nf 1/9 2 3/1\n",
            "line 6: f: `1/-2`: refers to texture coordinate -2, but the file has 1; 2 faces refer",
        ),
        (
            "f 1/1 2/2 3/3\n",
            "line 4: f: `1/1`: refers to texture coordinate 1, but the file has 0",
        ),
        (
            "vn 0 0 1\nf 1//7 2//1 3//8\n",
            "line 5: f: `1//7`: refers to normal 7, but the file has 1; 1 face refers to normals that the file does not have",
        ),
        (
            "f 1//99999999999 2//1 3//1\n",
            "line 4: f: `1//99999999999`: refers to normal 99999999999, but the file has 0",
        ),
        (
            "vn 0 0 1\nf 1//0 2//1 3//1\nf 1//0 2//0 3//0\n",
            "line 5: f: `1//0`: refers to normal 0, but the file has 1; 2 faces refer to normals",
        ),
        (
            "vt 0 0\nf 1/0 2/1 3/1\n",
            "line 5: f: `1/0`: refers to texture coordinate 0, but the file has 1; 1 face refers to texture coordinates",
        ),
    ] {
        let (_folder, path) = write(&format!("{corners}{rest}"));
        let file = load(&path);
        check_sound(&file, &path);
        let [warning] = file.warnings.as_slice() else {
            panic!("{rest}: {:?}", file.warnings)
        };
        assert!(warning.message.contains(words), "{rest}: {warning}");
    }
    let (_folder, path) = write(&format!(
        "{corners}vt 0.5 0.25\nvn 0 1 0\nf 1/1/1 2/1/1 3/1/1\ns 1\nf 1/2/3 2/1/1 3/1/1\nf 1/1/1 2/1/2 3/1/1\n"
    ));
    let file = load(&path);
    let [warning] = file.warnings.as_slice() else {
        panic!("{:?}", file.warnings)
    };
    assert!(
        warning.message.contains("to texture coordinates")
            && warning.message.contains("to normals"),
        "{warning}"
    );
    let all: Vec<_> = file
        .scene
        .objects
        .iter()
        .map(|object| mesh_of(&file, object))
        .collect();
    let corners = all.iter().flat_map(|mesh| {
        mesh.indices
            .as_flattened()
            .iter()
            .map(|&i| (mesh.normals[i as usize], mesh.uvs[0][i as usize]))
    });
    let count = |normal, uv| {
        corners
            .clone()
            .filter(|&corner| corner == (normal, uv))
            .count()
    };
    let (own, made, mapped) = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.75]);
    assert_eq!(
        [
            count(own, mapped),
            count(made, [0.0; 2]),
            count(made, mapped)
        ],
        [3; 3]
    );
}

/// Protects: carriage returns, line feeds and pairs end lines of models and libraries, each file in
/// its own style or a mixture: all faces exist, the material is found, and no warning appears.
#[test]
fn line_ends_of_each_kind() {
    let model = "# a model\nmtllib red.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    let library = "# a library\nnewmtl red\nKd 0.5 0 0\n";
    let mixed = |text: &str| text.replacen('\n', "\r", 3).replacen('\n', "\r\n", 1);
    let alone = |text: &str| text.replace('\n', "\r");
    let pairs = |text: &str| text.replace('\n', "\r\n");
    let texts = |text: &str| [text.to_owned(), alone(text), pairs(text), mixed(text)];
    for model in texts(model) {
        for library in texts(library) {
            let (folder, path) = write(&model);
            std::fs::write(folder.path().join("red.mtl"), &library).expect("a library");
            let file = load(&path);
            check_sound(&file, &path);
            assert_eq!(
                (triangle_count(&file), file.warnings.len()),
                (1, 0),
                "{model:?}, {library:?}: {:?}",
                file.warnings
            );
            assert_eq!(
                physical(&file, "red").base_colour,
                ColourInput::Constant(Colour([0.5, 0.0, 0.0])),
                "{library:?}"
            );
        }
    }
}

/// Protects: a broken, unsupported or invalid image is treated as a missing one: a warning, and the
/// material's numbers without the image, from the library or by default.
#[test]
fn broken_images_are_as_missing_ones() {
    let statements = "map_Kd x.png\nmap_Ke x.png\nmap_Pr x.png\nmap_Pm x.png\nmap_d x.png\nnorm x.png\nNs 30\nKs 0.5 0.5 0.5\n";
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_fn(9, 9, |x, y| {
        image::Rgba([x as u8 * 17, y as u8 * 29, (x * y) as u8, 255])
    })
    .write_to(&mut png, image::ImageFormat::Png)
    .unwrap();
    let png = png.into_inner();
    let value_of = |picture: Option<&[u8]>| {
        let (folder, path) = write("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
        std::fs::write(
            folder.path().join("m.mtl"),
            format!("newmtl m\n{statements}"),
        )
        .unwrap();
        picture
            .into_iter()
            .for_each(|bytes| std::fs::write(folder.path().join("x.png"), bytes).unwrap());
        let file = load(&path);
        check_sound(&file, &path);
        assert_eq!(file.warnings.len(), 1, "{:?}", file.warnings);
        assert!(
            file.warnings[0].message.contains("x.png")
                && file.warnings[0].message.contains("the texture is left out"),
            "{:?}",
            file.warnings
        );
        assert!(file.scene.images.is_empty() && file.scene.textures.is_empty());
        physical(&file, "m").clone()
    };
    let missing = value_of(None);
    assert_eq!(
        (&missing.emission, missing.base_colour_texture.is_none()),
        (&Colour::BLACK.into(), true)
    );
    for broken in [
        &png[..20],
        &png[..png.len() / 2],
        b"GIF89a",
        b"text",
        b"",
        b"\xabKTX 20\xbb\r\n\x1a\n",
    ] {
        assert_eq!(value_of(Some(broken)), missing, "{broken:?}");
    }
}

/// Protects: UTF-16 texts, with a byte order mark or without, and binary files are refused with
/// their kind.
#[test]
fn foreign_texts_are_named() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let units = || text.encode_utf16();
    let files: [(Vec<u8>, &str); 5] = [
        (
            [0xfeff]
                .into_iter()
                .chain(units())
                .flat_map(u16::to_le_bytes)
                .collect(),
            "UTF-16",
        ),
        (
            [0xfeff]
                .into_iter()
                .chain(units())
                .flat_map(u16::to_be_bytes)
                .collect(),
            "UTF-16",
        ),
        (units().flat_map(u16::to_le_bytes).collect(), "UTF-16"),
        (units().flat_map(u16::to_be_bytes).collect(), "UTF-16"),
        (
            [&b"Kaydara FBX Binary  \0\x1a\0"[..], text.as_bytes()].concat(),
            "binary",
        ),
    ];
    for (bytes, word) in files {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("test.obj");
        std::fs::write(&path, bytes).unwrap();
        let error = try_load(&path).expect_err(word).to_string();
        assert!(
            error.contains(word) && error.contains("test.obj") && error.lines().count() == 1,
            "{error}"
        );
    }
}

/// Protects: images of roughness, metalness and coverage multiply their numbers, in the channel of
/// `-imfchan`, which colours and normals ignore; `norm` perturbs normals by `-bm`, and unsupported keys are left out by name, unless their number disables them.
#[test]
fn images_of_the_pbr_keys() {
    let (folder, path) =
        write("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n");
    let lines = "Pr 0.5\nmap_Pr a.png\nmap_Pm b.png\nnorm -bm 0.25 -imfchan m c.png\nmap_Kd -imfchan g c.png\nmap_d -imfchan b a.png\nd 0.75\nPs 0\nPc 0.5\nPcr 0.1\nmap_Bump c.png\n";
    std::fs::write(
        folder.path().join("m.mtl"),
        format!("newmtl m\nKd 1 0 0\n{lines}"),
    )
    .unwrap();
    for name in ["a.png", "b.png", "c.png"] {
        image::RgbaImage::from_raw(1, 1, vec![128; 4])
            .expect("a pixel")
            .save(folder.path().join(name))
            .unwrap();
    }
    let file = load(&path);
    let material = physical(&file, "m");
    let image = |input: &NumberInput| match input {
        NumberInput::Texture(input) => {
            let texture = &input.texture;
            let image = file
                .scene
                .textures
                .iter()
                .find(|t| t.name == texture.name)
                .expect("a texture");
            assert_eq!(image.colour_space, ColourSpace::Linear);
            (image.image.as_str(), texture.factor.0[0], texture.channel)
        }
        other => panic!("{other:?}"),
    };
    let [red, blue] = [Channel::Red, Channel::Blue].map(Some);
    assert_eq!(image(&material.roughness), ("a.png", 0.5, red));
    assert_eq!(image(&material.metallic), ("b.png", 1.0, red));
    assert_eq!(
        (image(&material.opacity), material.alpha),
        (("a.png", 0.75, blue), AlphaMode::Blend)
    );
    for texture in [&material.base_colour_texture, &material.normal_texture] {
        assert_eq!(texture.as_ref().map(|of| of.channel), Some(None));
    }
    assert_eq!(material.normal_scale, 0.25);
    let left_out: Vec<&str> = file
        .scene
        .unread
        .iter()
        .map(|part| part.label.as_str())
        .collect();
    assert_eq!(left_out, ["MTL map_bump"]);
    let coat = material.clearcoat.as_ref().expect("a coat");
    assert_eq!(
        (&coat.factor, &coat.roughness, material.sheen.is_none()),
        (&0.5.into(), &0.1.into(), true)
    );
}

/// Protects: `d` is opacity, `Tr` transparency, `d` takes precedence, and `Tr 1` alone, which old
/// exporters wrote for opaque, is taken as opaque with a warning.
#[test]
fn opacity_is_told_both_ways() {
    for (lines, opacity, words) in [
        ("d 0.25", 0.25, ""),
        ("Tr 0.75", 0.25, ""),
        ("Tr 0.75\nd 0.5", 0.5, ""),
        ("Tr 0", 1.0, ""),
        ("Tr 1", 1.0, "`Tr 1` without `d`"),
    ] {
        let (folder, path) = write("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
        std::fs::write(
            folder.path().join("m.mtl"),
            format!("newmtl m\nKd 1 0 0\n{lines}\n"),
        )
        .unwrap();
        let file = load(&path);
        assert_eq!(physical(&file, "m").opacity, opacity.into(), "{lines}");
        assert_eq!(
            format!("{:?}", file.warnings).contains("`Tr 1` without `d`"),
            !words.is_empty(),
            "{lines}: {:?}",
            file.warnings
        );
    }
}

/// Protects: a missing texture, a missing library and a reference outside the folder are warnings;
/// no outside file is read.
#[test]
fn missing_things_are_warnings() {
    let (folder, path) =
        write("mtllib ../x.mtl\nmtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
    std::fs::write(
        folder.path().join("m.mtl"),
        "newmtl m\nKd 1 0 0\nKd 0.5 0,5 0,5\nmap_Kd /etc/passwd\nmap_Ke gone.png\nmap_Pr C:\\x.png\n",
    )
    .unwrap();
    let file = load(&path);
    let material = physical(&file, "m");
    assert!(material.base_colour_texture.is_none() && material.emission_texture.is_none());
    assert_eq!(material.emission, Colour::BLACK.into());
    assert_eq!(
        material.base_colour,
        ColourInput::Constant(Colour([1.0, 0.0, 0.0]))
    );
    let text = format!("{:?}", file.warnings);
    for words in [
        "../x.mtl",
        "/etc/passwd",
        "gone.png",
        "`C:/x.png` lies outside",
        "line 3: `Kd 0.5 0,5 0,5`",
    ] {
        assert!(text.contains(words), "nothing about {words} in {text}");
    }
}

/// Protects: malformed files have the results that the collection prescribes.
#[test]
fn malformed_files_get_their_verdict() {
    let Some(folder) = assets("malformed/obj") else {
        return;
    };
    assert!(try_load(&folder.join("index_out_of_range.obj")).is_err());
    assert!(try_load(&folder.join("index_zero.obj")).is_err());
    for file in ["huge_coordinates.obj", "mtl_missing_texture.obj"] {
        let path = folder.join(file);
        let loaded = load(&path);
        check_sound(&loaded, &path);
        assert!(!loaded.warnings.is_empty(), "{file}");
    }
}

/// Protects: if only the later faces of a material have texture coordinates, these stay with their
/// own corners, v counted from the top, and earlier corners have (0, 0).
#[test]
fn coordinates_stay_with_their_corners() {
    let (_folder, path) =
        write("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.125\nvt 1 0\nvt 0 1\nf 1 2 3\nf 1/1 2/2 3/3\n");
    let loaded = load(&path);
    let mut found = Vec::new();
    for object in &loaded.scene.objects {
        let data = mesh_of(&loaded, object);
        let uv = |corner: u32| {
            data.uvs
                .first()
                .map_or([0.0; 2], |set| set[corner as usize])
        };
        found.extend(data.indices.iter().map(|face| face.map(uv)));
    }
    assert_eq!(
        found,
        [[[0.0; 2]; 3], [[0.25, 0.875], [1.0, 1.0], [0.0, 0.0]]]
    );
}

/// A triangle with texture coordinates in the material `name`, its library at `library`, and the
/// library's content.
fn with_library(
    name: &str,
    library: &str,
    content: &str,
) -> (tempfile::TempDir, std::path::PathBuf) {
    let (folder, path) = write(&format!(
        "mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl {name}\nf 1/1 2/1 3/1\n"
    ));
    let library = folder
        .path()
        .join(library.split(" # ").next().expect("a name"));
    std::fs::create_dir_all(library.parent().expect("a folder")).unwrap();
    std::fs::write(library, content).unwrap();
    (folder, path)
}

/// Writes an image of a single texel.
fn write_texel(path: &std::path::Path, code: u8) {
    std::fs::create_dir_all(path.parent().expect("a folder")).unwrap();
    let texel = image::RgbaImage::from_raw(1, 1, vec![code; 4]).expect("a texel");
    texel.save(path).unwrap();
}

/// Protects: `#` is part of the names of materials, libraries and images. A comment behind a name
/// is left out where no such name exists with it.
#[test]
fn names_keep_their_hashes() {
    for (name, library, words) in [
        ("Material #25", "m.mtl", ""),
        ("Material #25  \t", "m #1.mtl", ""),
        ("Material #25 # the red one", "m.mtl # all of them", ""),
        ("red", "m.mtl", ""),
        ("red # a note", "m.mtl", ""),
        (
            "Material #27",
            "m.mtl",
            "material `Material #27` is in no material library",
        ),
    ] {
        let red = "Kd 1 0 0\nmap_Kd a #1.png\nmap_d b.png # a mask\n";
        let (folder, path) = with_library(
            name,
            library,
            &format!(
                "newmtl red # a note\n{red}newmtl Material #25\n{red}newmtl Material #26\nKd 0 1 0\n"
            ),
        );
        for image in ["a #1.png", "b.png"] {
            write_texel(&folder.path().join(image), 255);
        }
        let file = load(&path);
        check_sound(&file, &path);
        let text = format!("{:?}", file.warnings);
        assert_eq!(
            file.warnings.len(),
            usize::from(!words.is_empty()),
            "{name}: {text}"
        );
        assert!(text.contains(words), "{name}: {text}");
        if words.is_empty() {
            let material = physical(&file, name.trim());
            assert_eq!(
                material.base_colour,
                ColourInput::Constant(Colour([1.0, 0.0, 0.0])),
                "{name}"
            );
            let images: Vec<&str> = file.scene.images.iter().map(|image| &*image.name).collect();
            assert_eq!(images, ["a #1.png", "b.png"], "{name}");
        }
    }
}

/// Protects: a texture is found beside its library, below it, in the folder of the OBJ file by `..`
/// or by its path alone, and nowhere outside. The one beside the library has precedence.
#[test]
fn images_are_beside_their_library() {
    for (statement, image, found) in [
        ("red.png", "parts/red.png", Some("parts/red.png")),
        (
            "maps\\red.png",
            "parts/maps/red.png",
            Some("parts/maps/red.png"),
        ),
        ("../red.png", "red.png", Some("parts/../red.png")),
        ("red.png", "red.png", Some("red.png")),
        (
            "-s 2 2 1 red.png # x",
            "parts/red.png",
            Some("parts/red.png"),
        ),
        ("../../red.png", "red.png", None),
        ("/red.png", "red.png", None),
    ] {
        let (folder, path) = with_library(
            "m",
            "parts/m.mtl",
            &format!("newmtl m\nmap_Kd {statement}\nmap_Ke {statement}\n"),
        );
        write_texel(&folder.path().join(image), 255);
        let file = load(&path);
        check_sound(&file, &path);
        let images: Vec<&str> = file.scene.images.iter().map(|image| &*image.path).collect();
        assert_eq!(
            images,
            found.into_iter().collect::<Vec<_>>(),
            "{statement}: {:?}",
            file.warnings
        );
        assert_eq!(
            file.warnings.len(),
            usize::from(found.is_none()),
            "{:?}",
            file.warnings
        );
    }
    let (folder, path) = write(
        "mtllib a/m.mtl\nmtllib b/m.mtl\nmtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a/\nf 1/1 2/1 3/1\nusemtl b/\nf 1/1 2/1 3/1\nusemtl \nf 1/1 2/1 3/1\nusemtl c\nf 1/1 2/1 3/1\n",
    );
    for (place, code) in [("a/", 1), ("b/", 2), ("", 3)] {
        write_texel(&folder.path().join(place).join("x.png"), code);
        let text = format!("newmtl {place}\nmap_Kd x.png\nnewmtl c\nmap_Kd a/x.png\n");
        std::fs::write(folder.path().join(place).join("m.mtl"), text).unwrap();
    }
    let file = load(&path);
    check_sound(&file, &path);
    let mut images: Vec<&str> = file.scene.images.iter().map(|image| &*image.path).collect();
    images.sort_unstable();
    assert_eq!(images, ["a/x.png", "b/x.png"], "{:?}", file.warnings);
}

/// Protects: a vertex colour a little above 1 is a fraction, clamped with a warning, and darkens no
/// other; whole numbers far above 1 are codes. sRGB .3 is 0.0732.
#[test]
fn colours_a_little_above_one_are_fractions() {
    for (odd, expected, warned) in [
        ("1.000001 0.3 0.2", 0.073_239, true),
        ("2.0 0.3 0.2", 0.073_239, true),
        ("1e9 0.3 0.2", 0.073_239, true),
        ("300 0.3 0.2", 0.073_239, true),
        ("1 0.3 0.2", 0.073_239, false),
        ("inf 0.3 nan", 0.073_239, true),
    ] {
        let (_folder, path) = write(&format!(
            "v 0 0 0 {odd}\nv 1 0 0 0.9 0.3 0.2\nv 0 1 0 0.9 0.3 0.2\nf 1 2 3\n"
        ));
        let file = load(&path);
        let colours = &mesh_of(&file, &file.scene.objects[0]).colours;
        assert!(
            colours[0][0] == 1.0 && colours.iter().all(|c| (c[1] - expected).abs() < 1e-5),
            "{odd}: {colours:?}"
        );
        let text = format!("{:?}", file.warnings);
        assert_eq!(
            text.contains("channels above 1 are clamped"),
            warned,
            "{text}"
        );
    }
    for (line, red) in [
        ("255 0 0", 1.0),
        ("300 0 0", 1.0),
        ("64 1 0", 0.051_269),
        ("127.5 64 254.5", 0.214_041),
    ] {
        let (_folder, path) = write(&format!("v 0 0 0 {line}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
        let file = load(&path);
        let colours = &mesh_of(&file, &file.scene.objects[0]).colours;
        assert!((colours[0][0] - red).abs() < 1e-5, "{line}: {colours:?}");
        assert_eq!(
            file.warnings.len(),
            usize::from(line.starts_with("300")),
            "{:?}",
            file.warnings
        );
    }
}

/// Protects: `illum` 4, 6, 7 and 9 with a diffuse colour are opaque, unless `d`, `Tr` or a `Tf` that
/// is neither 0 nor 1 states transparency. A note counts the materials taken for glass.
#[test]
fn refraction_is_stated() {
    let illums = [4, 6, 7, 9];
    for (lines, glass) in [
        ("Kd 0.8 0.1 0.1\nTf 1 1 1\nNi 1", [false; 4]),
        (
            "Kd 0.8 0.1 0.1\nTf 1 1 1\nd 1\nKs 0.1 0.1 0.1\nNs 18",
            [false; 4],
        ),
        ("Kd 0.8 0.1 0.1\nTf 0 0 0\nTr 0", [false; 4]),
        ("Kd 1 0 0\nTf 1 1 1", [false; 4]),
        ("map_Kd gone.png\nTf 1 1 1", [false; 4]),
        ("Kd 0.8 0.1 0.1\nTf 0.9 1 1", [true; 4]),
        ("Kd 0.8 0.1 0.1\nTf 0.5", [true; 4]),
        ("Kd 0.8 0.1 0.1\nd 0.5", [true; 4]),
        ("Kd 0.8 0.1 0.1\nTr 0.5\nTf 0 0 0", [true; 4]),
        ("Kd 0.01 0.01 0.01\nTf 1 1 1\nd 1\nTr 0", [true; 4]),
        ("Kd 0 0 0\nNi 1.5", [false, true, true, false]),
        ("Ni 1.5", [false, true, true, false]),
    ] {
        let faces = illums
            .map(|illum| format!("usemtl m{illum}\nf 1 2 3\n"))
            .concat();
        let (folder, path) = write(&format!("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}"));
        let library = illums.map(|illum| format!("newmtl m{illum}\nillum {illum}\n{lines}\n"));
        std::fs::write(folder.path().join("m.mtl"), library.concat()).unwrap();
        let file = load(&path);
        for (illum, glass) in illums.into_iter().zip(glass) {
            let material = physical(&file, &format!("m{illum}"));
            assert_eq!(
                material.transmission == 1.0.into(),
                glass,
                "illum {illum}\n{lines}"
            );
            let colour = |rgb: [f32; 3]| ColourInput::Constant(Colour(rgb.map(f64::from)));
            if lines.contains("Tf 0 0 0") {
                let expected = if glass { [1.0; 3] } else { [0.8, 0.1, 0.1] };
                assert_eq!(
                    material.base_colour,
                    colour(expected),
                    "illum {illum}\n{lines}"
                );
            }
        }
        let count = glass.iter().filter(|glass| **glass).count();
        let text = format!("{:?}", file.warnings);
        let words = format!("{count} materials taken for glass");
        assert_eq!(text.contains(&words), count > 0, "{lines}: {text}");
    }
}

/// Protects: numbers that old C libraries write for NaN are read as `nan` is: a vertex loses its
/// triangles, a normal is made anew, and unused vertices do nothing.
#[test]
fn numbers_of_old_libraries_are_nan() {
    for nan in ["nan", "-1.#IND00", "1.#QNAN0", "1.#INF", "-1.#J"] {
        let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        for (rest, triangles) in [
            (format!("vn {nan} {nan} {nan} # x\nf 1//1 2//1 3//1"), 1),
            (format!("v {nan} 0 0\nf 1 2 3"), 1),
            (format!("v {nan} 0 0 # x\nf 1 2 3\nf 1 2 4"), 1),
        ] {
            let (_folder, path) = write(&format!("{corners}{rest}\n"));
            let file = load(&path);
            check_sound(&file, &path);
            assert_eq!(triangle_count(&file), triangles, "{rest}");
            let data = mesh_of(&file, &file.scene.objects[0]);
            assert!(
                data.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]),
                "{rest}: {:?}",
                data.normals
            );
            let dropped = format!("{:?}", file.warnings).contains("1 triangle with vertices");
            assert_eq!(dropped, rest.contains("f 1 2 4"), "{:?}", file.warnings);
        }
    }
}
