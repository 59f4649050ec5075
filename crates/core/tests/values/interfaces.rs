//! Refraction and reflection of glass at one interface.

use serde_json::{Value, json};

use crate::support::{
    DOWN, EyeAndTarget, FROM_BELOW, SLANTED, classic, expect_pixel, floor, physical, render_scene,
    scene, settings,
};
use raywright_core::{Scene, Settings};

/// A floor of glass, with its inside below, under a sky that encodes directions as colours.
fn glass(transmission: Value, face_viewer: bool) -> Scene {
    let mut scene = floor(
        classic(json!({ "local": 0, "transmission": transmission })),
        json!({ "sky": { "expression": "2 + d" } }),
    );
    scene.objects[0].face_viewer = face_viewer;
    scene
}

fn switch(threshold: f64) -> Value {
    json!({ "ior": 1.5, "choice": { "switch": { "threshold": threshold } }, "refracted_tint": [0.5, 1, 2], "reflected_tint": [2, 1, 0.5] })
}

/// Protects: Snell's law from both sides, total reflection, and the tint of either ray, also if the
/// normal is not flipped.
#[test]
fn rays_bend_by_the_sines() {
    let within = f64::sqrt(1.0 - 0.16);
    let out = f64::sqrt(1.0 - 0.81);
    let flat: EyeAndTarget = [[4.0, -3.0, 0.0], [0.0; 3]];
    for face_viewer in [true, false] {
        let glass = glass(switch(0.5), face_viewer);
        expect_pixel(&glass, SLANTED, [0.5 * (2.0 - 0.4), 2.0 - within, 4.0]);
        expect_pixel(&glass, FROM_BELOW, [0.5 * (2.0 - 0.9), 2.0 + out, 4.0]);
        // sin = 0.8 · 1.5 > 1.
        expect_pixel(&glass, flat, [2.0 * (2.0 - 0.8), 2.0 - 0.6, 1.0]);
    }
}

/// Protects: the switch uses Schlick's reflectance at the incident angle: 0.04 + 0.96 · 0.2⁵ =
/// 0.0403072.
#[test]
fn the_switch_is_schlicks_reflectance() {
    expect_pixel(
        &glass(switch(0.0403), true),
        SLANTED,
        [2.0 * (2.0 - 0.6), 2.0 + 0.8, 1.0],
    );
    expect_pixel(
        &glass(switch(0.04031), true),
        SLANTED,
        [0.5 * (2.0 - 0.4), 2.0 - f64::sqrt(0.84), 4.0],
    );
    expect_pixel(
        &glass(switch(0.0403), true),
        FROM_BELOW,
        [2.0 * (2.0 - 0.6), 2.0 - 0.8, 1.0],
    );
    expect_pixel(
        &glass(switch(0.04031), true),
        FROM_BELOW,
        [0.5 * (2.0 - 0.9), 2.0 + f64::sqrt(0.19), 4.0],
    );
}

/// Fresnel's reflectance in its textbook form, from index n1 at cosine c1 to index n2 at cosine c2.
fn reflectance(n1: f64, c1: f64, n2: f64, c2: f64) -> f64 {
    let s = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2);
    let p = (n2 * c1 - n1 * c2) / (n2 * c1 + n1 * c2);
    0.5 * (s * s + p * p)
}

/// Protects: both rays divide the light by Fresnel's equations, from either side, each with its
/// tint.
#[test]
fn both_rays_share_by_fresnel() {
    let split = json!({ "ior": 1.5, "refracted_tint": [0.5, 1, 2], "reflected_tint": [2, 1, 0.5] });
    let (within, out) = (f64::sqrt(0.84), f64::sqrt(0.19));
    for face_viewer in [true, false] {
        let glass = glass(split.clone(), face_viewer);
        let f = reflectance(1.0, 0.8, 1.5, within);
        assert!((f - 0.043_894).abs() < 1e-5);
        let g = 1.0 - f;
        expect_pixel(
            &glass,
            SLANTED,
            [
                f * 2.0 * 1.4 + g * 0.5 * 1.6,
                f * 2.8 + g * (2.0 - within),
                f + g * 4.0,
            ],
        );
        let f = reflectance(1.5, 0.8, 1.0, out);
        let g = 1.0 - f;
        expect_pixel(
            &glass,
            FROM_BELOW,
            [
                f * 2.0 * 1.4 + g * 0.5 * 1.1,
                f * 1.2 + g * (2.0 + out),
                f + g * 4.0,
            ],
        );
    }
}

/// Protects: the traced segments of a slab at each depth, with their weights at normal incidence (4
/// % reflection) and the number of rays of each kind.
#[test]
fn a_slab_is_followed_as_deep_as_allowed() {
    let face = |y: f64, up: f64| json!({ "shape": { "plane": { "point": [0, y, 0], "normal": [0, up, 0] } }, "material": "glass" });
    let slab = scene(
        json!({ "sky": { "constant": 1 }, "objects": [face(0.0, 1.0), face(-1.0, -1.0)],
        "materials": [{ "name": "glass", "model": { "classic": { "local": 0, "transmission": { "ior": 1.5 } } } }] }),
    );
    for (max_depth, expected, reflection, refraction) in [
        (1, 0.0, 0, 0),
        (2, 0.04, 1, 1),
        (3, 0.04 + 0.9216, 2, 2),
        (4, 0.04 + 0.9216 + 0.9216 * 0.04, 3, 3),
    ] {
        let rendered = render_scene(
            &slab,
            &Settings {
                max_depth,
                ..settings(&slab, DOWN)
            },
        );
        let found = f64::from(rendered.picture.rgb[0][1]);
        assert!(
            (found - expected).abs() < 1e-6,
            "depth {max_depth}: {found} instead of {expected}"
        );
        let counters = rendered.counters;
        assert_eq!(
            (counters.reflection, counters.refraction, counters.shadow),
            (reflection, refraction, 0),
            "depth {max_depth}"
        );
    }
}

/// Protects: physical glass reflects and refracts by Fresnel's equations from outside and from
/// inside, with the transmission in the base colour; beyond the critical angle all light is
/// reflected. The same if the normal is flipped or not.
#[test]
fn physical_glass_has_two_sides() {
    for face_viewer in [true, false] {
        let glass =
            json!({ "base_colour": [0.5, 1, 0.25], "transmission": 1, "roughness": 0, "ior": 1.5 });
        let mut scene = floor(physical(glass), json!({ "sky": { "expression": "2 + d" } }));
        scene.objects[0].face_viewer = face_viewer;
        let f = reflectance(1.0, 0.8, 1.5, f64::sqrt(0.84));
        let g = 1.0 - f;
        expect_pixel(
            &scene,
            SLANTED,
            [
                f * 1.4 + g * 0.5 * 1.6,
                f * 2.8 + g * (2.0 - f64::sqrt(0.84)),
                f * 2.0 + g * 0.5,
            ],
        );
        let f = reflectance(1.5, 0.8, 1.0, f64::sqrt(0.19));
        let g = 1.0 - f;
        expect_pixel(
            &scene,
            FROM_BELOW,
            [
                f * 1.4 + g * 0.5 * 1.1,
                f * 1.2 + g * (2.0 + f64::sqrt(0.19)),
                f * 2.0 + g * 0.5,
            ],
        );
        expect_pixel(
            &scene,
            [[4.0, -3.0, 0.0], [0.0; 3]],
            [2.0 - 0.8, 2.0 - 0.6, 2.0],
        );
    }
}
