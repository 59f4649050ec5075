//! Sky light on physical materials: its mean on matte ones, its mirror image on smooth ones, and
//! transmission.

use raywright_core::{Scene, Settings};
use serde_json::{Value, json};

use crate::support::{
    DOWN, SLANTED, expect_pixel, expect_pixel_within, floor, physical, pixel, render_scene, scene,
    settings,
};

fn under(terms: Value, sky: &str) -> Scene {
    floor(physical(terms), json!({ "sky": { "expression": sky } }))
}

/// Karis's fit (2014) of the reflectance under uniform light, as published: scale and offset of F0.
fn karis(roughness: f64, cosine: f64) -> (f64, f64) {
    let c0 = [-1.0, -0.0275, -0.572, 0.022];
    let c1 = [1.0, 0.0425, 1.04, -0.04];
    let r: [f64; 4] = core::array::from_fn(|i| roughness * c0[i] + c1[i]);
    let a004 = (r[0] * r[0]).min(f64::exp2(-9.28 * cosine)) * r[0] + r[1];
    (-1.04 * a004 + r[2], 1.04 * a004 + r[3])
}

/// Protects: a white furnace stays white: a matte surface reflects diffusely all that it does not
/// mirror, and a mirror neither adds the sky's mean to its image nor loses more than the fit's
/// error.
#[test]
fn a_white_furnace_stays_white() {
    for view in [DOWN, SLANTED] {
        for roughness in [0.1, 0.5, 1.0] {
            expect_pixel_within(
                &under(json!({ "roughness": roughness }), "1"),
                view,
                [1.0; 3],
                1e-4,
            );
        }
        for roughness in [0.0, 0.05] {
            expect_pixel_within(
                &under(json!({ "roughness": roughness }), "1"),
                view,
                [0.9945; 3],
                0.0055,
            );
            expect_pixel_within(
                &under(json!({ "roughness": roughness, "metallic": 1 }), "1"),
                view,
                [1.0; 3],
                1e-5,
            );
        }
    }
}

/// Protects: the share of the sky's mean that a rough surface mirrors: (0.4524, −0.0024) for the
/// roughest at normal incidence, and the published fit elsewhere.
#[test]
fn rough_surfaces_mirror_the_average() {
    expect_pixel_within(
        &under(json!({ "metallic": 1, "roughness": 1 }), "1"),
        DOWN,
        [0.45; 3],
        1e-4,
    );
    for (view, cosine) in [
        (DOWN, 1.0),
        (SLANTED, 0.8),
        ([[4.0, 3.0, 0.0], [0.0; 3]], 0.6),
        ([[12.0, 3.5, 0.0], [0.0; 3]], 0.28),
    ] {
        for roughness in [0.1, 0.5, 1.0] {
            let (scale, offset) = karis(roughness, cosine);
            let terms = |metallic: f64| json!({ "base_colour": [0.75, 0.5, 0], "metallic": metallic, "roughness": roughness });
            let expected = [0.75, 0.5, 0.0].map(|f0| (f0 * scale + offset).max(0.0));
            expect_pixel_within(&under(terms(1.0), "1"), view, expected, 2e-4);
            let mirrored = 0.04 * scale + offset;
            expect_pixel_within(
                &under(terms(0.0), "1"),
                view,
                [0.75, 0.5, 0.0].map(|base| base * (1.0 - mirrored) + mirrored),
                2e-4,
            );
        }
    }
}

/// Protects: all nine harmonics of the sky's mean, against the closed forms of skies up to degree
/// two: 2/3 of a linear part, 1/4 of a quadratic one of mean zero. Viewed along its normal, a white
/// matte surface shows the sky's mean.
#[test]
fn the_average_has_its_closed_forms() {
    let n = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    let [x, y, z] = n;
    for (sky, expected) in [
        ("1 + d.x", 1.0 + 2.0 / 3.0 * x),
        ("1 + d.y", 1.0 + 2.0 / 3.0 * y),
        ("1 + d.z", 1.0 + 2.0 / 3.0 * z),
        ("1 + d.x*d.y", 1.0 + 0.25 * x * y),
        ("1 + d.y*d.z", 1.0 + 0.25 * y * z),
        ("1 + d.x*d.z", 1.0 + 0.25 * x * z),
        ("d.z*d.z", 1.0 / 3.0 + 0.25 * (z * z - 1.0 / 3.0)),
        ("1 + d.x*d.x - d.y*d.y", 1.0 + 0.25 * (x * x - y * y)),
    ] {
        let plane = json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": n } }, "material": "white" });
        let scene = scene(json!({ "sky": { "expression": sky }, "objects": [plane],
            "materials": [{ "name": "white", "model": physical(json!({})) }] }));
        let found = pixel(&scene, &settings(&scene, [[2.0, 3.0, 6.0], [0.0; 3]]))[0];
        assert!(
            (found - expected).abs() < 2e-4,
            "{sky}: {found} instead of {expected}"
        );
    }
}

