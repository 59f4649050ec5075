//! Skies and backgrounds of rays that hit nothing.

use std::sync::Arc;

use raywright_core::Settings;
use raywright_core::scene::{Image, ImageData, PixelData, Scene, Sky, SkyMap};
use raywright_core::settings::Background;
use serde_json::{Value, json};

use crate::support::{
    DOWN, EyeAndTarget, classic, expect_near, expect_pixel, floor, pixel, render_scene, scene,
    settings,
};

fn view_towards(d: [f64; 3]) -> EyeAndTarget {
    [[1.0, 2.0, 3.0], [1.0 + d[0], 2.0 + d[1], 3.0 + d[2]]]
}

fn sky(sky: Value) -> Scene {
    scene(json!({ "sky": sky }))
}

/// Protects: a missing sky is black; a constant sky, and an expression of the ray's direction and
/// origin.
#[test]
fn plain_skies() {
    expect_pixel(&scene(json!({})), view_towards([1.0, 0.0, 0.0]), [0.0; 3]);
    expect_pixel(
        &sky(json!({ "constant": [1, 0.5, 0.25] })),
        view_towards([1.0, 0.0, 0.0]),
        [1.0, 0.5, 0.25],
    );
    expect_pixel(
        &sky(json!({ "expression": "o + d" })),
        view_towards([0.6, -0.8, 0.0]),
        [1.6, 1.2, 3.0],
    );
}

/// Protects: a gradient is linear in height from bottom to top, and suns of weight · colour ·
/// cosine^exponent add up, on their side only.
#[test]
fn gradients_with_suns() {
    let gradient = |suns: Value| {
        sky(json!({ "gradient": { "bottom": [1, 0, 0], "top": [0, 1, 0], "suns": suns } }))
    };
    let plain = gradient(json!([]));
    expect_pixel(&plain, view_towards([0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]);
    expect_pixel(&plain, view_towards([0.0, -1.0, 0.0]), [1.0, 0.0, 0.0]);
    expect_pixel(&plain, view_towards([0.8, 0.6, 0.0]), [0.2, 0.8, 0.0]);
    let suns = json!([{ "direction": [4, 0, 0], "colour": [1, 0.5, 2], "weight": 0.5, "exponent": 2 },
                      { "direction": [0, 0, -1], "colour": 1, "weight": 7, "exponent": 1 }]);
    expect_pixel(
        &gradient(suns.clone()),
        view_towards([0.8, 0.6, 0.0]),
        [0.2 + 0.32, 0.8 + 0.16, 0.64],
    );
    expect_pixel(
        &gradient(suns),
        view_towards([-0.8, 0.0, -0.6]),
        [0.5 + 4.2, 0.5 + 4.2, 4.2],
    );
}

/// A sky of four columns and two rows; each texel holds its column in red and its row in green.
fn map(rotation: f64, strength: f64) -> Scene {
    let pixels = (0..8_u8)
        .map(|i| [f32::from(i % 4), f32::from(i / 4), 0.5, 1.0])
        .collect();
    let data = Arc::new(ImageData {
        width: 4,
        height: 2,
        pixels: PixelData::Linear(pixels),
    });
    Scene {
        images: vec![Image {
            name: "round".to_owned(),
            path: "round.exr".to_owned(),
            data: Some(data),
            mended: 0,
        }],
        sky: Some(Sky::Map(SkyMap {
            image: "round".to_owned(),
            rotation,
            strength,
        })),
        ..Scene::default()
    }
}

/// Protects: u runs from −x over −z, +x and +z, so that an image is unmirrored from inside, and v
/// runs down; a rotation of 90° moves −z to +x; filtering crosses the seam; the strength
/// multiplies.
#[test]
fn maps_lie_as_documented() {
    let high = f64::sqrt(2.0);
    for (column, [x, z]) in [
        (0.0, [-1.0, -1.0]),
        (1.0, [1.0, -1.0]),
        (2.0, [1.0, 1.0]),
        (3.0, [-1.0, 1.0]),
    ] {
        expect_near(
            pixel(
                &map(0.0, 1.0),
                &settings(&map(0.0, 1.0), view_towards([x, high, z])),
            ),
            [column, 0.0, 0.5],
            1e-6,
            "upper",
        );
        expect_near(
            pixel(
                &map(0.0, 2.0),
                &settings(&map(0.0, 2.0), view_towards([x, -high, z])),
            ),
            [2.0 * column, 2.0, 1.0],
            1e-6,
            "lower",
        );
        let turned = map(90.0, 1.0);
        expect_near(
            pixel(&turned, &settings(&turned, view_towards([-z, high, x]))),
            [column, 0.0, 0.5],
            1e-6,
            "turned",
        );
    }
    let scene = map(0.0, 1.0);
    expect_near(
        pixel(&scene, &settings(&scene, view_towards([-1.0, 0.0, 0.0]))),
        [1.5, 0.5, 0.5],
        1e-6,
        "seam",
    );
    expect_near(
        pixel(&scene, &settings(&scene, view_towards([0.0, 0.0, 1.0]))),
        [2.5, 0.5, 0.5],
        1e-6,
        "between",
    );
}

/// Protects: a background replaces the sky for camera rays only, and a transparent one is black
/// with alpha 0.
#[test]
fn backgrounds_hide_the_sky_from_the_camera() {
    let scene = floor(
        classic(json!({ "local": 0, "reflection": { "weight": 1 } })),
        json!({ "sky": { "constant": [0, 1, 0] } }),
    );
    let up: EyeAndTarget = [[0.0, 2.0, 0.0], [0.0, 3.0, 0.0]];
    for (view, rgb, alpha) in [(up, [0.0; 3], 0.0), (DOWN, [0.0, 1.0, 0.0], 1.0)] {
        let settings = Settings {
            background: Background::Transparent,
            ..settings(&scene, view)
        };
        let picture = render_scene(&scene, &settings).picture;
        let behind = picture.composite_over([0.25, 0.5, 0.75]).rgb[0].map(f64::from);
        assert_eq!((picture.rgb[0], picture.alpha), (rgb, Some(vec![alpha])));
        expect_near(
            behind,
            if alpha > 0.0 {
                [0.0, 1.0, 0.0]
            } else {
                [0.25, 0.5, 0.75]
            },
            1e-6,
            "before a colour",
        );
    }
    assert_eq!(
        render_scene(&scene, &settings(&scene, up)).picture.alpha,
        None
    );
}
