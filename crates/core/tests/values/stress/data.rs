//! Faults of materials, images and skies.

use std::sync::Arc;

use raywright_core::scene::{ImageData, Pixels};

use super::*;

/// A clean scene whose ball has these terms in place of its own.
fn painted(terms: Value) -> Scene {
    scene(
        &json!({ "materials": [paint("paint", terms), paint("other", json!({ "base_colour": 0.4 }))] }),
    )
}

/// Such a ball with an image under the name `image`, read as a texture `texture`.
fn with_image(terms: Value, colour_space: &str, data: Option<ImageData>) -> Scene {
    let mut all = json!({
        "images": [{ "name": "image", "path": "image.png" }],
        "textures": [{ "name": "texture", "image": "image", "colour_space": colour_space }],
    });
    all["materials"] = json!([
        paint("paint", terms),
        paint("other", json!({})),
        paint("glass", json!({}))
    ]);
    let mut scene = scene(&all);
    scene.images[0].data = data.map(Arc::new);
    scene
}

fn texture() -> Value {
    json!({ "name": "texture" })
}

fn codes(texels: impl Fn(u32) -> [u8; 4]) -> Option<ImageData> {
    Some(ImageData {
        width: 8,
        height: 8,
        pixels: Pixels::Codes((0..64).map(texels).collect()),
    })
}

fn linear(width: u32, texels: impl Fn(u32) -> [f32; 4]) -> Option<ImageData> {
    Some(ImageData {
        width,
        height: width / 2,
        pixels: Pixels::Linear((0..width * width / 2).map(texels).collect()),
    })
}

/// Protects: materials that make light, and values that are no numbers or out of their range.
#[test]
fn materials_that_make_light() {
    let found = alone(
        &painted(json!({ "base_colour": 1.4 })),
        Code::EnergyMade,
        PictureWrong,
    );
    assert!(
        found.why.contains("`base_colour` is up to 1.400"),
        "{}",
        found.why
    );
    let found = alone(
        &painted(json!({ "roughness": "1.5 + 0*p.x" })),
        Code::ValuesOutOfRange,
        Harmless,
    );
    assert!(
        found.why.contains("`roughness` is up to 1.500"),
        "{}",
        found.why
    );
    let found = alone(
        &painted(json!({ "base_colour": "sqrt(p.x - 100)" })),
        Code::ValuesNotNumbers,
        PictureWrong,
    );
    assert!(found.why.contains("`base_colour`"), "{}", found.why);
    let hdr = with_image(
        json!({ "base_colour_texture": texture() }),
        "linear",
        linear(8, |i| [if i == 2 { 8.0 } else { 0.1 }; 4]),
    );
    finds(&hdr, Code::BrighterThanLights, SlowOrNoisy, &[]);
}

/// Protects: what is nowhere there, glass without segments to come through, and absorption in other
/// units.
#[test]
fn materials_that_show_nothing() {
    finds(
        &painted(json!({ "alpha": { "mask": { "cutoff": 1.5 } } })),
        Code::InvisibleObject,
        Harmless,
        &[],
    );
    let mut shallow = painted(json!({ "transmission": 1, "roughness": 0 }));
    shallow.render.max_depth = 2;
    finds(&shallow, Code::DepthBelowGlass, PictureWrong, &[]);
    let dense = json!({ "transmission": 1, "roughness": 0, "attenuation_colour": [0.1, 0.5, 0.5], "attenuation_distance": 1e-6 });
    finds(&painted(dense), Code::AbsorptionOutOfScale, Harmless, &[]);
}

/// Protects: images of one colour, with texels that are no light, that could not be read, and such
/// as are read as what they are not.
#[test]
fn images() {
    let base = || json!({ "base_colour_texture": texture() });
    let varied = |i: u32| [(3 * i) as u8, 90, 200, 255];
    assert_eq!(
        listed(&report(&with_image(base(), "srgb", codes(varied))).findings),
        []
    );
    finds(
        &with_image(base(), "srgb", codes(|_| [90; 4])),
        Code::UniformImage,
        Harmless,
        &[],
    );
    let hole = |i: u32| [if i == 5 { f32::NAN } else { 0.02 * i as f32 }; 4];
    alone(
        &with_image(base(), "linear", linear(8, hole)),
        Code::ImageNotLight,
        PictureWrong,
    );
    finds(
        &with_image(base(), "srgb", None),
        Code::MissingImage,
        PictureWrong,
        &[],
    );
    let normals = |i: u32| [120 + (i % 16) as u8, 128, 250, 255];
    let bent = || json!({ "normal_texture": texture() });
    assert_eq!(
        listed(&report(&with_image(bent(), "linear", codes(normals))).findings),
        []
    );
    let found = alone(
        &with_image(bent(), "srgb", codes(normals)),
        Code::DataReadAsColour,
        PictureWrong,
    );
    assert!(
        found.why.contains("`normal_texture`") && found.why.contains("sRGB"),
        "{}",
        found.why
    );
    finds(
        &with_image(bent(), "linear", codes(|i| [4 * i as u8 / 2; 4])),
        Code::NotANormalMap,
        PictureWrong,
        &[],
    );
}

/// Protects: textures on meshes that have no place for them.
#[test]
fn texture_coordinates() {
    let cube = |uvs: Option<Vec<[f64; 2]>>, terms: Value| {
        let mut scene = with_image(
            terms,
            "linear",
            codes(|i| [120 + (i % 16) as u8, 128, 250, 255]),
        );
        let mut mesh = super::meshes::cube([0.0; 3], |_, _| {});
        if let Some(uvs) = uvs {
            mesh["source"]["inline"]["uvs"] = json!([uvs]);
        }
        scene.meshes = vec![serde_json::from_value(mesh).expect("a mesh")];
        scene.objects = vec![
            serde_json::from_value(object("cube", json!({ "mesh": "cube" }), "paint"))
                .expect("an object"),
        ];
        scene
    };
    finds(
        &cube(None, json!({ "base_colour_texture": texture() })),
        Code::NoTextureCoordinates,
        PictureWrong,
        &[],
    );
    // As readers write what a file lacks.
    finds(
        &cube(
            Some(vec![[0.0; 2]; 8]),
            json!({ "base_colour_texture": texture() }),
        ),
        Code::NoTextureCoordinates,
        PictureWrong,
        &[],
    );
    let same = Some(vec![[0.5, 0.5]; 8]);
    finds(
        &cube(same, json!({ "normal_texture": texture() })),
        Code::FlatTextureCoordinates,
        PictureWrong,
        &[],
    );
}

/// Protects: a sky with one point that has most of its light, and one with a texel that is none.
#[test]
fn skies() {
    let under = |data: Option<ImageData>| {
        let mut scene = scene(
            &json!({ "sky": { "map": { "image": "sky" } }, "images": [{ "name": "sky", "path": "sky.exr" }] }),
        );
        scene.images[0].data = data.map(Arc::new);
        scene
    };
    let varied = |i: u32| [0.1 + 1e-5 * i as f32, 0.1, 0.2, 1.0];
    assert_eq!(listed(&report(&under(linear(256, varied))).findings), []);
    let sun = |i: u32| if i == 9000 { [60000.0; 4] } else { varied(i) };
    finds(&under(linear(256, sun)), Code::SkySpikes, SlowOrNoisy, &[]);
    let hole = |i: u32| {
        if i == 9000 {
            [f32::INFINITY; 4]
        } else {
            varied(i)
        }
    };
    alone(&under(linear(256, hole)), Code::ImageNotLight, PictureWrong);
}
