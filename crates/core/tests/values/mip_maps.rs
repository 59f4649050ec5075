//! Mip-mapped textures, against the level by plane geometry.

use std::sync::Arc;

use raywright_core::effects::{Effect, EffectSet, EffectStatus, assess_effects};
use raywright_core::scene::{ImageData, PixelData, Pose, Projection, Scene};
use raywright_core::{Settings, prepare};
use serde_json::{Value, json};

use crate::support::{DOWN, SLANTED, classic, expect_pixel, floor, physical, pixel, settings, sun};

/// A scene with an image of two by two texels, white and black in turns: in the middle of a white
/// texel a level from 0 to 1 reads 1 − level/2, and every higher one a half.
fn checked(mut scene: Scene, colour_space: &str) -> Scene {
    let [white, black] = [[255; 4], [0, 0, 0, 255]];
    let pixels = PixelData::Codes(vec![white, black, black, white]);
    let texture = json!({ "name": "checked", "image": "checked", "filter": "mipmaps", "colour_space": colour_space });
    scene.textures = vec![serde_json::from_value(texture).expect("a texture")];
    scene.images = vec![
        serde_json::from_value(json!({ "name": "checked", "path": "a.png" })).expect("an image"),
    ];
    scene.images[0].data = Some(Arc::new(ImageData {
        width: 2,
        height: 2,
        pixels,
    }));
    scene
}

/// Value in the middle of a white texel at a level.
fn read_at(level: f64) -> f64 {
    1.0 - 0.5 * level.clamp(0.0, 1.0)
}

/// Width of a pixel of the test's view at one metre: 40 degrees high, one pixel.
fn spread() -> f64 {
    2.0 * 20.0_f64.to_radians().tan()
}

/// A use of the image repeated `times` per unit of the coordinates, with the origin in the middle
/// of a white texel.
fn tiled(times: f64) -> Value {
    json!({ "name": "checked", "uv_transform": [[times, 0, 0.25], [0, times, 0.25]] })
}

fn glowing(texture: Value) -> Value {
    classic(json!({ "colour": { "texture": texture }, "ambient": 1 }))
}

const LEVELS: [f64; 7] = [-3.0, -0.1, 0.0, 0.3, 0.75, 1.0, 20.0];

/// Protects: the level on a plane at a known distance and slant, in every precision; colours are
/// averaged linearly.
#[test]
fn the_level_of_a_plane() {
    for (view, width) in [(DOWN, 2.0 * spread()), (SLANTED, 5.0 * spread() / 0.8)] {
        for level in LEVELS {
            // Texels 2^-level times as wide as the spot, two to an image.
            let model = glowing(tiled(2.0_f64.powf(level) / width * 0.5));
            for space in ["srgb", "linear"] {
                let scene = checked(unchecked_floor(&model), space);
                expect_pixel(&scene, view, [read_at(level); 3]);
            }
        }
    }
}

/// The floor without its texture's data.
fn unchecked_floor(model: &Value) -> Scene {
    let mut scene = floor(classic(json!({ "ambient": 1 })), json!({}));
    scene.materials[0].model = serde_json::from_value(model.clone()).expect("a model");
    scene
}

/// Protects: on meshes the level follows the triangle's area in the world and in its coordinates:
/// scaled, mirrored, as instances and for the set that the material reads. Without coordinates the
/// barycentric ones count.
#[test]
fn the_level_of_a_mesh() {
    let triangle = json!([[-8, 0, 8], [24, 0, 8], [-8, 0, -24]]);
    let sets = json!([[[0, 0], [1, 0], [0, 1]], [[-4, -4], [12, -4], [-4, 12]]]);
    let width = 2.0 * spread();
    for (uvs, set, per_metre) in [
        (sets.clone(), 0, 1.0 / 32.0),
        (sets, 1, 0.5),
        (json!([]), 0, 1.0 / 32.0),
    ] {
        for (steps, scale) in [
            (json!([]), 1.0),
            (json!([{ "scale": [2, 2, 2] }]), 2.0),
            (json!([{ "scale": [-4, 1, 1] }]), 2.0),
            (json!([{ "scale": [0.5, 1, 2] }]), 1.0),
        ] {
            for copies in [1, 2] {
                for level in LEVELS {
                    let times = 2.0_f64.powf(level) / width * 0.5 / per_metre * scale;
                    // The middle of a white texel lies below the eye.
                    let at = if set == 1 { 0.0 } else { 0.25 };
                    let offset = 0.25 - times * at;
                    let texture = json!({ "name": "checked", "uv_set": set,
                        "uv_transform": [[times, 0, offset], [0, times, offset]] });
                    let object = json!({ "shape": { "mesh": "leaf" }, "material": "floor", "transform": steps, "side": "both" });
                    let mut scene = checked(unchecked_floor(&glowing(texture)), "linear");
                    let mesh = json!({ "name": "leaf", "source": { "inline": { "positions": triangle, "indices": [[0, 1, 2]], "uvs": uvs } } });
                    scene.meshes = vec![serde_json::from_value(mesh).expect("a mesh")];
                    scene.objects =
                        vec![serde_json::from_value(object).expect("an object"); copies];
                    if copies == 2 {
                        // Outside the view.
                        let away = json!([{ "translate": [100, 0, 0] }]);
                        scene.objects[1].transform =
                            serde_json::from_value(away).expect("a transform");
                    }
                    expect_pixel(&scene, DOWN, [read_at(level); 3]);
                }
            }
        }
    }
}

