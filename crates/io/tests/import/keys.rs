//! Tables of the importers: the meaning of each key of a material, a light or a texture, and its
//! default.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use raywright_core::scene::{
    AlphaMode, Colour, ColourSpace, Falloff, LightKind, MaterialModel, Physical, PixelData,
    TextureRef,
};
use raywright_io::LoadedScene;
use serde_json::json;

use crate::keyed::KeyedTriangle;
use crate::shared::{load, mesh_of};

fn first(loaded: &LoadedScene) -> Physical {
    let name = &loaded.scene.objects[0].material;
    match loaded
        .scene
        .materials
        .iter()
        .find(|material| &material.name == name)
        .map(|material| &material.model)
    {
        Some(MaterialModel::Physical(physical)) => Physical::clone(physical),
        other => panic!("{name}: {other:?}"),
    }
}

fn picture(folder: &Path) {
    image::RgbaImage::from_pixel(1, 1, image::Rgba([255, 188, 0, 102]))
        .save(folder.join("a.png"))
        .unwrap();
}

/// Material of an OBJ file whose library has these lines, without its textures, and the number of
/// textures.
fn library(lines: &str) -> (Physical, usize) {
    let folder = tempfile::tempdir().unwrap();
    picture(folder.path());
    let path = folder.path().join("a.obj");
    std::fs::write(
        &path,
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n",
    )
    .unwrap();
    std::fs::write(folder.path().join("a.mtl"), format!("newmtl m\n{lines}\n")).unwrap();
    let physical = first(&load(&path));
    let textures = [
        &physical.base_colour_texture,
        &physical.metallic_roughness_texture,
        &physical.emission_texture,
    ];
    let count = textures.into_iter().flatten().count();
    (
        Physical {
            base_colour_texture: None,
            metallic_roughness_texture: None,
            emission_texture: None,
            ..physical
        },
        count,
    )
}

