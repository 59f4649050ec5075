//! glTF files with known contents.

use glam::DVec3;
use raywright_core::scene::{
    Colour, ColourInput, ColourSpace, LightKind, MaterialModel, Physical, PixelData, Pose,
    Projection, SideRule, TextureFilter, WrapMode,
};
use raywright_io::LoadedScene;

use crate::shared::{assets, load, mesh_of, transform, triangle_count, world_triangles};

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

/// Largest distance between corresponding corners of two files, object by object.
fn farthest(a: &LoadedScene, b: &LoadedScene) -> f64 {
    assert_eq!(a.scene.objects.len(), b.scene.objects.len());
    let mut farthest = 0.0_f64;
    for (x, y) in a.scene.objects.iter().zip(&b.scene.objects) {
        let (x, y) = (world_triangles(a, x).0, world_triangles(b, y).0);
        assert_eq!(x.len(), y.len());
        for (p, q) in x.as_flattened().iter().zip(y.as_flattened()) {
            farthest = farthest.max(p.distance(*q));
        }
    }
    farthest
}

/// Protects: a real file from end to end: container, hierarchy, texture, camera.
#[test]
fn duck() {
    let Some(path) = assets("gltf/Duck/Duck.glb") else {
        return;
    };
    let duck = load(&path);
    assert_eq!(triangle_count(&duck), 4212);
    assert_eq!(
        (
            duck.scene.objects.len(),
            duck.scene.cameras.len(),
            duck.scene.lights.len()
        ),
        (1, 1, 0)
    );
    assert_eq!(duck.scene.objects[0].side, SideRule::Culled);
    let data = mesh_of(&duck, &duck.scene.objects[0]);
    assert_eq!(
        (data.positions.len(), data.normals.len(), data.uvs.len()),
        (2399, 2399, 1)
    );
    let image = duck.scene.images[0].data.as_ref().unwrap();
    assert_eq!((image.width, image.height), (512, 512));
    let texture = &duck.scene.textures[0];
    assert_eq!(
        (texture.colour_space, texture.filter, texture.wrap_u),
        (ColourSpace::Srgb, TextureFilter::Bilinear, WrapMode::Repeat)
    );
    let material = physical(&duck, &duck.scene.objects[0].material);
    assert_eq!(
        material
            .base_colour_texture
            .as_ref()
            .map(|t| t.name.as_str()),
        Some(texture.name.as_str())
    );
    assert_eq!(material.metallic, 0.0.into());
    // The root scales by 0.01; unscaled, the duck would be 166 units high.
    let height = world_triangles(&duck, &duck.scene.objects[0])
        .0
        .as_flattened()
        .iter()
        .map(|p| p.y)
        .fold(0.0, f64::max);
    assert!((1.5..1.7).contains(&height), "{height}");
}

/// Protects: buffers are found in files with a blank in their name; the lamp's radiance is factor
/// times strength.
#[test]
fn cornell() {
    let Some(path) = assets("gltf/crafted/cornell/cornell.gltf") else {
        return;
    };
    let room = load(&path);
    assert_eq!(room.scene.cameras.len(), 1);
    let lamps: Vec<_> = room
        .scene
        .materials
        .iter()
        .filter_map(|m| match &m.model {
            MaterialModel::Physical(p) => p
                .emission
                .constant()
                .filter(|emission| *emission != Colour::BLACK),
            _ => None,
        })
        .collect();
    let [Colour(lamp)] = lamps.as_slice() else {
        panic!("one lamp, not {lamps:?}")
    };
    assert!(
        lamp.iter()
            .zip([15.0, 12.0, 9.0])
            .all(|(a, b)| (a - b).abs() < 1e-5),
        "{lamp:?}"
    );
    let Projection::Pinhole(view) = &room.scene.cameras[0].projection else {
        panic!("a pinhole")
    };
    assert!(
        view.vertical_fov
            .is_some_and(|fov| fov > 10.0 && fov < 90.0)
    );
    assert_eq!(room.scene.cameras[0].aspect, None);
}

