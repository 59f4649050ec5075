//! Mirrors of classic surfaces, and the depth limit of paths.

use raywright_core::Settings;
use serde_json::{Value, json};

use crate::support::{
    DOWN, EyeAndTarget, SLANTED, classic, expect_near, expect_pixel, floor, pixel, render_scene,
    scene, settings, sun,
};

/// Protects: weight and tint of a mirrored ray's radiance.
#[test]
fn a_mirror_shows_the_mirrored_direction() {
    let mirror = |reflection: Value| {
        floor(
            classic(json!({ "local": 0, "colour": [0.5, 0.25, 1], "reflection": reflection })),
            json!({ "sky": { "expression": "1 + d" } }),
        )
    };
    // 1 + r = (0.4, 1.8, 1).
    expect_pixel(
        &mirror(json!({ "weight": 0.5 })),
        SLANTED,
        [0.1, 0.225, 0.5],
    );
    expect_pixel(
        &mirror(json!({ "weight": 0.5, "tinted": false })),
        SLANTED,
        [0.2, 0.9, 0.5],
    );
    expect_pixel(
        &mirror(json!({ "weight": "1 + dot(d, n)", "tinted": false })),
        SLANTED,
        [0.08, 0.36, 0.2],
    );
}

/// Protects: fuzz disturbs a reflection by its rows: direction = unit(mirror + amount · w) with w_i
/// = sin(row i · p).
#[test]
fn fuzz_disturbs_by_its_rows() {
    use core::f64::consts::PI;
    let fuzz = json!({ "amount": 0.5, "frequencies": [[PI, 0, 0], [0, 0, 0], [PI / 3.0, 0, 0]] });
    let mirror = classic(json!({ "local": 0, "reflection": { "weight": 1, "fuzz": fuzz } }));
    let length = f64::sqrt(0.25 + 1.0 + 0.0625);
    let view: EyeAndTarget = [[0.5, 2.0, 0.0], [0.5, 0.0, 0.0]];
    expect_pixel(
        &floor(mirror, json!({ "sky": { "expression": "d" } })),
        view,
        [0.5 / length, 1.0 / length, 0.25 / length],
    );
}

/// Protects: a reflection's weight reads the first light's direction and shadow, not the last
/// one's.
#[test]
fn a_weight_finds_the_first_light() {
    let terms = json!({ "diffuse": 0.5, "reflection": { "weight": "l.y*shadow" } });
    let parts = json!({ "lights": [sun([3.0, 4.0, 0.0]), sun([0.0, 1.0, 0.0])], "sky": { "constant": [1, 0.5, 0] } });
    expect_pixel(
        &floor(classic(terms), parts),
        SLANTED,
        [0.9 + 0.8, 0.9 + 0.4, 0.9],
    );
}

/// A floor and a ceiling that mirror each other.
fn corridor(terms: Value, rules: Value) -> raywright_core::Scene {
    let plane = |y: f64, up: f64| json!({ "shape": { "plane": { "point": [0, y, 0], "normal": [0, up, 0] } }, "material": "mirror" });
    scene(
        json!({ "classic": rules, "objects": [plane(0.0, 1.0), plane(4.0, -1.0)],
        "materials": [{ "name": "mirror", "model": { "classic": terms } }] }),
    )
}

/// Protects: the depth counts segments, the camera ray included; a reflection at the last segment
/// is dropped.
#[test]
fn paths_have_as_many_segments_as_they_may() {
    let scene = corridor(
        json!({ "local": 0, "emission": 1, "reflection": { "weight": 0.5 } }),
        json!({}),
    );
    for (max_depth, expected) in [(1, 1.0), (2, 1.5), (3, 1.75), (6, 1.96875)] {
        let rendered = render_scene(
            &scene,
            &Settings {
                max_depth,
                ..settings(&scene, DOWN)
            },
        );
        expect_near(
            rendered.picture.rgb[0].map(f64::from),
            [expected; 3],
            1e-6,
            &format!("depth {max_depth}"),
        );
        let counters = rendered.counters;
        assert_eq!(
            (counters.camera, counters.reflection, counters.refraction),
            (1, u64::from(max_depth) - 1, 0)
        );
    }
}

/// Protects: with `local_only` the last segment shows the local term with weight one, also of
/// purely reflective surfaces.
#[test]
fn the_last_segment_may_show_the_local_term() {
    let rules = json!({ "ambient": 1, "depth_limit": "local_only" });
    let scene = corridor(
        json!({ "local": 0.25, "emission": 2, "reflection": { "weight": 0.5 } }),
        rules,
    );
    for (max_depth, expected) in [
        (1, 3.0),
        (2, 2.25 + 0.5 * 3.0),
        (3, 2.25 + 0.5 * 2.25 + 0.25 * 3.0),
    ] {
        expect_near(
            pixel(
                &scene,
                &Settings {
                    max_depth,
                    ..settings(&scene, DOWN)
                },
            ),
            [expected; 3],
            1e-6,
            &format!("depth {max_depth}"),
        );
    }
    // A non-reflective surface keeps its weight.
    let matte = corridor(
        json!({ "local": 0.25 }),
        json!({ "ambient": 1, "depth_limit": "local_only" }),
    );
    expect_near(
        pixel(
            &matte,
            &Settings {
                max_depth: 1,
                ..settings(&matte, DOWN)
            },
        ),
        [0.25; 3],
        1e-6,
        "matte",
    );
}
