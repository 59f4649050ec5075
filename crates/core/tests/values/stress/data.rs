//! Faults of materials, images and skies.

use std::sync::Arc;

use raywright_core::scene::{ImageData, PixelData};

use super::*;

/// A faultless scene whose ball has these material terms.
fn painted(terms: Value) -> Scene {
    scene(
        &json!({ "materials": [paint("paint", terms), paint("other", json!({ "base_colour": 0.4 }))] }),
    )
}

/// The scene of `painted`, with an image `image` that is read by a texture `texture`.
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
        pixels: PixelData::Codes((0..64).map(texels).collect()),
    })
}

fn linear(width: u32, texels: impl Fn(u32) -> [f32; 4]) -> Option<ImageData> {
    Some(ImageData {
        width,
        height: width / 2,
        pixels: PixelData::Linear((0..width * width / 2).map(texels).collect()),
    })
}

/// Protects: materials that reflect more light than they receive are found, and so are values that
/// are not finite.
#[test]
fn materials_that_make_light() {
    let finding = alone(
        &painted(json!({ "base_colour": 1.4 })),
        FaultKind::EnergyMade,
        PictureWrong,
    );
    assert!(
        finding.message.contains("`base_colour` is up to 1.400"),
        "{}",
        finding.message
    );
    let finding = alone(
        &painted(json!({ "base_colour": "sqrt(p.x - 100)" })),
        FaultKind::ValuesNotNumbers,
        PictureWrong,
    );
    assert!(
        finding.message.contains("`base_colour`"),
        "{}",
        finding.message
    );
    let hdr = with_image(
        json!({ "base_colour_texture": texture() }),
        "linear",
        linear(8, |i| [if i == 2 { 8.0 } else { 0.1 }; 4]),
    );
    alone(&hdr, FaultKind::EnergyMade, PictureWrong);
    // The furnace's ball shows little of the bright part.
    let in_part =
        json!({ "base_colour": "vec3(0.6 + 0.9*step(0.2, p.y))", "metallic": 1, "roughness": 0.1 });
    let finding = alone(&painted(in_part), FaultKind::EnergyMade, PictureWrong);
    assert!(finding.message.contains("1.500"), "{finding:?}");
}

/// Protects: glass with too short paths is found.
#[test]
fn glass_deeper_than_any_path() {
    let mut shallow = painted(json!({ "transmission": 1, "roughness": 0 }));
    shallow.render.max_depth = 2;
    expect_finding(&shallow, FaultKind::DepthBelowGlass, PictureWrong, &[]);
}

/// Protects: images with invalid texels or used for the wrong purpose are found.
#[test]
fn images() {
    let base = || json!({ "base_colour_texture": texture() });
    let varied = |i: u32| [(3 * i) as u8, 90, 200, 255];
    assert_eq!(
        listed(&summarise_findings(&with_image(base(), "srgb", codes(varied))).findings),
        []
    );
    let hole = |i: u32| [if i == 5 { f32::NAN } else { 0.02 * i as f32 }; 4];
    alone(
        &with_image(base(), "linear", linear(8, hole)),
        FaultKind::ImageNotLight,
        PictureWrong,
    );
    let normals = |i: u32| [120 + (i % 16) as u8, 128, 250, 255];
    let curved = || json!({ "normal_texture": texture() });
    assert_eq!(
        listed(&summarise_findings(&with_image(curved(), "linear", codes(normals))).findings),
        []
    );
    let finding = alone(
        &with_image(curved(), "srgb", codes(normals)),
        FaultKind::DataReadAsColour,
        PictureWrong,
    );
    assert!(
        finding.message.contains("`normal_texture`") && finding.message.contains("sRGB"),
        "{}",
        finding.message
    );
    expect_finding(
        &with_image(curved(), "linear", codes(|i| [4 * i as u8 / 2; 4])),
        FaultKind::NotANormalMap,
        PictureWrong,
        &[],
    );
}

