//! Constant ray offsets of documented shaders: ray origins and least distances, seen in the origin
//! of rays that reach the sky.

use serde_json::{Value, json};

use crate::support::{FROM_BELOW, SLANTED, ball, classic, expect_pixel, floor, physical};

fn constant(rest: Value) -> Value {
    let mut fields = json!({ "offset": 0.5 });
    fields
        .as_object_mut()
        .expect("a table")
        .extend(rest.as_object().expect("a table").clone());
    json!({ "spawn": { "constant": fields } })
}

fn shown(terms: Value, rules: Value) -> raywright_core::Scene {
    floor(
        classic(terms),
        json!({ "sky": { "expression": "2 + o" }, "classic": rules }),
    )
}

/// Protects: a mirrored ray starts off the surface, along the normal or along itself.
#[test]
fn reflections_start_off_the_surface() {
    let mirror = || json!({ "local": 0, "reflection": { "weight": 1 } });
    expect_pixel(
        &shown(mirror(), constant(json!({}))),
        SLANTED,
        [2.0, 2.5, 2.0],
    );
    expect_pixel(
        &shown(mirror(), constant(json!({ "along": "ray" }))),
        SLANTED,
        [1.7, 2.4, 2.0],
    );
    expect_pixel(
        &shown(mirror(), constant(json!({}))),
        FROM_BELOW,
        [2.0, 1.5, 2.0],
    );
}

/// Protects: a refracted ray starts on the other side, from either side, whether the normal is
/// flipped or not.
#[test]
fn refractions_start_on_the_other_side() {
    let through = |threshold: f64| json!({ "local": 0, "transmission": { "ior": 1.5, "choice": { "switch": { "threshold": threshold } } } });
    for face_viewer in [true, false] {
        let case = |threshold: f64| {
            let mut scene = shown(through(threshold), constant(json!({})));
            scene.objects[0].face_viewer = face_viewer;
            scene
        };
        expect_pixel(&case(1.0), SLANTED, [2.0, 1.5, 2.0]);
        expect_pixel(&case(1.0), FROM_BELOW, [2.0, 2.5, 2.0]);
        expect_pixel(&case(0.0), SLANTED, [2.0, 2.5, 2.0]);
        expect_pixel(&case(0.0), FROM_BELOW, [2.0, 1.5, 2.0]);
    }
}

/// Protects: each kind of ray has its own least distance. A ball of radius 0.5 around the eye is
/// 0.5 away; a ball on the mirrored ray and a disk on the shadow ray begin 1.0 behind the ray's
/// origin.
#[test]
fn what_is_too_near_does_not_count() {
    let glow =
        json!({ "name": "glow", "model": { "classic": { "local": 0, "emission": [0, 1, 0] } } });
    let around = |rules: Value| {
        floor(
            classic(json!({ "local": 0, "emission": [1, 0, 0] })),
            json!({ "classic": rules, "materials": [glow], "objects": [ball([3.0, 4.0, 0.0], 0.5, "glow")] }),
        )
    };
    expect_pixel(
        &around(constant(json!({ "camera_min": 0.4 }))),
        SLANTED,
        [0.0, 1.0, 0.0],
    );
    expect_pixel(
        &around(constant(json!({ "camera_min": 0.6 }))),
        SLANTED,
        [1.0, 0.0, 0.0],
    );
    // 2 along the mirrored ray from its origin at (0, 0.5, 0).
    let mirrored = |rules: Value| {
        floor(
            classic(json!({ "local": 0, "reflection": { "weight": 1 } })),
            json!({ "classic": rules, "materials": [glow], "objects": [ball([-1.2, 2.1, 0.0], 1.0, "glow")] }),
        )
    };
    expect_pixel(
        &mirrored(constant(json!({ "secondary_min": 0.9 }))),
        SLANTED,
        [0.0, 1.0, 0.0],
    );
    expect_pixel(
        &mirrored(constant(json!({ "secondary_min": 3.1 }))),
        SLANTED,
        [0.0; 3],
    );
    // The shadow ray starts at (0, 0.5, 0); the disk is 1.0 above that point, and another one below
    // it.
    let disk = |y: f64| json!({ "shape": { "disk": { "centre": [0, y, 0], "normal": [0, 1, 0], "radius": 0.4 } }, "material": "glow" });
    let shaded = |rules: Value, y: f64| {
        floor(
            classic(json!({})),
            json!({ "classic": rules, "materials": [glow], "objects": [disk(y)],
            "lights": [{ "kind": { "directional": { "to_light": [0, 1, 0] } }, "colour": 1 }] }),
        )
    };
    let unlit_lamp = |mut scene: raywright_core::Scene| {
        scene.materials[1].model = scene.materials[0].model.clone();
        scene
    };
    expect_pixel(
        &unlit_lamp(shaded(constant(json!({ "shadow_min": 0.9 })), 1.5)),
        SLANTED,
        [0.0; 3],
    );
    expect_pixel(
        &unlit_lamp(shaded(constant(json!({ "shadow_min": 1.1 })), 1.5)),
        SLANTED,
        [1.0; 3],
    );
    expect_pixel(
        &unlit_lamp(shaded(constant(json!({})), 0.4)),
        SLANTED,
        [1.0; 3],
    );
    expect_pixel(
        &unlit_lamp(shaded(constant(json!({})), 0.6)),
        SLANTED,
        [0.0; 3],
    );
}

/// Protects: behind an absent surface a ray starts on the other side, from either side, whether the
/// normal is flipped or not.
#[test]
fn rays_go_on_behind_what_is_absent() {
    let absent = physical(json!({ "opacity": 0, "alpha": "blend" }));
    for face_viewer in [true, false] {
        let scene = |along: &str| {
            let parts = json!({ "sky": { "expression": "2 + o" }, "classic": constant(json!({ "along": along })) });
            let mut scene = floor(absent.clone(), parts);
            scene.objects[0].face_viewer = face_viewer;
            scene
        };
        expect_pixel(&scene("normal"), SLANTED, [2.0, 1.5, 2.0]);
        expect_pixel(&scene("normal"), FROM_BELOW, [2.0, 2.5, 2.0]);
        expect_pixel(&scene("ray"), SLANTED, [1.7, 1.6, 2.0]);
    }
}
