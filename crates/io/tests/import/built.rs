//! Models generated here, for each part that the importers read and in each container: tests that
//! work in a clone without the shared files.

use std::path::{Path, PathBuf};

use glam::DVec3;
use raywright_core::scene::{
    AlphaMode, Colour, Falloff, LightKind, MaterialModel, Physical, PixelData, Pose, Projection,
    SideRule,
};
use raywright_io::{ErrorKind, LoadedScene};

use crate::shared::{check_sound, load, mesh_of, try_load, world_triangles};

/// Red, and a half transparent blue.
const PIXELS: [[u8; 4]; 2] = [[255, 0, 0, 255], [0, 0, 255, 128]];

fn picture(folder: &Path) {
    let pixels = PIXELS.concat();
    image::RgbaImage::from_raw(2, 1, pixels)
        .expect("two pixels")
        .save(folder.join("two.png"))
        .expect("a picture");
}

/// Two triangles over the unit square, facing +z, with normals, texture coordinates and colours:
/// three vertices shared.
fn square() -> Vec<u8> {
    let corners = [[0.0_f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let positions = corners.iter().flat_map(|&[x, y]| [x, y, 0.0]);
    let normals = corners.iter().flat_map(|_| [0.0, 0.0, 1.0]);
    let uvs = corners.iter().flat_map(|&[x, y]| [x, 1.0 - y]);
    let colours = corners.iter().flat_map(|&[x, y]| [x, y, 0.5, 1.0]);
    let numbers = positions.chain(normals).chain(uvs).chain(colours);
    let indices = [0_u16, 1, 2, 1, 3, 2];
    numbers
        .flat_map(f32::to_le_bytes)
        .chain(indices.iter().flat_map(|i| i.to_le_bytes()))
        .collect()
}

/// The JSON around it: a root at (1, 2, 3) that doubles sizes; below it the square, rotated by a
/// quarter turn about y and again unrotated, a light and a camera.
fn json(buffer: &str, image: &str, more_views: &str, intensity: &str) -> String {
    let quarter = std::f64::consts::FRAC_1_SQRT_2;
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "extensionsUsed": ["KHR_lights_punctual"], "scene": 0, "scenes": [{{ "nodes": [0] }}],
        "extensions": {{ "KHR_lights_punctual": {{ "lights": [{{ "type": "spot", "color": [1, 0.5, 0.25], "intensity": {intensity},
            "range": 9, "spot": {{ "innerConeAngle": 0, "outerConeAngle": 0.5 }} }}] }} }},
        "nodes": [{{ "children": [1, 2, 3, 4], "translation": [1, 2, 3], "scale": [2, 2, 2] }},
            {{ "mesh": 0, "rotation": [0, {quarter}, 0, {quarter}] }}, {{ "mesh": 0 }},
            {{ "translation": [0, 1, 0], "extensions": {{ "KHR_lights_punctual": {{ "light": 0 }} }} }},
            {{ "translation": [0, 0, 5], "camera": 0 }}],
        "cameras": [{{ "type": "perspective", "perspective": {{ "yfov": 0.7853981633974483, "znear": 0.1 }} }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3 }}, "indices": 4,
            "material": 0 }}] }}],
        "materials": [{{ "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [0, 0.5, 0],
            "pbrMetallicRoughness": {{ "baseColorFactor": [0.5, 0.25, 1, 0.75], "metallicFactor": 0.25, "roughnessFactor": 0.5,
                "baseColorTexture": {{ "index": 0 }} }} }}],
        "textures": [{{ "source": 0 }}], "images": [{image}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }},
            {{ "bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC3" }},
            {{ "bufferView": 0, "byteOffset": 96, "componentType": 5126, "count": 4, "type": "VEC2" }},
            {{ "bufferView": 0, "byteOffset": 128, "componentType": 5126, "count": 4, "type": "VEC4" }},
            {{ "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 192 }}, {{ "buffer": 0, "byteOffset": 192, "byteLength": 12 }}{more_views}],
        "buffers": [{buffer}] }}"#
    )
}

/// Writes buffer and picture to files of their own.
fn gltf(folder: &Path, intensity: &str) -> PathBuf {
    picture(folder);
    std::fs::write(folder.join("square.bin"), square()).expect("a file");
    let text = json(
        r#"{ "uri": "square.bin", "byteLength": 204 }"#,
        r#"{ "uri": "two.png" }"#,
        "",
        intensity,
    );
    let path = folder.join("square.gltf");
    std::fs::write(&path, text).expect("a file");
    path
}