/// Protects: normalised and plain integers of 8 and 16 bits equal the floats of the twin file.
#[test]
fn quantized_equals_its_float_twin() {
    let Some(folder) = assets("gltf/crafted") else {
        return;
    };
    let (a, b) = (
        load(&folder.join("quantized.glb")),
        load(&folder.join("quantized_float_twin.glb")),
    );
    assert!(farthest(&a, &b) < 1e-6, "{}", farthest(&a, &b));
    for (x, y) in a.scene.objects.iter().zip(&b.scene.objects) {
        let (x, y) = (mesh_of(&a, x), mesh_of(&b, y));
        for (p, q) in x
            .normals
            .as_flattened()
            .iter()
            .zip(y.normals.as_flattened())
        {
            assert!((p - q).abs() < 1e-6, "normal {p} {q}");
        }
        for (p, q) in x
            .colours
            .as_flattened()
            .iter()
            .zip(y.colours.as_flattened())
        {
            assert!((p - q).abs() < 1e-6, "colour {p} {q}");
        }
    }
}

/// Protects: nested non-uniform scales, reflections and matrices give the twin's positions, and
/// normals on the same side of the same facets.
#[test]
fn nested_transforms_equal_their_baked_twin() {
    let Some(folder) = assets("gltf/crafted") else {
        return;
    };
    let (a, b) = (
        load(&folder.join("nested_transforms.glb")),
        load(&folder.join("nested_transforms_baked_twin.glb")),
    );
    assert_eq!(a.scene.objects.len(), b.scene.objects.len());
    let mut mirrored = 0;
    for (x, y) in a.scene.objects.iter().zip(&b.scene.objects) {
        let mirror = transform(x).0.determinant() < 0.0;
        mirrored += usize::from(mirror);
        let ((points, normals), (twin_points, twin_normals)) =
            (world_triangles(&a, x), world_triangles(&b, y));
        assert_eq!(points.len(), twin_points.len());
        for (i, (p, q)) in points.iter().zip(&twin_points).enumerate() {
            // A triangle of the twin may start at another corner.
            let closest = |p: &DVec3| q.iter().map(|q| p.distance(*q)).fold(f64::MAX, f64::min);
            assert!(
                p.iter().all(|p| closest(p) < 1e-5),
                "{}: {p:?} {q:?}",
                x.name
            );
            let (n, m) = (normals[i][0], twin_normals[i][0]);
            assert!(n.distance(m) < 1e-4, "{}: normal {n} {m}", x.name);
        }
    }
    assert!(mirrored > 0, "the file has mirrored nodes");
}

/// Protects: all index types, no indices, strips and fans give the same quad.
#[test]
fn index_types_make_the_same_quads() {
    let Some(path) = assets("gltf/crafted/index_types.glb") else {
        return;
    };
    let file = load(&path);
    let mut areas = Vec::new();
    for object in &file.scene.objects {
        let data = mesh_of(&file, object);
        let corner = |i: u32| data.positions.position(i as usize);
        let mut area = DVec3::ZERO;
        for [a, b, c] in &data.indices {
            area += (corner(*b) - corner(*a)).cross(corner(*c) - corner(*a)) / 2.0;
        }
        assert_eq!(data.indices.len(), 2, "{}", object.name);
        areas.push(area);
    }
    assert!(areas.len() >= 6, "{areas:?}");
    // Equal as vectors: same area, same orientation.
    assert!(
        areas.iter().all(|area| area.distance(areas[0]) < 1e-6),
        "{areas:?}"
    );
}

/// Protects: a flat sheet has five points raised by a sparse accessor.
#[test]
fn sparse_positions_raise_five_points() {
    let Some(folder) = assets("gltf/crafted") else {
        return;
    };
    for path in crate::shared::files_below(&folder)
        .iter()
        .filter(|p| p.to_string_lossy().contains("sparse_"))
    {
        let file = load(path);
        let raised: usize = file.scene.objects.iter().map(|o| raised(&file, o)).sum();
        assert_eq!(raised, 5, "{}", path.display());
    }
}

fn raised(file: &LoadedScene, object: &raywright_core::scene::Object) -> usize {
    let positions = &mesh_of(file, object).positions;
    (0..3)
        .map(|axis| positions.iter().filter(|p| p[axis].abs() > 1e-6).count())
        .min()
        .unwrap_or(0)
}

