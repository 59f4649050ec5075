//! Lamps of varying emission are sampled like uniform ones; samples may be clamped, and paths
//! unlimited: against closed forms, and strategies of light sampling against each other.

use core::f64::consts::PI;
use std::sync::Arc;

use raywright_core::Settings;
use raywright_core::scene::{ImageData, PixelData, Scene};
use raywright_core::settings::LightSampling;
use serde_json::{Value, json};

use crate::paths::{AT, expect_pixels, mean_radiance, paths};
use crate::support::{EyeAndTarget, ball, classic, floor, physical, render_scene, scene, settings};

const WAYS: [LightSampling; 3] = [
    LightSampling::Scattering,
    LightSampling::Lights,
    LightSampling::Both,
];

/// Asserts that all strategies of light sampling agree within three and a half combined standard
/// errors.
#[track_caller]
fn agree(scene: &Scene, depth: u32, label: &str) -> [f64; 3] {
    let [(a, sa), (b, sb), (both, sc)] = WAYS.map(|light_sampling| {
        mean_radiance(
            scene,
            &Settings {
                light_sampling,
                ..paths(scene, AT, depth)
            },
        )
    });
    for k in 0..3 {
        for (one, error) in [(a[k], sa[k]), (b[k], sb[k])] {
            let allowed = 3.5 * (error * error + sc[k] * sc[k]).sqrt() + 1e-9;
            assert!(
                (one - both[k]).abs() <= allowed,
                "{label}: {a:?} ± {sa:?}, {b:?} ± {sb:?}, {both:?} ± {sc:?}"
            );
        }
    }
    assert!(
        (0..3).all(|k| sc[k] <= 0.02 * both[k] + 1e-9),
        "{label}: too noisy to tell: {both:?} ± {sc:?}"
    );
    both
}

/// A black emissive screen two metres above a floor: a mesh of two triangles with two by two
/// texels, three dark and one bright.
fn screen(size: f64, texture: Value) -> Scene {
    let mut model = json!({ "base_colour": 0, "roughness": 1, "specular": 0, "emission": 5 });
    model["emission_texture"] = texture;
    let h = size / 2.0;
    let mut scene = floor(
        classic(json!({ "colour": 0.6 })),
        json!({ "materials": [{ "name": "screen", "model": physical(model) }],
            "images": [{ "name": "i", "path": "i.exr" }],
            "textures": [{ "name": "t", "image": "i", "filter": "nearest", "colour_space": "linear", "wrap_u": "clamp", "wrap_v": "clamp" }],
            "meshes": [{ "name": "m", "source": { "inline": { "positions": [[-h, 2, -h], [h, 2, -h], [h, 2, h], [-h, 2, h]],
                "uvs": [[[0, 0], [1, 0], [1, 1], [0, 1]]], "indices": [[0, 1, 2], [0, 2, 3]] } } }],
            "objects": [{ "shape": { "mesh": "m" }, "material": "screen" }] }),
    );
    let texels = vec![
        [0.0, 0.0, 0.0, 1.0],
        [1.0, 0.5, 0.25, 1.0],
        [0.0, 0.0, 0.0, 1.0],
        [0.1, 0.0, 0.0, 1.0],
    ];
    scene.images[0].data = Some(Arc::new(ImageData {
        width: 2,
        height: 2,
        pixels: PixelData::Linear(texels),
    }));
    scene
}

/// Protects: lamps of varying emission, by expressions of position and coordinates and by checkers,
/// on transformed and untransformed shapes, with alpha: light sampling and scattering agree,
/// whatever a lamp's mean.
#[test]
fn lamps_that_vary() {
    let shapes = [
        json!({ "quad": { "corner": [-1, 2, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2] } }),
        json!({ "disk": { "centre": [0.5, 1.5, 0], "normal": [0.2, -1, 0], "radius": 1 } }),
        json!({ "sphere": { "centre": [0.5, 1.5, -0.2], "radius": 0.6 } }),
        json!({ "box": { "min": [-0.5, 1, -0.5], "max": [0.5, 1.4, 0.5] } }),
        json!({ "torus": { "centre": [0, 1.5, 0], "axis": [0, 1, 0], "major_radius": 0.7, "minor_radius": 0.2 } }),
    ];
    for shape in shapes {
        for emission in [
            json!("3 + 3*sin(9*p.x)"),
            json!("8*smoothstep(0.4, 0.6, u)"),
            json!({ "checker": { "even": 6, "odd": [0, 1, 2], "size": 0.3 } }),
        ] {
            for turned in [false, true] {
                let material = json!({ "name": "lamp", "model": { "classic": { "local": 0, "emission": emission } } });
                let mut object = json!({ "shape": shape, "material": "lamp" });
                if turned {
                    object["transform"] = json!([{ "rotate": { "axis": [0, 0, 1], "degrees": 10 } }, { "scale": [1, 0.8, 1.1] }]);
                }
                let found = floor(
                    classic(json!({ "colour": 0.6 })),
                    json!({ "materials": [material], "objects": [object] }),
                );
                agree(&found, 2, &format!("{shape} {emission} {turned}"));
            }
        }
    }
    let faded = json!({ "name": "lamp", "model": physical(json!({ "base_colour": 0, "specular": 0, "emission": 4, "alpha": "blend", "opacity": 0.3 })) });
    let found = floor(
        classic(json!({ "colour": 0.6 })),
        json!({ "materials": [faded], "objects": [ball([0.0, 2.0, 0.0], 0.8, "lamp")] }),
    );
    // A ray through the ball hits it twice: 1 − 0.7² of its emission.
    let actual = agree(&found, 2, "a faded ball");
    let expected = 0.6 * 4.0 * (1.0 - 0.49) * 0.64 / 4.0;
    assert!(
        (actual[0] - expected).abs() < 0.02 * expected,
        "{actual:?} instead of {expected}"
    );
}

