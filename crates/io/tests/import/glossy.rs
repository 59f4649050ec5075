//! Coloured reflections of glTF, compared with closed forms: in a white furnace a smooth surface
//! seen head-on returns its reflectance, and its diffuse colour times the rest.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use raywright_core::scene::{
    Camera, Colour, Integrator, MaterialModel, Pinhole, PixelData, Pose, Projection, Sky,
};
use raywright_core::settings::Sampling;
use raywright_core::{Settings, prepare};
use serde_json::{Value, json};

use crate::keyed::KeyedTriangle;

/// Mean over pixels that see a point of the model's triangle head-on, in a white furnace.
fn furnace(material: &Value) -> [f64; 3] {
    let mut made = KeyedTriangle::new();
    let coordinates = made.accessor("VEC2", &[0.5; 6]);
    // One texel: the sRGB codes of (0.5, 0.25, 0.125), and a glossiness of 1.
    let mut png = std::io::Cursor::new(Vec::new());
    let texel = image::RgbaImage::from_pixel(1, 1, image::Rgba([188, 137, 99, 255]));
    texel
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("a picture");
    let made = made.with(|document| {
        document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(coordinates);
        document["images"] = json!([{ "uri": format!("data:image/png;base64,{}", STANDARD.encode(png.into_inner())) }]);
        document["textures"] = json!([{ "source": 0 }]);
        document["materials"][0] = material.clone();
    });
    let mut scene = made
        .load_with(None, None, None)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
    scene.sky = Some(Sky::Constant(Colour::WHITE));
    let pose = Pose::LookAt {
        eye: [0.25, 0.25, 9.0],
        target: [0.25, 0.25, 5.0],
        up: [0.0, 1.0, 0.0],
    };
    let projection = Projection::Pinhole(Pinhole {
        vertical_fov: Some(1e-3),
        ..Pinhole::default()
    });
    let camera = Camera {
        name: String::new(),
        pose,
        projection,
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    };
    let settings = Settings {
        camera: Some(camera),
        integrator: Integrator::Path,
        size: [8, 8],
        sampling: Sampling::General(256),
        ..Settings::from_scene(&scene)
    };
    let seen = prepare(&scene, &settings, &())
        .expect("it can be rendered")
        .render(&())
        .picture
        .rgb;
    core::array::from_fn(|k| {
        seen.iter().map(|pixel| f64::from(pixel[k])).sum::<f64>() / seen.len() as f64
    })
}

#[track_caller]
fn sends_back(material: &Value, expected: [f64; 3]) {
    let found = furnace(material);
    let near = found
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() <= 0.01);
    assert!(near, "{material}: {found:?}, not {expected:?}");
}

/// Protects: a material of the specular-glossiness model returns specular + diffuse · (1 − largest
/// specular), by factors and by images alike, for a dielectric, for a metal and for both.
#[test]
fn specular_and_diffuse_colours_are_as_given() {
    let value_of =
        |body: Value| json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": body } });
    for (diffuse, specular) in [
        ([0.8, 0.1, 0.1], [0.1; 3]),
        ([0.0, 0.3, 0.0], [0.5, 0.0, 0.5]),
        ([0.8, 0.4, 0.2], [0.0; 3]),
        ([0.0; 3], [1.0, 0.75, 0.5]),
        ([1.0; 3], [0.9; 3]),
    ] {
        let left = 1.0 - specular.into_iter().fold(0.0, f64::max);
        let expected = core::array::from_fn(|k| specular[k] + diffuse[k] * left);
        let [r, g, b] = diffuse;
        sends_back(
            &value_of(json!({ "diffuseFactor": [r, g, b, 1], "specularFactor": specular })),
            expected,
        );
    }
    let texture = json!({ "index": 0 });
    sends_back(
        &value_of(json!({ "diffuseTexture": texture, "specularFactor": [0.3, 0.3, 0.3] })),
        [0.65, 0.475, 0.3875],
    );
    let both = json!({ "diffuseFactor": [0, 1, 0, 1], "specularFactor": [0.5, 0.5, 0.5], "specularGlossinessTexture": texture });
    sends_back(&value_of(both), [0.25, 0.875, 0.0625]);
}

/// Protects: an index of 0 reflects everything at every angle, times the specular factor
/// (KHR_materials_ior).
#[test]
fn an_index_of_zero_reflects_all() {
    let value_of = |extensions: Value| json!({ "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0, "roughnessFactor": 0 }, "extensions": extensions });
    let ior = json!({ "ior": 0 });
    sends_back(&value_of(json!({ "KHR_materials_ior": ior })), [1.0; 3]);
    let half = json!({ "specularColorFactor": [0.5, 0.5, 0.5] });
    sends_back(
        &value_of(json!({ "KHR_materials_ior": ior, "KHR_materials_specular": half })),
        [0.5; 3],
    );
    sends_back(
        &value_of(json!({ "KHR_materials_ior": { "ior": 1001 } })),
        [0.996; 3],
    );
}

/// Protects: materials that share a glossiness image each have a roughness by their own factor.
#[test]
fn factors_of_one_glossiness_stay_apart() {
    let mut made = KeyedTriangle::new();
    let coordinates = made.accessor("VEC2", &[0.5; 6]);
    let mut png = std::io::Cursor::new(Vec::new());
    let texel = image::RgbaImage::from_pixel(1, 1, image::Rgba([255; 4]));
    texel
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("a picture");
    let scene = made
        .with(|document| {
            document["images"] = json!([{ "uri": format!("data:image/png;base64,{}", STANDARD.encode(png.into_inner())) }]);
            document["textures"] = json!([{ "source": 0 }]);
            document["meshes"][0]["primitives"] =
                [0, 1].map(|k| json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": coordinates }, "material": k })).into();
            for (k, factor) in [1.0, 0.2].into_iter().enumerate() {
                let glossy = json!({ "glossinessFactor": factor, "specularGlossinessTexture": { "index": 0 } });
                document["materials"][k] = json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": glossy } });
            }
        })
        .load_with(None, None, None)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
    let codes = scene.objects.iter().map(|object| {
        let material = scene
            .materials
            .iter()
            .find(|material| material.name == object.material)
            .expect("a material");
        let MaterialModel::Physical(model) = &material.model else {
            panic!("physical")
        };
        let name = &model
            .metallic_roughness_texture
            .as_ref()
            .expect("a texture")
            .name;
        let texture = scene
            .textures
            .iter()
            .find(|texture| texture.name == *name)
            .expect("it is there");
        let image = scene
            .images
            .iter()
            .find(|image| image.name == texture.image)
            .expect("it is there");
        let Some(PixelData::Codes(pixels)) = image.data.as_ref().map(|data| &data.pixels) else {
            panic!("codes")
        };
        pixels[0][1]
    });
    assert_eq!(codes.collect::<Vec<_>>(), [0, 204]);
}