/// Protects: `scene: 1` shows the second scene and nothing of the first.
#[test]
fn the_default_scene_is_shown() {
    let Some(path) = assets("gltf/crafted/two_scenes_default_1.glb") else {
        return;
    };
    let file = load(&path);
    let colours: Vec<_> = file
        .scene
        .objects
        .iter()
        .map(|o| physical(&file, &o.material).base_colour.clone())
        .collect();
    assert_eq!(colours.len(), 2, "{colours:?}");
    for colour in colours {
        let ColourInput::Constant(Colour([r, g, b])) = colour else {
            panic!("{colour:?}")
        };
        assert!(r < g.max(b), "red is the other scene's: {r} {g} {b}");
    }
}

/// Protects: images are found by names with blanks, umlauts or sub-folders, and in data references.
#[test]
fn encoded_references_are_found() {
    let Some(folder) = assets("gltf/crafted/uri_encoding") else {
        return;
    };
    let file = load(&folder.join("uri encoding.gltf"));
    let textured = file
        .scene
        .objects
        .iter()
        .filter(|o| physical(&file, &o.material).base_colour_texture.is_some())
        .count();
    assert_eq!(textured, file.scene.objects.len(), "{:?}", file.warnings);
    assert!(textured >= 3);
}

/// Protects: palettes, grey, alpha, gamma chunks and orientation tags decode to equal 8-bit codes
/// for equal pictures.
#[test]
fn image_formats_decode_alike() {
    let Some(path) = assets("gltf/crafted/image_formats.glb") else {
        return;
    };
    let file = load(&path);
    assert!(file.scene.images.len() >= 4);
    for image in &file.scene.images {
        let data = image.data.as_ref().unwrap();
        let PixelData::Codes(codes) = &data.pixels else {
            panic!("{}: codes", image.name)
        };
        assert_eq!(
            codes.len(),
            (data.width * data.height) as usize,
            "{}",
            image.name
        );
    }
}