/// Protects: a screen with an image lights a floor by the emission of each part and its form
/// factor, and by light sampling, since scattering alone would be much noisier.
#[test]
fn a_screen() {
    for (size, uv) in [
        (2.0, json!({})),
        (0.2, json!({})),
        (0.2, json!({ "uv_transform": [[0.5, 0, 0.5], [0, 0.5, 0]] })),
    ] {
        let mut texture = uv;
        texture["name"] = json!("t");
        let found = screen(size, texture);
        let both = agree_small(&found);
        assert!(
            both[0] > 0.0 && both[0] > both[1] && both[1] > both[2],
            "{both:?}"
        );
    }
    // Small enough to be a point: E = L·A/d² of the mean of its texels.
    let found = screen(0.05, json!({ "name": "t" }));
    let (actual, error) = mean_radiance(
        &found,
        &Settings {
            light_sampling: LightSampling::Lights,
            ..paths(&found, AT, 2)
        },
    );
    for (k, texels) in [1.1, 0.5, 0.25].into_iter().enumerate() {
        let expected = 0.6 / PI * 5.0 * texels / 4.0 * 0.0025 / 4.0;
        assert!(
            (actual[k] - expected).abs() <= 3.0 * error[k] + 0.003 * expected,
            "{actual:?} instead of {expected} in {k}"
        );
        assert!(error[k] < 0.05 * expected, "{error:?} of {expected}");
    }
}

/// [`agree`] for lamps so small that scattering alone is very noisy.
fn agree_small(scene: &Scene) -> [f64; 3] {
    let [(a, sa), (b, sb), (both, sc)] = WAYS.map(|light_sampling| {
        mean_radiance(
            scene,
            &Settings {
                light_sampling,
                ..paths(scene, AT, 2)
            },
        )
    });
    for k in 0..3 {
        for (one, error) in [(a[k], sa[k]), (b[k], sb[k])] {
            let allowed = 3.5 * (error * error + sc[k] * sc[k]).sqrt() + 1e-9;
            assert!(
                (one - both[k]).abs() <= allowed,
                "{a:?} ± {sa:?}, {b:?} ± {sb:?}, {both:?} ± {sc:?}"
            );
        }
    }
    both
}

/// Protects: unlimited paths give the whole sum e/(1 − a) of a closed room, even a long one; and a
/// white room, whose sum is infinite, ends.
#[test]
fn paths_without_limit() {
    let room = |albedo: Value| {
        let wall = classic(json!({ "colour": albedo, "emission": 0.5 }));
        let mut room = ball([0.0; 3], 2.0, "wall");
        room["side"] = json!("inside");
        scene(json!({ "materials": [{ "name": "wall", "model": wall }], "objects": [room] }))
    };
    let view: EyeAndTarget = [[0.5, 0.2, 0.3], [0.0, 0.0, -1.0]];
    let albedo = [0.5, 0.8, 0.97];
    expect_pixels(
        &room(json!(albedo)),
        view,
        Settings::UNLIMITED,
        albedo.map(|a: f64| 0.5 / (1.0 - a)),
        "without limit",
    );
    let white = room(json!(1));
    let (actual, _) = mean_radiance(&white, &paths(&white, view, Settings::UNLIMITED));
    // At least the 64 segments before which no path ends.
    assert!(actual[0] > 30.0 && actual[0].is_finite(), "{actual:?}");
    // Dividing rays keep their limit: 2⁶³ of them would be too many, so this scene has a single
    // continuation.
    let mirror = classic(
        json!({ "local": 0, "reflection": { "weight": 1, "tinted": false }, "emission": 0.25 }),
    );
    let mut object = ball([0.0; 3], 2.0, "wall");
    object["side"] = json!("inside");
    let found =
        scene(json!({ "materials": [{ "name": "wall", "model": mirror }], "objects": [object] }));
    let whitted = |max_depth: u32| {
        render_scene(
            &found,
            &Settings {
                max_depth,
                ..settings(&found, view)
            },
        )
        .picture
        .rgb
    };
    assert_eq!(whitted(Settings::UNLIMITED), whitted(64));
}

/// Protects: a clamp dims brighter samples in their hue, leaves the others unchanged, and has no
/// effect if unset.
#[test]
fn clamped_samples() {
    let value_of = |radiance: f64, clamp: Option<f64>| {
        let material = json!({ "name": "lamp", "model": { "classic": { "local": 0, "emission": [radiance, radiance / 2.0, radiance / 4.0] } } });
        let found =
            scene(json!({ "materials": [material], "objects": [ball([0.0; 3], 1.0, "lamp")] }));
        let view: EyeAndTarget = [[0.0, 0.0, 4.0], [0.0, 0.0, 0.0]];
        mean_radiance(
            &found,
            &Settings {
                clamp,
                ..paths(&found, view, 1)
            },
        )
        .0
    };
    assert_eq!(value_of(8.0, None), [8.0, 4.0, 2.0]);
    assert_eq!(value_of(8.0, Some(2.0)), [2.0, 1.0, 0.5]);
    assert_eq!(value_of(1.0, Some(2.0)), [1.0, 0.5, 0.25]);
}