/// Protects: the table from MTL to the physical model: each key, each `illum` and the rules between
/// interpretations. An exponent of 30 is a roughness of one half, whose fourth power is 2/(30 + 2).
#[test]
fn each_key_of_a_library_has_its_meaning() {
    let plain = |grey: f64| Physical {
        base_colour: Colour([grey; 3]).into(),
        ior: 1.0.into(),
        ..Physical::default()
    };
    let glossy = |grey: f64| Physical {
        ior: 1.5.into(),
        roughness: 0.5.into(),
        ..plain(grey)
    };
    let metal = |colour: [f64; 3], roughness: f64| Physical {
        base_colour: Colour(colour).into(),
        metallic: 1.0.into(),
        roughness: roughness.into(),
        ..Physical::default()
    };
    let glass = |tint: f64, ior: f64| Physical {
        transmission: 1.0.into(),
        roughness: 0.0.into(),
        ior: ior.into(),
        ..plain(tint)
    };
    let faded = |opacity: f64| Physical {
        alpha: AlphaMode::Blend,
        opacity: opacity.into(),
        ..plain(0.8)
    };
    let glowing = |colour: [f64; 3]| Physical {
        emission: Colour(colour).into(),
        ..plain(0.8)
    };
    let gold = [1.0, 0.75, 0.25];
    for (lines, expected) in [
        ("", plain(0.8)),
        ("Kd 0.5 0.5 0.5", plain(0.5)),
        ("Kd 2 2 2", plain(1.0)),
        ("map_Kd a.png", plain(1.0)),
        ("Ks 1 1 1\nNs 30", glossy(0.8)),
        (
            "Ks 1 1 1",
            Physical {
                roughness: 1.0.into(),
                ..glossy(0.8)
            },
        ),
        ("Ks 1 1 1\nNs 30\nillum 0", plain(0.8)),
        ("Ks 1 1 1\nNs 30\nillum 1", plain(0.8)),
        ("Ks 1 1 1\nNs 30\nillum 2", glossy(0.8)),
        ("Ks 0 0 0\nNs 30\nillum 2", plain(0.8)),
        ("Kd 0 0 0\nKs 1 0.75 0.25\nNs 30", metal(gold, 0.5)),
        ("Kd 0 0 0\nmap_Kd a.png\nKs 1 0.75 0.25\nNs 30", glossy(0.0)),
        ("Kd 0.5 0.5 0.5\nNs 30\nillum 3", metal([0.5; 3], 0.5)),
        ("Kd 0 0 0\nKs 1 0.75 0.25\nNs 30\nillum 3", metal(gold, 0.0)),
        ("illum 4", plain(0.8)),
        ("Ks 1 1 1\nNs 30\nillum 4", glossy(0.8)),
        ("Tf 0 0 0\nillum 4", plain(0.8)),
        ("Tf 0.5 0.5 0.5\nillum 4", glass(0.5, 1.5)),
        ("Tf 0.5\nillum 9\nNi 1.25", glass(0.5, 1.25)),
        ("d 0.5\nillum 9", glass(1.0, 1.5)),
        (
            "Ns 30\nNi 1.75\nillum 5",
            Physical {
                roughness: 0.0.into(),
                ior: 1.75.into(),
                ..plain(0.8)
            },
        ),
        ("illum 6", glass(1.0, 1.5)),
        ("Tf 0.25\nNi 2\nillum 7", glass(0.25, 2.0)),
        ("Ni 0.5\nillum 7", glass(1.0, 1.5)),
        (
            "Pr 0.25",
            Physical {
                roughness: 0.25.into(),
                ..plain(0.8)
            },
        ),
        (
            "Pm 0.25",
            Physical {
                metallic: 0.25.into(),
                ..plain(0.8)
            },
        ),
        ("Ke 1 2 4", glowing([1.0, 2.0, 4.0])),
        ("map_Ke a.png", glowing([1.0; 3])),
        ("Ke 0.5 1 2\nmap_Ke a.png", glowing([0.5, 1.0, 2.0])),
        ("d 0.25", faded(0.25)),
        ("d -halo 0.25", faded(0.25)),
        ("Tr 0.75", faded(0.25)),
        (
            "map_Kd a.png\nmap_d a.png",
            Physical {
                opacity: 1.0.into(),
                base_colour: Colour::WHITE.into(),
                ..faded(1.0)
            },
        ),
    ] {
        let (physical, textures) = library(lines);
        assert_eq!(physical, expected, "{lines}");
        assert_eq!(
            textures,
            lines.matches("a.png").count() - usize::from(lines.contains("map_d")),
            "{lines}"
        );
    }
}

/// Loads a glTF file of one triangle with this material.
fn gltf(material: &str) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    picture(folder.path());
    let corners = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "nodes": [{{ "mesh": 0 }}], "materials": [{{ {material} }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "material": 0 }}] }}],
        "images": [{{ "uri": "a.png" }}], "textures": [{{ "source": 0 }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}],
        "buffers": [{{ "byteLength": 36, "uri": "data:;base64,{corners}" }}] }}"#
    );
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, text).unwrap();
    load(&path)
}