/// Protects: each image of numbers that is read as colours is found, in all layers of a material.
/// An alpha channel, which is linear in any colour space, is not.
#[test]
fn images_of_numbers() {
    let varied = |i: u32| [(3 * i) as u8, 90, 200, 255 - i as u8];
    let glossy = |layer: Value| json!({ "clearcoat": layer });
    let read = |channel: &str| json!({ "texture": { "name": "texture", "channel": channel } });
    for (terms, slot) in [
        (json!({ "roughness": read("green") }), "`roughness`"),
        (
            glossy(json!({ "roughness_texture": texture() })),
            "`clearcoat.roughness_texture`",
        ),
        (
            json!({ "sheen": { "roughness_texture": texture() } }),
            "`sheen.roughness_texture`",
        ),
        (
            json!({ "iridescence": { "thickness_texture": texture() } }),
            "`iridescence.thickness_texture`",
        ),
    ] {
        let scene = with_image(terms, "srgb", codes(varied));
        let finding = alone(&scene, FaultKind::DataReadAsColour, PictureWrong);
        assert!(finding.message.contains(slot), "{finding:?}");
    }
    for terms in [
        json!({ "roughness": read("alpha") }),
        json!({ "sheen": { "colour_texture": texture() } }),
        json!({ "specular_colour_texture": texture() }),
    ] {
        let scene = with_image(terms, "srgb", codes(varied));
        assert_eq!(listed(&summarise_findings(&scene).findings), []);
    }
}

/// Protects: a `uv_transform` of zeros is found. One that only turns an image is not.
#[test]
fn texture_coordinates_times_zero() {
    let of = |rows: [[f64; 3]; 2]| {
        let varied = |i: u32| [(3 * i) as u8, 90, 200, 255];
        let texture = json!({ "name": "texture", "uv_transform": rows });
        with_image(
            json!({ "base_colour_texture": texture }),
            "srgb",
            codes(varied),
        )
    };
    alone(
        &of([[0.0, 0.0, 0.3], [0.0, 0.0, 0.3]]),
        FaultKind::NoTextureCoordinates,
        PictureWrong,
    );
    let turned = of([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]);
    assert_eq!(listed(&summarise_findings(&turned).findings), []);
}

/// Protects: textures on meshes without usable texture coordinates are found.
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
    expect_finding(
        &cube(None, json!({ "base_colour_texture": texture() })),
        FaultKind::NoTextureCoordinates,
        PictureWrong,
        &[],
    );
    // As readers write what a file lacks.
    expect_finding(
        &cube(
            Some(vec![[0.0; 2]; 8]),
            json!({ "base_colour_texture": texture() }),
        ),
        FaultKind::NoTextureCoordinates,
        PictureWrong,
        &[],
    );
    // An image of one colour is the same everywhere.
    let mut plain = cube(None, json!({ "base_colour_texture": texture() }));
    plain.images[0].data = codes(|_| [90; 4]).map(Arc::new);
    assert_eq!(listed(&summarise_findings(&plain).findings), []);
    let same = Some(vec![[0.5, 0.5]; 8]);
    expect_finding(
        &cube(same, json!({ "normal_texture": texture() })),
        FaultKind::FlatTextureCoordinates,
        PictureWrong,
        &[],
    );
}

/// Protects: a sky with a single, extremely bright texel is found, and so is a sky with an invalid
/// texel.
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
    assert_eq!(
        listed(&summarise_findings(&under(linear(256, varied))).findings),
        []
    );
    let sun = |i: u32| if i == 9000 { [60000.0; 4] } else { varied(i) };
    expect_finding(
        &under(linear(256, sun)),
        FaultKind::SkySpikes,
        SlowOrNoisy,
        &[],
    );
    // A quarter of the top row covers 0.4 ten-thousandths of the sky, a quarter of the top two rows
    // 1.5. The weight of a row is that of its centre.
    for (rows, is_found) in [(1, true), (2, false)] {
        let top = |i: u32| match i % 256 < 64 && i / 256 < rows {
            true => [60000.0; 4],
            false => varied(i),
        };
        let all = summarise_findings(&under(linear(256, top))).findings;
        let found = all.iter().any(|f| f.kind == FaultKind::SkySpikes);
        assert_eq!(found, is_found, "{rows}: {all:?}");
    }
    let hole = |i: u32| {
        if i == 9000 {
            [f32::INFINITY; 4]
        } else {
            varied(i)
        }
    };
    alone(
        &under(linear(256, hole)),
        FaultKind::ImageNotLight,
        PictureWrong,
    );
}