/// Protects: node transforms are read in double precision: neighbours in geocentric coordinates
/// keep their distance.
#[test]
fn node_translations_keep_double_precision() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.gltf");
    let buffer = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0,1]}}],
        "nodes":[{{"mesh":0,"translation":[6378137.123,0,0]}},{{"mesh":0,"translation":[6378137.373,0,0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{buffer}"}}]}}"#
    );
    std::fs::write(&path, json).unwrap();
    let file = load(&path);
    let [a, b] = [0, 1].map(|i| transform(&file.scene.objects[i]).1.x);
    assert!((b - a - 0.25).abs() < 1e-9, "{}", b - a);
    assert_eq!(file.scene.meshes.len(), 1, "objects of one mesh share it");
}

/// Protects: the markers of the texture transform test show the arrow's tip: just beyond (0.69,
/// 0.69) in the image.
#[test]
fn texture_transforms_turn_the_right_way() {
    let Some(path) = assets("gltf/TextureTransformTest/TextureTransformTest.gltf") else {
        return;
    };
    let file = load(&path);
    let image_point = |name: &str, u: f64, v: f64| {
        let rows = physical(&file, name)
            .base_colour_texture
            .as_ref()
            .and_then(|t| t.uv_transform)
            .expect("a transform");
        rows.map(|row| row[0] * u + row[1] * v + row[2])
    };
    for (name, u, v) in [
        ("Rotation", 0.420_952, 1.016_267),
        ("Scale", 0.518_545, 0.518_545),
        ("All", 0.43, 0.75),
    ] {
        let [x, y] = image_point(name, u, v);
        assert!(
            (0.74..0.80).contains(&x) && (0.74..0.80).contains(&y),
            "{name}: {x} {y}"
        );
    }
    assert_eq!(image_point("Offset U", 0.25, 0.25), [0.75, 0.25]);
    assert_eq!(image_point("Offset V", 0.25, 0.25), [0.25, 0.75]);
}

/// Protects: a chain of nodes as deep as a file is long neither overflows the stack nor takes long;
/// nodes of two parents that would be shown 2^n times are refused.
#[test]
fn deep_and_braided_hierarchies() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, nodes: Vec<String>| {
        let path = folder.path().join(name);
        let nodes = nodes.join(",");
        std::fs::write(
            &path,
            format!(
                r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}]}}"#
            ),
        )
        .unwrap();
        path
    };
    let n = 200_000;
    let chain = (0..n).map(|i| {
        if i + 1 < n {
            format!(r#"{{"children":[{}]}}"#, i + 1)
        } else {
            "{}".to_owned()
        }
    });
    load(&write("deep.gltf", chain.collect()));
    let braid = (0..30)
        .map(|i| format!(r#"{{"children":[{},{}]}}"#, i + 1, i + 1))
        .chain(["{}".to_owned()]);
    let error = crate::shared::try_load(&write("braid.gltf", braid.collect()))
        .expect_err("two parents")
        .to_string();
    assert!(error.contains("several parents"), "{error}");
}

/// Protects: radiance of the emissive row is factor times strength, exactly; the strength without
/// the extension is 1.
#[test]
fn emissive_strength_multiplies() {
    let Some(path) = assets("gltf/crafted/emissive_strength.glb") else {
        return;
    };
    let file = load(&path);
    for strength in ["0.25", "1", "4", "16"] {
        let s: f64 = strength.parse().unwrap();
        let [plain, textured] = [0, 1].map(|row| physical(&file, &format!("e{strength}_{row}")));
        assert_eq!(plain.emission, Colour([s, 0.5 * s, 0.25 * s]).into());
        assert_eq!(textured.emission, plain.emission);
        assert!(plain.emission_texture.is_none() && textured.emission_texture.is_some());
    }
}

/// Protects: both kinds of camera have the pose of their nodes.
#[test]
fn cameras_have_their_nodes_pose() {
    let Some(path) = assets("gltf/Cameras/Cameras.gltf") else {
        return;
    };
    let file = load(&path);
    let [perspective, orthographic] = file.scene.cameras.as_slice() else {
        panic!("two cameras")
    };
    let Projection::Pinhole(view) = &perspective.projection else {
        panic!("{perspective:?}")
    };
    assert!(
        (view.vertical_fov.unwrap() - 40.107).abs() < 1e-2,
        "{view:?}"
    );
    let Pose::Axes {
        eye,
        right,
        up,
        back,
    } = &perspective.pose
    else {
        panic!("axes")
    };
    assert_eq!(
        (*eye, *right, *up, *back),
        (
            [0.5, 0.5, 3.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0]
        )
    );
    let Projection::Orthographic { height } = orthographic.projection else {
        panic!("{orthographic:?}")
    };
    assert_eq!(height, 2.0);
}

/// Protects: point, spot and directional lights have their position, direction, cone and intensity.
#[test]
fn punctual_lights_are_read() {
    let Some(path) = assets("gltf/crafted/lights_punctual.glb") else {
        return;
    };
    let file = load(&path);
    let [point, spot, sun] = file.scene.lights.as_slice() else {
        panic!("{:?}", file.scene.lights)
    };
    assert_eq!(point.colour, Colour([20.0, 10.0, 5.0]));
    let LightKind::Point {
        position,
        range: None,
        ..
    } = point.kind
    else {
        panic!("{point:?}")
    };
    assert_eq!(position, [-2.5, 1.5, 0.0]);
    let close = |a: [f64; 3], b: [f64; 3]| DVec3::from(a).distance(DVec3::from(b)) < 1e-6;
    let LightKind::Spot {
        position,
        direction,
        inner_angle,
        outer_angle,
        ..
    } = spot.kind
    else {
        panic!("{spot:?}")
    };
    assert!(
        close(position, [1.5, 3.0, 0.0]) && close(direction, [0.0, -1.0, 0.0]),
        "{spot:?}"
    );
    let degrees = [0.2_f64, 0.5].map(f64::to_degrees);
    assert!(
        (inner_angle - degrees[0]).abs() < 1e-5 && (outer_angle - degrees[1]).abs() < 1e-5,
        "{spot:?}"
    );
    // A light along -z of a node rotated by -1 radian about x.
    let LightKind::Directional { to_light } = sun.kind else {
        panic!("{sun:?}")
    };
    assert!(
        close(to_light, [0.0, 1.0_f64.sin(), 1.0_f64.cos()]),
        "{sun:?}"
    );
    assert!(close(sun.colour.0, [0.2, 0.25, 0.5]), "{sun:?}");
}

/// Protects: wrap modes, filters and single-sidedness are those of the file.
#[test]
fn samplers_and_sides_are_read() {
    let Some(path) = assets("gltf/TextureSettingsTest/TextureSettingsTest.gltf") else {
        return;
    };
    let file = load(&path);
    let wraps: Vec<_> = file
        .scene
        .textures
        .iter()
        .map(|t| (t.wrap_u, t.wrap_v))
        .collect();
    for wrap in [WrapMode::Repeat, WrapMode::MirroredRepeat, WrapMode::Clamp] {
        assert!(
            wraps.iter().any(|(u, v)| *u == wrap || *v == wrap),
            "{wrap:?} in {wraps:?}"
        );
    }
    let sides: Vec<_> = file.scene.objects.iter().map(|o| o.side).collect();
    assert!(
        sides.contains(&SideRule::Both) && sides.contains(&SideRule::Culled),
        "{sides:?}"
    );
}

/// Protects: each ignored part of a file is named once.
#[test]
fn what_is_ignored_is_named() {
    let Some(folder) = assets("gltf") else { return };
    for (file, words) in [(
        "AnimatedMorphCube/AnimatedMorphCube.gltf",
        ["animations", "--at"],
    )] {
        let text: Vec<_> = load(&folder.join(file))
            .warnings
            .into_iter()
            .map(|w| w.message)
            .collect();
        for word in words {
            assert!(
                text.iter().any(|w| w.contains(word)),
                "{file}: nothing about {word} in {text:?}"
            );
        }
    }
}

/// Protects: unsupported parts of materials are left out by name, with the materials that have
/// them; a part without effect is not listed.
#[test]
fn extensions_of_materials_are_left_out_by_name() {
    use raywright_core::Settings;
    use raywright_core::effects::{Effect, EffectStatus, assess_effects};
    let Some(folder) = assets("gltf") else { return };
    let told = |file: &str| {
        let scene = load(&folder.join(file)).scene;
        let report = assess_effects(&scene, &Settings::from_scene(&scene));
        let finding = report.effects[Effect::MaterialExtensions as usize].clone();
        (finding.status == EffectStatus::LeftOut).then_some(finding.because)
    };
    for file in [
        "ClearCoatTest/ClearCoatTest.glb",
        "bio-19_sheen/19_sheen.gltf",
        "Duck/Duck.glb",
        "bio-15_transmission/15_transmission.gltf",
    ] {
        assert_eq!(told(file), None, "{file}");
    }
    let scene = with_material(
        r#""name": "wax", "extensions": { "KHR_materials_subsurface": { "scatterDistance": 1 }, "VENDOR_glow": {} }"#,
    )
    .scene;
    let left = assess_effects(&scene, &Settings::from_scene(&scene)).effects
        [Effect::MaterialExtensions as usize]
        .because
        .clone();
    assert!(
        left.contains("KHR_materials_subsurface of `wax`") && left.contains("VENDOR_glow of `wax`"),
        "{left}"
    );
}

/// Loads a glTF file of one triangle of a material with these keys.
fn with_material(keys: &str) -> LoadedScene {
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
        "materials": [{{ {keys} }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "material": 0 }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}], "buffers": [{{ "byteLength": 36, "uri": "own.bin" }}] }}"#
    );
    let own = tempfile::tempdir().unwrap();
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(own.path().join("own.bin"), bytes).unwrap();
    std::fs::write(own.path().join("own.gltf"), text).unwrap();
    load(&own.path().join("own.gltf"))
}

