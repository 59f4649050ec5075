//! Uses of images: their coordinates, and the inputs that their texels multiply.

use std::sync::Arc;

use glam::DVec3;
use raywright_core::prepare;
use raywright_core::scene::{Colour, Image, ImageData, PixelData, Scene, Sky};
use serde_json::{Value, json};

use crate::support::{
    EyeAndTarget, Surface, classic, expect_near, expect_pixel, physical, pixel, scene, settings,
    sun,
};

/// A mesh of a material in the plane z = 0 with two sets of coordinates. `ramp` holds its column in
/// red and its row in green, in steps of a half and a quarter, and alpha 0.5 in its last row;
/// `codes` is one texel of 8-bit codes.
fn leaf(model: Value, two_sets: bool) -> Scene {
    let mut sets = vec![json!([[0.125, 0.125], [0.125, 0.125], [0.125, 0.125]])];
    if two_sets {
        sets.push(json!([[0.875, 0.625], [0.875, 0.625], [0.875, 0.625]]));
    }
    let data = json!({ "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]], "uvs": sets });
    let texture = |name: &str, image: &str, colour_space: &str| json!({ "name": name, "image": image, "filter": "nearest", "colour_space": colour_space });
    let (mut mirrored, mut soft) = (
        texture("mirrored", "ramp", "linear"),
        texture("soft", "ramp", "linear"),
    );
    (mirrored["wrap_u"], soft["filter"]) = (json!("mirrored_repeat"), json!("bilinear"));
    let mut scene = scene(
        json!({ "meshes": [{ "name": "leaf", "source": { "inline": data } }],
        "images": [{ "name": "ramp", "path": "ramp.exr" }, { "name": "codes", "path": "codes.png" }],
        "textures": [texture("ramp", "ramp", "linear"), texture("linear", "codes", "linear"), texture("srgb", "codes", "srgb"),
            mirrored, soft],
        "objects": [{ "shape": { "mesh": "leaf" }, "material": "leaf" }], "materials": [{ "name": "leaf", "model": model }],
        "lights": [sun([0.0, 0.0, 1.0])] }),
    );
    let ramp = (0..16_u8)
        .map(|i| {
            [
                f32::from(i % 4) * 0.5,
                f32::from(i / 4) * 0.25,
                1.0,
                if i >= 12 { 0.5 } else { 1.0 },
            ]
        })
        .collect();
    let data = |width, height, pixels| {
        Some(Arc::new(ImageData {
            width,
            height,
            pixels,
        }))
    };
    scene.images[0].data = data(4, 4, PixelData::Linear(ramp));
    scene.images[1] = Image {
        data: data(1, 1, PixelData::Codes(vec![[51, 102, 255, 255]])),
        ..scene.images[1].clone()
    };
    scene
}

const AT: EyeAndTarget = [[0.25, 0.25, 2.0], [0.25, 0.25, 0.0]];

/// Asserts the radiance of a classic surface with a use of a texture under ambient light.
fn shown(texture: Value, two_sets: bool, expected: [f64; 3]) {
    let mut scene = leaf(
        classic(json!({ "colour": { "texture": texture }, "ambient": 1 })),
        two_sets,
    );
    scene.lights.clear();
    expect_pixel(&scene, AT, expected);
}

/// Protects: the set of coordinates is respected; a missing second set, or any larger number, falls
/// back to the first.
#[test]
fn sets_of_coordinates() {
    shown(json!({ "name": "ramp" }), true, [0.0, 0.0, 1.0]);
    shown(
        json!({ "name": "ramp", "uv_set": 1 }),
        true,
        [1.5, 0.5, 1.0],
    );
    shown(
        json!({ "name": "ramp", "uv_set": 1 }),
        false,
        [0.0, 0.0, 1.0],
    );
    shown(
        json!({ "name": "ramp", "uv_set": 2 }),
        true,
        [0.0, 0.0, 1.0],
    );
}

/// Protects: texture coordinates are transformed by u' = a·u + b·v + c, v' = d·u + e·v + f;
/// expressions replace the coordinates before that; the factor multiplies.
#[test]
fn transforms_and_expressions_of_coordinates() {
    shown(
        json!({ "name": "ramp", "uv_transform": [[1, 0, 0.5], [0, 1, 0.25]] }),
        true,
        [1.0, 0.25, 1.0],
    );
    shown(
        json!({ "name": "ramp", "uv": [0.3, 0.6], "uv_transform": [[0, 1, 0], [3, 0, 0]] }),
        true,
        [1.0, 0.75, 1.0],
    );
    shown(
        json!({ "name": "ramp", "uv": [0.3, 0.6], "uv_transform": [[0.5, 0, 0], [0, 1, 0]] }),
        true,
        [0.0, 0.5, 1.0],
    );
    shown(
        json!({ "name": "ramp", "uv": ["p.x + 0.55", "p.y + 0.05"], "factor": [1, 2, 0.5] }),
        true,
        [1.5, 0.5, 0.5],
    );
}

/// Protects: maps of one material with different lookups are each read at their own texels, in any
/// order: with another set of coordinates, transform, wrapping, filter or size. A shared lookup
/// must compare all of these.
#[test]
fn maps_of_one_material() {
    let moved = |name: &str, [u, v]: [f64; 2]| json!({ "name": name, "uv_transform": [[1, 0, u], [0, 1, v]] });
    let cases = [
        (json!({ "name": "ramp" }), [0.0, 0.0, 1.0]),
        (json!({ "name": "ramp", "uv_set": 1 }), [1.5, 0.5, 1.0]),
        (moved("ramp", [0.5, 0.25]), [1.0, 0.25, 1.0]),
        (moved("ramp", [1.0625, 0.0]), [0.0, 0.0, 1.0]),
        (moved("mirrored", [1.0625, 0.0]), [1.5, 0.0, 1.0]),
        (moved("soft", [1.0625, 0.0]), [0.125, 0.0, 1.0]),
        (json!({ "name": "linear", "uv_set": 1 }), [0.2, 0.4, 1.0]),
        (json!({ "name": "ramp", "uv": [0.3, 0.6] }), [0.5, 0.5, 1.0]),
    ];
    for (one, first) in &cases {
        for (other, second) in &cases {
            let model = json!({ "colour": { "texture": one }, "ambient": 1, "emission": { "texture": other } });
            let mut scene = leaf(classic(model), true);
            scene.lights.clear();
            expect_pixel(&scene, AT, core::array::from_fn(|i| first[i] + second[i]));
        }
    }
}

/// Protects: codes are divided by 255, or decoded by the sRGB curve: 0.2 → ((0.2 +
/// 0.055)/1.055)^2.4.
#[test]
fn codes_and_curves() {
    let decode = |c: f64| ((c + 0.055) / 1.055_f64).powf(2.4);
    shown(json!({ "name": "linear" }), true, [0.2, 0.4, 1.0]);
    shown(
        json!({ "name": "srgb" }),
        true,
        [decode(0.2), decode(0.4), 1.0],
    );
}

/// Protects: each texture of a physical material multiplies its input, the factor included: base
/// colour and alpha, roughness by green and metalness by blue, emission.
#[test]
fn textures_of_physical_materials() {
    let unlit = |rest: Value| {
        let mut terms = json!({ "unlit": true, "base_colour": [0.5, 1, 0.25] });
        terms
            .as_object_mut()
            .expect("a table")
            .extend(rest.as_object().expect("a table").clone());
        leaf(physical(terms), true)
    };
    let at = |row: f64| json!({ "name": "ramp", "uv": [0.6, row], "factor": [1, 1, 2] });
    expect_pixel(
        &unlit(json!({ "base_colour_texture": at(0.4) })),
        AT,
        [0.5, 0.25, 0.5],
    );
    expect_pixel(
        &unlit(json!({ "base_colour_texture": at(0.9), "alpha": "blend", "opacity": 0.5 })),
        AT,
        [0.125, 0.1875, 0.125],
    );
    let dark =
        json!({ "base_colour": 0, "ior": 1, "emission": [3, 4, 5], "emission_texture": at(0.4) });
    expect_pixel(&leaf(physical(dark), true), AT, [3.0, 1.0, 10.0]);
    // Roughness 1 · 0.5 and metalness 0.5 · 1 at normal incidence: see `physical`.
    let terms = json!({ "base_colour": 0.5, "metallic": 0.5, "metallic_roughness_texture": { "name": "ramp", "uv": [0.6, 0.6] } });
    let half = Surface {
        metallic: 0.5,
        ..Surface::dielectric(0.5, 0.5, 0.04)
    };
    expect_pixel(
        &leaf(physical(terms), true),
        AT,
        half.sends([DVec3::Y; 3], true)
            .map(|x| x / core::f64::consts::PI),
    );
}

/// Protects: the image of a transmission multiplies it by its red channel, or by the named one;
/// without the image its factor alone applies.
#[test]
fn textures_of_transmission() {
    let actual = |terms: Value, has_image: bool| {
        let mut scene = leaf(physical(terms), true);
        if !has_image {
            scene.images[0].data = None;
        }
        scene.sky = Some(Sky::Constant(Colour::WHITE));
        pixel(&scene, &settings(&scene, AT))
    };
    let even = |share: f64| actual(json!({ "transmission": share }), true);
    let with = |more: Value, has_image| {
        let mut texture = json!({ "name": "ramp", "uv": [0.3, 0.6] });
        texture
            .as_object_mut()
            .expect("a table")
            .extend(more.as_object().expect("a table").clone());
        actual(
            json!({ "transmission": 0.8, "transmission_texture": texture }),
            has_image,
        )
    };
    for (found, expected) in [
        (with(json!({}), true), even(0.8 * 0.5)),
        (
            with(json!({ "uv": [0.3, 0.3], "channel": "green" }), true),
            even(0.8 * 0.25),
        ),
        (with(json!({ "factor": 0.5 }), true), even(0.8 * 0.25)),
        (with(json!({ "uv": [0.1, 0.3] }), true), even(0.0)),
        (with(json!({ "uv": [0.9, 0.3] }), true), even(1.0)),
        (with(json!({}), false), even(0.8)),
    ] {
        expect_near(found, expected, 1e-12, "an image of transmission");
    }
    assert!(
        even(0.4) != even(0.2) && even(0.2) != even(0.0),
        "what is compared above differs"
    );
}

/// Protects: inputs read one after the other at a hit each have their own texel, of different
/// images and of the same one.
#[test]
fn every_input_reads_its_own_texture() {
    let at = |row: f64| json!({ "name": "ramp", "uv": [0.6, row] });
    let lit = Surface {
        base: [1.0, 0.25, 1.0],
        metallic: 0.0,
        roughness: 1.0,
        f0: 0.0,
    }
    .sends([DVec3::Z; 3], true);
    let both = |emission: Value, glow: [f64; 3]| {
        let terms = json!({ "ior": 1, "base_colour_texture": at(0.4), "emission": 1, "emission_texture": emission });
        expect_pixel(
            &leaf(physical(terms), true),
            AT,
            core::array::from_fn(|k| lit[k] / core::f64::consts::PI + glow[k]),
        );
    };
    both(json!({ "name": "linear" }), [0.2, 0.4, 1.0]);
    both(at(0.9), [1.0, 0.75, 1.0]);
}

/// Protects: if an image is missing, the factor alone applies.
#[test]
fn missing_images_leave_the_factor() {
    let mut scene = leaf(
        classic(
            json!({ "colour": { "texture": { "name": "ramp", "factor": [0.5, 1, 2] } }, "ambient": 1 }),
        ),
        true,
    );
    scene.lights.clear();
    scene.images[0].data = None;
    expect_pixel(&scene, AT, [0.5, 1.0, 2.0]);
}

/// Protects: a surface with textured emission is visible but lights nothing; with a colour, every
/// triangle lights others.
#[test]
fn textured_emission_lights_nothing() {
    let emitters = |terms: Value| {
        let scene = leaf(physical(terms), true);
        let ready = prepare(&scene, &settings(&scene, AT), &()).expect("prepares");
        ready.table_sizes().emitters
    };
    assert_eq!(emitters(json!({ "emission": 1 })), 1);
    assert_eq!(
        emitters(json!({ "emission": 1, "emission_texture": { "name": "ramp" } })),
        0
    );
    assert_eq!(emitters(json!({})), 0);
}