/// Writes everything to a single file.
fn glb(folder: &Path) -> PathBuf {
    picture(folder);
    let image = std::fs::read(folder.join("two.png")).expect("just written");
    let view = format!(
        r#", {{ "buffer": 0, "byteOffset": 204, "byteLength": {} }}"#,
        image.len()
    );
    let mut binary = [square(), image].concat();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let buffer = format!(r#"{{ "byteLength": {} }}"#, binary.len());
    let mut text = json(
        &buffer,
        r#"{ "bufferView": 2, "mimeType": "image/png" }"#,
        &view,
        "100",
    )
    .into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunk = |kind: &[u8; 4], bytes: &[u8]| {
        [&(bytes.len() as u32).to_le_bytes()[..], kind, bytes].concat()
    };
    let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &binary)].concat();
    let length = 12 + chunks.len() as u32;
    let path = folder.join("square.glb");
    let whole = [
        &b"glTF"[..],
        &2_u32.to_le_bytes(),
        &length.to_le_bytes(),
        &chunks,
    ]
    .concat();
    std::fs::write(&path, whole).expect("a file");
    path
}

/// Writes the square again, with negative indices, a library and a picture beside it, and a
/// triangle without either.
fn obj(folder: &Path) -> PathBuf {
    picture(folder);
    let library = "newmtl painted\nKd 0.5 0.25 1\nKe 0 0.5 0\nd 0.75\nmap_Kd -s 2 1 1 two.png\n";
    std::fs::write(folder.join("square.mtl"), library).expect("a file");
    let text = "mtllib square.mtl\no square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n\
        usemtl painted\nf -4/-4/-1 -3/-3/-1 -2/-2/-1 -1/-1/-1\no bare\nv 0 0 5\nusemtl\nf 1 2 5\n";
    let path = folder.join("square.obj");
    std::fs::write(&path, text).expect("a file");
    path
}

/// Writes a model of each container to a folder.
pub fn models(folder: &Path) -> [PathBuf; 3] {
    [gltf(folder, "100"), glb(folder), obj(folder)]
}

fn physical(loaded: &LoadedScene, object: usize) -> &Physical {
    let name = &loaded.scene.objects[object].material;
    match loaded
        .scene
        .materials
        .iter()
        .find(|material| &material.name == name)
        .map(|material| &material.model)
    {
        Some(MaterialModel::Physical(physical)) => physical,
        other => panic!("{name}: {other:?}"),
    }
}

fn near(a: DVec3, b: DVec3) -> bool {
    a.distance(b) < 1e-6
}

/// Protects: arrays, hierarchy, material, texture, light and camera of a glTF file, inside a
/// container and beside it.
#[test]
fn a_gltf_model_in_both_containers() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for path in [gltf(folder.path(), "100"), glb(folder.path())] {
        let loaded = load(&path);
        check_sound(&loaded, &path);
        assert_eq!(
            (
                loaded.scene.objects.len(),
                loaded.scene.meshes.len(),
                loaded.scene.lights.len()
            ),
            (2, 1, 1)
        );
        // A quarter turn about y takes x to −z; then the root doubles and translates.
        let (corners, normals) = world_triangles(&loaded, &loaded.scene.objects[0]);
        let expected = [
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(1.0, 2.0, 1.0),
            DVec3::new(1.0, 4.0, 3.0),
        ];
        assert!(
            corners[0].iter().zip(expected).all(|(&a, b)| near(a, b))
                && near(normals[0][0], DVec3::X),
            "{corners:?}"
        );
        let (corners, _) = world_triangles(&loaded, &loaded.scene.objects[1]);
        assert!(
            corners.len() == 2 && near(corners[1][1], DVec3::new(3.0, 4.0, 3.0)),
            "{corners:?}"
        );
        let data = mesh_of(&loaded, &loaded.scene.objects[0]);
        assert_eq!(
            (data.indices.as_slice(), data.uvs[0][3], data.colours[1]),
            (
                &[[0, 1, 2], [1, 3, 2]][..],
                [1.0, 0.0],
                [1.0, 0.0, 0.5, 1.0]
            )
        );
        let paint = physical(&loaded, 0);
        assert_eq!(
            (&paint.base_colour, paint.opacity.clone()),
            (&Colour([0.5, 0.25, 1.0]).into(), 0.75.into())
        );
        assert_eq!(
            (paint.metallic.clone(), paint.roughness.clone()),
            (0.25.into(), 0.5.into())
        );
        assert_eq!(
            (paint.alpha, paint.emission.clone()),
            (
                AlphaMode::Mask { cutoff: 0.25 },
                Colour([0.0, 0.5, 0.0]).into()
            )
        );
        assert!(paint.vertex_colours && paint.base_colour_texture.is_some());
        assert_eq!(loaded.scene.objects[0].side, SideRule::Both);
        let image = loaded.scene.images[0].data.as_ref().expect("it is there");
        assert_eq!(
            (image.width, image.height, &image.pixels),
            (2, 1, &PixelData::Codes(PIXELS.into()))
        );
        let lamp = &loaded.scene.lights[0];
        let LightKind::Spot {
            position,
            direction,
            falloff,
            ..
        } = lamp.kind
        else {
            panic!("{:?}", lamp.kind)
        };
        assert_eq!(
            (lamp.colour, falloff),
            (Colour([100.0, 50.0, 25.0]), Falloff::InverseSquare)
        );
        assert!(
            near(position.into(), DVec3::new(1.0, 4.0, 3.0))
                && near(direction.into(), DVec3::NEG_Z)
        );
        let camera = &loaded.scene.cameras[0];
        let (Pose::Axes { eye, .. }, Projection::Pinhole(pinhole)) =
            (&camera.pose, &camera.projection)
        else {
            panic!("{camera:?}")
        };
        assert!(near((*eye).into(), DVec3::new(1.0, 2.0, 13.0)));
        assert!(
            pinhole
                .vertical_fov
                .is_some_and(|fov| (fov - 45.0).abs() < 1e-4),
            "{pinhole:?}"
        );
    }
}