/// Protects: a white material that shines white, as exporters leave it behind that lose the textures,
/// is named: its surfaces show no shading.
#[test]
fn flat_white_materials_are_named() {
    for (keys, words) in [
        (r#""emissiveFactor": [1, 1, 1]"#, 1),
        (r#""emissiveFactor": [1, 1, 0.2]"#, 0),
        (
            r#""emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] }"#,
            0,
        ),
        (r#""name": "plain""#, 0),
    ] {
        let warnings = with_material(keys).warnings;
        let named = warnings
            .iter()
            .filter(|w| w.message.contains("shines white"));
        assert_eq!(named.count(), words, "{keys}: {warnings:?}");
    }
}

/// Loads a glTF file of one triangle with the corners 0, x and y, with more of accessor and node.
fn crafted(accessor: &str, node: &str, more: &[u8]) -> LoadedScene {
    tried(accessor, node, more).unwrap_or_else(|error| panic!("{error}"))
}

/// The same for a file that may be refused.
fn tried(accessor: &str, node: &str, more: &[u8]) -> Result<LoadedScene, raywright_io::Error> {
    let corners = [[0.0_f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes: Vec<u8> = corners
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    bytes.extend(more);
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0{node} }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }} }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [9, 9, 9]{accessor} }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}, {{ "buffer": 0, "byteOffset": 36, "byteLength": 4 }},
            {{ "buffer": 0, "byteOffset": 40, "byteLength": 24 }}],
        "buffers": [{{ "byteLength": {}, "uri": "a.bin" }}] }}"#,
        bytes.len()
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.bin"), bytes).unwrap();
    std::fs::write(folder.path().join("a.gltf"), text).unwrap();
    crate::shared::try_load(&folder.path().join("a.gltf"))
}