/// Protects: each factor of glTF 2.0 and its extensions has its meaning, and its default if
/// omitted: a metal by default.
#[test]
fn each_factor_of_gltf_has_its_meaning() {
    let default = || Physical {
        metallic: 1.0.into(),
        ..Physical::default()
    };
    let masked = |cutoff: f64| Physical {
        alpha: AlphaMode::Mask { cutoff },
        ..default()
    };
    let shiny = |colour: [f64; 3], metallic: f64, roughness: f64, opacity: f64| Physical {
        base_colour: Colour(colour).into(),
        metallic: metallic.into(),
        roughness: roughness.into(),
        opacity: opacity.into(),
        ..Physical::default()
    };
    let extension = |name: &str, body: &str| {
        format!(r#""extensions": {{ "KHR_materials_{name}": {{ {body} }} }}"#)
    };
    let factors = |body: &str| format!(r#""pbrMetallicRoughness": {{ {body} }}"#);
    let glow = |strength: f64| Physical {
        emission: Colour([0.5 * strength, strength, 0.0]).into(),
        ..default()
    };
    for (material, expected) in [
        (String::new(), default()),
        (
            factors(r#""baseColorFactor": [0.5, 0.25, 1, 0.75]"#),
            shiny([0.5, 0.25, 1.0], 1.0, 1.0, 0.75),
        ),
        (
            factors(r#""metallicFactor": 0.25"#),
            shiny([1.0; 3], 0.25, 1.0, 1.0),
        ),
        (
            factors(r#""roughnessFactor": 0.25"#),
            shiny([1.0; 3], 1.0, 0.25, 1.0),
        ),
        (r#""emissiveFactor": [0.5, 1, 0]"#.to_owned(), glow(1.0)),
        (
            format!(
                r#""emissiveFactor": [0.5, 1, 0], {}"#,
                extension("emissive_strength", r#""emissiveStrength": 8"#)
            ),
            glow(8.0),
        ),
        (r#""alphaMode": "OPAQUE""#.to_owned(), default()),
        (
            r#""alphaMode": "BLEND""#.to_owned(),
            Physical {
                alpha: AlphaMode::Blend,
                ..default()
            },
        ),
        (r#""alphaMode": "MASK""#.to_owned(), masked(0.5)),
        (
            r#""alphaMode": "MASK", "alphaCutoff": 0.25"#.to_owned(),
            masked(0.25),
        ),
        (
            r#""alphaMode": "MASK", "alphaCutoff": 1.5"#.to_owned(),
            masked(1.5),
        ),
        (
            r#""alphaMode": "MASK", "alphaCutoff": 1e30"#.to_owned(),
            masked(2.0),
        ),
        (
            extension("ior", r#""ior": 1.25"#),
            Physical {
                ior: 1.25.into(),
                ..default()
            },
        ),
        (extension("ior", ""), default()),
        (
            extension("transmission", r#""transmissionFactor": 0.25"#),
            Physical {
                transmission: 0.25.into(),
                thin_walled: true,
                ..default()
            },
        ),
        (
            extension("unlit", ""),
            Physical {
                unlit: true,
                ..default()
            },
        ),
        // A dielectric of index 1.5 reflects 4 %, times the specular colour.
        (
            extension(
                "pbrSpecularGlossiness",
                r#""diffuseFactor": [0.5, 0.25, 0, 0.75], "specularFactor": [0, 0, 0]"#,
            ),
            Physical {
                specular_colour: Colour::BLACK.into(),
                ..shiny([0.5, 0.25, 0.0], 0.0, 0.0, 0.75)
            },
        ),
        (
            extension(
                "pbrSpecularGlossiness",
                r#""diffuseFactor": [0.5, 0.5, 0.5, 1], "specularFactor": [1, 0.5, 0], "glossinessFactor": 0.25"#,
            ),
            Physical {
                specular_colour: Colour([1.0 / 0.04, 0.5 / 0.04, 0.0]).into(),
                ..shiny([0.5, 0.5, 0.5], 0.0, 0.75, 1.0)
            },
        ),
    ] {
        let physical = first(&gltf(&material));
        let near = |a: &Physical, b: &Physical| {
            let colour = |m: &Physical| m.base_colour.constant().unwrap().0;
            colour(a)
                .iter()
                .zip(colour(b))
                .all(|(a, b)| (a - b).abs() < 1e-12)
                && (a.metallic.constant().unwrap() - b.metallic.constant().unwrap()).abs() < 1e-12
        };
        assert!(near(&physical, &expected), "{material}: {physical:?}");
        let rest = Physical {
            base_colour: expected.base_colour.clone(),
            metallic: expected.metallic.clone(),
            ..physical
        };
        assert_eq!(rest, expected, "{material}");
    }
}

/// Protects: the images of the old specular-glossiness model become those of base colour and of
/// specular colour, with their transforms, and glossiness becomes roughness, texel by texel.
#[test]
fn specular_glossiness_has_images() {
    let transform =
        r#""texCoord": 1, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0] } }"#;
    let moved = Some([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]]);
    for (diffuse, place) in [
        ("", None),
        (r#""diffuseTexture": { "index": 0 },"#, Some((0, None))),
    ] {
        let loaded = gltf(&format!(
            r#""extensions": {{ "KHR_materials_pbrSpecularGlossiness": {{ {diffuse} "diffuseFactor": [0.5, 0, 0, 0.5],
            "specularFactor": [1, 1, 1], "glossinessFactor": 0.5, "specularGlossinessTexture": {{ "index": 0, {transform} }} }} }}"#
        ));
        let physical = first(&loaded);
        assert!(loaded.scene.unread.is_empty());
        let at =
            |used: &Option<TextureRef>| used.as_ref().map(|used| (used.uv_set, used.uv_transform));
        assert_eq!(at(&physical.base_colour_texture), place);
        let images = [
            &physical.specular_colour_texture,
            &physical.metallic_roughness_texture,
        ]
        .map(|used| {
            assert_eq!(at(used), Some((1, moved)));
            let name = &used.as_ref().expect("a texture").name;
            let texture = loaded
                .scene
                .textures
                .iter()
                .find(|texture| texture.name == *name)
                .expect("it is there");
            let image = loaded
                .scene
                .images
                .iter()
                .find(|image| image.name == texture.image)
                .expect("it is there");
            let Some(PixelData::Codes(pixels)) =
                image.data.as_ref().map(|data| data.pixels.clone())
            else {
                panic!("codes")
            };
            (texture.colour_space, pixels[0])
        });
        // Glossiness is a half of 102/255.
        assert_eq!(
            images,
            [
                (ColourSpace::Srgb, [255, 188, 0, 102]),
                (ColourSpace::Linear, [0, 204, 0, 255])
            ]
        );
        assert_eq!(physical.base_colour, Colour([0.5, 0.0, 0.0]).into());
        assert_eq!(
            (physical.metallic, physical.roughness, physical.opacity),
            (0.0.into(), 1.0.into(), 0.5.into())
        );
    }
}

/// Protects: the set of coordinates in a texture's transform takes precedence over that of its
/// reference (KHR_texture_transform).
#[test]
fn a_transform_may_name_its_own_coordinates() {
    for (body, set) in [
        ("", 0),
        (r#", "texCoord": 1"#, 1),
        (
            r#", "texCoord": 1, "extensions": { "KHR_texture_transform": {} }"#,
            1,
        ),
        (
            r#", "texCoord": 1, "extensions": { "KHR_texture_transform": { "texCoord": 2 } }"#,
            2,
        ),
        (
            r#", "texCoord": 1, "extensions": { "KHR_texture_transform": { "texCoord": 0 } }"#,
            0,
        ),
    ] {
        let material =
            format!(r#""pbrMetallicRoughness": {{ "baseColorTexture": {{ "index": 0{body} }} }}"#);
        let texture = first(&gltf(&material)).base_colour_texture.unwrap();
        assert_eq!(texture.uv_set, set, "{body}");
    }
}

/// Protects: lights of KHR_lights_punctual have their kinds, defaults, a range of zero, and names,
/// or those of their nodes.
#[test]
fn lamps_have_their_defaults() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let read = |light: &str, node: &str| {
        let text = format!(
            r#"{{ "asset": {{ "version": "2.0" }},
            "nodes": [{{ {node} "extensions": {{ "KHR_lights_punctual": {{ "light": 0 }} }} }}],
            "extensions": {{ "KHR_lights_punctual": {{ "lights": [{{ {light} }}] }} }} }}"#
        );
        std::fs::write(&path, text).unwrap();
        let mut lights = load(&path).scene.lights;
        assert_eq!(lights.len(), 1, "{light}");
        lights.remove(0)
    };
    let [here, target_direction] = [[0.0; 3], [0.0, 0.0, -1.0]];
    let falloff = Falloff::InverseSquare;
    let spot = |outer_angle: f64, range| LightKind::Spot {
        position: here,
        direction: target_direction,
        inner_angle: 0.0,
        outer_angle,
        falloff,
        range,
    };
    for (light, kind) in [
        (
            r#""type": "directional""#,
            LightKind::Directional {
                to_light: [0.0, 0.0, 1.0],
            },
        ),
        (
            r#""type": "point""#,
            LightKind::Point {
                position: here,
                falloff,
                range: None,
            },
        ),
        (
            r#""type": "point", "range": 4"#,
            LightKind::Point {
                position: here,
                falloff,
                range: Some(4.0),
            },
        ),
        (
            r#""type": "point", "range": 0"#,
            LightKind::Point {
                position: here,
                falloff,
                range: None,
            },
        ),
        (r#""type": "spot""#, spot(45.0, None)),
        (
            r#""type": "spot", "spot": {}, "range": 4"#,
            spot(45.0, Some(4.0)),
        ),
    ] {
        let found = read(light, "");
        let rounded = |kind| match kind {
            LightKind::Spot {
                position,
                direction,
                inner_angle,
                outer_angle,
                falloff,
                range,
            } => {
                let outer_angle = (outer_angle * 1e4).round() / 1e4;
                LightKind::Spot {
                    position,
                    direction,
                    inner_angle,
                    outer_angle,
                    falloff,
                    range,
                }
            }
            other => other,
        };
        assert_eq!(rounded(found.kind), kind, "{light}");
        assert_eq!(
            (found.colour, found.shadows, found.specular),
            (Colour::WHITE, true, true),
            "{light}"
        );
    }
    for (own, node, name) in [
        ("", "", ""),
        ("", "post", "post"),
        ("lamp", "post", "lamp"),
        ("lamp", "", "lamp"),
    ] {
        let found = read(
            &format!(r#""type": "point", "name": "{own}""#),
            &format!(r#""name": "{node}","#),
        );
        assert_eq!(found.name, name);
    }
}

/// Protects: a normal map is read with its scale and transform, as linear data; a file's tangents
/// are kept where a material needs them and the mesh has normals, unless any of them is invalid.
#[test]
fn normal_maps_of_gltf() {
    let normal = r#""index": 0, "scale": 0.5, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0.25] } }"#;
    let loaded = gltf(&format!(r#""normalTexture": {{ {normal} }}"#));
    let Some(MaterialModel::Physical(model)) = loaded
        .scene
        .materials
        .first()
        .map(|material| &material.model)
    else {
        panic!("one")
    };
    let image = model.normal_texture.as_ref().expect("a normal map");
    assert_eq!((model.normal_scale, image.uv_set), (0.5, 0));
    assert_eq!(
        image.uv_transform,
        Some([[1.0, 0.0, 0.5], [0.0, 1.0, 0.25]])
    );
    let texture = loaded
        .scene
        .textures
        .iter()
        .find(|texture| texture.name == image.name)
        .expect("a texture");
    assert_eq!(texture.colour_space, ColourSpace::Linear);
    let tangents = |last: [f32; 4], bumpy: bool, normals: bool| {
        let mut made = KeyedTriangle::new();
        let up = made.accessor("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        let ways = made.accessor(
            "VEC4",
            &[[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, -1.0], last].concat(),
        );
        let made = made.with(|d| {
            let attributes = &mut d["meshes"][0]["primitives"][0]["attributes"];
            attributes["TANGENT"] = json!(ways);
            if normals {
                attributes["NORMAL"] = json!(up);
            }
            d["images"] =
                json!([{ "uri": format!("data:image/png;base64,{}", STANDARD.encode(DOT)) }]);
            d["textures"] = json!([{ "source": 0 }]);
            if bumpy {
                d["materials"][0]["normalTexture"] = json!({ "index": 0 });
            }
        });
        let loaded = made
            .load_with(None, None, None)
            .unwrap_or_else(|e| panic!("{e}"));
        mesh_of(&loaded, &loaded.scene.objects[0]).tangents.clone()
    };
    let found = tangents([0.0, 2.0, 0.0, -0.5], true, true);
    assert_eq!(
        found,
        [
            [1.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, -1.0],
            [0.0, 2.0, 0.0, -1.0]
        ]
    );
    for last in [
        [0.0, 0.0, 0.0, 1.0],
        [f32::NAN, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, f32::NAN],
    ] {
        assert!(tangents(last, true, true).is_empty(), "{last:?}");
    }
    assert!(
        tangents([1.0; 4], false, true).is_empty() && tangents([1.0; 4], true, false).is_empty()
    );
}

/// A grey PNG of one pixel.
const DOT: &[u8] = &[
    137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 0, 1, 0, 0, 0, 1, 8, 0, 0,
    0, 0, 58, 126, 155, 85, 0, 0, 0, 10, 73, 68, 65, 84, 120, 156, 99, 104, 0, 0, 0, 130, 0, 129,
    119, 205, 114, 182, 0, 0, 0, 0, 73, 69, 78, 68, 174, 66, 96, 130,
];

/// Protects: an unusable picture - no picture, truncated in its header or in its data, of an
/// unsupported format, outside of its buffer, of broken base64, missing, or a missing texture - is
/// a warning, inside the file or beside it, and the material has no texture; other pictures stay.
#[test]
fn pictures_that_are_none() {
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_fn(9, 9, |x, y| {
        image::Rgba([x as u8 * 17, y as u8 * 29, (x * y) as u8, 255])
    })
    .write_to(&mut png, image::ImageFormat::Png)
    .expect("a picture");
    let png = png.into_inner();
    let value_of = |image: Option<serde_json::Value>, texture: u32| {
        let made = KeyedTriangle::new().with(|d| {
            d["images"] = json!([image.clone().unwrap_or_else(|| json!({})), { "uri": "dot.png" }]);
            d["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
            let material = &mut d["materials"][0];
            material["emissiveTexture"] = json!({ "index": 1 });
            let textured = ["baseColorTexture", "metallicRoughnessTexture"]
                .map(|key| (key, json!({ "index": texture })));
            for (key, value) in textured.into_iter().filter(|_| image.is_some()) {
                material["pbrMetallicRoughness"][key] = value;
            }
        });
        let path = made.write();
        for (name, bytes) in [
            ("dot.png", DOT),
            ("text.png", b"text"),
            ("half.png", &png[..png.len() / 2]),
            ("a.gif", b"GIF89a"),
        ] {
            std::fs::write(path.with_file_name(name), bytes).expect("a file");
        }
        let loaded = made
            .load_with(None, None, None)
            .unwrap_or_else(|e| panic!("{image:?}: {e}"));
        crate::shared::check_sound(&loaded, &path);
        assert_eq!(
            (loaded.scene.images.len(), loaded.scene.textures.len()),
            (1, 1),
            "{image:?}"
        );
        let MaterialModel::Physical(model) = &loaded.scene.materials[0].model else {
            panic!("physical")
        };
        let describe = loaded
            .warnings
            .iter()
            .map(|warning| warning.message.clone());
        (
            model.clone(),
            describe
                .filter(|message| message.contains("the texture is left out"))
                .collect::<Vec<_>>(),
        )
    };
    let (plain, none) = value_of(None, 0);
    assert!(none.is_empty(), "{none:?}");
    let uri = |uri: &str| json!({ "uri": uri });
    let data = |bytes: &[u8]| uri(&format!("data:image/png;base64,{}", STANDARD.encode(bytes)));
    for (image, texture, words) in [
        (data(b"text"), 0, "images[0]: is not a picture"),
        (data(&png[..20]), 0, "images[0]: is a broken picture"),
        (
            data(&png[..png.len() / 2]),
            0,
            "images[0]: is a broken picture",
        ),
        (data(b"GIF89a"), 0, "images[0]: is a broken picture"),
        (
            data(b"\xabKTX 20\xbb\r\n\x1a\n"),
            0,
            "images[0]: is a KTX2 picture that ends",
        ),
        (
            uri("data:image/png;base64,@@@"),
            0,
            "images[0]: a data: URI has invalid base64",
        ),
        (uri("text.png"), 0, "images[0]: is not a picture"),
        (uri("half.png"), 0, "images[0]: is a broken picture"),
        (uri("a.gif"), 0, "images[0]: is a broken picture"),
        (uri("gone.png"), 0, "images[0]: cannot read `gone.png`"),
        (
            json!({ "bufferView": 77 }),
            0,
            "images[0]: bufferViews[77] does not exist",
        ),
        (json!({}), 0, "images[0]: has neither uri nor bufferView"),
        (data(DOT), 5, "textures[5] does not exist"),
    ] {
        let (model, warnings) = value_of(Some(image), texture);
        assert!(model == plain, "{words}");
        assert!(
            warnings.len() == 1 && warnings[0].contains(words),
            "{words}: {warnings:?}"
        );
    }
}

/// Protects: occlusion maps, and materials of the specular-glossiness model, are one warning each,
/// with the number of the materials in use.
#[test]
fn converted_materials_are_counted_in_one_warning() {
    let made = KeyedTriangle::new().with(|d| {
        let mut material = d["materials"][0].clone();
        material["occlusionTexture"] = json!({ "index": 0 });
        material["extensions"] = json!({ "KHR_materials_pbrSpecularGlossiness": {} });
        d["materials"] = json!([material, material, material]);
        let [mut first, mut second] = [0, 1].map(|_| d["meshes"][0]["primitives"][0].clone());
        (first["material"], second["material"]) = (json!(0), json!(2));
        d["meshes"][0]["primitives"] = json!([first, second]);
    });
    let loaded = made
        .load_with(None, None, None)
        .unwrap_or_else(|e| panic!("{e}"));
    for (label, outcome) in [
        ("the occlusion map", "ignored, because"),
        ("KHR_materials_pbrSpecularGlossiness", "converted"),
    ] {
        let messages = loaded.warnings.iter().map(|warning| &warning.message);
        let told: Vec<_> = messages.filter(|message| message.contains(label)).collect();
        let expected = format!("{label} of 2 materials is {outcome}");
        assert!(told.len() == 1 && told[0].contains(&expected), "{told:?}");
    }
}

/// Protects: a material of the specular-glossiness model keeps its factors if its specular image
/// cannot be decoded.
#[test]
fn broken_specular_images_leave_factors() {
    let value_of = |bytes: &[u8]| {
        let made = KeyedTriangle::new().with(|d| {
            d["images"] = json!([{ "uri": format!("data:image/png;base64,{}", STANDARD.encode(bytes)) }]);
            d["textures"] = json!([{ "source": 0 }]);
            let factors = json!({ "diffuseFactor": [0.5, 0.25, 0.125, 1.0], "specularFactor": [0.04, 0.04, 0.04], "glossinessFactor": 0.75,
                "specularGlossinessTexture": { "index": 0 } });
            d["materials"][0]["extensions"] = json!({ "KHR_materials_pbrSpecularGlossiness": factors });
        });
        let loaded = made
            .load_with(None, None, None)
            .unwrap_or_else(|e| panic!("{e}"));
        crate::shared::check_sound(&loaded, &made.write());
        loaded
    };
    // Result for a valid header with broken data.
    let loaded = value_of(&DOT[..45]);
    assert!(
        loaded
            .warnings
            .iter()
            .any(|warning| warning.message.contains("broken picture")),
        "{:?}",
        loaded.warnings
    );
    let model = first(&loaded);
    assert_eq!(
        (model.base_colour, model.specular_colour_texture),
        (Colour([0.5, 0.25, 0.125]).into(), None)
    );
    let pixels: Vec<_> = loaded
        .scene
        .images
        .iter()
        .map(|image| &image.data.as_ref().expect("made").pixels)
        .collect();
    assert_eq!(
        pixels,
        [&PixelData::Codes(vec![[
            0,
            (255.0_f64 * 0.25).round() as u8,
            0,
            255
        ]])]
    );
}

/// Protects: each key of glTF's material extensions reaches its property, and a factor of zero
/// disables the extension.
#[test]
fn layers_of_materials() {
    let value_of = |extensions: &str| first(&gltf(&format!(r#""extensions": {{ {extensions} }}"#)));
    let coat = value_of(r#""KHR_materials_clearcoat": { "clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25 }"#)
        .clearcoat
        .expect("a coat");
    assert_eq!(
        (coat.factor, coat.roughness, coat.normal_texture),
        (0.5.into(), 0.25.into(), None)
    );
    assert_eq!(
        value_of(r#""KHR_materials_clearcoat": { "clearcoatRoughnessFactor": 0.25 }"#).clearcoat,
        None
    );
    let sheen = value_of(r#""KHR_materials_sheen": { "sheenColorFactor": [0.5, 1, 0.25], "sheenRoughnessFactor": 0.75 }"#)
        .sheen
        .expect("fibres");
    assert_eq!(
        (sheen.colour, sheen.roughness),
        (Colour([0.5, 1.0, 0.25]).into(), 0.75.into())
    );
    let anisotropy = value_of(
        r#""KHR_materials_anisotropy": { "anisotropyStrength": 0.5, "anisotropyRotation": 1.5707963267948966 }"#,
    );
    let anisotropy = anisotropy.anisotropy.expect("combed");
    assert_eq!(
        (anisotropy.strength, anisotropy.rotation),
        (0.5.into(), 90.0)
    );
    let film = value_of(
        r#""KHR_materials_iridescence": { "iridescenceFactor": 1, "iridescenceThicknessMaximum": 500 }"#,
    );
    let film = film.iridescence.expect("a film");
    assert_eq!(
        (film.factor, film.ior, film.thickness, film.thinnest),
        (1.0.into(), 1.3, 500.0.into(), 100.0)
    );
    let physical = value_of(
        r#""KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [2, 1, 0.5] }"#,
    );
    assert_eq!(
        (physical.specular, physical.specular_colour),
        (0.5.into(), Colour([2.0, 1.0, 0.5]).into())
    );
    let glass = r#""KHR_materials_transmission": { "transmissionFactor": 1 }"#;
    let body = value_of(&format!(
        r#"{glass}, "KHR_materials_volume": {{ "thicknessFactor": 0.1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0] }},
        "KHR_materials_dispersion": {{ "dispersion": 0.3 }}"#
    ));
    assert_eq!(
        (body.thin_walled, body.dispersion, body.attenuation_distance),
        (false, 0.3, Some(2.0))
    );
    assert_eq!(body.attenuation_colour, Colour([1.0, 0.5, 0.0]));
    let wall = value_of(&format!(
        r#"{glass}, "KHR_materials_volume": {{ "attenuationDistance": 2 }}"#
    ));
    assert_eq!((wall.thin_walled, wall.attenuation_distance), (true, None));
    let leaf = value_of(
        r#""KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorFactor": [1, 0.5, 0] }"#,
    );
    let through = leaf.diffuse_transmission.expect("it lets light through");
    assert_eq!(
        (through.factor, through.colour, leaf.thin_walled),
        (0.5.into(), Colour([1.0, 0.5, 0.0]).into(), true)
    );
}