/// Protects: a mirrored ray has the width of its whole path, and rays of an orthographic camera do
/// not widen.
#[test]
fn the_level_beyond_a_mirror() {
    let mirror = classic(json!({ "local": 0, "reflection": { "weight": 1 } }));
    for level in LEVELS {
        // Two metres down and five up.
        let model = glowing(tiled(2.0_f64.powf(level) / (7.0 * spread()) * 0.5));
        let mut scene = checked(unchecked_floor(&mirror), "linear");
        let ceiling = json!({ "shape": { "plane": { "point": [0, 5, 0], "normal": [0, -1, 0] } }, "material": "ceiling" });
        scene
            .objects
            .push(serde_json::from_value(ceiling).expect("an object"));
        scene.materials.push(
            serde_json::from_value(json!({ "name": "ceiling", "model": model }))
                .expect("a material"),
        );
        expect_pixel(&scene, DOWN, [read_at(level); 3]);

        let scene = checked(
            unchecked_floor(&glowing(tiled(2.0_f64.powf(level) / 3.0 * 0.5))),
            "linear",
        );
        let mut settings = settings(&scene, [[0.0, 500.0, 0.0], [0.0; 3]]);
        let camera = settings.camera.as_mut().expect("a camera");
        camera.projection = Projection::Orthographic { height: 3.0 };
        let Pose::LookAt { .. } = camera.pose else {
            panic!("it looks at the floor")
        };
        let [found, ..] = pixel(&scene, &settings);
        assert!((found - read_at(level)).abs() < 1e-6, "{level}: {found}");
    }
}

/// Protects: a mask reads its alpha without mip maps, so that it has the same coverage from afar as
/// from near: a mean of a half would lie below the cutoff everywhere. With expressions as
/// coordinates the image is read without mip maps too.
#[test]
fn what_is_read_without() {
    let masked = |alpha: &str| {
        let model = physical(
            json!({ "unlit": true, "base_colour": [0.5, 0.25, 1], "alpha": { "mask": { "cutoff": 0.7 } },
            "base_colour_texture": tiled(1.0) }),
        );
        let mut scene = checked(unchecked_floor(&model), "linear");
        let Some(image) = scene.images[0].data.as_mut().map(Arc::make_mut) else {
            panic!("it has pixels")
        };
        let (here, there) = if alpha == "here" { (255, 0) } else { (0, 255) };
        image.pixels = PixelData::Codes(vec![
            [255, 255, 255, here],
            [255, 255, 255, there],
            [255, 255, 255, there],
            [255, 255, 255, here],
        ]);
        scene
    };
    expect_pixel(&masked("here"), SLANTED, [0.5, 0.25, 1.0]);
    expect_pixel(&masked("there"), SLANTED, [0.0; 3]);
    let expressed = json!({ "name": "checked", "uv": ["0.25 + 9*p.x", "0.25 + 9*p.z"] });
    expect_pixel(
        &checked(unchecked_floor(&glowing(expressed)), "linear"),
        DOWN,
        [1.0; 3],
    );
}