/// Protects: elements of a sparse accessor are replaced in any order: the third by (7, 8, 9), the
/// first by (1, 2, 3).
#[test]
fn sparse_elements_in_any_order() {
    let mut more = vec![2, 0, 0, 0];
    more.extend(
        [7.0_f32, 8.0, 9.0, 1.0, 2.0, 3.0]
            .iter()
            .flat_map(|x| x.to_le_bytes()),
    );
    let sparse = r#", "sparse": { "count": 2, "indices": { "bufferView": 1, "componentType": 5121 }, "values": { "bufferView": 2 } }"#;
    let file = crafted(sparse, "", &more);
    let data = mesh_of(&file, &file.scene.objects[0]);
    assert_eq!(
        *data.positions.offsets(),
        [[1.0, 2.0, 3.0], [1.0, 0.0, 0.0], [7.0, 8.0, 9.0]]
    );
}

/// Protects: a sparse accessor with more replacements than elements, or with an index out of range,
/// is refused with the numbers.
#[test]
fn sparse_elements_that_there_are_not() {
    let said = |count: u32, indices: [u8; 4]| {
        let sparse = format!(
            r#", "sparse": {{ "count": {count}, "indices": {{ "bufferView": 1, "componentType": 5121 }}, "values": {{ "bufferView": 2 }} }}"#
        );
        let more = [&indices[..], &[0; 24]].concat();
        tried(&sparse, "", &more)
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    assert_eq!(said(2, [1, 2, 0, 0]), Ok(()));
    let [many, beyond] =
        [said(4, [0, 1, 2, 2]), said(2, [1, 3, 0, 0])].map(|said| said.expect_err("refused"));
    assert!(
        many.contains("replaces 4 elements, but the accessor has only 3"),
        "{many}"
    );
    assert!(
        beyond.contains("replaces element 3, but the accessor has only 3 elements"),
        "{beyond}"
    );
}

/// Protects: the length of a rotation has no effect: (0, 0, 1, 1), of length √2, is a quarter turn
/// about z without scale.
#[test]
fn rotations_of_any_length_only_turn() {
    let file = crafted("", r#", "rotation": [0, 0, 1, 1]"#, &[0; 28]);
    let corners = world_triangles(&file, &file.scene.objects[0]).0;
    let expected = [DVec3::ZERO, DVec3::Y, DVec3::NEG_X];
    for (corner, expected) in corners.as_flattened().iter().zip(expected) {
        assert!(
            corner.distance(expected) < 1e-12,
            "{corner} is not {expected}"
        );
    }
}