/// Protects: negative indices, groups, library and texture of an OBJ file.
#[test]
fn an_obj_model_with_its_library() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = obj(folder.path());
    let loaded = load(&path);
    check_sound(&loaded, &path);
    let by_triangles = |n: usize| {
        let found = loaded
            .scene
            .objects
            .iter()
            .position(|object| mesh_of(&loaded, object).indices.len() == n);
        found.unwrap_or_else(|| panic!("no object of {n} triangles"))
    };
    let (painted, bare) = (by_triangles(2), by_triangles(1));
    let (corners, normals) = world_triangles(&loaded, &loaded.scene.objects[painted]);
    let area: f64 = corners
        .iter()
        .map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).z)
        .sum();
    assert!(
        (area - 1.0).abs() < 1e-12 && normals.as_flattened().iter().all(|&n| near(n, DVec3::Z)),
        "{corners:?}"
    );
    let paint = physical(&loaded, painted);
    // An image replaces the colour of the library, and a picture's rows count from the top.
    assert!(
        paint.base_colour_texture.is_some() && paint.emission == Colour([0.0, 0.5, 0.0]).into(),
        "{paint:?}"
    );
    assert_eq!(
        loaded.scene.images[0]
            .data
            .as_ref()
            .map(|image| [image.width, image.height]),
        Some([2, 1])
    );
    assert!(physical(&loaded, bare).base_colour_texture.is_none());
    let (corners, _) = world_triangles(&loaded, &loaded.scene.objects[bare]);
    assert!(
        near(corners[0][2], DVec3::new(0.0, 0.0, 5.0)),
        "{corners:?}"
    );
}

/// Protects: light beyond 1e37, the limit of a scene, is clamped with one warning that names the
/// file, and does not refuse the model.
#[test]
fn light_beyond_measure_is_capped() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let loaded = load(&gltf(folder.path(), "3e38"));
    assert_eq!(
        loaded.scene.lights[0].colour,
        Colour([1e37, 0.5 * 1e37, 0.25 * 1e37])
    );
    let told: Vec<_> = loaded
        .warnings
        .iter()
        .map(|warning| &warning.message)
        .filter(|message| message.contains("lights[0]"))
        .collect();
    assert!(
        told.len() == 1 && told[0].contains("square.gltf: "),
        "{told:?}"
    );
}

/// Protects: a missing buffer is an error that names it, a missing picture a warning, in each
/// container's own folder.
#[test]
fn missing_files_are_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = gltf(folder.path(), "100");
    std::fs::remove_file(folder.path().join("two.png")).expect("it was there");
    let loaded = load(&path);
    assert!(
        loaded
            .warnings
            .iter()
            .any(|warning| warning.message.contains("two.png")),
        "{:?}",
        loaded.warnings
    );
    assert!(physical(&loaded, 0).base_colour_texture.is_none());
    std::fs::remove_file(folder.path().join("square.bin")).expect("it was there");
    let error = try_load(&path).expect_err("no arrays");
    assert!(
        error.kind() == ErrorKind::Input && error.to_string().contains("square.bin"),
        "{error}"
    );
}