/// Protects: the effect is simulated if a texture in use needs it, absent if none does and left out
/// if switched off, with the picture without mip maps; memory is estimated; shadows and several
/// samples render.
#[test]
fn mip_maps_are_an_effect() {
    let mut scene = checked(unchecked_floor(&glowing(tiled(50.0))), "linear");
    let status = |scene: &Scene, settings: &Settings| {
        let report = assess_effects(scene, settings);
        let finding = report
            .effects
            .iter()
            .find(|finding| finding.effect == Effect::MipMaps)
            .expect("it is told");
        (finding.status, finding.source.clone())
    };
    let settings = settings(&scene, SLANTED);
    assert_eq!(
        status(&scene, &settings),
        (
            EffectStatus::Simulated,
            Some("textures[0].filter".to_owned())
        )
    );
    let off = Settings {
        without: EffectSet::from_effects(&[Effect::MipMaps]),
        ..settings.clone()
    };
    assert_eq!(status(&scene, &off).0, EffectStatus::LeftOut);
    assert_eq!(
        (pixel(&scene, &settings), pixel(&scene, &off)),
        ([0.5; 3], [1.0; 3])
    );
    let bytes = |scene: &Scene, settings: &Settings| {
        let ready = prepare(scene, settings, &()).expect("it can be prepared");
        (ready.table_sizes().texture_bytes, ready.memory().textures)
    };
    assert_eq!(
        (bytes(&scene, &settings), bytes(&scene, &off)),
        ((16 + 16, 32), (16, 16))
    );
    scene.textures[0].filter = raywright_core::scene::TextureFilter::Bilinear;
    assert_eq!(status(&scene, &settings).0, EffectStatus::Absent);
    scene
        .lights
        .push(serde_json::from_value(sun([0.0, 1.0, 0.0])).expect("a light"));
    assert!(pixel(&scene, &settings).iter().all(|c| c.is_finite()));
}

/// Protects: for a distant camera, with ray origins near the scene's bounded part, the whole
/// distance counts, to the first hit and beyond a mirror: the level belongs to the eye's distance.
#[test]
fn the_level_from_far_away() {
    const AWAY: f64 = 5000.0;
    let mirror = classic(json!({ "local": 0, "reflection": { "weight": 1 } }));
    let far = |model: &Value, further: Value| {
        let mut scene = checked(unchecked_floor(model), "linear");
        let marker = json!({ "shape": { "sphere": { "centre": [3, 1, 0], "radius": 0.5 } }, "material": "floor" });
        scene
            .objects
            .push(serde_json::from_value(marker).expect("an object"));
        scene
            .objects
            .extend(serde_json::from_value::<Vec<_>>(further["objects"].clone()).expect("objects"));
        scene.materials.extend(
            serde_json::from_value::<Vec<_>>(further["materials"].clone()).expect("materials"),
        );
        scene
    };
    for level in [0.2, 0.5, 0.8] {
        let on_the_way =
            |metres: f64| glowing(tiled(2.0_f64.powf(level) / (metres * spread()) * 0.5));
        let straight = far(&on_the_way(AWAY), json!({ "objects": [], "materials": [] }));
        let shown = json!({ "name": "shown", "model": on_the_way(AWAY + 9000.0) });
        let above = json!({ "shape": { "plane": { "point": [0, 9000, 0], "normal": [0, -1, 0] } }, "material": "shown" });
        let mirrored = far(&mirror, json!({ "objects": [above], "materials": [shown] }));
        for scene in [straight, mirrored] {
            let settings = settings(&scene, [[0.0, AWAY, 0.0], [0.0; 3]]);
            let [found, ..] = pixel(&scene, &settings);
            assert!(
                (found - read_at(level)).abs() < 1e-3,
                "{level}: {found} instead of {}",
                read_at(level)
            );
            let robust = Settings {
                precision: raywright_core::settings::PrecisionChoice::Robust,
                ..settings
            };
            let [found, ..] = pixel(&scene, &robust);
            assert!(
                (found - read_at(level)).abs() < 1e-2,
                "{level}: {found} instead of {}",
                read_at(level)
            );
        }
    }
}

/// Protects: a scene switched to a camera of another field of view filters its textures by that
/// camera's pixels.
#[test]
fn turned_cameras_have_their_own_pixels() {
    let scene = checked(
        unchecked_floor(&glowing(tiled(2.0_f64.powf(0.7) / (2.0 * spread()) * 0.5))),
        "linear",
    );
    let wide = settings(&scene, DOWN);
    let mut camera = wide.camera.clone().expect("a camera");
    let pinhole = raywright_core::scene::Pinhole {
        vertical_fov: Some(30.0),
        ..Default::default()
    };
    camera.projection = Projection::Pinhole(pinhole);
    let anew = pixel(
        &scene,
        &Settings {
            camera: Some(camera.clone()),
            ..wide.clone()
        },
    );
    let mut ready = prepare(&scene, &wide, &()).expect("a small scene");
    assert!(ready.replace_camera(&scene, &camera));
    assert_eq!(ready.render(&()).picture.rgb[0].map(f64::from), anew);
    assert_ne!(pixel(&scene, &wide), anew);
}