/// Protects: a rough surface mirrors the sky's mean about the mirror direction: 1 + 2/3 · r.x.
#[test]
fn the_mirrored_average_is_about_the_mirrored_direction() {
    let (scale, offset) = karis(0.5, 0.8);
    let terms = json!({ "base_colour": 0.5, "metallic": 1, "roughness": 0.5 });
    expect_pixel_within(
        &under(terms, "1 + d.x"),
        SLANTED,
        [(0.5 * scale + offset) * (1.0 - 0.4); 3],
        2e-4,
    );
}

/// Protects: a smooth metal mirrors by Schlick's F of its base colour, if its roughness is a
/// mirror's and segments remain.
#[test]
fn smooth_metals_mirror_the_sky() {
    let metal = |roughness: f64| {
        under(
            json!({ "base_colour": [1, 0.5, 0.25], "metallic": 1, "roughness": roughness }),
            "1 + d",
        )
    };
    let f = |base: f64| base + (1.0 - base) * 0.2_f64.powi(5);
    expect_pixel(&metal(0.05), SLANTED, [0.4 * f(1.0), 1.8 * f(0.5), f(0.25)]);
    let reflections = |roughness: f64, max_depth: u32| {
        let scene = metal(roughness);
        render_scene(
            &scene,
            &Settings {
                max_depth,
                ..settings(&scene, SLANTED)
            },
        )
        .counters
        .reflection
    };
    assert_eq!(
        (
            reflections(0.05, 2),
            reflections(0.0501, 2),
            reflections(0.05, 1)
        ),
        (1, 0, 0)
    );
}

/// Protects: a clear material mirrors 4 % at normal incidence and transmits the rest times its base
/// colour and its transmission; the remainder is diffuse, and a metal transmits nothing.
#[test]
fn clear_materials_transmit() {
    let terms = |transmission: f64, metallic: f64| json!({ "base_colour": [1, 0.5, 0.25], "transmission": transmission, "metallic": metallic, "roughness": 0 });
    let base = [1.0, 0.5, 0.25];
    expect_pixel_within(
        &under(terms(1.0, 0.0), "1"),
        DOWN,
        base.map(|b| 0.04 + 0.96 * b),
        1e-6,
    );
    let (scale, offset) = karis(0.0, 1.0);
    let diffused = |f0: f64| 1.0 - (f0 * scale + offset);
    let half = |b: f64| 0.04 + 0.96 * 0.5 * b + 0.5 * b * diffused(0.04);
    expect_pixel_within(&under(terms(0.5, 0.0), "1"), DOWN, base.map(half), 1e-4);
    // Half a metal: half of the light hits glass, without a diffuse part, and Whitted's integrator
    // continues through glass alone.
    let mixed = |b: f64| 0.5 * (0.04 + 0.96 * b);
    expect_pixel_within(&under(terms(1.0, 0.5), "1"), DOWN, base.map(mixed), 1e-4);
    expect_pixel_within(&under(terms(1.0, 1.0), "1"), DOWN, base, 1e-5);
}

/// Protects: without a sky there is no sky light, and classic materials receive none.
#[test]
fn no_sky_light_without_a_sky() {
    expect_pixel(&floor(physical(json!({})), json!({})), DOWN, [0.0; 3]);
    expect_pixel(
        &floor(
            crate::support::classic(json!({})),
            json!({ "sky": { "constant": 1 } }),
        ),
        DOWN,
        [0.0; 3],
    );
}
